"""The world of one robot: what stands and moves around it, its base, lidar, camera, odometry."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.contract import BodyKind, Goal, Latency, Obstacles, Sensing
from clearway.geometry.angles import wrap
from clearway.geometry.distance import clearance
from clearway.geometry.packing import boxes, pack, place
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream
from clearway.robots import Robot
from clearway.scenarios.scenario import DisturbanceSpec
from clearway.trials import Body
from clearway.world import ride, setting
from clearway.world.between import Between
from clearway.world.camera import ObstacleSensor
from clearway.world.contact import TOUCH
from clearway.world.latency import Delays, Past, between
from clearway.world.scanner import Scanner
from clearway.world.tracks import pose_at
from clearway.world.traffic import Traffic

_SAME = 1e-9  # s


class World:
    """Holds the truth about one robot, and moves it on by one control period at a time: first as it would drive if nothing
    else moved, for whoever decides by where it goes; then, where it may meet anybody, among where all the others went.

    Args:
        robot: Who moves.
        start: (3,) true pose, map frame.
        speed: Set speed of the test, m/s; caps the robot's.
        bodies: What it can hit.
        traffic: What moves; of the robots there, this one joins. Its bodies are those of `bodies` without a pose, in their order.
        seed: Seed of the errors of odometry, lidar and camera, and of the disturbance.
        disturbance: How the ground moves it; None: it does not.
        latency: Factor on the robot's latency, and on the time that its lidar takes for a sweep.

    Attributes:
        member: Which of the robots in `traffic` it is.
        moving_obstacles: (m, 3) poses now of the moving bodies; NaN: absent.
        latency: How late the robot senses and acts.
        between: What was where between the ends of the periods.
        ride: The robot on its way, as kernels take it.
        scanner: Its lidar; None: it has none.
        camera: Its camera; None: it has none.
        pivot: How far ahead of base_link it turns, m: there is the pose that `ride` has.
        axle: The same where its odometry knows it, m: a car's does. Its dead-reckoned pose is base_link's then, else that of where it turns.
    """

    def __init__(
        self,
        robot: Robot,
        start: FloatArray,
        speed: float,
        bodies: Sequence[Body],
        traffic: Traffic,
        seed: int,
        disturbance: DisturbanceSpec | None = None,
        latency: float = 1.0,
    ) -> None:
        self.bodies = tuple(bodies)
        self._still = [b for b in bodies if b.pose is not None]
        self._moving = [b for b in bodies if b.pose is None]
        self._robot, self._traffic, self._period = robot, traffic, robot.period
        drive = robot.drive
        self.pivot = drive.pivot  # all that is inside moves about it; outside, a pose is base_link's
        self.axle = drive.pivot if drive.kind == "ackermann" else 0.0
        self._state = np.zeros(setting.STATE)
        self._state[:3] = self._shifted(start, self.pivot)
        self._state[2] = wrap(self._state[2])
        self._count = 0
        own = robot.latency
        self.latency = Latency(latency * own.sensing, latency * own.command, latency * own.jitter, drive.lag)
        self._delays = Delays(self.latency, robot.period, seed)
        sweep = 0.0 if robot.lidar is None else latency * robot.lidar.sweep
        late = self.latency.sensing + self.latency.jitter
        self._late = late + sweep > 0.0  # whether anybody asks for the past
        grip, turn_grip = 1.0 - drive.slip_ratio, 1.0 - drive.turn_slip_ratio
        measured = np.array((1.0 / grip, 1.0 if robot.odometry.gyro else 1.0 / turn_grip, 1.0 / grip))
        self._past = Past(late + 0.5 * sweep, robot.period, self._state, measured)
        self._commands = np.full((self._delays.rows, 4), math.inf)
        self._commands[0, 0] = 0.0
        self._sideways = robot.limits().v_y_max > 0.0
        self._odometry = slice(setting.ODOM_V, setting.ODOM_V + (3 if self._sideways else 2))
        self._components = setting.V_Y + self._sideways

        foot = pack([robot.shape])
        foot = place(foot, np.array([[-self.pivot, 0.0, 0.0]]))
        foot = foot._replace(reach=np.hypot(*foot.points.T).max(keepdims=True) + foot.radius)
        poses = np.array([b.pose for b in self._still], dtype=np.float64).reshape(-1, 3)
        still = place(pack([b.shape for b in self._still]), poses)
        moving = pack([b.shape for b in self._moving])
        self._reach = float(foot.reach[0]), still.reach.tolist(), moving.reach.tolist()
        key = stream(seed, "odometry")
        self._boxes = boxes(still)
        self._slack = np.zeros(len(self._moving))
        self.moving_obstacles = np.full((len(self._moving), 3), np.nan)
        self._sensed_obstacles = self.moving_obstacles.copy()
        vehicle = setting.Vehicle(
            robot.period, robot.limits(speed), drive.lag, grip, turn_grip, setting.odometry_errors(robot.odometry, key, turn_grip), key,
            setting.disturbance_bounds(disturbance), stream(seed, "disturbance"),
            foot.points, float(foot.radius[0]), float(foot.reach[0]),
        )  # fmt: skip
        limits, bounds = vehicle.limits, vehicle.bounds
        straight, turning = limits.fastest + bounds[2], self.pivot * (limits.omega_max + bounds[3])
        fastest = straight + abs(turning) if self._sideways else math.hypot(straight, turning)
        fastest += math.hypot(bounds[0], self.pivot * bounds[1]) / robot.period
        self.member = traffic.join(foot, self.pivot, self._state[:3], 1.01 * fastest)
        self._around = traffic.without(self.member)
        self._way = np.zeros((setting.steps(robot.period) + 1, setting.WAY))
        self._way[:] = self._state[: setting.WAY]
        standing = setting.Still(still, self._boxes, np.zeros(len(self._still)))
        tracks, since = self._around.tracks, self._around.since
        among = setting.Moving(moving, tracks, since, self._slack, self.moving_obstacles)
        room = setting.room_for(vehicle, among)
        around = setting.Setting(vehicle, standing, among, self._commands, self._way, room)
        nothing = setting.Moving(pack([]), tracks, np.zeros(0), np.zeros(0), np.zeros((0, 3)))
        self.between = Between(setting.hold(around), self.pivot, robot.shape, self._moving)
        self._began = self._state.copy()
        self._far = False  # whether nothing of the last period is worth being kept between its samples
        self.ride = ride.Ride(
            around, nothing, self._state, self._began, self._state.copy(), *traffic.track(self.member),
            np.zeros(1, np.bool_), self.between.near,
        )  # fmt: skip
        self._ride = ride.hold(self.ride)
        self._among = traffic.among(self._ride) if traffic.ridden_among else None
        self.camera = (
            None if robot.camera is None else ObstacleSensor(robot.camera, self.bodies, still.reach, moving.reach, seed)
        )

        self.scanner: Scanner | None = None
        if robot.lidar is not None:
            self.scanner = Scanner(
                robot.lidar, self.pivot, self._still, self._moving, traffic, self._around, self._past, robot.period,
                self._state[:3], latency, late, seed,
            )  # fmt: skip
            self._sensed_obstacles = self.scanner.poses

    @property
    def state(self) -> FloatArray:
        """(TOLD,) now, as `clearway.world.setting` orders it: true pose in the map frame and velocity, dead-reckoned pose in
        the odom frame since the start and measured velocity; m, rad, m/s, rad/s."""
        return self._outside(self._state[: setting.TOLD])

    @property
    def motion(self) -> FloatArray:
        """(5,) true pose in the map frame, v [m/s] and omega [rad/s] now; of an omnidirectional base v_y [m/s] behind them."""
        return self._shifted(self._state[: self._components], -self.pivot)

    def _outside(self, inner: FloatArray) -> FloatArray:
        """(TOLD,) as `state`, of what moves about the pivot."""
        state = self._shifted(inner, -self.pivot)
        if self.axle:  # the odom frame is where base_link began
            theta = state[setting.ODOM_THETA]
            state[setting.ODOM_X] += self.axle * (1.0 - math.cos(theta))
            state[setting.ODOM_Y] -= self.axle * math.sin(theta)
        return state

    @staticmethod
    def _shifted(state: FloatArray, ahead: float) -> FloatArray:
        """A copy whose first three entries, a pose, are `ahead` m further along their heading."""
        out = state.copy()
        if ahead:
            out[0] += ahead * math.cos(out[2])
            out[1] += ahead * math.sin(out[2])
        return out

    def begin(self) -> None:
        """Time 0: everything that moves has its place."""
        self._around.place(0.0, self.moving_obstacles)

    def begin_leg(self, leg: int, t: float) -> None:
        """The robot begins its leg number `leg` at time `t` [s]; the first of the robots takes those along that follow its legs."""
        if self.member == 0:
            self._traffic.begin_leg(leg, t)
        self._slack[:] = 0.0
        self.between.begin_leg()
        self._around.place(t, self.moving_obstacles)

    def sensing(self, t: float, goal: Goal) -> Sensing:
        """What arrives of the sensors at time `t` [s], which is now."""
        inner, moving, stamp = self._state[: setting.TOLD], self._sensed_obstacles, t
        if self._late:
            stamp = self._delays.stamp(t, self._count)
            self._past.see(t, self.moving_obstacles)
        if stamp >= t:
            stamp = t
            if self._moving:
                moving[:] = self.moving_obstacles
        else:
            inner = self._past.state(stamp)
            if stamp >= self._traffic.leg_began:
                self._around.place(stamp, moving)
            else:
                moving[:] = self._past.seen(stamp)
        state = self._outside(inner)
        return Sensing(
            stamp,
            state[setting.ODOM_X : setting.WAY],
            state[self._odometry],
            None if self.scanner is None else self.scanner.look(stamp, inner[:3], self._count),
            self._picture(state),
            goal,
            state[0:3],
        )

    def _picture(self, state: FloatArray) -> Obstacles | None:
        """What the camera sees from `state` (TOLD,); None without a camera."""
        if self.camera is None:
            return None
        return self.camera.look(float(state[0]), float(state[1]), self._sensed_obstacles, self._count)

    def send(self, v: float, omega: float, t: float, v_y: float = 0.0) -> None:
        """Command v [m/s], omega [rad/s] and v_y [m/s] at time `t` [s], which may be still to come in this control period."""
        self._delays.send(t, self._count, v, omega, v_y)

    def rehearse(self, t: float) -> FloatArray:
        """(n + 1, 3 or more) the way that its pivot would take in the period from time `t` [s] on if nothing else moved."""
        self._delays.fill(self._commands, t, self._period)
        ride.rehearse_held(self._ride, self._count, self._traffic.leg, t)
        return self._way

    def drive(self, t: float) -> tuple[float, Body | None]:
        """Drive on what was commanded in the period from time `t` [s] on, or until contact; the same when it is asked again.

        Returns:
            The time driven [s], and the body that was touched, if any.
        """
        if self._traffic.decided:
            self._around.now()
            hit, self._far = ride.drive_held(self._ride, self._count, self._traffic.leg, t)
        else:
            self._delays.fill(self._commands, t, self._period)
            hit, self._far = ride.drive_on(self._ride, self._count, self._traffic.leg, t)
        return self._driven(hit)

    def drive_among(self, t: float, end: float) -> tuple[float, Body | None]:
        """`rehearse` and `drive` in the period from time `t` [s] to `end` [s] while the crowd around decides."""
        self._delays.fill(self._commands, t, self._period)
        assert self._among is not None
        hit, self._far = self._traffic.ride(self._among, ride.Period(self._count, t, end + _SAME))
        return self._driven(hit)

    def _driven(self, hit: int) -> tuple[float, Body | None]:
        if hit < 0:
            return self._period, None
        return float(self._state[setting.ELAPSED]), (self._still + self._moving)[hit]

    def keep(self, t: float, driven: float) -> None:
        """What was driven in the period from time `t` [s] on, for `driven` [s], is what happened."""
        self._count += 1
        if self._traffic.decided:
            self._began[:] = self._state
        if self._late:
            self._past.drive(t, self._period, self._way, self._state)
            if self.scanner is not None:
                self.scanner.keep(t, self._way)
        if not self._far:
            self.between.look(self._traffic.leg, t, driven)

    def halt(self, t: float, driven: float) -> None:
        """In the period from time `t` [s] on it was stopped after `driven` [s], before whatever else would have stopped it."""
        self._far = False
        h = self._period / (len(self._way) - 1)
        i = min(int(driven / h), len(self._way) - 2)
        a, b, share = self._way[i], self._way[i + 1], min(driven / h - i, 1.0)
        speeds = slice(setting.V, setting.ODOM_X)
        self._state[speeds] = a[speeds] + share * (b[speeds] - a[speeds])
        for k in (0, setting.ODOM_X):
            self._state[k : k + 3] = between(a[k : k + 3], b[k : k + 3], share)
        self._around.place(t + driven, self.moving_obstacles)

    def stay(self, t: float) -> None:
        """From time `t` [s] on it stands where it is, for good."""
        self._traffic.halt(self.member, t, self._state[:3])

    @property
    def stands(self) -> bool:
        """Whether it stands."""
        return not self._state[setting.V : setting.ODOM_X].any()

    def body(self, name: str) -> Body:
        """The moving body of this name."""
        return next(body for body in self._moving if body.name == name)

    def touching(self) -> Body | None:
        """A body that the robot touches where it stands now, None if there is none."""
        shape, pose = self._robot.shape, self._shifted(self._state[0:3], -self.pivot)
        near, moving = self._within(pose[:2])
        for body, at in [(self._still[i], self._still[i].pose) for i in near] + moving:
            if at is not None and clearance(shape, pose, body.shape, at) <= TOUCH:
                return body
        return None

    def _within(self, centre: FloatArray) -> tuple[list[int], list[tuple[Body, FloatArray]]]:
        """The static bodies that the robot's reach around `centre` (2,) may meet, and the moving ones."""
        own, _, moving = self._reach
        outside = np.maximum(np.maximum(self._boxes[:, :2] - centre, centre - self._boxes[:, 2:]), 0.0)
        near = np.flatnonzero(np.hypot(outside[:, 0], outside[:, 1]) <= own + abs(self.pivot) + TOUCH)
        apart = np.hypot(self.moving_obstacles[:, 0] - centre[0], self.moving_obstacles[:, 1] - centre[1])
        met = np.flatnonzero(apart <= np.array(moving) + own + abs(self.pivot) + TOUCH)  # one that is absent isn't
        return near.tolist(), [(self._moving[m], self.moving_obstacles[m]) for m in met.tolist()]

    def speed_of(self, body: Body, t: float) -> float:
        """How fast `body` moves at time `t` [s], m/s."""
        if body.pose is not None:
            return 0.0
        m, around = self._moving.index(body), self._around
        begin, end = around.tracks.rows[around.leg, m].tolist()
        before, now, h = np.empty(3), np.empty(3), 1e-3
        pose_at(around.tracks.knots, begin, end, t - around.since[m] - h, before)
        pose_at(around.tracks.knots, begin, end, t - around.since[m], now)
        moved = math.dist(before[:2], now[:2])
        return moved / h if math.isfinite(moved) else 0.0

    def obstacles_at(self, t: float) -> FloatArray:
        """(n, 4) x, y, radius [m] and presence (1 or 0) at time `t` [s] of every obstacle of the test, as planned now; one
        that decides moves on as it does now."""
        _, still, moving = self._reach
        rows = [(b.pose[0], b.pose[1], r, 1.0) for b, r in zip(self._still, still, strict=True)
                if b.kind == BodyKind.OBSTACLE and b.pose is not None]  # fmt: skip
        at, around = np.empty(3), self._around
        around.now()
        for m, ((begin, end), since, reach) in enumerate(
            zip(around.tracks.rows[around.leg].tolist(), around.since.tolist(), moving, strict=True)
        ):
            foreseen = around.foreseen(m, t)
            if foreseen is not None:
                at[:2] = foreseen
                there = math.isfinite(at[0])
            else:
                there = pose_at(around.tracks.knots, begin, end, t - since, at)
            rows.append((at[0], at[1], reach, float(there)))
        return np.array(rows, dtype=np.float64).reshape(-1, 4)
