"""Nav2's behaviours: spin, wait, back up and drive on heading, each looking out for collisions.

Behaviour read from ros-navigation/navigation2: nav2_behaviors/include/nav2_behaviors/timed_behavior.hpp,
plugins/spin.cpp, plugins/wait.cpp, plugins/drive_on_heading.hpp, plugins/back_up.cpp.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol, cast

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Scene, footprint_cost, make_scene
from clearway.navigators.common.rates import EARLY, Rate
from clearway.navigators.nav2.behavior_tree.actions import MoveRequest
from clearway.navigators.nav2.behavior_tree.servers import Error, Job
from clearway.navigators.nav2.parameters import servers as parameters
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.seams import CostView, Velocity

STILL = Velocity(0.0, 0.0, 0.0)


class _Failed(NamedTuple):
    """Why a behaviour failed.

    Attributes:
        error: Its code.
        message: The same in words.
    """

    error: Error
    message: str


class _Motion(Protocol):
    """A behaviour while it runs."""

    def step(self, now: float, pose: FloatArray, view: CostView) -> Velocity | _Failed | None:
        """The next command, why it fails, or None: it is done."""


class _Spin:
    def __init__(self, server: parameters.BehaviorServer, request: MoveRequest, now: float, pose: FloatArray) -> None:
        self._server, self._request = server, request
        self._end = now + request.allowance
        self._yaw, self._turned = float(pose[2]), 0.0

    def step(self, now: float, pose: FloatArray, view: CostView) -> Velocity | _Failed | None:
        s, r = self._server, self._request
        if self._end - now < -EARLY and r.allowance > 0.0:
            return _Failed(Error.SPIN_TIMEOUT, "Spin took longer than it was allowed")
        turn = float(pose[2]) - self._yaw
        if abs(turn) > math.pi:
            turn = math.copysign(2.0 * math.pi - abs(turn), self._yaw)
        self._turned += turn
        self._yaw = float(pose[2])
        left = abs(r.amount) - abs(self._turned)
        if left < 1e-6:
            return None
        speed = min(max(math.sqrt(2.0 * s.rotational_acc_lim * left), s.min_rotational_vel), s.max_rotational_vel)
        omega = math.copysign(speed, r.amount)
        cycles = int(s.cycle_frequency * s.simulate_ahead_time)
        if not r.blind and not _free(_scene(view), pose, 0.0, omega, s.cycle_frequency, cycles, abs(self._turned)):
            return _Failed(Error.SPIN_COLLISION_AHEAD, "Spin would collide")
        return Velocity(0.0, 0.0, omega)


class _Drive:
    """Straight on, or back with a negative distance and speed."""

    def __init__(
        self,
        server: parameters.BehaviorServer,
        own: parameters.DriveOnHeading,
        request: MoveRequest,
        now: float,
        pose: FloatArray,
        errors: tuple[Error, Error],
    ) -> None:
        self._server, self._own, self._request, self._errors = server, own, request, errors
        self._end = now + request.allowance
        self._x, self._y = float(pose[0]), float(pose[1])
        self._last = 0.0

    def step(self, now: float, pose: FloatArray, view: CostView) -> Velocity | _Failed | None:
        s, own, r = self._server, self._own, self._request
        late, collision = self._errors
        if self._end - now < -EARLY and r.allowance > 0.0:
            return _Failed(late, "it took longer than it was allowed")
        gone = math.hypot(pose[0] - self._x, pose[1] - self._y)
        left = abs(r.amount) - gone
        if left <= 0.0:
            return None
        forward = 1.0 if r.speed > 0.0 else -1.0
        last = self._last * forward
        least = last - abs(own.deceleration_limit) / s.cycle_frequency
        most = last + abs(own.acceleration_limit) / s.cycle_frequency
        speed = min(max(abs(r.speed), least), most)
        stopping = math.sqrt(2.0 * abs(own.deceleration_limit) * left)
        if stopping < abs(speed):
            speed = stopping
        if abs(speed) < own.minimum_speed:
            speed = own.minimum_speed
        v = forward * speed
        cycles = int(s.cycle_frequency * s.simulate_ahead_time)
        if not r.blind and not _free(_scene(view), pose, v, 0.0, s.cycle_frequency, cycles, left):
            return _Failed(collision, "it would collide")
        self._last = v
        return Velocity(v, 0.0, 0.0)


class _Wait:
    def __init__(self, request: MoveRequest, now: float) -> None:
        self._end = now + request.amount

    def step(self, now: float, pose: FloatArray, view: CostView) -> Velocity | _Failed | None:
        return None if now >= self._end - EARLY else STILL


class BehaviorServer:
    """Runs the behaviours that a tree asks for.

    Args:
        branch: Its parameters, with those of its behaviours.
    """

    ACTIONS = frozenset({"spin", "wait", "backup", "drive_on_heading"})

    def __init__(self, branch: Branch) -> None:
        self._parameters = cast("parameters.BehaviorServer", branch.group)
        self._own = {name: child.group for name, child in branch.children.items()}  # an action has its behaviour's name
        self._rate = Rate(self._parameters.cycle_frequency)
        self._action = ""
        self._job: Job | None = None
        self._motion: _Motion | None = None

    def send(self, action: str, request: MoveRequest, now: float, pose: FloatArray) -> Job:
        """Begin a behaviour at `now` [s] with the robot at `pose` (3,), local costmap's frame."""
        if self._job is not None and self._job.running:
            self._job.abort(Error.NONE, "another behaviour began")
        job = Job(request)
        if action not in self._own:
            job.abort(Error.NONE, f"there is no behaviour {action!r} in behavior_plugins")
            return job
        drive = self._own[action]
        match action:
            case "spin":
                self._motion = _Spin(self._parameters, request, now, pose)
            case "wait":
                self._motion = _Wait(request, now)
            case _:
                assert isinstance(drive, parameters.DriveOnHeading)
                errors = (Error.DRIVE_TIMEOUT, Error.DRIVE_COLLISION_AHEAD)
                if action == "backup":
                    request = request._replace(amount=-abs(request.amount), speed=-abs(request.speed))
                    errors = (Error.BACKUP_TIMEOUT, Error.BACKUP_COLLISION_AHEAD)
                elif (request.amount > 0.0) != (request.speed > 0.0):
                    job.abort(Error.DRIVE_INVALID_INPUT, "speed and distance have not the same sign")
                    return job
                self._motion = _Drive(self._parameters, drive, request, now, pose, errors)
        self._job, self._action = job, action
        self._rate.restart()
        return job

    def cancel(self, action: str) -> bool:
        """Stop a behaviour; whether it ran."""
        if self._job is None or not self._job.running or self._action != action:
            return False
        self._job.succeed()
        self._job = self._motion = None
        return True

    @property
    def running(self) -> str:
        """The behaviour that runs, empty: none."""
        return self._action if self._job is not None else ""

    def step(self, now: float, pose: FloatArray, view: CostView) -> Velocity | None:
        """The command of the behaviour that runs, None: none commands now.

        Args:
            now: s.
            pose: (3,) of the robot in the local costmap's frame.
            view: The local costmap.
        """
        if self._job is None or self._motion is None or not self._rate.due(now):
            return None
        answer = self._motion.step(now, pose, view)
        if isinstance(answer, Velocity):
            return None if self._action == "wait" else answer
        job, waited = self._job, self._action == "wait"
        if answer is None:
            job.succeed()
        else:
            job.abort(answer.error, answer.message)
        self._job = self._motion = None
        return None if waited else STILL


def _scene(view: CostView) -> Scene:
    return make_scene(view.cost, view.origin, view.resolution, view.footprint)


@kernel
def _free(scene: Scene, pose: FloatArray, v: float, omega: float, frequency: float, cycles: int, reach: float) -> bool:
    """Whether the outline stays off obstacles and on the map on the way ahead, at the instants of the next `cycles`.

    It is looked at no further than `reach`, metres or, of a turn, radians. Of a turn that is what was turned so far: so it
    is in the source, which sees less the less was turned.
    """
    for i in range(cycles):
        change = (v if omega == 0.0 else omega) * (i / frequency)
        if reach - abs(change) <= 0.0:
            break
        x, y, yaw = pose[0], pose[1], pose[2]
        if omega == 0.0:
            x, y = x + change * math.cos(yaw), y + change * math.sin(yaw)
        else:
            yaw += change
        cost = footprint_cost(scene.cost, scene.frame, scene.polygon, x, y, math.cos(yaw), math.sin(yaw), 1.0)
        if cost < 0:
            return False
    return True
