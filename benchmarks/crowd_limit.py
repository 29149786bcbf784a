"""How much longer a robot took among those who don't see it than somebody who knew their whole future, and whether anybody could get through.

Of `RESULTS` of `clearway run crowd`, each batch in which people don't see the robot: the mean time of the trials that reached the goal, and
the mean of the clairvoyant's limit in the same ones (`clearway.clairvoyant`: a disc that takes up any velocity up to the set speed at once, from
the start to within the tolerance of the goal; arrival counts at the end of a control period, as it does for the robot).

Of a suite whose movers are known ahead, as they see nobody (`dynabarn`, `replayed` and their held-out kin), each batch: of how many scenarios a way was
found for the robot's circumscribed disc within the time limit, which is therefore solvable; in how many of the others there is none, not even for its
inscribed disc; over the former the mean time of that way, and the mean bound before which the inscribed disc, so no robot, arrives.

    python benchmarks/crowd_limit.py RESULTS [--trials N] [--smoke]
    python benchmarks/crowd_limit.py --suite NAME [--suite NAME ...] [--batch NAME ...] [--seeds A:B] [--trials N] [--seconds S]

`RESULTS`: of `clearway run crowd`; `--trials`: at most so many of each batch and navigator; `--seconds`:
a scenario that is searched for longer is given up, and neither found nor shown to have none; `--smoke`: makes two of its own.
"""

from __future__ import annotations

import argparse
import math
import signal
import tempfile
from collections import defaultdict
from pathlib import Path
from types import FrameType

import numpy as np

import clearway
from clearway.clairvoyant.reach import earliest
from clearway.clairvoyant.space_time import scene_of, shortest
from clearway.geometry.shapes import FloatArray, circumscribed_radius, inscribed_radius
from clearway.robots import Robot, load_robot
from clearway.scenarios.motions import knots
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection, seed_range
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome, Trial
from clearway.trials.store import open_results

SAMPLE = 0.05
"""Of the motions that are known ahead, s: straight in between, and who is absent at one is absent up to the next one."""
AHEAD = ("dynabarn", "dynabarn-held-out", "replayed", "replayed-held-out")
"""Suites whose movers are known ahead."""
LAYER = 0.1
"""Of the bound's grid, m at full speed."""


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


def ahead(scenario: Scenario, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Where everybody is every `SAMPLE` seconds (T, m, 2), NaN who is absent, and their radii (m,), m."""
    t = SAMPLE * np.arange(math.ceil(seconds / SAMPLE) + 2)
    motions = [o.motion for o in scenario.obstacles if o.motion is not None]
    assert len(motions) == len(scenario.obstacles)
    assert all(p.behaviour == "recorded" and not p.sees_robots for p in scenario.people)
    tracks = [knots(motion, float(t[-1])) for motion in motions] + [np.array(p.track) for p in scenario.people]
    radii = [circumscribed_radius(o.shape.shape()) for o in scenario.obstacles] + [p.radius for p in scenario.people]
    at = [
        [np.interp(t, track[:, 0], track[:, k], left=math.nan, right=math.nan) for k in (1, 2)] for track in tracks
    ]  # fmt: skip
    return np.array(at).transpose(2, 0, 1), np.array(radii)


def limits(scenario: Scenario, robot: Robot) -> tuple[float, float]:
    """The time of a way for the robot's circumscribed disc, and the bound before which its inscribed one doesn't arrive, s; inf: there is none
    within the time limit."""
    leg = scenario.legs[0]
    moving, radii = ahead(scenario, leg.time_limit)
    slack, start = leg.xy_tolerance or robot.tolerances.xy, np.array(scenario.start[:2])
    goal, none, v = np.array(leg.goal[:2]), np.empty((0, 3)), min(scenario.speed, robot.drive.v_max)
    found = shortest(
        start, goal, goal_radius=slack, v_max=v, static=none, moving=moving, radii=radii + circumscribed_radius(robot.shape),
        dt=SAMPLE, horizon=leg.time_limit, bound=False,
    )  # fmt: skip
    latest = leg.time_limit if found is None else found.time
    scene = scene_of(goal, slack, v, none, moving, radii + inscribed_radius(robot.shape), SAMPLE, None)
    before = earliest(scene, start, 0.0, latest, LAYER / v)
    return (found.time, before) if found is not None else (math.inf, math.inf if before >= latest else before)


def limits_in(seconds: float, scenario: Scenario, robot: Robot) -> tuple[float, float]:
    """`limits`; NaN both where they take longer than so many seconds, at least."""

    def ring(signum: int, frame: FrameType | None) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        return limits(scenario, robot)
    except TimeoutError:
        return math.nan, math.nan
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def suites(names: list[str], batches: list[str], seeds: str | None, most: int, seconds: float) -> None:
    """Print the table of what is known ahead, of at most so many scenarios a batch, each given up after `seconds`; 0: never."""
    print(
        "| suite | batch | scenarios | a way found | shown to have none | clairvoyant, found (s) | nobody before (s) |"
    )
    print("|---|---|---:|---:|---:|---:|---:|")
    for name in names:
        suite = load_suite(name)
        robot = load_robot(suite.robots[0])
        groups: dict[str, list[Scenario]] = defaultdict(list)
        for scenario in suite.build(
            robot, Selection(seeds=seed_range(seeds) if seeds else None, batches=tuple(batches))
        ):
            groups[scenario.labels.batch].append(scenario)
        for batch, scenarios in groups.items():
            rows = np.array([limits_in(seconds, scenario, robot) for scenario in scenarios[:most]])
            found, none = np.isfinite(rows[:, 0]), np.isinf(rows[:, 1])
            mean = rows[found].mean(axis=0)
            print(
                f"| {name} | {batch} | {len(rows)} | {found.sum()} | {none.sum()} | {mean[0]:.2f} | {mean[1]:.2f} |",
                flush=True,
            )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, nargs="?")
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--suite", action="append", default=[], choices=AHEAD)
    parser.add_argument("--batch", action="append", default=[])
    parser.add_argument("--seeds", metavar="A:B")
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    if given.smoke:
        suites(["dynabarn"], ["easy"], None, 2, 60.0)
    if given.suite:
        suites(given.suite, given.batch, given.seeds, given.trials, given.seconds)
        return
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
