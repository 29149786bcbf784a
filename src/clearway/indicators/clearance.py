"""MDO, minimum distance from obstacles: edge to edge between exact footprints, 0 in a collision.

Paper A's eq. 6 says "any obstacle in its surroundings": the headline takes the obstacles that the test placed (static
and moving), so that the room does not decide it; `MDO_walls` takes everything that can be hit, `MDO_centre` is the
distance between centres. The turn at B does not count. A robot that gives up far from any obstacle is not a safe one:
an unfinished trial has an MDO only if it is 0 (which it also is where a person
confirmed a contact that was measured as possible). A test without obstacles (batch NO) has none. Between two instants the
robot is taken to drive the arc that joins them, an obstacle the line. A simulated trial holds, beside its samples, the instants
that make this right wherever something that moves came nearest; so edge to edge and centre to centre are right to 1 mm. A
recording has its samples only.

A disc needs no heading; it is then taken to drive straight from sample to sample. While a recording does not see the robot
or an obstacle, they may have come closer to each other: MDO then is known only where they cannot have, from where they
were last and next seen and by their largest speeds. Else it lies between two `bounds`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

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
from clearway.trials.unseen import Way, body_ways, nearest, robot_way

TOUCH = 1e-5
"""m; a smaller gap is contact and counts as 0 (no measurement tells them apart; the simulated world stops there)."""
FINE = 1e-4
"""m; so near to the true minimum of the arcs and lines the smallest distance is found."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is measured against what on one leg.

    Attributes:
        drive: The leg as it was driven.
        footprint: The robot's outline in base_link.
        path: (n, 3) poses of the robot in the map: x, y [m], theta [rad], 0 where its footprint needs none; NaN where it was
            not seen.
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

    def runs(self) -> list[slice]:
        """The stretches in which the robot was seen without a break."""
        known = known_rows(self.path)
        breaks = np.flatnonzero(~(known[:-1] & known[1:]) | self.drive.missed) + 1
        bounds = [0, *(int(b) for b in breaks), len(known)]
        return [slice(a, b) for a, b in pairwise(bounds) if known[a]]


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


def _present(
    trial: Trial, drives: tuple[DrivenLeg, ...], fixed: list[Body], moving: list[Body], columns: list[int]
) -> None:
    """Nothing, unless no obstacle was there; one of a recording that was not seen was there."""
    hidden = trial.attempt.source == "recorded" and any(not body.visits for body in moving)
    seen = any(np.isfinite(drive.moving_obstacles[:, columns, :2]).all(axis=2).any() for drive in drives)
    if not fixed and not seen and not hidden:
        raise NotComputable("no obstacle was present while a scored leg was driven")


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
    moving = _moving(trial, columns)
    _present(trial, drives, fixed, moving, columns)
    return [_scene(trial, footprint, drive, fixed, moving, columns) for drive in drives]


def _moving(trial: Trial, columns: list[int]) -> list[Body]:
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    return [moving[c] for c in columns]


def _scene(
    trial: Trial, footprint: Shape, drive: DrivenLeg, fixed: list[Body], moving: list[Body], columns: list[int]
) -> Scene:
    moving_obstacles = drive.moving_obstacles[:, columns].copy()
    for k, body in enumerate(moving):
        if isinstance(body.shape, Circle):
            moving_obstacles[:, k, 2] = np.where(np.isfinite(moving_obstacles[:, k, 2]), moving_obstacles[:, k, 2], 0.0)
    there = [
        body
        for k, body in enumerate(moving)
        if known_rows(moving_obstacles[:, k, :2]).any() or (trial.attempt.source == "recorded" and not body.visits)
    ]
    for body in (*fixed, *there):
        if not body.outlined:
            raise NotComputable(f"the shape of {body.name} is unknown, or where that is on its markers")
    blind = np.isfinite(moving_obstacles[:, :, :2]).all(axis=2) & ~np.isfinite(moving_obstacles[:, :, 2])
    for k, body in enumerate(moving):
        if blind[:, k].any() and not np.isfinite(moving_obstacles[:, k, 2]).any():
            raise NotComputable(f"the heading of {body.name} is unknown")
    moving_obstacles[blind] = np.nan
    _carried(drive, moving_obstacles, columns)
    path = _path(footprint, drive)
    return Scene(drive, footprint, path, (*map(_upright, fixed), *moving), moving_obstacles, tuple(columns))


