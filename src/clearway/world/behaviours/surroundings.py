"""What people keep off whose behaviour is written in plain Python: as `walkers.everybody` has it for a crowd."""

from __future__ import annotations

import numpy as np

from clearway.crowds.bodies import Bodies
from clearway.geometry.packing import transform
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import GLANCE, PERIOD, Cast, Scene, SeenRobot
from clearway.world.behaviours.keeping_off import BESIDE, FAR, Around, Walker, keep_off


def step_of(cast: Cast, k: int, at: FloatArray, velocity: FloatArray, v_max: float, t: float, scene: Scene) -> None:
    """Take person `k` of a `cast` a step further: it keeps off whatever `scene` holds.

    Args:
        at: (3,) where it is; updated, but for where it looks.
        velocity: (2,) at which it would walk, m/s; updated.
        v_max: The most that it walks at, m/s.
        t: The time, s.
    """
    around, person = _around(cast, k, t, scene), cast.people[k]
    walker = Walker(cast.members[k], float(at[0]), float(at[1]), float(at[2]), 3 if person.sees_robots else 1, v_max)
    keep_off(walker, velocity, False, around, PERIOD)
    at[:2] += PERIOD * velocity


def seen(robot: SeenRobot, t: float, reaction: float) -> tuple[FloatArray, FloatArray]:
    """Where a robot is at time `t` [s] if it has driven on as it drove a `reaction` [s] ago, and that velocity: (2,) each."""
    now, before = (robot.track.at(t - reaction - d)[:2] for d in (0.0, GLANCE))
    velocity: FloatArray = (now - before) / GLANCE
    return now + reaction * velocity, velocity


def _around(cast: Cast, k: int, t: float, scene: Scene) -> Around:
    reaction, things = cast.people[k].reaction, cast.things
    there = np.nan_to_num(scene.moving[:, :2], nan=FAR)
    moved = np.nan_to_num((scene.moving[:, :2] - scene.before[:, :2]) / PERIOD)
    there[things.of], moved[things.of] = FAR, 0.0
    discs = np.full((2, len(things.of), 2), np.nan)
    for d, i in enumerate(things.of):
        for poses, out in ((scene.moving, discs[0]), (scene.before, discs[1])):
            transform(things.disc[d : d + 1, :2], poses[i, 0], poses[i, 1], poses[i, 2], out[d : d + 1])
    robots = [seen(robot, t, reaction) for robot in scene.robots]
    n = len(there) + len(discs[0]) + len(robots)
    age, layer = np.zeros(n), np.ones(n, np.int64)
    age[n - len(robots) :], layer[n - len(robots) :] = reaction, 2
    bodies = Bodies(
        np.concatenate([there, np.nan_to_num(discs[0], nan=FAR), *(at[None] for at, _ in robots)]),
        np.concatenate([moved, np.nan_to_num((discs[0] - discs[1]) / PERIOD), *(v[None] for _, v in robots)]),
        np.concatenate(
            [cast.radius, things.disc[:, 2] + BESIDE, [float(robot.shape.reach[0]) + BESIDE for robot in scene.robots]]
        ),
        layer,
        np.ones(n),
    )
    return Around(bodies, scene.bound, scene.free, age, cast.room, cast.walls, np.empty((2 * n, 3)))
