"""How hard a member of a family looks before any trial of it: into whom its robot would run, and how fast.

The robot is thought to drive straight to its goals, and everybody else to go as they do, those who look seeing it there. Whoever then
meets it asks it to change its way. It can fall back, for which it has brakes; it can't hurry, as it drives at its set speed already. So the
measure of an encounter is by how far the robot has to fall back to let the other one pass, which is most where the other
one would hit its rear half, times how deep they would overlap, times how fast they close in while the robot drives a metre:

    hardness = (1 - along / reach) (1 - (miss / reach)^2) closing / speed

`miss` is the distance between the two, `along` the part of it by which the other one is ahead of the robot along its way, `reach` the sum
of their radii, `closing` their relative speed and `speed` the robot's set speed. A scenario is as hard as this gets in its first encounter
and those soon after it; later ones are not foreseen, as the robot has changed its way by then. Where nobody meets the robot
it is negative, the more the farther they miss it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.geometry.packing import pack
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.indicators.legs import FASTEST
from clearway.robots import Robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.world.behaviours.registry import behaviours_of
from clearway.world.bodies import bodies_of, moving_obstacles_of
from clearway.world.laid import Laid
from clearway.world.tracks import place, tracks
from clearway.world.traffic import Traffic

STEP = 0.2
"""Between so long instants all go straight, s."""
LONGEST = 120.0
"""Encounters after that are not looked for, s."""
_TOGETHER = 3.0
"""What begins within that time of the first encounter counts, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """How a robot would drive if nothing was in its way.

    Attributes:
        poses: (k, 3) at instants `STEP` apart, from 0 on: x, y [m], theta [rad].
        begins: When each of its legs begins, s.
        speed: Its set speed, m/s.
    """

    poses: FloatArray
    begins: tuple[float, ...]
    speed: float


def straight(scenario: Scenario, robot: Robot) -> Way:
    """Straight from goal to goal at the set speed; where a goal is its own place it turns there, for half a turn."""
    speed, drive = min(scenario.speed, robot.drive.v_max), robot.drive
    places = [scenario.start[:2], *(leg.goal[:2] for leg in scenario.legs)]
    times = [0.0]
    late = 0.5 * speed / drive.acceleration  # than without having to get up to speed
    for a, b in itertools.pairwise(places):
        far = math.dist(a, b)
        times.append(times[-1] + (late + far / speed if far > 0.0 else math.pi / drive.omega_max))
    instants = np.arange(0.0, min(times[-1], LONGEST) + STEP, STEP)
    at = np.stack([np.interp(instants, times, [p[c] for p in places]) for c in range(2)], axis=1)
    steps = np.diff(at, axis=0, append=at[-1:])
    return Way(np.column_stack([at, np.arctan2(steps[:, 1], steps[:, 0])]), tuple(times[:-1]), speed)


def hardness(scenario: Scenario, robots: Sequence[Robot]) -> float:
    """How hard the scenario looks, see above; -inf where nobody moves but one robot.

    Args:
        scenario: The test.
        robots: Its own robot, then its other `robots` in their order.
    """
    ways = [straight(member, robot) for member, robot in zip(scenario.members(), robots, strict=True)]
    instants = max(len(way.poses) for way in ways)
    others = _others(scenario, robots[0], ways[0])
    reach = [circumscribed_radius(o.shape.shape()) for o in moving_obstacles_of(scenario)]
    reach += [person.radius for person in scenario.people]
    drives = np.full((instants, len(ways), 2), np.nan)  # each is there until it arrives
    for k, way in enumerate(ways):
        drives[: len(way.poses), k] = way.poses[:, :2]
    radii = [circumscribed_radius(robot.shape) for robot in robots]
    hardest = -math.inf
    for k in scenario.tested():
        n, rest = len(ways[k].poses), [j for j in range(len(ways)) if j != k]
        around = np.full((n, others.shape[1] + len(rest), 2), np.nan)
        around[: len(others), : others.shape[1]] = others[:n]
        around[:, others.shape[1] :] = drives[:n, rest]
        sums = np.array([*reach, *(radii[j] for j in rest)]) + radii[k]
        found = encounters(ways[k].poses[:, :2], around, sums, ways[k].speed).max(axis=1, initial=-math.inf)
        met = np.flatnonzero(found > 0.0)
        if len(met):
            found = found[met[0] : met[0] + round(_TOGETHER / STEP)]
        hardest = max(hardest, float(found.max(initial=-math.inf)))
    return hardest


def encounters(own: FloatArray, others: FloatArray, reach: FloatArray, speed: float) -> FloatArray:
    """(k - 1, m) how hard each of m others is for a robot in each step, see above; -inf where one is absent or leaps.

    Args:
        own: (k, 2) where the robot is at instants `STEP` apart, m.
        others: (k, m, 2) where they are, NaN while one is absent, m.
        reach: (m,) sum of its radius and each of theirs, m.
        speed: The robot's set speed, m/s.
    """
    gap, step = others - own[:, None], np.diff(own, axis=0)
    change = np.diff(gap, axis=0)
    way = np.square(change).sum(axis=2)
    share = np.clip(-(gap[:-1] * change).sum(axis=2) / np.maximum(way, 1e-12), 0.0, 1.0)
    nearest = gap[:-1] + share[:, :, None] * change
    miss = np.hypot(nearest[:, :, 0], nearest[:, :, 1]) / reach
    driven = np.hypot(*step.T)
    ahead = np.einsum("kmc,kc->km", nearest, step / np.maximum(driven, 1e-9)[:, None]) / reach
    moves = np.minimum(driven / (STEP * speed), 1.0)[:, None]  # who stands at its goal is not run into
    overlap = 1.0 - np.square(miss)
    hard = np.where(overlap > 0.0, overlap * (1.0 - ahead) * np.sqrt(way) / (STEP * speed) * moves, overlap)
    leaps = np.hypot(*np.moveaxis(np.diff(others, axis=0), 2, 0)) > FASTEST * STEP
    found: FloatArray = np.where(np.isfinite(hard) & ~leaps, hard, -np.inf)
    return found


def _others(scenario: Scenario, robot: Robot, way: Way) -> FloatArray:
    """(k, m, 2) where its moving obstacles and people are while the robot drives its way, NaN while one is absent, m."""
    moving, legs = moving_obstacles_of(scenario), [leg.name for leg in scenario.legs]
    who = len(moving) + len(scenario.people)
    there = np.empty((len(way.poses), who, 3))
    if not who:
        return there[:, :, :2]
    laid = tracks(moving, legs, STEP * len(there), len(scenario.people))
    decide = bool(scenario.people) or any(o.behaviour is not None for o in moving)
    bodies = bodies_of(load_floor_plan(scenario.floor_plan).fixtures, scenario) if decide else ()
    traffic = Traffic(laid, behaviours_of(scenario, bodies) if decide else (), legs)
    traffic.join(pack([robot.shape]), 0.0, way.poses[0], robot.drive.v_max)
    seen, since, leg = Laid(*traffic.track(0)), np.zeros(who), 0
    traffic.start()
    for i, pose in enumerate(way.poses):
        t = i * STEP
        if i:
            seen.lay(t, pose)
        traffic.decide_until(t)
        if leg + 1 < len(legs) and way.begins[leg + 1] <= t:
            leg += 1
            traffic.begin_leg(leg, t)
            since[~laid.lasting] = t
        place(laid, leg, since, t, there[i])
    return there[:, :, :2]
