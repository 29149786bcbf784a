"""What a policy sees of an observation and says with its numbers: the same where it is trained and where it drives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from numbers import Integral

import numpy as np
import numpy.typing as npt

from clearway.contract import Command, Goal, Need, Observation, Obstacles, Scan
from clearway.errors import ClearwayError
from clearway.geometry.angles import turn_between
from clearway.robots import Robot

Numbers = npt.NDArray[np.float32]

MOST = 10_000
"""Of beams, and of obstacles."""
GOAL, OBSTACLE = 4, 6
"""Numbers of the goal, and of an obstacle."""


@dataclass(frozen=True, slots=True)
class Seeing:
    """What a policy sees, in SI units and the robot's frame (base_link).

    Of a goal: x, y [m], and the cosine and sine of the turn to its heading, both 0 where that is free. Of the velocity: v [m/s],
    omega [rad/s], of an omnidirectional base v_y [m/s]. Of the lidar: in each of `beams` equal parts of its field of view the shortest
    return [m], its longest range where there is none. Of an obstacle, the nearest first: x, y [m], its velocity v_x, v_y over ground
    [m/s], its radius [m], and 1; zeros where there are fewer.

    Attributes:
        beams: In how many parts the lidar's sweep is cut; 0: it isn't seen.
        obstacles: How many of the tracked obstacles are seen; 0: none.
    """

    beams: int = 0
    obstacles: int = 0

    def __post_init__(self) -> None:
        for name in ("beams", "obstacles"):
            value: int = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, Integral) or not 0 <= value <= MOST:
                raise ClearwayError(f"{value!r} is no number of {name}; 0 to {MOST:,} are", field=name)
            object.__setattr__(self, name, int(value))  # NumPy's can't be written down

    @property
    def needs(self) -> frozenset[Need]:
        """What observations must hold for it."""
        return frozenset((["scan"] if self.beams else []) + (["obstacles"] if self.obstacles else []))  # type: ignore[arg-type]

    def check(self, robot: Robot) -> None:
        """Whether `robot` has what is to be seen.

        Raises:
            ClearwayError: it has no lidar, one of fewer beams, or nothing that perceives obstacles.
        """
        if self.beams and robot.lidar is None:
            raise ClearwayError(f"robot {robot.name!r} has no lidar; 0 beams are seen of it", field="beams")
        if robot.lidar is not None and self.beams > robot.lidar.beams:
            raise ClearwayError(
                f"{self.beams} parts are more than the {robot.lidar.beams} beams of {robot.name!r}'s lidar",
                field="beams",
            )
        if self.obstacles and robot.lidar is None and robot.camera is None:
            raise ClearwayError(
                f"robot {robot.name!r} has nothing that perceives obstacles; 0 are seen", field="obstacles"
            )

    def sizes(self, robot: Robot) -> dict[str, int]:
        """Of each part of what is seen how many numbers it has, in their order in a flat observation."""
        sizes = {"goal": GOAL, "velocity": len(axes(robot))}
        if self.beams:
            sizes["lidar"] = self.beams
        if self.obstacles:
            sizes["obstacles"] = self.obstacles * OBSTACLE
        return sizes

    def parts(self, observation: Observation) -> dict[str, Numbers]:
        """What is seen of `observation`, by part."""
        seen = {"goal": _goal(observation), "velocity": observation.velocity.astype(np.float32)}
        if self.beams:
            assert observation.scan is not None
            seen["lidar"] = _lidar(observation.scan, self.beams)
        if self.obstacles:
            assert observation.obstacles is not None
            seen["obstacles"] = _obstacles(observation.obstacles, observation.pose, self.obstacles)
        return seen

    def flat(self, observation: Observation) -> Numbers:
        """(n,) the same in a row."""
        return flat(self.parts(observation))


def flat(parts: dict[str, Numbers]) -> Numbers:
    """(n,) the parts of what is seen in a row."""
    return np.concatenate([part.ravel() for part in parts.values()])


def _goal(observation: Observation) -> Numbers:
    (x, y, theta), goal = observation.pose.tolist(), observation.goal
    dx, dy, c, s = goal.pose[0] - x, goal.pose[1] - y, math.cos(theta), math.sin(theta)
    turn = turn_to(goal, theta)
    heading = (0.0, 0.0) if turn is None else (math.cos(turn), math.sin(turn))
    return np.array((c * dx + s * dy, c * dy - s * dx, *heading), np.float32)


def turn_to(goal: Goal, theta: float) -> float | None:
    """From the heading `theta` to the goal's, rad; None where that is free."""
    return turn_between(theta, float(goal.pose[2])) if goal.yaw_tolerance < math.pi else None


@lru_cache(maxsize=64)
def cuts(n: int, beams: int) -> npt.NDArray[np.int64]:
    """(beams,) where each part of `n` beams begins."""
    return np.arange(beams, dtype=np.int64) * n // beams


def _lidar(scan: Scan, beams: int) -> Numbers:
    nearest = np.minimum.reduceat(scan.ranges, cuts(len(scan.ranges), beams))
    return np.minimum(nearest, scan.range_max).astype(np.float32)


def _obstacles(obstacles: Obstacles, pose: npt.NDArray[np.float64], most: int) -> Numbers:
    seen = np.zeros((most, OBSTACLE), np.float32)
    away = obstacles.position - pose[:2]
    near = np.argsort(np.hypot(away[:, 0], away[:, 1]) - obstacles.radius, kind="stable")[:most]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    turned = np.array(((c, -s), (s, c)))  # a row times this is seen from the robot
    rows = seen[: len(near)]
    rows[:, 0:2] = away[near] @ turned
    rows[:, 2:4] = obstacles.velocity[near] @ turned
    rows[:, 4] = obstacles.radius[near]
    rows[:, 5] = 1.0
    return seen


@dataclass(frozen=True, slots=True)
class Acting:
    """What a policy says.

    Attributes:
        normalised: Whether each number is a share of what the base can do that way, within the test's set speed: from -1 to 1; else
            it is a speed, m/s or rad/s.
    """

    normalised: bool = True

    def command(self, action: npt.ArrayLike, robot: Robot, speed: float) -> Command:
        """What the base is told; what is beyond its limits is cut.

        Args:
            action: (k,) in the order of `axes`.
            robot: Who is driven.
            speed: The test's set speed, m/s.

        Raises:
            ValueError: it has another shape, or is not finite.
        """
        said = np.asarray(action, dtype=np.float64)
        low, high = bounds(robot, speed)
        if said.shape != low.shape or not np.isfinite(said).all():
            raise ValueError(f"the action {action!r} is not {len(low)} finite numbers: {', '.join(axes(robot))}")
        if self.normalised:
            said = np.clip(said, -1.0, 1.0)
            said = np.where(said < 0.0, -said * low, said * high)
        else:
            said = np.clip(said, low, high)
        v, *sideways, omega = said.tolist()
        return Command(v, omega, v_y=sideways[0] if sideways else 0.0)


def axes(robot: Robot) -> tuple[str, ...]:
    """What an action's numbers are, in their order."""
    return ("v", "v_y", "omega") if robot.limits().v_y_max > 0.0 else ("v", "omega")


def bounds(robot: Robot, speed: float = math.inf) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(k,) the least and the most of each axis, m/s and rad/s, where no more than `speed` [m/s] is allowed."""
    limits = robot.limits(speed)
    side = (limits.v_y_max,) if limits.v_y_max > 0.0 else ()
    high = np.array((limits.v_max, *side, limits.omega_max))
    low = -high
    low[0] = limits.v_min
    return low, high
