"""A robot on its path, driven by a person with a joystick who sees the tested robot; or a bed, by who pushes it.

The person takes what was seen of a robot a reaction time ago, lets it drive on for a while in thought, and slows down so as to stop
short of it where it comes into the way. Who has stood for long enough backs off slowly, and goes on when the way is free. People, who
make way, and other things it only doesn't run into: it goes up to them as they are.
Who comes in while the trial goes on waits until nobody is there, and no robot near.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.distance import Placed, gap, min_clearance
from clearway.geometry.motion import ramp
from clearway.geometry.packing import Packed, pack, transform
from clearway.geometry.shapes import FloatArray, Shape
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.line_keeping import Line, hand, pose_on, steepest
from clearway.scenarios.scenario import RunSpec
from clearway.world.behaviours.behaviour import ABSENT, GLANCE, Scene, SeenRobot

_THOUGHTS = 5
"""Into so many instants the time is cut for which the robot is thought to drive on."""
_FREE = 0.5
"""So much further than `stop_short` the way has to be free before one who has backed off goes on, m."""
_STRIDE = 0.02
"""Least step along the path when it is looked at, m."""


class Operator:
    """Drives one body along its runs.

    Args:
        spec: Who drives.
        shape: The body's.
        runs: Its runs on each leg, one after another.
        seed: Of the trial.
        member: Which of the moving bodies it is.
        name: The body's; with the seed it decides how the hand strays.
        moving: All bodies that move, this one among them.
    """

    def __init__(
        self, spec: OperatorSpec, shape: Shape, runs: Mapping[str, Sequence[RunSpec]], seed: int, member: int, name: str,
        moving: Sequence[Placed],
    ) -> None:  # fmt: skip
        self.members: tuple[int, ...] = (member,)
        self._spec, self._shape, self._moving = spec, shape, moving
        self._outlines = pack([body.shape for body in moving])
        self._thoughts = np.linspace(spec.reaction, spec.reaction + spec.foresight, _THOUGHTS)[:, None]
        packed = pack([shape])
        self._outline, self._rim, self._reach = packed.points, float(packed.radius[0]), float(packed.reach[0])
        fastest = max((run.speed for on_leg in runs.values() for run in on_leg), default=0.0)
        self.speed = np.full(1, 1.1 * max(fastest, spec.backing) * math.hypot(1.0, steepest(spec.line_keeping)))
        phases = hand(seed, name)
        self._runs = {
            leg: [(run, Line(run, spec.line_keeping, phases)) for run in on_leg] for leg, on_leg in runs.items()
        }
        self._waiting: list[tuple[RunSpec, Line]] = []
        self._path: Line | None = None
        self._s = self._v = self._set_speed = self._stood = 0.0
        self._backing = False

    def begin_leg(self, leg: str, t: float) -> FloatArray:
        """The runs of this leg begin, each after its delay."""
        self._waiting = sorted(self._runs.get(leg, ()), key=lambda waiting: waiting[0].delay)
        self._began, self._path = t, None
        return self._start(t, t, None)[None]

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Drive on from `t` to `until` [s]."""
        return self._next(t, until, scene)[None]

    def _next(self, t: float, until: float, scene: Scene) -> FloatArray:
        if self._path is None:
            return self._start(t, until, scene)
        wanted = self._wanted(t, scene, until - t)
        now, spec = self._v, self._spec
        if now >= 0.0:
            self._v, mean = ramp(now, wanted, spec.acceleration, spec.deceleration, until - t)
        else:
            self._v, mean = ramp(now, wanted, spec.deceleration, spec.acceleration, until - t)
        self._s = max(self._s + mean * (until - t), 0.0)
        if self._s >= self._path.length:
            self._path = None
            return self._start(t, until, scene)
        return self._path.pose(self._s)

    def _start(self, t: float, until: float, scene: Scene | None) -> FloatArray:
        """Begin the next run if it is time at `until` [s], and the place is not taken by the `scene` at time `t` [s], if one is seen; at
        its set speed, as if it had been under way."""
        if not self._waiting or until < self._began + self._waiting[0][0].delay:
            return ABSENT
        run, path = self._waiting[0]
        s = (until - self._began - run.delay) * run.speed
        if s < path.length and scene is not None and self._is_taken(path.pose(s), t, scene):
            self._began = until - run.delay
            return ABSENT
        del self._waiting[0]
        if s >= path.length:
            return ABSENT
        self._s, self._path = s, path
        self._v = self._set_speed = run.speed
        self._stood, self._backing = 0.0, False
        return path.pose(s)

    def _is_taken(self, pose: FloatArray, t: float, scene: Scene) -> bool:
        """Whether one who comes in at `pose` (3,) would touch somebody, or could have a robot before it at once."""
        near = self._near(scene, pose, self._spec.beside)
        bodies = [self._moving[m] for m in near]
        if bodies and min_clearance(self._shape, pose[None], bodies, scene.moving[None, near])[0] <= self._spec.beside:
            return True
        for robot in scene.robots:
            apart = self._reach + float(robot.shape.reach[0]) + self._spec.stop_short + _FREE
            places = self._thought(robot, t)
            if (np.hypot(places[:, 0] - pose[0], places[:, 1] - pose[1]) <= apart).any():
                return True
        return False

    def _thought(self, robot: SeenRobot, t: float) -> FloatArray:
        """(p, 3) poses at which the person at time `t` [s] thinks that `robot` may be."""
        seen = t - self._spec.reaction
        now, before = robot.track.at(seen), robot.track.at(seen - GLANCE)
        velocity = (now - before) / GLANCE
        velocity[2] = 0.0
        places: FloatArray = now + self._thoughts * velocity
        return places

    def _wanted(self, t: float, scene: Scene, dt: float) -> float:
        """The speed that the joystick asks for, m/s."""
        spec, v = self._spec, self._v
        free = self._free_of_robots(t, scene, 1.0)
        self._stood = self._stood + dt if v == 0.0 and free <= spec.stop_short else 0.0
        if self._stood >= spec.patience:
            self._backing = True
        if self._backing and free > spec.stop_short + _FREE:
            self._backing = False
        speed, way = (spec.backing, -1.0) if self._backing else (self._set_speed, 1.0)
        if self._backing:
            free = self._free_of_robots(t, scene, -1.0)
        room = min(free - spec.stop_short, self._free_of_others(scene, way) - spec.beside)
        return way * _within(speed, room, spec.deceleration)

    def _free_of_robots(self, t: float, scene: Scene, way: float) -> float:
        """How far robots leave the path free ahead (way 1) or behind (way -1), as the person has it at time `t` [s], m."""
        far = self._sight
        for robot in scene.robots:
            far = self._free(
                far, way, robot.shape.points, float(robot.shape.radius[0]), self._thought(robot, t), self._spec.beside
            )
        return far

    def _free_of_others(self, scene: Scene, way: float) -> float:
        """The same of people and things where they are now, m."""
        assert self._path is not None
        path, at = self._path, scene.moving[self.members[0]]
        near = self._near(scene, at, self._sight)
        return free_of_all(
            path.points, path.along, path.stray, path.phases, self._s, way, self._sight, self._outline, self._rim, self._outlines,
            scene.moving, near,
        )  # fmt: skip

    def _near(self, scene: Scene, at: FloatArray, within: float) -> npt.NDArray[np.int64]:
        """Which others may come within so many metres of this body at `at` (3,)."""
        away = np.hypot(scene.moving[:, 0] - at[0], scene.moving[:, 1] - at[1])
        near = away <= within + self._reach + self._outlines.reach
        near[self.members[0]] = False
        return np.flatnonzero(near)

    @property
    def _sight(self) -> float:
        """How far the person looks along the path, m."""
        return self._set_speed**2 / (2.0 * self._spec.deceleration) + self._spec.stop_short + _FREE + 1.0

    def _free(self, far: float, way: float, other: FloatArray, rim: float, places: FloatArray, beside: float) -> float:
        """`free_way` from where it is."""
        assert self._path is not None
        path = self._path
        return free_way(
            path.points, path.along, path.stray, path.phases, self._s, way, far, self._outline, self._rim, other, rim, places, beside
        )  # fmt: skip


