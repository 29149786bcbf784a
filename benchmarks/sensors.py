"""What each error of the sensors costs each navigator: the same tests, with the same seeds, as they are and without it.

Prints Markdown, a line a suite, robot and navigator: successes of all tests as they are, and for each error that is left out (`all`:
all of them) how many tests more are passed without it, with Newcombe's paired 95 % interval of the difference in success, in points. Where
an interval holds 0, nothing is shown. By default all registered navigators that can drive the robot there, but those that are told the future.

    python benchmarks/sensors.py [--suite hospital-held-out ...] [--robot NAME ...] [--navigator NAME ...] [--error NAME ...]
        [--batch NAME ...] [--repetitions N] [--out DIR] [--workers N] [--smoke]

With `--out` the campaigns are kept, and a second call goes on where the first one stopped.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import clearway
from clearway.campaigns.plan_checks import ALL
from clearway.robots.ideal import RobotError
from clearway.statistics import paired_success

AS_IT_IS = ""
KEY = ("suite", "robot", "navigator", "scenario", "member")


def outcomes(
    suite: str, error: str, asked: argparse.Namespace, folder: Path
) -> dict[tuple[Any, ...], bool]:  # fmt: skip
    """Whether each trial of a campaign is a success, by what tells it apart."""
    out = folder / f"{suite}-{error or 'as-it-is'}"
    batches = [b for b in asked.batch if suite.startswith("hospital")]
    results = clearway.run(
        suite, robots=asked.robot, navigators=asked.navigator, batches=batches, repetitions=asked.repetitions,
        speeds=asked.speed if suite.startswith("hospital") else (),
        configurations=("passing",) if asked.smoke and suite == "people" else (), ideal=[error] if error else (),
        out=out, resume=out.exists(), workers=asked.workers,
    )  # fmt: skip
    columns = [results.trials.column(name).to_pylist() for name in (*KEY, "success")]
    return {row[:-1]: bool(row[-1]) for row in zip(*columns, strict=True)}


def line(
    with_: dict[tuple[Any, ...], bool], without: Sequence[dict[tuple[Any, ...], bool]], of: tuple[Any, ...]
) -> str:
    """Of the tests of one suite, robot and navigator."""
    tests = [key for key in with_ if key[:3] == of]
    cells = [*map(str, of), f"{sum(with_[k] for k in tests)}/{len(tests)}"]
    for other in without:
        pair = paired_success([with_[k] for k in tests], [other[k] for k in tests])
        d = pair.difference
        cells.append(f"{pair.only_b - pair.only_a:+d} ({100 * d.low:.0f} to {100 * d.high:.0f})")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", action="append")
    parser.add_argument("--robot", action="append")
    parser.add_argument("--navigator", action="append")
    parser.add_argument("--error", action="append", choices=get_args(RobotError))
    parser.add_argument("--batch", action="append", help="of the hospital")
    parser.add_argument("--speed", action="append", type=float, help="set speeds in the hospital, m/s")
    parser.add_argument("--repetitions", type=int, default=1)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--smoke", action="store_true", help="a few trials, to see that it runs")
    asked = parser.parse_args()
    asked.suite = asked.suite or (["people"] if asked.smoke else ["hospital-held-out", "people"])
    asked.robot = asked.robot or ["tiago"]
    asked.navigator = asked.navigator or (["move-base"] if asked.smoke else [ALL])
    asked.batch = asked.batch or ["MO", "CE"]
    asked.speed = asked.speed or [0.4]
    errors = asked.error or (["legs"] if asked.smoke else list(get_args(RobotError)))
    with tempfile.TemporaryDirectory() as scratch:
        folder = asked.out or Path(scratch)
        heads = ["suite", "robot", "navigator", "as they are", *(f"without {e}" for e in errors)]
        print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
        for suite in asked.suite:
            with_ = outcomes(suite, AS_IT_IS, asked, folder)
            without = [outcomes(suite, error, asked, folder) for error in errors]
            for of in dict.fromkeys(key[:3] for key in with_):
                print(line(with_, without, of), flush=True)


if __name__ == "__main__":
    main()
