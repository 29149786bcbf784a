"""How fast a team could be whose robots all knew the future, and one another's ways.

Of each batch of `sar-team` and `sar-team-held-out`, by number of robots: of how many scenarios a joint way was found (every robot from
its start to its goal, clear of all obstacles and of all other robots at all times, so the scenario is solvable), the mean over those of the time at
which the last robot arrives, in the best joint way found and as a bound that no team can beat (each robot alone among the obstacles,
`clearway.clairvoyant`'s lower bound). A robot is here a disc that takes up any velocity up to its set speed at once and stands where it has arrived.
Joint ways are sought one robot after another, each among those before it, in several orders: "none" shows nothing.

    python benchmarks/team_limit.py [--suite NAME ...] [--batch NAME] [--number N ...] [--scenarios N] [--orders N] [--smoke]
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np

from clearway.clairvoyant.space_time import SpaceTimePath, shortest
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.robots import load_robot
from clearway.robots.robot import RESCUE
from clearway.scenarios.sar_rules import AREA, RADIUS
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.world.tracks import KNOT, swing

HORIZON = 60.0
"""s; the worst bound by far is below 30."""


class Member(NamedTuple):
    """One robot of a team.

    Attributes:
        start: (2,) where it starts, m.
        goal: (2,) where it goes, m.
        slack: How near to the goal it ends, m.
        radius: Its own, m.
        speed: The most it does, m/s.
    """

    start: FloatArray
    goal: FloatArray
    slack: float
    radius: float
    speed: float


def members(scenario: Scenario) -> list[Member]:
    """The robots of a scenario."""
    own = (scenario.start, scenario.legs[0], None)
    found = []
    for start, leg, kind in (own, *((r.start, r.legs[0], r.robot) for r in scenario.robots)):
        robot = load_robot(kind or RESCUE)
        slack = leg.xy_tolerance if leg.xy_tolerance is not None else robot.tolerances.xy
        speed = min(scenario.speed, robot.drive.v_max)
        found.append(
            Member(np.array(start[:2]), np.array(leg.goal[:2]), slack, circumscribed_radius(robot.shape), speed)
        )
    return found


class Floor(NamedTuple):
    """What a team meets beside itself.

    Attributes:
        static: (n, 2) centres of the obstacles that stand, m.
        moving: (T, m, 2) centres of those that move, every `KNOT` seconds, m.
    """

    static: FloatArray
    moving: FloatArray


def floor(scenario: Scenario) -> Floor:
    """The obstacles of a scenario."""
    still = [o.pose[:2] for o in scenario.obstacles if o.pose is not None]
    swings = [swing(o.lasting, HORIZON)[:, 1:3] for o in scenario.obstacles if o.lasting is not None]
    assert len(still) + len(swings) == len(scenario.obstacles)
    count = math.ceil(HORIZON / KNOT) + 2
    return Floor(np.array(still).reshape(-1, 2), np.stack(swings, axis=1) if swings else np.zeros((count, 0, 2)))


def way(robot: Member, ground: Floor, before: list[tuple[Member, FloatArray]], bound: bool) -> SpaceTimePath | None:
    """The fastest of `robot` among the obstacles and those that have theirs (T, 2) already."""
    moving = np.concatenate([ground.moving, *(track[:, None] for _, track in before)], axis=1)
    # A track is straight between its samples, the way that it is made of has its corners anywhere.
    radii = [RADIUS] * ground.moving.shape[1] + [other.radius + other.speed * KNOT for other, _ in before]
    return shortest(
        robot.start, robot.goal, goal_radius=robot.slack, v_max=robot.speed,
        static=np.column_stack([ground.static, np.full(len(ground.static), RADIUS + robot.radius)]),
        moving=moving, radii=np.array(radii) + robot.radius, dt=KNOT, area=AREA, horizon=HORIZON, bound=bound,
    )  # fmt: skip


def track(path: SpaceTimePath, count: int) -> FloatArray:
    """(count, 2) where it is every `KNOT` seconds; at last it stands."""
    t = KNOT * np.arange(count)
    return np.column_stack([np.interp(t, path.points[:, 0], path.points[:, k]) for k in (1, 2)])


def joint(robots: list[Member], ground: Floor, order: list[int], best: float) -> float:
    """When the last robot arrives, in this order, s; inf: a robot found no way, or none before `best`."""
    before: list[tuple[Member, FloatArray]] = []
    last = 0.0
    for k in order:
        found = way(robots[k], ground, before, bound=False)
        if found is None or found.time >= best:
            return math.inf
        last = max(last, found.time)
        before.append((robots[k], track(found, len(ground.moving))))
    return last


def limit(scenario: Scenario, orders: int) -> tuple[float, float]:
    """The best joint way's time that was found, inf without, and the bound below all, s."""
    robots, ground = members(scenario), floor(scenario)
    alone = [way(robot, ground, [], bound=True) for robot in robots]
    if any(a is None for a in alone):
        return math.inf, math.inf
    times = [a.time for a in alone if a is not None]
    below = max(a.time * (1.0 - a.error) for a in alone if a is not None)
    late_first = sorted(range(len(robots)), key=lambda k: -times[k])  # who needs longest has the right of way
    rng, best = np.random.default_rng(len(robots)), math.inf
    for attempt in range(orders):
        order = late_first if attempt == 0 else [int(k) for k in rng.permutation(len(robots))]
        best = min(best, joint(robots, ground, order, best))
        if best <= below * 1.005:
            break
    return best, below


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", action="append")
    parser.add_argument("--batch", action="append")
    parser.add_argument("--number", type=int, action="append")
    parser.add_argument("--scenarios", type=int, default=10, help="of each batch and number, at most")
    parser.add_argument("--orders", type=int, default=10)
    parser.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    if given.smoke:
        given.suite, given.batch, given.number, given.scenarios, given.orders = ["sar-team"], ["case 1"], [2], 1, 1
    print("| suite | batch | robots | scenarios | joint way found | last arrives, found (s) | no team before (s) |")
    print("|---|---|---:|---:|---:|---:|---:|")
    for name in given.suite or ("sar-team", "sar-team-held-out"):
        groups: dict[tuple[str, str], list[Scenario]] = defaultdict(list)
        for scenario in load_suite(name).build(load_robot(RESCUE), Selection()):
            groups[scenario.labels.batch, scenario.labels.configuration].append(scenario)
        for (batch, number), scenarios in groups.items():
            if (given.batch and batch not in given.batch) or (given.number and int(number) not in given.number):
                continue
            rows = [limit(scenario, given.orders) for scenario in scenarios[: given.scenarios]]
            solved = np.array([row for row in rows if math.isfinite(row[0])]).reshape(-1, 2)
            print(
                f"| {name} | {batch} | {number} | {len(rows)} | {len(solved)} |"
                f" {solved[:, 0].mean():.2f} | {solved[:, 1].mean():.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
