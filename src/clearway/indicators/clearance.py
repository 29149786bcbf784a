"""MDO, minimum distance from obstacles: edge to edge between exact footprints, 0 in a collision.

Paper A's eq. 6 says "any obstacle in its surroundings": the headline takes the obstacles that the test placed (static
and moving), so that the room does not decide it; `MDO_walls` takes everything that can be hit, `MDO_centre` is the
distance between centres. The turn at B does not count. A robot that gives up far from any obstacle is not a safe one:
an unfinished trial has an MDO only if it is 0 (which it also is where a person
confirmed a contact that was measured as possible). A test without obstacles (batch NO) has none. Between two instants the
robot is taken to drive the arc that joins them, an obstacle the line. A simulated trial holds, beside its samples, the instants
that make this right wherever something that moves came nearest; so edge to edge and centre to centre are right to 1 mm. A
recording has its samples only.

A disc needs no heading; it is then taken to drive straight from sample to sample. An obstacle of which a recording
loses sight while a leg is driven may have come closer meanwhile: the distance is not computable then. One that is not
there yet when a leg begins, or any more when it ends, counts as absent.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from clearway.contract import PLACED, EventKind
from clearway.geometry.distance import closest_approach, path_clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import (
    DrivenLeg,
    begun,
    contact_time,
    finished,
    gap_time,
    known_rows,
    positions,
    refined,
    track,
)
from clearway.trials import Body, Trial

TOUCH = 1e-5
"""m; a smaller gap is contact and counts as 0 (no measurement tells them apart; the simulated world stops there)."""
FASTEST = 10.0
"""m/s; an obstacle that moves faster between two samples was carried."""
FINE = 1e-4
"""m; so near to the true minimum of the arcs and lines the smallest distance is found."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is measured against what on one leg.

    Attributes:
        drive: The leg as it was driven.
        footprint: The robot's outline in base_link.
        path: (n, 3) poses of the robot in the map: x, y [m], theta [rad], 0 where its footprint needs none.
        bodies: Those that stand first, then those that move.
        moving_obstacles: (n, k, 3) poses of those that move, NaN while absent.
        columns: Their columns in `Trial.moving_obstacles`.
    """

    drive: DrivenLeg
    footprint: Shape
    path: FloatArray
    bodies: tuple[Body, ...]
    moving_obstacles: FloatArray
    columns: tuple[int, ...]


def _bodies(trial: Trial, kinds: Iterable[str] | None) -> tuple[list[Body], list[int]]:
    """The static bodies of these kinds (None: all), and the columns of the moving ones in `Trial.moving_obstacles`."""
    wanted = [body for body in trial.attempt.bodies if kinds is None or body.kind in kinds]
    if not wanted:
        raise NotComputable("the test has no obstacle")
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    columns = [i for i, body in enumerate(moving) if any(body is other for other in wanted)]
    fixed = [body for body in wanted if body.pose is not None]
    for body in fixed:
        if body.pose is None or not np.isfinite(body.pose[:2]).all():
            raise NotComputable(f"the place of {body.name} is unknown")
    return fixed, columns


def _present(trial: Trial, drives: tuple[DrivenLeg, ...], fixed: list[Body], columns: list[int]) -> None:
    if not fixed and not any(np.isfinite(drive.moving_obstacles[:, columns, :2]).all(axis=2).any() for drive in drives):
        raise NotComputable("no obstacle was present while a scored leg was driven")


def _seen_throughout(trial: Trial, drive: DrivenLeg, body: Body, column: int) -> None:
    """Nothing, unless the recording loses sight of the body between two samples of the leg (a simulated one left)."""
    if trial.attempt.source != "recorded":
        return
    known = known_rows(drive.moving_obstacles[:, column, :2])
    there = np.flatnonzero(known)
    if len(there) and not known[there[0] : there[-1]].all():
        lost = gap_time(drive.t[there[0] : there[-1] + 1], known[there[0] : there[-1] + 1])
        raise NotComputable(f"the pose of {body.name} has gaps ({lost:.1f} s)")


def scenes(trial: Trial, kinds: Iterable[str] | None = PLACED) -> list[Scene]:
    """What the robot could touch on every scored leg that was begun.

    Raises:
        NotComputable: no such obstacle, or a shape, a place or a heading that is needed is unknown.
    """
    footprint = trial.attempt.footprint
    if footprint is None:
        raise NotComputable("the footprint is unknown")
    fixed, columns = _bodies(trial, kinds)
    drives = begun(trial)
    _present(trial, drives, fixed, columns)
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    return [_scene(trial, footprint, drive, fixed, [moving[c] for c in columns], columns) for drive in drives]


def _scene(
    trial: Trial, footprint: Shape, drive: DrivenLeg, fixed: list[Body], moving: list[Body], columns: list[int]
) -> Scene:
    moving_obstacles = drive.moving_obstacles[:, columns].copy()
    for k, (body, column) in enumerate(zip(moving, columns, strict=True)):
        _seen_throughout(trial, drive, body, column)
        if isinstance(body.shape, Circle):
            moving_obstacles[:, k, 2] = np.where(np.isfinite(moving_obstacles[:, k, 2]), moving_obstacles[:, k, 2], 0.0)
    there = [body for k, body in enumerate(moving) if known_rows(moving_obstacles[:, k, :2]).any()]
    for body in (*fixed, *there):
        if not body.outlined:
            raise NotComputable(f"the shape of {body.name} is unknown, or where that is on its markers")
    blind = np.isfinite(moving_obstacles[:, :, :2]).all(axis=2) & ~np.isfinite(moving_obstacles[:, :, 2])
    for k, body in enumerate(moving):
        if blind[:, k].any():
            raise NotComputable(f"the heading of {body.name} is unknown")
    _carried(drive, moving_obstacles)
    path = _path(footprint, drive)
    return Scene(drive, footprint, path, (*map(_upright, fixed), *moving), moving_obstacles, tuple(columns))


def _carried(drive: DrivenLeg, moving_obstacles: FloatArray) -> None:
    """An obstacle that starts anew with the leg did not sweep the way back to its start: at first it is absent."""
    if len(moving_obstacles) > 1:
        leap = np.hypot(*np.moveaxis(moving_obstacles[1, :, :2] - moving_obstacles[0, :, :2], 1, 0))
        moving_obstacles[0, leap > FASTEST * (drive.t[1] - drive.t[0])] = np.nan


def _path(footprint: Shape, drive: DrivenLeg) -> FloatArray:
    """(n, 3) poses without a gap, the headings 0 where some are unknown and the footprint needs none."""
    if not isinstance(footprint, Circle) or np.isfinite(drive.pose).all():
        return track(drive)
    at = positions(drive)
    return np.column_stack([at, np.zeros(len(at))])


def _upright(body: Body) -> Body:
    """A static body whose heading is known, or does not matter."""
    assert body.pose is not None
    if np.isfinite(body.pose[2]):
        return body
    if not isinstance(body.shape, Circle):
        raise NotComputable(f"the heading of {body.name} is unknown")
    return replace(body, pose=np.array([body.pose[0], body.pose[1], 0.0]))


def clearances(scene: Scene) -> FloatArray:
    """(n,) smallest distance edge to edge between each sample and the next, m; inf where nothing is there."""
    return path_clearance(scene.footprint, scene.path, scene.bodies, scene.moving_obstacles)


def _edge_to_edge(trial: Trial, kinds: Iterable[str] | None) -> float:
    nearest = min(
        closest_approach(scene.footprint, scene.path, scene.bodies, scene.moving_obstacles, FINE)
        for scene in scenes(refined(trial), kinds)
    )
    nearest = 0.0 if nearest < TOUCH or _confirmed(trial, kinds) else nearest
    if nearest > 0:
        finished(trial)  # else it would be an upper bound only
    return nearest


def _confirmed(trial: Trial, kinds: Iterable[str] | None) -> bool:
    """Whether a person saw the contact that the measurement called possible, with such a body and no other."""
    possible = [event.body for event in trial.events if event.kind == EventKind.POSSIBLE_CONTACT]
    if contact_time(trial) is None or not possible:
        return False
    such = {i for i, body in enumerate(trial.attempt.bodies) if kinds is None or body.kind in kinds}
    return such.issuperset(possible)


@lru_cache(maxsize=8)
@measure
def minimum_distance(trial: Trial) -> float:
    """Smallest distance edge to edge from an obstacle that the test placed, m."""
    return _edge_to_edge(trial, PLACED)


@measure
def minimum_distance_walls(trial: Trial) -> float:
    """Smallest distance edge to edge from anything that can be hit, m."""
    return _edge_to_edge(trial, None)


@measure
def minimum_distance_centre(trial: Trial) -> float:
    """Smallest distance between the robot's origin and that of an obstacle that the test placed, m."""
    trial = refined(trial)
    fixed, columns = _bodies(trial, PLACED)
    drives = finished(trial)
    _present(trial, drives, fixed, columns)
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    for drive in drives:
        for column in columns:
            _seen_throughout(trial, drive, moving[column], column)
    return min(_between_origins(drive, fixed, [moving[c] for c in columns], columns) for drive in drives)


def _between_origins(drive: DrivenLeg, fixed: list[Body], moving: list[Body], columns: list[int]) -> float:
    point = Circle(0.0)
    at = drive.moving_obstacles[:, columns].copy()
    at[:, :, 2] = 0.0
    _carried(drive, at)
    placed = [replace(b, pose=np.array([*b.pose[:2], 0.0])) for b in fixed if b.pose is not None]
    bodies = [replace(b, shape=point) for b in (*placed, *moving)]
    return closest_approach(point, _path(point, drive), bodies, at, FINE)


ALL = (
    Indicator(
        "MDO", "minimum distance from obstacles", "m", "paper A, eq. 6, edge to edge", "higher", minimum_distance
    ),
    Indicator("MDO_centre", "MDO, centre to centre", "m", "paper A, eq. 6", "higher", minimum_distance_centre),
    Indicator("MDO_walls", "MDO, walls included", "m", "paper A, eq. 6", "higher", minimum_distance_walls),
)
