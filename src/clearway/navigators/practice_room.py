"""A room to try a navigator in: just enough of a world to make honest observations, known exactly and without noise."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clearway.contract import Command, Goal, Need, Observation, ObstacleOracle, Obstacles, Scan, Task
from clearway.geometry import raycast
from clearway.geometry.frames import compose, relative
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.motion import step_arc
from clearway.geometry.rasterise import rasterise
from clearway.geometry.shapes import Circle, FloatArray, Shape, rectangle
from clearway.robots import Robot

SIZE = (12.0, 8.0)
"""Of the room around the origin, x and y, m."""

START = (-3.0, 0.0, 0.0)
SPEED = 0.4
"""Set speed, m/s."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What a navigator is confronted with.

    Attributes:
        name: for people. goals: one after the other, (x, y, theta) in the map frame; the next comes when one is
        reached or its share of `duration` [s] is over. discs: x, y, radius [m] of what stands in the room.
        sees: False leaves every scan empty and every list of obstacles too. mapped: whether the discs are on the map.
    """

    name: str
    goals: tuple[tuple[float, float, float], ...]
    duration: float
    discs: tuple[tuple[float, float, float], ...] = ()
    sees: bool = True
    mapped: bool = False


SITUATIONS = (
    Situation("a free way", ((-0.5, 0.0, 0.0),), 20.0),
    Situation("nothing in sight", ((0.0, 1.0, 0.0),), 4.0, sees=False),
    Situation("an obstacle ahead", ((3.0, 0.0, 0.0),), 12.0, ((-1.2, 0.05, 0.25),)),
    Situation("a goal behind", ((-4.5, 0.5, math.pi),), 10.0),
    Situation(
        "many obstacles",
        ((3.0, 1.0, 0.0),),
        8.0,
        tuple((-1.5 + 0.9 * (i % 5), -3.0 + 1.2 * (i // 5), 0.15) for i in range(30)),
        mapped=True,
    ),
    Situation(
        "walled in",
        ((3.0, 0.0, 0.0),),
        6.0,
        tuple((-3.0 + 0.9 * math.cos(a), 0.9 * math.sin(a), 0.2) for a in np.linspace(0.0, math.tau, 14)[:-1]),
    ),
    Situation("a goal on top of itself", ((-3.0, 0.0, 0.0),), 2.0),
    Situation("goals that change", ((0.0, 2.0, 0.0), (-3.0, -2.0, math.pi), (0.0, 0.0, 0.0)), 30.0),
)


def task(situation: Situation, robot: Robot, needs: frozenset[Need], privileged: bool) -> Task:
    """What the navigator is told before it starts."""
    return Task(
        period=robot.period,
        speed_limit=min(SPEED, robot.drive.v_max),
        start=np.array(START),
        map=_map(situation) if "map" in needs else None,
        time_limit=situation.duration,
        obstacle_oracle=_forecast(situation) if privileged else None,
    )


@dataclass(eq=False)
class Room:
    """One run through a situation: iterate over `observations`, and tell each command to `obey`."""

    situation: Situation
    robot: Robot
    needs: frozenset[Need]

    def __post_init__(self) -> None:
        self.pose, self.velocity, self.arrived = np.array(START), np.zeros(2), False
        bodies, poses = _bodies(self.situation, discs=True)
        self._scene = raycast.scene(bodies, poses)
        lidar = self.robot.lidar
        if lidar is not None:
            self._beams = raycast.beams(lidar.beams, lidar.angle_min, lidar.angle_max, lidar.range_min, lidar.range_max)
        tolerances = self.robot.tolerances
        self._goals = [Goal(np.array(g), tolerances.xy, tolerances.yaw, i) for i, g in enumerate(self.situation.goals)]

    def observations(self) -> Iterator[Observation]:
        """An observation each control period, until the last goal is reached or the time is over."""
        start, t, self._k = np.array(START), 0.0, 0
        share = self.situation.duration / len(self._goals)
        while t < self.situation.duration and self._k < len(self._goals):
            yield Observation(
                t=t,
                pose=self.pose.copy(),
                velocity=self.velocity.copy(),
                odom_pose=relative(start, self.pose),
                goal=self._goals[self._k],
                scan=self._scan() if "scan" in self.needs else None,
                obstacles=self._obstacles() if "obstacles" in self.needs else None,
            )
            t += self.robot.period
            if self.arrived or t >= share * (self._k + 1):
                self._k += 1
                if self._k < len(self._goals):
                    self.arrived = False

    def obey(self, command: Command) -> None:
        """Move for one control period, about as the robot's drive would."""
        d, dt = self.robot.limits(), self.robot.period
        v = _towards(self.velocity[0], min(max(command.v, d.v_min), d.v_max), d.acceleration * dt)
        omega = min(max(command.omega, -d.omega_max), d.omega_max)
        omega = _towards(self.velocity[1], omega, d.angular_acceleration * dt)
        self.velocity = np.array((v, omega))
        self.pose = step_arc(self.pose, v, omega, dt)
        self.arrived = command.arrived if command.arrived is not None else self._within()

    def distance(self) -> float:
        """From the last goal, m."""
        return float(np.hypot(*(self._goals[-1].pose - self.pose)[:2]))

    def _within(self) -> bool:
        goal = self._goals[self._k]
        error = self.pose - goal.pose
        turn = abs(math.remainder(error[2], math.tau))
        return bool(np.hypot(error[0], error[1]) <= goal.xy_tolerance and turn <= goal.yaw_tolerance)

    def _scan(self) -> Scan:
        lidar, beams = self.robot.lidar, self._beams
        assert lidar is not None
        mount = np.array(lidar.mount)
        if self.situation.sees:
            ranges = raycast.sweep(self._scene, beams, compose(self.pose, mount))
        else:
            ranges = np.full(lidar.beams, np.inf)
        return Scan(ranges, beams.angle_min, beams.increment, beams.range_min, beams.range_max, mount)

    def _obstacles(self) -> Obstacles:
        discs = np.array(self.situation.discs if self.situation.sees else ()).reshape(-1, 3)
        n = len(discs)
        return Obstacles(
            position=discs[:, :2].copy(), velocity=np.zeros((n, 2)), radius=discs[:, 2].copy(), error=np.zeros(n),
            velocity_error=np.zeros(n), identity=np.arange(n), moving=np.zeros(n, np.bool_),
        )  # fmt: skip