def _within(speed: float, room: float, deceleration: float) -> float:
    """The speed [m/s], at most `speed`, from which one stops within `room` [m]."""
    return min(speed, math.sqrt(2.0 * deceleration * max(room, 0.0)))


@kernel
def free_of_all(
    points: FloatArray, along: FloatArray, stray: float, phases: FloatArray, s: float, way: float, far: float,
    outline: FloatArray, rim: float, others: Packed, poses: FloatArray, who: npt.NDArray[np.int64],
) -> float:  # fmt: skip
    """`free_way` until it touches any of those `who` (k,) of `others` at `poses` (n, 3), m; the other arguments as there."""
    for m in who:
        other = others.points[others.first[m] : others.first[m + 1]]
        far = free_way(
            points, along, stray, phases, s, way, far, outline, rim, other, others.radius[m], poses[m : m + 1], 0.0
        )
    return far


@kernel
def free_way(
    points: FloatArray, along: FloatArray, stray: float, phases: FloatArray, s: float, way: float, far: float,
    outline: FloatArray, rim: float, other: FloatArray, other_rim: float, places: FloatArray, beside: float,
) -> float:  # fmt: skip
    """How far a body can go along its path until it comes within `beside` [m] of what is thought to be at `places`, m.

    Args:
        points: As `pose_on` has it.
        along: As `pose_on` has it.
        stray: As `pose_on` has it.
        phases: As `pose_on` has it.
        s: Where on the path the body is, m.
        way: 1 for ahead, -1 for backwards.
        far: How far it looks at most, m.
        outline: (k, 2) points of the body in its own frame, m.
        rim: By which they are thickened, m.
        other: (j, 2) points of the other in its own frame, m.
        other_rim: By which they are thickened, m.
        places: (p, 3) poses at which the other may be.
        beside: What comes nearer is in the way, m.
    """
    own, theirs, at = np.empty_like(outline), np.empty_like(other), np.empty(3)
    pose_on(points, along, stray, phases, s, at)
    x, y, nose_x, nose_y = at[0], at[1], way * math.cos(at[2]), way * math.sin(at[2])
    for p in range(len(places)):
        if (places[p, 0] - x) * nose_x + (places[p, 1] - y) * nose_y < 0.0:
            continue  # behind it
        transform(other, places[p, 0], places[p, 1], places[p, 2], theirs)
        gone = 0.0
        while gone < far:
            place = s + way * gone
            if place < 0.0 or place > along[-1]:
                break
            pose_on(points, along, stray, phases, place, at)
            transform(outline, at[0], at[1], at[2], own)
            apart = gap(own, rim, theirs, other_rim) - beside
            if apart <= 0.0:
                far = gone
                break
            gone += max(apart, _STRIDE)
    return far
