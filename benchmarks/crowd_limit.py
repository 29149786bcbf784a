"""How much longer a robot took through CrowdNav's people than somebody who knew their whole future.

Of each batch in which people don't see the robot: the mean time of the trials that reached the goal, and the mean of the clairvoyant's
limit in the same ones (`clearway.clairvoyant`: a disc that takes up any velocity up to the set speed at once, from the start to within
the tolerance of the goal; arrival counts at the end of a control period, as it does for the robot).

    python benchmarks/crowd_limit.py RESULTS [--trials N] [--smoke]

`RESULTS`: of `clearway run crowd`; `--trials`: at most so many of each batch and navigator; `--smoke`: makes two of its own.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

import clearway
from clearway.clairvoyant.space_time import shortest
from clearway.geometry.shapes import circumscribed_radius
from clearway.robots import load_robot
from clearway.trials import Outcome, Trial
from clearway.trials.store import open_results


def limit(trial: Trial) -> tuple[float, float]:
    """The clairvoyant's time through what moved in `trial`, s, and the bound of its relative error; NaN: none was found."""
    attempt, leg = trial.attempt, trial.attempt.legs[0]
    moving = [body for body in attempt.bodies if body.pose is None]
    own = circumscribed_radius(attempt.footprint) if attempt.footprint is not None else math.nan
    found = shortest(
        trial.pose[0, :2], leg.goal[:2], goal_radius=leg.xy_tolerance, v_max=float(attempt.labels.speed or math.nan),
        static=np.empty((0, 3)), moving=trial.moving_obstacles[:, :, :2],
        radii=np.array([circumscribed_radius(body.shape) + own for body in moving]), dt=float(trial.t[1] - trial.t[0]),
    )  # fmt: skip
    return (math.nan, math.nan) if found is None else (found.time, found.error)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, nargs="?")
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if given.smoke:
            given.results = Path(folder) / "crowd"
            clearway.run(
                "crowd", batches=["square-invisible"], configurations=["case-0", "case-2"], navigators=["orca"],
                out=given.results, workers=1,
            )  # fmt: skip
        elif given.results is None:
            parser.error("which results?")
        groups: dict[tuple[str, str], list[tuple[float, float, float]]] = defaultdict(list)
        for trial in open_results(given.results):
            labels, group = trial.attempt.labels, (trial.attempt.labels.batch, trial.attempt.navigator)
            if (
                trial.outcome is not Outcome.REACHED
                or not labels.batch.endswith("-invisible")
                or len(groups[group]) >= given.trials
            ):
                continue
            groups[group].append((float(trial.t[-1]), *limit(trial)))
    period = load_robot("crowdnav-disc").period
    print(
        "| batch | navigator | trials | mean time (s) | clairvoyant (s) | ratio | without a way found | bound of the error, worst (%) |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for (batch, navigator), rows in groups.items():
        took, best, error = np.array([row for row in rows if math.isfinite(row[1])]).reshape(-1, 3).T
        whole = period * np.ceil(best / period - 1e-9)
        print(
            f"| {batch} | {navigator} | {len(took)} | {took.mean():.2f} | {whole.mean():.2f} | {took.mean() / whole.mean():.3f} |"
            f" {len(rows) - len(took)} | {100 * error.max():.1f} |"
        )


if __name__ == "__main__":
    main()
