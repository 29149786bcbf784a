"""A user's Nav2 file in the BARN worlds in which the real Nav2 was driven with it, beside what was published of that.

Published are 78 runs of Nav2 (jazzy) with MPPI in eight of BARN's worlds, Jackal, by Saadmaghani/The-Barn-Challenge-Ros2
(d6c575b, `res/mppi_out.txt`; its file of parameters is `jackal_helper/config/nav2.yaml`). None of it comes with Clearway: fetch the
file and name it. The runner there takes its times from the computer's clock, not from the simulated one (`barn_runner.py` asks a
node that isn't told to `use_sim_time`), so they say how fast Gazebo ran as well.

    python benchmarks/nav2_barn.py nav2.yaml [--repetitions 10] [--world N]... [--workers N] [--out DIR] [--json]
    python benchmarks/nav2_barn.py --smoke

`--out`: where the results lie; one that is there already is read, not run again. `--smoke`: one world, once, with the
Jackal's own public file.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

import clearway
from clearway.statistics import success_interval


class Published(NamedTuple):
    """What was published of a world. Those that failed took longer than 100 s; nothing was hit.

    Attributes:
        runs: Their number.
        reached: How many arrived.
        mean: Mean time of those, s of the computer's clock.
        median: Their median, s.
        least: The fastest, s.
    """

    runs: int
    reached: int
    mean: float
    median: float
    least: float


PUBLISHED = {
    0: Published(10, 10, 61.1, 54.2, 46.9),
    6: Published(10, 8, 44.3, 45.7, 39.9),
    12: Published(10, 6, 60.5, 45.0, 42.3),
    18: Published(10, 8, 41.4, 36.5, 34.5),
    24: Published(10, 7, 49.3, 49.2, 47.9),
    30: Published(10, 8, 48.0, 46.7, 45.0),
    36: Published(10, 6, 34.0, 33.9, 33.1),
    42: Published(8, 6, 39.8, 39.0, 36.4),
}
"""By world."""


def run(file: str | None, worlds: tuple[int, ...], repetitions: int, workers: int, out: str | None) -> clearway.Results:
    """The campaign, or what it left at `out`."""
    if out is not None and (Path(out) / "campaign.json").is_file():
        return clearway.open_results(out)
    options = "trees=jazzy" if file is None else f"params={file},trees=jazzy"
    return clearway.run(
        "barn",
        robots=["jackal"],
        navigators=[f"nav2[{options}]"],
        worlds=worlds,
        repetitions=repetitions,
        workers=workers,
        out=out,
    )


def rows(results: clearway.Results) -> list[dict[str, Any]]:
    """A row a world, and one of all that were run."""
    trials: dict[int, list[tuple[str, float]]] = {}
    for trial in results.trials.to_pylist():
        world = int(trial["configuration"].partition("-")[2])
        trials.setdefault(world, []).append((trial["outcome"], trial["CT"]))
    found = [_row(str(world), PUBLISHED[world], some) for world, some in sorted(trials.items())]
    told = [PUBLISHED[world] for world in trials]
    reached = sum(p.reached for p in told)
    mean = sum(p.reached * p.mean for p in told) / reached
    whole = Published(sum(p.runs for p in told), reached, mean, float("nan"), min(p.least for p in told))
    all_ = _row("all", whole, [end for some in trials.values() for end in some])
    return [*found, all_ | {"ratio": float(np.median([row["ratio"] for row in found]))}]


def _row(world: str, told: Published, ends: list[tuple[str, float]]) -> dict[str, Any]:
    times = [time for outcome, time in ends if outcome == "reached"]
    outcomes = [outcome for outcome, _ in ends]
    return {
        "world": world,
        "published": told._asdict(),
        "runs": len(ends),
        "reached": len(times),
        "others": {o: outcomes.count(o) for o in sorted(set(outcomes) - {"reached"})},
        "mean": float(np.mean(times)) if times else float("nan"),
        "median": float(np.median(times)) if times else float("nan"),
        "least": min(times, default=float("nan")),
        "ratio": told.least / min(times, default=float("nan")),
    }


def _share(reached: int, runs: int) -> str:
    told = success_interval(reached, runs)
    return f"{reached}/{runs} = {told.estimate:.3f} [{told.low:.3f}, {told.high:.3f}]"


def main() -> None:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", help="the file of ROS 2 parameters")
    parser.add_argument("--repetitions", type=int, default=10, help="of each world")
    parser.add_argument("--world", type=int, action="append", choices=PUBLISHED, help="default: all eight")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", help="results directory")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    worlds, repetitions = tuple(given.world or PUBLISHED), given.repetitions
    if given.file is None and not given.smoke:
        parser.error("name the file of ROS 2 parameters")
    with TemporaryDirectory() as folder:
        if given.smoke:
            given.out, worlds, repetitions = f"{folder}/results", (36,), 1
        found = rows(run(given.file, worlds, repetitions, given.workers, given.out))
    if given.json:
        print(json.dumps(found))
        return
    print(
        "| world | published: success | time: mean, median, least (s) | here: success | time: mean, median, least (s) | least, there to here (of all: median) |"
    )
    print("|---|---|---|---|---|---|")
    for row in found:
        p = row["published"]
        others = "".join(f", {n} {o}" for o, n in row["others"].items())
        if row["world"] == "all":
            shares = _share(p["reached"], p["runs"]), _share(row["reached"], row["runs"])
        else:
            shares = f"{p['reached']}/{p['runs']}", f"{row['reached']}/{row['runs']}"
        there, here = (
            ", ".join(f"{t[k]:.1f}" if t[k] == t[k] else "–" for k in ("mean", "median", "least")) for t in (p, row)
        )
        print(f"| {row['world']} | {shares[0]} | {there} | {shares[1]}{others} | {here} | {row['ratio']:.2f} |")


if __name__ == "__main__":
    main()