def _carried(drive: DrivenLeg, moving_obstacles: FloatArray, columns: list[int]) -> None:
    """An obstacle that starts anew with the leg did not sweep the way back to its start: at first it is absent."""
    moving_obstacles[0, drive.carried[0, columns]] = np.nan


def _path(footprint: Shape, drive: DrivenLeg) -> FloatArray:
    """(n, 3) poses, NaN where the robot was not seen; all headings are 0 where some are unknown and the footprint needs none.

    Raises:
        NotComputable: it was not seen at all, or its heading was not, which the footprint needs.
    """
    path = drive.pose.copy()
    if isinstance(footprint, Circle) and (known_rows(path[:, :2]) & ~np.isfinite(path[:, 2])).any():
        path[:, 2] = 0.0
    known = known_rows(path)
    if not known.any():
        track(drive)
    path[~known] = np.nan
    return path


def _upright(body: Body) -> Body:
    """A static body whose heading is known, or does not matter."""
    assert body.pose is not None
    if np.isfinite(body.pose[2]):
        return body
    if not isinstance(body.shape, Circle):
        raise NotComputable(f"the heading of {body.name} is unknown")
    return replace(body, pose=np.array([body.pose[0], body.pose[1], 0.0]))


def clearances(scene: Scene) -> FloatArray:
    """(n,) smallest distance edge to edge between each sample and the next, m; inf where nothing is there, or the robot was not
    seen."""
    found = np.full(len(scene.path), math.inf)
    for run in scene.runs():
        found[run] = path_clearance(scene.footprint, scene.path[run], scene.bodies, scene.moving_obstacles[run])
    return found


def _seen(scene: Scene) -> float:
    """The smallest distance edge to edge that was seen, m; inf where nothing was there."""
    return min(
        (
            closest_approach(scene.footprint, scene.path[run], scene.bodies, scene.moving_obstacles[run], FINE)
            for run in scene.runs()
        ),
        default=math.inf,
    )


def _unseen(trial: Trial, parts: Sequence[Scene], known: tuple[Way, Sequence[Way]]) -> float:
    """How near the robot can have come on its legs to any of the bodies while one of the two was not seen, m; inf where both
    were throughout."""
    if trial.attempt.source != "recorded":
        return math.inf
    robot, bodies = known
    least = math.inf
    for drive in (scene.drive for scene in parts):
        for body in bodies:
            for start, end in (*robot.unseen(), *body.unseen()):
                start, end = max(start, drive.span.start), min(end, drive.span.end)
                if start < end:
                    least = min(least, nearest(robot, body, start, end)[0])
    return least


def unseen_clearance(trial: Trial, parts: Sequence[Scene], kinds: Iterable[str] | None) -> float:
    """How near the robot can have come on its legs to a body of these kinds while one of the two was not seen, m; inf: both were."""
    assert trial.attempt.footprint is not None
    return _unseen(trial, parts, ways(trial, kinds, trial.attempt.footprint))


def ways(trial: Trial, kinds: Iterable[str] | None, footprint: Shape) -> tuple[Way, list[Way]]:
    """What is known of how the robot of this footprint moved, and each body of these kinds."""
    bodies = body_ways(trial.attempt, trial.t, trial.moving_obstacles)
    wanted = [w for w, b in zip(bodies, trial.attempt.bodies, strict=True) if kinds is None or b.kind in kinds]
    return robot_way(trial.attempt, trial.t, trial.pose, footprint), wanted


