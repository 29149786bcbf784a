"""People at the height of a lidar: two legs that walk, within the disc that can be touched.

Each leg stands while the other one swings, so that beside the body it moves to and fro at the body's own speed: a triangular wave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.contract import BodyKind
from clearway.geometry.compiled import kernel
from clearway.geometry.raycast import Scene, scene
from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.geometry.streams import stream, uniform
from clearway.trials import Body
from clearway.world.tracks import Tracks, pose_at

RADIUS = 0.06
"""Of a leg, m: a calf of 0.39 m around (ANSUR II); lidar people trackers take legs for 0.1 to 0.25 m wide (Bellotto, Hu 2009)."""
APART = 0.17
"""Between the middles of two legs that stand side by side, m (McIlroy, Maki 1997: heels in the preferred stance)."""
STRIDES = 0.91
"""A second: 109 steps a minute (Dall et al. 2013), whatever the speed; who walks slower takes shorter steps here."""
WINDOW = 0.25
"""s over which a person's speed is measured, so that a leg does not jump when a behaviour decides."""


class Legs(NamedTuple):
    """The legs among the circles of a scene.

    Attributes:
        circle: (n,) which circle each is.
        owner: (n,) which moving body it belongs to.
        side: (n,) 1 for a left leg, -1 for a right one.
        phase: (n,) of the walk at time 0, in strides; the same for both of one person.
        reach: (n,) the farthest that it swings, m: no farther than the person's disc reaches.
    """

    circle: npt.NDArray[np.int64]
    owner: npt.NDArray[np.int64]
    side: FloatArray
    phase: FloatArray
    reach: FloatArray


def has_legs(body: Body) -> bool:
    """Whether a lidar that looks low sees two legs of `body`."""
    return body.kind == BodyKind.PERSON and isinstance(body.shape, Circle)


def proportions(radius: float) -> tuple[float, float, float]:
    """Radius of a leg, half the distance between two, and how far one swings at most within a disc of `radius`; all in m."""
    leg = min(RADIUS, 0.5 * radius)
    room = radius - leg
    half = min(0.5 * APART, room)
    return leg, half, math.sqrt(room * room - half * half)


def on_legs(bodies: Sequence[Body], seed: int, low: bool) -> tuple[Scene, Legs]:
    """What a lidar can see of moving `bodies`, each in its own frame; if it looks `low`, legs instead of persons.

    Args:
        seed: Of the phases; a person's is drawn for its name.
    """
    shapes: list[Shape] = []
    owner: list[int] = []
    legs: list[tuple[int, float, float, float, float]] = []  # shape, side, phase, reach, half
    for m, body in enumerate(bodies):
        if low and has_legs(body) and isinstance(body.shape, Circle):
            radius, half, reach = proportions(body.shape.radius)
            phase = uniform(stream(seed, f"legs {body.name}"), 0, 0)
            for side in (1.0, -1.0):
                legs.append((len(shapes), side, phase, reach, half))
                shapes.append(Circle(radius))
                owner.append(m)
        else:
            shapes.append(body.shape)
            owner.append(m)
    made, owners = scene(shapes), np.array(owner, dtype=np.int64)
    row = {int(shape): i for i, shape in enumerate(made.circle_owner)}
    for shape, side, _, _, half in legs:
        made.circles[row[shape], 1] = side * half
    table = np.array([leg[1:4] for leg in legs], dtype=np.float64).reshape(-1, 3)
    found = Legs(
        circle=np.array([row[leg[0]] for leg in legs], dtype=np.int64),
        owner=np.array([owner[leg[0]] for leg in legs], dtype=np.int64),
        side=np.ascontiguousarray(table[:, 0]),
        phase=np.ascontiguousarray(table[:, 1]),
        reach=np.ascontiguousarray(table[:, 2]),
    )
    seen = made._replace(segment_owner=owners[made.segment_owner], circle_owner=owners[made.circle_owner])
    return seen, found


def standing(bodies: Sequence[Body], low: bool) -> Scene:
    """What a lidar can see of `bodies` that stand for good, in the map frame; if it looks `low`, legs instead of persons."""
    shapes: list[Shape] = []
    poses: list[tuple[float, float, float]] = []
    for body in bodies:
        assert body.pose is not None
        x, y, theta = (float(p) for p in body.pose)
        if low and has_legs(body) and isinstance(body.shape, Circle):
            radius, half, _ = proportions(body.shape.radius)
            for side in (half, -half):
                shapes.append(Circle(radius))
                poses.append((x - side * math.sin(theta), y + side * math.cos(theta), theta))
        else:
            shapes.append(body.shape)
            poses.append((x, y, theta))
    return scene(shapes, np.array(poses, dtype=np.float64).reshape(-1, 3))


@kernel
def walk(circles: FloatArray, legs: Legs, tracks: Tracks, since: FloatArray, leg: int, t: float) -> None:
    """Put the `legs` among `circles` (k, 3), each in its owner's frame, to where they are at time `t` [s].

    Args:
        tracks: Of the bodies that move.
        since: (m,) when the clock of each began, s.
        leg: Number of the robot's leg that the tracks are in.
    """
    now, before = np.empty(3), np.empty(3)
    for i in range(len(legs.circle)):
        m = legs.owner[i]
        begin, end = tracks.rows[leg, m, 0], tracks.rows[leg, m, 1]
        ahead = 0.0
        if pose_at(tracks.knots, begin, end, t - since[m], now) and pose_at(
            tracks.knots, begin, end, t - since[m] - WINDOW, before
        ):
            c, s = math.cos(now[2]), math.sin(now[2])
            speed = (c * (now[0] - before[0]) + s * (now[1] - before[1])) / WINDOW
            u = STRIDES * t + legs.phase[i]
            wave = 4.0 * abs(u - math.floor(u) - 0.5) - 1.0
            most = legs.reach[i]
            ahead = legs.side[i] * wave * min(max(speed / (4.0 * STRIDES), -most), most)
        circles[legs.circle[i], 0] = ahead
