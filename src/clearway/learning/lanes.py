"""A control period of many learners' worlds in one kernel: judged, driven, sensed, and written down as they see it.

What `clearway.learning.episode.Episode` does step by step, for what is compiled throughout: one robot without latency, that knows where it
is by the truth or its odometry, among what stands, runs on rails, or is one compiled crowd (`tests/learning/test_vector.py` holds
both side by side).
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.shapes import FloatArray
from clearway.navigators.learnt.encoding import GOAL, OBSTACLE
from clearway.world.behaviours.among import walk_until
from clearway.world.goal_and_progress_checker import (
    GOAL_THETA,
    GOAL_X,
    GOAL_Y,
    PLANNER_YAW,
    Verdict,
    judged,
    near_goal,
)
from clearway.world.legs import Legs, walk
from clearway.world.lidar import View, scan_from
from clearway.world.plant import drive_period
from clearway.world.ride import Ride, drive, rehearse
from clearway.world.setting import (
    ODOM_OMEGA,
    ODOM_THETA,
    ODOM_V,
    ODOM_V_Y,
    ODOM_X,
    ODOM_Y,
    OMEGA,
    STATE,
    THETA,
    V_Y,
    V,
    X,
    Y,
)

_SAME = 1e-9  # s


class Phase(IntEnum):
    """How far a lane has come in its control period, and what it waits for there."""

    TOLD = 0
    """It has been told what to do."""
    JUDGED = 1
    """That is in force: it drives."""
    WALKED = 2
    """Its crowd has stopped for what is to be seen to; then it is `LOOKED`."""
    LOOKED = 3
    """That has been seen to: it drives on."""
    SEEN = 4
    """It has driven, and been shown what there is."""
    ARRIVED = 5
    """A leg other than the last was reached: the next one is to begin; then it is `JUDGED`."""
    OVER = 6
    """Its episode is over; `Lane.now` says how."""


PERIODS, DECISIONS, LEG, VERDICT, HIT, TOLD_LEG = range(6)


class Lane(NamedTuple):
    """One learner's world.

    Attributes:
        ride: Its robot, on its way.
        lidar: Its lidar, of as many beams as it has; none: it has no lidar, or that is not seen.
        walking: The people's legs that the lidar sees.
        pivot: How far ahead of base_link the point is whose pose `ride.state` has, m.
        axle: The same where its odometry knows it, as `World.axle`, m.
        rules: (l, RULES) of each leg, see `goal_and_progress_checker`.
        progress: (PROGRESS_STATE,) the same.
        livelock: Whether that ends an episode.
        now: (6,) int64: control periods, decisions of others, the leg, the last `Verdict`, what was hit (-1: nothing), and the leg when
            it was told what to do.
        start: (3,) where the robot was put.
        by_odometry: Whether it knows where it is by its odometry, else by the truth.
        estimate: (3,) where it takes itself to be.
        ranges: (n,) room for a scan, m.
        cuts: (b + 1,) int64, which of the ranges each part that is seen begins with.
        farthest: The longest range, m.
        discs: (k, 3) x, y [m] and radius of what is told, now.
        which: (k,) int64, which of the moving bodies each of these is; -1: it stands.
        before: (k, 2) where they were when they were last told of; NaN: they weren't.
        order: (k,) int64, room to sort.
        away: (k,) the same.
        most: How many of the discs are seen.
        sight: How far off the edge of one may be, m.
        sideways: Whether the base moves sideways.
    """

    ride: Ride
    lidar: View
    walking: Legs
    pivot: float
    axle: float
    rules: FloatArray
    progress: FloatArray
    livelock: bool
    now: npt.NDArray[np.int64]
    start: FloatArray
    by_odometry: bool
    estimate: FloatArray
    ranges: FloatArray
    cuts: npt.NDArray[np.int64]
    farthest: float
    discs: FloatArray
    which: npt.NDArray[np.int64]
    before: FloatArray
    order: npt.NDArray[np.int64]
    away: FloatArray
    most: int
    sight: float
    sideways: bool


class Told(NamedTuple):
    """What n learners say, and what they are shown.

    Attributes:
        commands: (n, 3) v [m/s], omega [rad/s], v_y [m/s].
        phase: (n,) int64, see `Phase`.
        seen: (n, m) float32, what each sees.
        moved: (n, 2) how far from the goal that it had the robot was when it was told, and is, by the truth, m.
    """

    commands: FloatArray
    phase: npt.NDArray[np.int64]
    seen: npt.NDArray[np.float32]
    moved: FloatArray


@kernel
def hold(lane: Lane) -> Held[Lane]:
    """`lane`, as the others here take it."""
    return Held(lane)


@light
def base_link(state: FloatArray, pivot: float) -> tuple[float, float, float]:
    """The true pose of base_link."""
    theta = state[THETA]
    if pivot == 0.0:
        return state[X], state[Y], theta
    return state[X] - pivot * math.cos(theta), state[Y] - pivot * math.sin(theta), theta


@light
def away(lane: Lane) -> float:
    """How far the robot is from the goal that it had when it was told what to do, by the truth, m."""
    x, y, _ = base_link(lane.ride.state, lane.pivot)
    rule = lane.rules[lane.now[TOLD_LEG]]
    return math.hypot(rule[GOAL_X] - x, rule[GOAL_Y] - y)


@light
def judge(lane: Lane, v: float, omega: float, v_y: float) -> int:
    """Take a command over, and judge the instant at which it was given: a `Verdict`."""
    state, rule, commands = lane.ride.state, lane.rules[lane.now[LEG]], lane.ride.setting.commands
    called = near_goal(rule, lane.estimate[0], lane.estimate[1], lane.estimate[2])
    for row in range(1, len(commands)):
        commands[row, 0] = math.inf
    commands[0, 0] = 0.0
    commands[0, 1], commands[0, 2], commands[0, 3] = (0.0, 0.0, 0.0) if called else (v, omega, v_y)
    x, y, _ = base_link(state, lane.pivot)
    t = lane.now[PERIODS] * lane.ride.setting.vehicle.period
    speed = math.hypot(state[V], state[V_Y])
    return judged(rule, lane.progress, t, x, y, speed, state[OMEGA], called, False, lane.livelock)


@light
def begin(lane: Lane, told: Told, i: int) -> int:
    """The first part of lane `i`'s control period, up to where it drives: its `Phase`."""
    lane.now[TOLD_LEG] = lane.now[LEG]
    told.moved[i, 0] = told.moved[i, 1] = away(lane)
    verdict = judge(lane, told.commands[i, 0], told.commands[i, 1], told.commands[i, 2])
    lane.now[VERDICT] = verdict
    if verdict == Verdict.GOES_ON:
        return Phase.JUDGED.value
    if verdict == Verdict.REACHED and lane.now[LEG] + 1 < len(lane.rules):
        return Phase.ARRIVED.value
    return Phase.OVER.value


