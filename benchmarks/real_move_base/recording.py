"""What the real planners were asked and answered (`recorder/`), and what ours answer to the same.

Ours is handed what the real one read in that very cycle: its local costmap, its plans as they came, the pose, the measured
velocity; what both remember of earlier cycles (latches, oscillation flags) each keeps by itself.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from clearway.geometry.frames import compose, relative
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.costmap import Costmap
from clearway.navigators.common.costmaps.plans import local_plan
from clearway.navigators.move_base.local_planners.dwa import DWAPlanner
from clearway.navigators.move_base.local_planners.dwa_search import window_of as dwa_window
from clearway.navigators.move_base.local_planners.rollout_search import window_of as rollout_window
from clearway.navigators.move_base.parameters import Parameters
from clearway.navigators.move_base.planners import make_global_planner, make_local_planner
from clearway.robots import Robot

HEADER = struct.Struct("<5I")
EXACT = 1e-3
"""m/s and rad/s: up to which two commands are the same sample; the real planners round poses to floats."""


class Record(NamedTuple):
    """One call of a planner: P a plan is set, R whether the goal is reached, C a command, G a global plan."""

    kind: str
    numbers: FloatArray
    cost: npt.NDArray[np.uint8]


class Answer(NamedTuple):
    """A command of both.

    Attributes:
        t: s of `/clock`.
        real: (4,) whether one was found, v [m/s], omega [rad/s], v_y [m/s].
        ours: (4,) likewise.
        steps: (2,) between two samples of v and of omega.
        steady: Whether pose and velocity stayed as they were while the real one was at work.
    """

    t: float
    real: FloatArray
    ours: FloatArray
    steps: FloatArray
    steady: bool

    @property
    def same(self) -> bool:
        """Whether both chose the same sample, or none."""
        return bool(self.real[0] == self.ours[0] and np.abs(self.real[1:] - self.ours[1:]).max() <= EXACT)

    @property
    def near(self) -> bool:
        """Whether theirs lie within one sample of each other."""
        apart = np.abs(self.real[1:3] - self.ours[1:3])
        return bool(self.real[0] == self.ours[0] and (apart <= self.steps + EXACT).all())


def records(file: Path) -> Iterator[Record]:
    """All that is in a file, in order; what a process that was ended left half written at the end is left out."""
    with file.open("rb") as stream:
        while len(header := stream.read(HEADER.size)) == HEADER.size:
            kind, numbers, rows, columns, size = HEADER.unpack(header)
            if len(packed := stream.read(size)) < size:
                return
            data = zlib.decompress(packed)
            cells = np.frombuffer(data, np.uint8, rows * columns, 8 * numbers).reshape(rows, columns)
            yield Record(chr(kind), np.frombuffer(data, np.float64, numbers).copy(), cells)


def answers(
    file: Path, robot: Robot, speed: float | None = None, parameters: Parameters | None = None
) -> Iterator[Answer]:
    """The commands of both, in order.

    Args:
        robot: Whose parameters the real one had.
        speed: The set speed that it was told.
        parameters: Ours; None: those of the robot's file.
    """
    p = parameters or Parameters.read(robot)
    shape = p.local_costmap.outline(robot.planner_shape)
    polygon = Costmap(p.local_costmap, shape, None, "local_costmap").footprint
    omnidirectional = robot.limits().v_y_max > 0.0
    planner = make_local_planner(p, polygon, None, omnidirectional)
    planner.reset()
    limit = np.inf if speed is None else speed
    plan, begin = np.empty((0, 3)), 0
    for kind, n, cost in records(file):
        if kind == "P":
            plan, begin = n[1:].reshape(-1, 3), 0
            planner.set_plan()
            continue
        if kind == "G" or len(plan) == 0:
            continue
        t, pose, velocity, frame = n[0], n[1:4], n[4:7] if omnidirectional else n[4:6], n[7:10]
        goal = compose(frame, plan[-1])
        if kind == "R":
            planner.goal_reached(pose, velocity, goal)
            continue
        ok, v, omega, v_y, steady, x, y, resolution = n[10:]
        reach = max(cost.shape) * resolution / 2
        ahead, begin = local_plan(plan, begin, relative(frame, pose), frame, reach, planner.prune_plan)
        ours = np.zeros(4)
        steps = np.zeros(2)
        if len(ahead):
            found = planner.compute(pose, velocity, ahead, goal, cost, np.array((x, y)), resolution, limit)
            ours = np.array((found.ok, found.v, found.omega, found.v_y)) if found.ok else ours
            left = float(np.hypot(*(ahead[-1, :2] - pose[:2])))
            if isinstance(planner, DWAPlanner):
                table = p.DWAPlannerROS
                low_v, high_v, low_w, high_w = dwa_window(planner.window(resolution, limit, left), velocity, left)
                counts = max(2, table.vx_samples), max(2, table.vth_samples)
            else:
                old = p.TrajectoryPlannerROS
                low_v, high_v, low_w, high_w = rollout_window(planner.window(resolution, limit), velocity, left)
                counts = old.vx_samples, old.vtheta_samples
            steps = np.array(((high_v - low_v) / (counts[0] - 1), (high_w - low_w) / (counts[1] - 1)))
        real = np.array((ok, v, omega, v_y)) if ok else np.zeros(4)
        yield Answer(t, real, ours, steps, bool(steady))


class _Seen(NamedTuple):
    """A global costmap as the real one saw it, with as much of `Costmap` as a global planner asks for."""

    cost: npt.NDArray[np.uint8]
    origin: FloatArray
    resolution: float

    cell = Costmap.cell


def plans(file: Path, robot: Robot) -> Iterator[tuple[FloatArray, FloatArray, float]]:
    """The plans (n, 3) of both that were recorded, empty where there was none, and the edge of a cell [m]."""
    planner = make_global_planner(Parameters.read(robot))
    for kind, n, cost in records(file):
        if kind == "G":
            seen = _Seen(cost.copy(), n[7:9], n[9])
            ours = planner.plan(seen, n[1:4], n[4:7])  # type: ignore[arg-type]
            yield n[11:].reshape(-1, 3) if n[10] else np.empty((0, 3)), np.empty((0, 3)) if ours is None else ours, n[9]


def apart(one: FloatArray, other: FloatArray) -> float:
    """The largest distance of a point of either plan from the other plan's nearest point, m."""
    if min(len(one), len(other)) == 0:
        return 0.0 if len(one) == len(other) else np.inf
    there, back = (cKDTree(b[:, :2]).query(a[:, :2])[0].max() for a, b in ((one, other), (other, one)))
    return float(max(there, back))
