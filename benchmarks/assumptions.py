"""How often is an assumption of hp-st's guarantee seen violated? Counted over the trials of results directories.

One line a robot, navigator and kind of violation: in how many trials it was told, and how often in all.

    python benchmarks/assumptions.py RESULTS ... | --smoke
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import clearway
from clearway.contract import EventKind


def kind_of(text: str) -> str:
    """A violation's text without its numbers."""
    return re.sub(r"-?(?<![\w.])\d+(?:\.\d+)?(?:e-?\d+)?", "#", text)


def violations(paths: Iterable[Path]) -> Iterator[str]:
    """Lines of the table of each directory."""
    for path in paths:
        results = clearway.open_results(path)
        trials, clean = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
        told, events = Counter[tuple[str, str, str]](), Counter[tuple[str, str, str]]()
        for row in results.trials.to_pylist():
            who = str(row["robot"]), str(row["navigator"])
            texts = [kind_of(e.detail) for e in results.trial(row["trial"]).events if e.kind is EventKind.ASSUMPTION]
            trials[who] += 1
            clean[who] += not texts
            events.update((*who, text) for text in texts)
            told.update((*who, text) for text in set(texts))
        for who in trials:
            if "hp-st" not in who[1]:
                continue
            yield f"{path.name}, {who[0]}, {who[1]}: {clean[who]} of {trials[who]} trials without a violation"
            for (*whose, text), count in sorted(told.items()):
                if tuple(whose) == who:
                    yield f"  {count:5d} trials {events[(*who, text)]:6d} times  {text}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", nargs="*", type=Path, help="directories that `clearway run` has written")
    parser.add_argument("--smoke", action="store_true", help="run one trial and count there")
    options = parser.parse_args()
    if options.smoke:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "sar-misspecified"
            clearway.run("sar-misspecified", navigators=["hp-st"], seeds=(0, 1), workers=1, out=out)
            print("\n".join(violations([out])))
    elif options.results:
        print("\n".join(violations(options.results)))
    else:
        parser.error("which results?")


if __name__ == "__main__":
    main()