@light
def end(lane: Lane, told: Told, i: int, hit: int) -> int:
    """The last part of lane `i`'s control period, in which the robot `hit` something, or -1: its `Phase`."""
    ride = lane.ride
    told.moved[i, 1] = away(lane)
    lane.now[HIT] = hit
    if hit >= 0:
        return Phase.OVER.value
    for c in range(STATE):
        ride.began[c] = ride.state[c]
    lane.now[PERIODS] += 1
    see(lane, told.seen, i)
    return Phase.SEEN.value


@light
def see(lane: Lane, seen: npt.NDArray[np.float32], i: int) -> None:
    """Sense, and write what is seen to row `i` of `seen`, as `encoding.Seeing.flat` has it."""
    state, setting, rule = lane.ride.state, lane.ride.setting, lane.rules[lane.now[LEG]]
    count = lane.now[PERIODS]
    t = count * setting.vehicle.period
    x, y, theta = base_link(state, lane.pivot)
    if lane.by_odometry:
        theta = state[ODOM_THETA]
        ox, oy = state[ODOM_X] + lane.axle * (1.0 - math.cos(theta)), state[ODOM_Y] - lane.axle * math.sin(theta)
        c, s = math.cos(lane.start[2]), math.sin(lane.start[2])
        x, y = lane.start[0] + c * ox - s * oy, lane.start[1] + s * ox + c * oy
        theta = wrap(lane.start[2] + theta)
    lane.estimate[0], lane.estimate[1], lane.estimate[2] = x, y, theta
    dx, dy, c, s = rule[GOAL_X] - x, rule[GOAL_Y] - y, math.cos(theta), math.sin(theta)
    seen[i, 0], seen[i, 1], seen[i, 2], seen[i, 3] = c * dx + s * dy, c * dy - s * dx, 0.0, 0.0
    if rule[PLANNER_YAW] < math.pi:
        turn = turn_between(theta, rule[GOAL_THETA])
        seen[i, 2], seen[i, 3] = math.cos(turn), math.sin(turn)
    seen[i, GOAL], seen[i, GOAL + 1] = state[ODOM_V], state[ODOM_OMEGA]
    k = GOAL + 2
    if lane.sideways:
        seen[i, k] = state[ODOM_V_Y]
        k += 1
    if len(lane.cuts) > 1:
        k = _see_scan(lane, seen, i, k, t)
    if lane.most > 0:
        _see_discs(lane, seen, i, k, x, y, c, s)


