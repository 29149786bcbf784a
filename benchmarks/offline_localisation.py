"""How well a recorded robot is localised afterwards (`clearway localise`), and whether the uncertainty that it states holds.

The hospital's trials are simulated, with the robot's noisy lidar, its drifting odometry, obstacles and a moving robot that are in no map, and
what it sensed is kept. Then the robot is localised from that alone, from a start that is wrong, on the map that a robot was given, and held against
where it truly was: errors in mm and mrad, the share of samples within twice the stated standard uncertainty along each axis, the length of the
path over the true one, and how far the pose at each leg's end is off, which is what an error of DE would be.

    python benchmarks/offline_localisation.py [--robot NAME] [--trials N] [--json] [--smoke]    # about 8 minutes on one core
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

import numpy as np

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import granted_map
from clearway.contract import Sensing, Task
from clearway.geometry.shapes import FloatArray
from clearway.localising import localise
from clearway.navigators.registry import make_navigator
from clearway.recordings.recording import Sweeps, Track
from clearway.robots import Robot, load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Trial
from clearway.world import simulate

BATCHES = ("NO", "SO", "MO", "CE")
SCAN_EVERY = 2
"""Periods from a scan to the next: 10 Hz."""


class Kept:
    """Knows the true pose, as `truth` does, and keeps everything that the robot senses."""

    def __init__(self) -> None:
        self.sensed: list[Sensing] = []

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.sensed = []

    def update(self, sensing: Sensing) -> FloatArray:
        self.sensed.append(sensing)
        return sensing.truth.copy()


def driven(robot: Robot, batch: str, trials: int) -> list[tuple[Trial, list[Sensing], str]]:
    """The first trials of a batch, each with what the robot sensed, and the floor plan's name."""
    found = []
    for scenario in load_suite("hospital").build(robot, Selection(batches=(batch,)), 0)[:trials]:
        kept = Kept()
        pilot = compose(make_navigator("move-base"), kept)
        trial = simulate(
            scenario, robot, pilot, navigator="move-base", localisation="truth", map=granted_map(None, scenario)
        )
        found.append((trial, list(kept.sensed), scenario.floor_plan))
    return found


def recorded(sensed: list[Sensing]) -> tuple[Track, Sweeps]:
    """What a bag would hold: odometry at every period, a scan now and then."""
    t, odom = np.array([s.t for s in sensed]), np.array([s.odom_pose for s in sensed])
    half = odom[:, 2] / 2
    q = np.column_stack((np.zeros((len(t), 2)), np.sin(half), np.cos(half)))
    some = sensed[::SCAN_EVERY]
    scan = some[0].scan
    assert scan is not None
    ranges = np.array([s.scan.ranges for s in some if s.scan is not None])
    beams = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
    track = Track("odometry", "odom", "base_link", t, np.column_stack((odom[:, :2], np.zeros(len(t)))), q)
    return track, Sweeps("base_scan", t[::SCAN_EVERY], ranges, *beams, scan.mount)


def judge(robot: Robot, trial: Trial, sensed: list[Sensing], floor: str, seed: int) -> dict[str, Any]:
    """How far off the robot is put, and by how much it says so."""
    track, sweeps = recorded(sensed)
    truth = np.array([s.truth for s in sensed])
    wrong = np.random.default_rng(seed).uniform(-1.0, 1.0, 3) * (0.3, 0.3, 0.15)
    map = load_floor_plan(floor).map
    assert map is not None
    found = localise(track, sweeps, map, truth[0] + wrong, robot, seed=seed)
    off = found.pose - truth
    off[:, 2] = np.remainder(off[:, 2] + np.pi, 2 * np.pi) - np.pi
    held = np.abs(off) <= 2 * found.sigma[:, [0, 0, 1]]
    ends = [int(np.searchsorted(track.t, s.end)) for s in trial.spans if s.reached]
    ends = [min(i, len(off) - 1) for i in ends]
    length, true = (np.hypot(*np.diff(p[:, :2], axis=0).T).sum() for p in (found.pose, truth))
    return {
        "position": np.hypot(off[:, 0], off[:, 1]),
        "heading": np.abs(off[:, 2]),
        "held": held,
        "sigma": found.sigma,
        "length": float(length / true),
        "ends": np.hypot(off[ends, 0], off[ends, 1]),
        "agreement": float(np.median(found.agreement)),
    }


def figures(judged: list[dict[str, Any]]) -> dict[str, float]:
    """The figures of several trials."""
    position, heading = (np.concatenate([j[k] for j in judged]) for k in ("position", "heading"))
    held, sigma = (np.concatenate([j[k] for j in judged]) for k in ("held", "sigma"))
    ends = np.concatenate([j["ends"] for j in judged])
    return {
        "trials": len(judged),
        "position_median_mm": 1000 * float(np.median(position)),
        "position_95_mm": 1000 * float(np.quantile(position, 0.95)),
        "position_worst_mm": 1000 * float(position.max()),
        "heading_95_mrad": 1000 * float(np.quantile(heading, 0.95)),
        "stated_mm": 1000 * float(np.median(sigma[:, 0])),
        "within_2_sigma_percent": 100 * float(held.mean()),
        "length_ratio": float(np.mean([j["length"] for j in judged])),
        "leg_ends_95_mm": 1000 * float(np.quantile(ends, 0.95)) if len(ends) else float("nan"),
        "beams_at_walls_percent": 100 * float(np.median([j["agreement"] for j in judged])),
    }


def main(arguments: list[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--robot", default="tiago")
    parser.add_argument("--trials", type=int, default=4, help="of each batch")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one trial")
    asked = parser.parse_args(arguments)
    robot = load_robot(asked.robot)
    out: dict[str, dict[str, float]] = {}
    everything: list[dict[str, Any]] = []
    for batch in BATCHES[:1] if asked.smoke else BATCHES:
        trials = driven(robot, batch, 1 if asked.smoke else asked.trials)
        judged = [judge(robot, *one, seed=i) for i, one in enumerate(trials)]
        out[batch] = figures(judged)
        everything += judged
    out["all"] = figures(everything)
    if asked.json:
        print(json.dumps(out, indent=2))
        return 0
    names = list(out["all"])
    print("\t".join(["batch", *names]))
    for batch, row in out.items():
        print("\t".join([batch, *(f"{row[n]:.4g}" for n in names)]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