def _bounds(trial: Trial, kinds: Iterable[str] | None) -> tuple[float, float]:
    """Between what two distances the smallest one edge to edge lies, m; they are the same where it is known."""
    parts = scenes(refined(trial), kinds)
    most = min(map(_seen, parts))
    least = min(most, unseen_clearance(trial, parts, kinds))
    return (0.0, 0.0) if most < TOUCH or _confirmed(trial, kinds) else (least, most)


def _known(trial: Trial, least: float, most: float) -> float:
    """The distance between two bounds that are the same.

    Raises:
        NotComputable: they are not; or nothing was seen that the robot could have touched.
    """
    if most > 0:
        finished(trial)  # else it would be an upper bound only
    if least < most:
        raise NotComputable(lost(trial))
    return most


def lost(trial: Trial) -> str:
    """What was not seen of what MDO needs."""
    for drive in begun(trial):
        try:
            track(drive) if not isinstance(trial.attempt.footprint, Circle) else positions(drive)
        except NotComputable as reason:
            return str(reason)
        moving = [body for body in trial.attempt.bodies if body.pose is None]
        for column, body in enumerate(moving):
            known = known_rows(drive.moving_obstacles[:, column, :2])
            if not known.all() and not (body.visits and not known.any()):
                return f"the pose of {body.name} has gaps ({gap_time(drive.t, known):.1f} s)"
    return "something was not seen"


def edge_to_edge(trial: Trial, kinds: Iterable[str] | None) -> float:
    """Smallest distance edge to edge from a body of these kinds (None: of any), m.

    Raises:
        NotComputable: there is none, or it is not known how near the robot came.
    """
    return _known(trial, *_bounds(trial, kinds))


@lru_cache(maxsize=8)
def bounds(trial: Trial) -> tuple[float, float] | None:
    """Between what two distances MDO lies, m; None where it is known, or nothing is. The larger one is inf where nothing was
    seen that the robot could have touched."""
    try:
        least, most = _bounds(trial, PLACED)
        finished(trial)
    except NotComputable:
        return None
    return (least, most) if least < most else None


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
    return edge_to_edge(trial, PLACED)


@measure
def minimum_distance_walls(trial: Trial) -> float:
    """Smallest distance edge to edge from anything that can be hit, m."""
    return edge_to_edge(trial, None)


@measure
def minimum_distance_centre(trial: Trial) -> float:
    """Smallest distance between the robot's origin and that of an obstacle that the test placed, m."""
    fixed, columns = _bodies(trial, PLACED)
    drives = finished(refined(trial))
    moving = _moving(trial, columns)
    _present(trial, drives, fixed, moving, columns)
    parts = [_origins(drive, fixed, moving, columns) for drive in drives]
    robot, bodies = ways(trial, PLACED, _POINT)
    most = min(map(_seen, parts))
    least = min(most, _unseen(trial, parts, (robot, [replace(body, shape=_POINT) for body in bodies])))
    return _known(trial, least, most)


_POINT = Circle(0.0)


def _origins(drive: DrivenLeg, fixed: list[Body], moving: list[Body], columns: list[int]) -> Scene:
    """Points for what is there."""
    at = drive.moving_obstacles[:, columns].copy()
    at[:, :, 2] = 0.0
    _carried(drive, at, columns)
    placed = [replace(b, pose=np.array([*b.pose[:2], 0.0])) for b in fixed if b.pose is not None]
    bodies = tuple(replace(b, shape=_POINT) for b in (*placed, *moving))
    return Scene(drive, _POINT, _path(_POINT, drive), bodies, at, tuple(columns))


ALL = (
    Indicator(
        "MDO", "minimum distance from obstacles", "m", "paper A, eq. 6, edge to edge", "higher", minimum_distance
    ),
    Indicator("MDO_centre", "MDO, centre to centre", "m", "paper A, eq. 6", "higher", minimum_distance_centre),
    Indicator("MDO_walls", "MDO, walls included", "m", "paper A, eq. 6", "higher", minimum_distance_walls),
)