def _towards(now: float, target: float, change: float) -> float:
    return float(min(max(target, now - change), now + change))


def _bodies(situation: Situation, *, discs: bool) -> tuple[list[Shape], FloatArray]:
    """The room's four walls, and what stands in it."""
    (w, h), thick = SIZE, 0.2
    long, short = rectangle(w + 2 * thick, thick), rectangle(thick, h)
    shapes: list[Shape] = [long, long, short, short]
    places = [(0.0, s * (h + thick) / 2, 0.0) for s in (1, -1)] + [(s * (w + thick) / 2, 0.0, 0.0) for s in (1, -1)]
    for x, y, radius in situation.discs if discs else ():
        shapes.append(Circle(radius))
        places.append((x, y, 0.0))
    return shapes, np.array(places)


def _map(situation: Situation) -> OccupancyGrid:
    shapes, poses = _bodies(situation, discs=situation.mapped)
    resolution, origin = 0.05, (-SIZE[0] / 2 - 0.5, -SIZE[1] / 2 - 0.5)
    size = (round((SIZE[1] + 1.0) / resolution), round((SIZE[0] + 1.0) / resolution))
    cells = rasterise(list(zip(shapes, poses, strict=True)), size, resolution, origin)
    return OccupancyGrid(np.where(cells, 100, 0).astype(np.int8), resolution, origin)


def _forecast(situation: Situation) -> ObstacleOracle:
    discs = np.array([(*d, 1.0) for d in situation.discs]).reshape(-1, 4)
    return lambda t: discs.copy()
