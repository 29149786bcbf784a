"""The tracking problem of a period of HP+TMPC: plan if need be, tighten, and pose (2)-(3) about the nominal motion."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.motion import reachable
from clearway.navigators.common.tracking.ancillary import gain, stability
from clearway.navigators.common.tracking.problem import IntArray, Problem, discounts, shift
from clearway.navigators.hp_tmpc.heuristic_planner.belts import Reference, plan_reference, predict, turn_first
from clearway.navigators.hp_tmpc.tube_mpc.tube import tightening
from clearway.robots.drive_limits import DriveLimits

BoolArray: TypeAlias = npt.NDArray[np.bool_]

STEP, AGE, CORNERS, FLAGS, SIDE = 0, 1, 2, 3, 4
"""Entries of `Memory.clock`: decisions so far, periods since the plan was made (-1: there is none), rows of `path`,
status of the plan (flags of `planner`), side of it (see `Reference`; 0: none)."""

MAX_CORNERS = 512


class Settings(NamedTuple):
    """What doesn't change during a trial; symbols as in `parameters`.

    Attributes:
        period: Control period c, s.
        horizon: N^P, periods.
        control_horizon: N^c, periods.
        window: Periods that the planner predicts.
        commitment: Most periods that a plan is kept.
        rho_rob: Radius of the robot, m.
        safe_margin: rho^safe, m.
        perception: How far obstacles are perceived, m.
        area: (4,) x_min, y_min, x_max, y_max of (3c), m.
        limits: Input box of (3d) and the base's accelerations; `v_min` is 0 for one that may not reverse.
        input_change: u^smooth of (3e), norm of the change of (m/s, rad/s) in a period.
        w1: w_1 of (2).
        w2: w_2 of (2).
        heading_weight: Weight of the heading's error in (2), m/rad.
        w_rob: w-bar^rob of (4), m.
        xi_rob: xi^rob of (4).
        w_dyn: w-bar^dyn,obs of (5), m.
        xi_dyn: xi^dyn,obs of (5).
        poles: (3,) of the ancillary gain.
        gain_limit: Largest correction of omega per error to the left, rad/s/m.
        threshold: Tracking error beyond which it plans anew, m.
        speed: v_ref, m/s.
        align: Deviation of the heading from the path beyond which the robot turns on the spot first, rad.
        turn: How fast it turns then, rad/s.
        model: Whether (1) is read literally.
        discount: Whether (2) is read literally.
        circle: Whether (3f) is read literally.
        feedback: Whether (3k) is read literally.
        exact: Whether the planner takes the tangent graph instead of the greedy rule.
        keep: Share by which the other side must be shorter to be changed to.
    """

    period: float
    horizon: int
    control_horizon: int
    window: int
    commitment: int
    rho_rob: float
    safe_margin: float
    perception: float
    area: FloatArray
    limits: DriveLimits
    input_change: float
    w1: float
    w2: float
    heading_weight: float
    w_rob: float
    xi_rob: float
    w_dyn: float
    xi_dyn: float
    poles: FloatArray
    gain_limit: float
    threshold: float
    speed: float
    align: float
    turn: float
    model: bool
    discount: bool
    circle: bool
    feedback: bool
    exact: bool
    keep: float


class Memory(NamedTuple):
    """What passes from one decision to the next; the kernels write into it.

    Attributes:
        points: (count + 1, 3) poses of the reference as planned.
        inputs: (count, 2) its v [m/s] and omega [rad/s].
        nominal: (3,) x_bar now.
        plan: (N, 2) last decided u_bar.
        input: (2,) last command.
        path: (MAX_CORNERS, 2) the planned path.
        clock: Counters and marks at the indices STEP, AGE, CORNERS, FLAGS, SIDE.
    """

    points: FloatArray
    inputs: FloatArray
    nominal: FloatArray
    plan: FloatArray
    input: FloatArray
    path: FloatArray
    clock: IntArray


class Posed(NamedTuple):
    """A tracking problem, with what it was made of.

    Attributes:
        problem: The tracking problem.
        warm: (N, 2) plan to start from.
        tube: (N + 1,) w_k^rob, m.
        correction: (2,) the ancillary law's K (x - x_bar), m/s and rad/s.
        radius: f^SR(A + B K).
        planned: Whether a plan was made.
        reference: That plan; without points where none was made.
    """

    problem: Problem
    warm: FloatArray
    tube: FloatArray
    correction: FloatArray
    radius: float
    planned: bool
    reference: Reference


def fresh_memory(horizon: int, count: int) -> Memory:
    """Of a robot that has decided nothing yet."""
    clock = np.zeros(5, np.int64)
    clock[AGE] = -1
    return Memory(
        np.zeros((count + 1, 3)), np.zeros((count, 2)), np.zeros(3), np.zeros((horizon, 2)), np.zeros(2),
        np.zeros((MAX_CORNERS, 2)), clock,
    )  # fmt: skip


@kernel
def sort_out(
    position: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    error: FloatArray,
    moving: BoolArray,
    rho_rob: float,
) -> tuple[FloatArray, FloatArray]:
    """Obstacles that stand (n, 3): x, y, distance of contact; and that move (m, 6): x, y, v_x, v_y, that, error bound.

    What has no finite position or radius is left out; an unknown velocity counts as zero; the error of one that stands
    is added to its distance of contact; for those that move it is where eq. 5 starts.
    """
    still, moving_obstacles = np.empty((len(radius), 3)), np.empty((len(radius), 6))
    n = m = 0
    for i in range(len(radius)):
        if not (math.isfinite(position[i, 0]) and math.isfinite(position[i, 1]) and math.isfinite(radius[i])):
            continue
        contact, doubt = rho_rob + max(radius[i], 0.0), error[i] if math.isfinite(error[i]) else 0.0
        if moving[i]:
            moving_obstacles[m, 0], moving_obstacles[m, 1], moving_obstacles[m, 4], moving_obstacles[m, 5] = (
                position[i, 0], position[i, 1], contact, doubt,
            )  # fmt: skip
            for j in range(2):
                moving_obstacles[m, 2 + j] = velocity[i, j] if math.isfinite(velocity[i, j]) else 0.0
            m += 1
        else:
            still[n, 0], still[n, 1], still[n, 2] = position[i, 0], position[i, 1], contact + doubt
            n += 1
    return still[:n].copy(), moving_obstacles[:m].copy()


@kernel
def plan(
    settings: Settings,
    memory: Memory,
    still: FloatArray,
    moving_obstacles: FloatArray,
    pose: FloatArray,
    goal: FloatArray,
    draw: float,
) -> Reference:
    """Ask the planner for a reference from `pose` (3,) to `goal` (3,) and commit to it: x_bar = x."""
    n, m = settings.window, len(moving_obstacles)
    tube = tightening(settings.w_rob, settings.xi_rob, n, 0.0)
    discs = still.copy()
    discs[:, 2] += settings.safe_margin + tube[min(n, settings.horizon)]
    margin = np.empty((m, n + 1))
    for i in range(m):
        margin[i] = settings.safe_margin + tube + tightening(settings.w_dyn, settings.xi_dyn, n, moving_obstacles[i, 5])
    predicted = predict(
        moving_obstacles[:, :2].copy(),
        moving_obstacles[:, 2:4].copy(),
        moving_obstacles[:, 4].copy(),
        margin,
        settings.period,
    )
    reference = plan_reference(
        pose, goal, discs, predicted, settings.area, settings.perception, settings.speed, settings.period,
        len(memory.inputs), draw, settings.exact, settings.keep * memory.clock[SIDE],
    )  # fmt: skip
    memory.points[:] = reference.points
    memory.inputs[:] = reference.inputs
    turn_first(memory.points, memory.inputs, pose[2], settings.align, settings.turn, settings.period)
    memory.nominal[:] = pose
    corners = min(len(reference.path), MAX_CORNERS)
    memory.path[:corners] = reference.path[:corners]
    memory.clock[CORNERS] = corners
    memory.clock[AGE] = 0
    memory.clock[FLAGS] = reference.status
    memory.clock[SIDE] = reference.side
    return reference


@kernel
def pose_problem(
    settings: Settings,
    memory: Memory,
    still: FloatArray,
    moving_obstacles: FloatArray,
    pose: FloatArray,
    goal: FloatArray,
    draw: float,
    anew: bool,
) -> Posed:
    """Plan if asked to (`anew`) or due, and pose the tracking problem (2)-(3) of this period.

    A plan is due where there is none, after `commitment` periods, and where the robot is more than `threshold` off it.
    """
    n, c, age = settings.horizon, settings.period, memory.clock[AGE]
    off = math.hypot(pose[0] - memory.points[max(age, 0), 0], pose[1] - memory.points[max(age, 0), 1])
    planned = anew or age < 0 or age >= settings.commitment or off > settings.threshold
    if planned:
        reference = plan(settings, memory, still, moving_obstacles, pose, goal, draw)
    else:
        empty = np.zeros((0, 2))
        reference = Reference(0, np.zeros((0, 3)), empty, empty, empty, np.zeros((0, 3)), 0.0, goal[:2].copy(), 0, 0)
    age = memory.clock[AGE]
    points, inputs = memory.points[age + 1 : age + 1 + n].copy(), memory.inputs[age : age + n].copy()
    warm = shift(memory.plan) if memory.clock[STEP] > 0 else inputs.copy()

    nominal, base = memory.nominal, warm[0]
    if settings.feedback:  # x_bar is the reference itself
        nominal, base = memory.points[age].copy(), inputs[0]
    error = pose - nominal
    error[2] = turn_between(nominal[2], pose[2])
    k = gain(nominal[2], base[0], base[1], c, settings.model, settings.poles, settings.gain_limit)
    correction = k @ error
    radius = stability(nominal[2], base[0], base[1], c, settings.model, k)
    tube = tightening(settings.w_rob, settings.xi_rob, n, math.hypot(error[0], error[1]))

    low, high = reachable(settings.limits, memory.input[0], memory.input[1], n, c)
    for j in range(2):
        low[0, j] -= correction[j]
        high[0, j] -= correction[j]
    rows, counts = obstacle_rows(settings, still, moving_obstacles, nominal, tube)
    widest = 0.0
    for i in range(len(still)):
        widest = max(widest, still[i, 2])
    for i in range(len(moving_obstacles)):
        widest = max(widest, moving_obstacles[i, 4])
    rho_safe = max(widest, settings.rho_rob) + settings.safe_margin
    reach = settings.perception - rho_safe
    if settings.circle:
        farthest = 0.0
        for i in range(memory.clock[CORNERS]):
            farthest = max(farthest, math.hypot(memory.path[i, 0] - pose[0], memory.path[i, 1] - pose[1]))
        reach = farthest - rho_safe
    area = np.empty((n, 4))
    for i in range(n):
        for j in range(2):  # never beyond where it is: a robot at the rim must not be asked for the impossible
            area[i, j] = min(settings.area[j] + tube[i + 1], nominal[j])
            area[i, 2 + j] = max(settings.area[2 + j] - tube[i + 1], nominal[j])
    problem = Problem(
        nominal.copy(), memory.input - correction, points, inputs, rows, counts, np.zeros((0, 3)), 1.0, pose[:2].copy(),
        np.full(n, reach), area, low, high, np.full(n, settings.input_change),
        discounts(n, settings.w1, memory.clock[STEP], settings.discount), settings.w2, settings.heading_weight, c,
        not settings.model, settings.control_horizon,
    )  # fmt: skip
    return Posed(problem, warm, tube, correction, radius, planned, reference)


@kernel
def obstacle_rows(
    settings: Settings, still: FloatArray, moving_obstacles: FloatArray, start: FloatArray, tube: FloatArray
) -> tuple[FloatArray, IntArray]:
    """(N, M, 3) x, y, required distance of (3g)-(3j), and how many of each stage count; out of reach: left out.

    A moving obstacle counts where it is at the steps before, at and after that of the stage, as far as the window knows.
    """
    n, c = settings.horizon, settings.period
    fastest = max(settings.limits.v_max, -settings.limits.v_min) * c
    doubts = np.empty((len(moving_obstacles), n + 1))
    for i in range(len(moving_obstacles)):
        doubts[i] = tightening(settings.w_dyn, settings.xi_dyn, n, moving_obstacles[i, 5])
    counts = np.zeros(n, np.int64)
    rows = np.empty((n, 0, 3))
    for filling in range(2):
        if filling:
            rows = np.empty((n, counts.max() if n else 0, 3))
            counts[:] = 0
        for k in range(n):
            safe, travel = settings.safe_margin + tube[k + 1], fastest * (k + 1)
            for i in range(len(still)):
                need = still[i, 2] + safe
                if math.hypot(still[i, 0] - start[0], still[i, 1] - start[1]) < need + travel:
                    if filling:
                        rows[k, counts[k], 0], rows[k, counts[k], 1], rows[k, counts[k], 2] = (
                            still[i, 0], still[i, 1], need,
                        )  # fmt: skip
                    counts[k] += 1
            for i in range(len(moving_obstacles)):
                for j in range(max(k, 1), min(k + 2, n) + 1):
                    x, y = (
                        moving_obstacles[i, 0] + moving_obstacles[i, 2] * j * c,
                        moving_obstacles[i, 1] + moving_obstacles[i, 3] * j * c,
                    )
                    need = moving_obstacles[i, 4] + safe + doubts[i, j]
                    if math.hypot(x - start[0], y - start[1]) < need + travel:
                        if filling:
                            rows[k, counts[k], 0], rows[k, counts[k], 1], rows[k, counts[k], 2] = x, y, need
                        counts[k] += 1
    return rows, counts
