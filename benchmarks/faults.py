"""What Clearway survives: faults of every kind, counted as survived of tried, as a Markdown table.

python benchmarks/faults.py                        # everything
python benchmarks/faults.py --only hostile         # hostile files and command lines
python benchmarks/faults.py --only fuzz --tries 100000
python benchmarks/faults.py --only recordings --tries 100000   # of every format, read and cleaned
python benchmarks/faults.py --only plans --tries 1000   # broken test plans: what passes `check` and fails `score`
python benchmarks/faults.py --only navigators      # navigators that misbehave
python benchmarks/faults.py --only damages         # results directories that were damaged
python benchmarks/faults.py --only kills           # kills at every stage, gone on with to the same bytes
python benchmarks/faults.py --only kills --every 7 # one in seven of these
python benchmarks/faults.py --smoke                # a few of each
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from fault_sections import Count, damages, fuzz, hostile, kills, navigators, plans, recordings

SECTIONS: dict[str, Callable[[argparse.Namespace], list[Count]]] = {
    "hostile": lambda asked: hostile.measure(asked.smoke),
    "fuzz": lambda asked: fuzz.measure(100 if asked.smoke else asked.tries, asked.seed),
    "recordings": lambda asked: recordings.measure(56 if asked.smoke else asked.tries, asked.seed),
    "plans": lambda asked: plans.measure(3 if asked.smoke else asked.tries, asked.seed),
    "navigators": lambda asked: navigators.measure(asked.smoke),
    "kills": lambda asked: kills.measure(asked.smoke, asked.every),
    "damages": lambda asked: damages.measure(asked.smoke),
}
"""What may be asked for by `--only`, in the order of the table."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=list(SECTIONS), help="repeatable; default: all")
    parser.add_argument("--tries", type=int, default=1000, help="how many mutated files")
    parser.add_argument("--every", type=int, default=1, help="of the kills one in so many")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn")
    parser.add_argument("--smoke", action="store_true", help="a few of each")
    asked = parser.parse_args()
    counts = [count for name in asked.only or SECTIONS for count in SECTIONS[name](asked)]
    print("| fault | tried | survived |\n|---|---|---|")
    for count in counts:
        print(f"| {count.fault} | {count.tried} | {count.survived} |")
    print(f"| **all** | {sum(c.tried for c in counts)} | {sum(c.survived for c in counts)} |")
    for line in (line for count in counts for line in count.fallen):
        print(line, file=sys.stderr)
    sys.exit(any(count.fallen for count in counts))


if __name__ == "__main__":
    main()
