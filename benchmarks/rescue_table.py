"""The search-and-rescue suites in one table: HP-ST, what flatters it beside it, and its rivals, on held-out seeds.

Each row is a robot and a navigator; each suite is run on the same seeds with all of them, at which nothing here was
chosen (the last column says how near to them its parameters were). Prints Markdown: successes with the exact 95 % interval, by the robot's own
estimate where that differs, path and time of the successes over the least there can be, contacts with the robot moving and at
rest, and trials in which an assumption of the guarantee was seen to be untrue.

    python benchmarks/rescue_table.py [--seeds 20000:20200] [--suite sar-stress ...] [--row lidar ...] [--out DIR]
        [--workers N] [--smoke]

With `--out` the campaigns are kept, and a second call goes on where the first one stopped.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple

SUITES = ("sar-case1", "sar-case2", "sar-confined", "sar-case3", "sar-stress", "sar-misspecified")


class Row(NamedTuple):
    """A line of the table.

    Attributes:
        title: What it is, in words.
        robot: With its preset.
        navigator: With its options.
    """

    title: str
    robot: str
    navigator: str


def _hp_st(title: str, robot: str, options: str = "") -> list[Row]:
    """One with each of its guarantees."""
    modes = ("passive", "evasive", "none")
    given = {mode: ",".join(filter(None, (f"guarantee={mode}", options))) for mode in modes}
    return [Row(f"{title}, {mode}", robot, f"hp-st[{chosen}]") for mode, chosen in given.items()]


_DOUBLED = "obstacle_speed=8.8,obstacle_acceleration=2.5,unseen_speed=8.8"
ROWS = (
    *_hp_st("hp-st", "rescue"),
    *_hp_st("hp-st, forecasts of constant velocity", "rescue", "without=forecast"),
    *_hp_st("hp-st, bounds doubled", "rescue", _DOUBLED),
    *_hp_st("hp-st, 0.1 s late", "rescue:late"),
    *_hp_st("hp-st, lidar", "rescue:lidar"),
    *_hp_st("hp-st, unlimited acceleration", "rescue:unlimited"),
    Row("hp-tmpc", "rescue", "hp-tmpc"),
    Row("hp-tmpc, at the set speed", "rescue:fast", "hp-tmpc"),
    Row("hp-tmpc, unlimited acceleration", "rescue:unlimited", "hp-tmpc"),
    Row("hp-tmpc, 0.1 s late", "rescue:late", "hp-tmpc"),
    Row("hl-rrt", "rescue", "hl-rrt"),
    Row("hl-rrt, at the set speed", "rescue:fast", "hl-rrt"),
    Row("colregs-apf", "rescue", "colregs-apf"),
    Row("colregs-apf, at the set speed", "rescue:fast", "colregs-apf"),
    Row("the clairvoyant", "rescue", "oracle"),
)


def trials(
    suite: str, rows: Sequence[Row], seeds: tuple[int, int], out: Path, workers: int | None
) -> dict[Row, list[dict[str, Any]]]:
    """The rows' trials: a campaign for each robot, as not every navigator is run with each."""
    import clearway

    found: dict[Row, list[dict[str, Any]]] = {}
    for robot in dict.fromkeys(row.robot for row in rows):
        own = [row for row in rows if row.robot == robot]
        folder = out / f"{suite}-{robot.replace(':', '-')}"
        results = clearway.run(
            suite, robots=[robot], navigators=[row.navigator for row in own], seeds=seeds, out=folder, workers=workers,
            resume=folder.exists(),
        )  # fmt: skip
        made = results.trials.to_pylist()
        for row in own:
            found[row] = [r for r in made if r["navigator"] == row.navigator]
    return found


def line(row: Row, own: Sequence[dict[str, Any]]) -> str:
    """The row as Markdown."""
    from clearway.statistics import success_interval

    won = [r for r in own if r["success"]]
    rate = success_interval(len(won), len(own))
    believed = sum(bool(r["success_self"]) for r in own)
    hit = [r for r in own if r["moved_at_contact"]]
    moving = sum(r["moved_at_contact"] in ("robot", "both") for r in hit)
    cells = (
        row.title,
        f"{len(won)}/{len(own)}",
        f"{100 * rate.estimate:.1f} ({100 * rate.low:.1f} to {100 * rate.high:.1f})",
        "" if believed == len(won) else f"{100 * believed / len(own):.1f}",
        _mean(won, "PL_shortest"),
        _mean(won, "CT_optimal"),
        str(moving),
        str(len(hit) - moving),
        str(sum(bool(r["violations"]) for r in own)),
        "; ".join(sorted({r["tuned"] for r in own})),
    )
    return f"| {' | '.join(cells)} |"


def _mean(rows: Sequence[dict[str, Any]], column: str) -> str:
    known = [r[column] for r in rows if r[column] is not None]
    return f"{fmean(known):.3f}" if known else ""


HEAD = (
    "| system | successes | SR, % (exact 95 %) | SR by its own estimate, % | path / shortest | time / clairvoyant's"
    " | contacts moving | contacts at rest | trials with violations | parameters chosen |\n" + "|---" * 10 + "|"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="20000:20200", help="A:B, drawn by the suites' generators")
    parser.add_argument("--suite", action="append", choices=SUITES, help="only this suite; repeat for more")
    parser.add_argument("--row", action="append", help="only rows whose title holds this; repeat for more")
    parser.add_argument("--out", type=Path, help="folder for the campaigns; default: a temporary one")
    parser.add_argument("--workers", type=int, help="processes; default: one a core")
    parser.add_argument("--smoke", action="store_true", help="one seed of one suite")
    asked = parser.parse_args()
    first, _, end = asked.seeds.partition(":")
    seeds = (20000, 20001) if asked.smoke else (int(first), int(end))
    suites = ["sar-case1"] if asked.smoke else asked.suite or SUITES
    words = ["hp-st, lidar", "colregs-apf"] if asked.smoke else asked.row or [""]
    rows = [row for row in ROWS if any(word in row.title for word in words)]
    if not rows:
        parser.error(f"no row holds {' or '.join(words)}; rows: {'; '.join(row.title for row in ROWS)}")
    with tempfile.TemporaryDirectory() as folder:
        for suite in suites:
            found = trials(suite, rows, seeds, asked.out or Path(folder), asked.workers)
            print(f"\n`{suite}`, seeds {seeds[0]} to {seeds[1] - 1}:\n\n{HEAD}", flush=True)
            for row in rows:
                print(line(row, found[row]), flush=True)


if __name__ == "__main__":
    main()