@light
def _see_scan(lane: Lane, seen: npt.NDArray[np.float32], i: int, k: int, t: float) -> int:
    """Scan, and write the shortest return of each part behind the first `k` numbers of row `i`; how many there are then."""
    state, moving, view = lane.ride.state, lane.ride.setting.moving, lane.lidar
    for m in range(len(view.poses)):
        for c in range(3):
            view.poses[m, c] = moving.poses[m, c]
    if len(lane.walking.circle) > 0:
        walk(view.movable.circles, lane.walking, moving.tracks, moving.since, lane.now[LEG], t)
    scan_from(lane.ranges, state[X], state[Y], state[THETA], lane.now[PERIODS], view)
    for b in range(len(lane.cuts) - 1):
        nearest = lane.farthest
        for j in range(lane.cuts[b], lane.cuts[b + 1]):
            nearest = min(nearest, lane.ranges[j])
        seen[i, k + b] = nearest
    return k + len(lane.cuts) - 1


@light
def _see_discs(
    lane: Lane, seen: npt.NDArray[np.float32], i: int, k: int, x: float, y: float, c: float, s: float
) -> None:
    """Write the nearest discs behind the first `k` numbers of row `i`, as seen from (x, y) [m], ahead along (c, s)."""
    discs, poses, before, order, away = lane.discs, lane.ride.setting.moving.poses, lane.before, lane.order, lane.away
    tx, ty, _ = base_link(lane.ride.state, lane.pivot)
    count = 0
    for j in range(len(discs)):
        if lane.which[j] >= 0:
            discs[j, 0], discs[j, 1] = poses[lane.which[j], 0], poses[lane.which[j], 1]
        if not math.hypot(discs[j, 0] - tx, discs[j, 1] - ty) - discs[j, 2] <= lane.sight:
            before[j, 0] = math.nan
            continue
        far, m = math.hypot(discs[j, 0] - x, discs[j, 1] - y) - discs[j, 2], count
        while m > 0 and far < away[m - 1]:
            order[m], away[m] = order[m - 1], away[m - 1]
            m -= 1
        order[m], away[m] = j, far
        count += 1
    period = lane.ride.setting.vehicle.period
    for n in range(lane.most):
        at = k + OBSTACLE * n
        if n >= count:
            for m in range(OBSTACLE):
                seen[i, at + m] = 0.0
            continue
        j = order[n]
        dx, dy, vx, vy = discs[j, 0] - x, discs[j, 1] - y, 0.0, 0.0
        if lane.which[j] >= 0 and math.isfinite(before[j, 0]):
            vx, vy = (discs[j, 0] - before[j, 0]) / period, (discs[j, 1] - before[j, 1]) / period
        seen[i, at], seen[i, at + 1] = c * dx + s * dy, c * dy - s * dx
        seen[i, at + 2], seen[i, at + 3] = c * vx + s * vy, c * vy - s * vx
        seen[i, at + 4], seen[i, at + 5] = discs[j, 2], 1.0
    for n in range(count):
        j = order[n]
        before[j, 0], before[j, 1] = discs[j, 0], discs[j, 1]


@kernel
def see_held(held: Held[Lane], seen: npt.NDArray[np.float32], i: int) -> None:
    """`see`."""
    see(held.value, seen, i)


def step(lanes: Any, *more: Any) -> None:
    """Drive each of `lanes` as far as it gets by itself: see `step_on_rails` and `step_among`."""
    if len(more) == 1:
        step_on_rails(lanes, *more)
    else:
        step_among(lanes, *more)


@kernel
def step_on_rails(lanes: Any, told: Told) -> None:
    """Drive each of `lanes` whose phase is `TOLD` or `JUDGED`, among what stands or runs on rails, as far as it gets."""
    for i in range(len(lanes)):
        if told.phase[i] > Phase.JUDGED:
            continue
        lane = lanes[i].value
        if told.phase[i] == Phase.TOLD:
            told.phase[i] = begin(lane, told, i)
        if told.phase[i] == Phase.JUDGED:
            ride, count = lane.ride, lane.now[PERIODS]
            hit = drive_period(ride.state, count, lane.now[LEG], count * ride.setting.vehicle.period, ride.setting)
            told.phase[i] = end(lane, told, i, hit)


@kernel
def step_among(lanes: Any, crowds: Any, streets: Any, told: Told) -> None:
    """The same, among a compiled crowd each; the phase may be `LOOKED` too."""
    for i in range(len(lanes)):
        if told.phase[i] > Phase.LOOKED or told.phase[i] == Phase.WALKED:
            continue
        lane = lanes[i].value
        if told.phase[i] == Phase.TOLD:
            told.phase[i] = begin(lane, told, i)
        looked = told.phase[i] == Phase.LOOKED
        if not (looked or told.phase[i] == Phase.JUDGED):
            continue
        leg, period, count = lane.now[LEG], lane.ride.setting.vehicle.period, lane.now[PERIODS]
        if not looked:
            rehearse(lane.ride, count, leg, count * period)
        until = (count + 1) * period + _SAME
        lane.now[DECISIONS], news = walk_until(crowds[i], streets[i], leg, lane.now[DECISIONS], until, looked)
        if news:
            told.phase[i] = Phase.WALKED.value
            continue
        told.phase[i] = end(lane, told, i, drive(lane.ride, count, leg, count * period))
