"""How near the robot came to people, for how long, how fast it was there, and how short of running into them: by Hall's zones.

All of it from outline to outline, as MDO is: a wide robot must not come nearer than a narrow one. Only bodies of the kind
`person` count, recorded or simulated, over the scored legs.

`person_ttc` is the time to collision: how long it would be, at each sample, until the outlines touch if both went on as they
do, the robot without turning; `ttc` is the same of whatever moves. While nobody is on such a course it is infinite; without any
such sample there is none. Exact between a robot of any outline and discs; of another outline the disc around it is taken, so
that the time is never too long.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from clearway.contract import BodyKind
from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius
from clearway.indicators.clearance import Scene, edge_to_edge, lost, scenes, unseen_clearance, ways
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import finished, known_rows, speed
from clearway.trials import Trial

PEOPLE = frozenset({BodyKind.PERSON})
MOVING = frozenset({BodyKind.PERSON, BodyKind.MOVING_OBSTACLE, BodyKind.ROBOT})
INTIMATE, PERSONAL, SOCIAL = 0.45, 1.2, 3.6
"""m; how far a person's intimate, personal and social zones reach (Hall 1966: 1.5, 4 and 12 feet)."""
_FAR = 1e3
"""m; so far away is whoever is not there."""


@lru_cache(maxsize=8)
def _among(trial: Trial, kinds: frozenset[BodyKind] = PEOPLE) -> list[Scene]:
    """The legs, all driven to their ends, with the people, or with whatever else is of these kinds. Cached, as `legs.begun` is.

    Raises:
        NotComputable: nobody was there, a leg was not finished, or something is not known that is needed.
    """
    if not any(body.kind in kinds for body in trial.attempt.bodies):
        raise NotComputable("nobody was there" if kinds is PEOPLE else "nothing moved there")
    finished(trial)
    return scenes(trial, kinds)


@lru_cache(maxsize=8)
def _distances(trial: Trial) -> list[list[tuple[slice, FloatArray]]]:
    """Leg by leg, in each stretch of samples in which the robot was seen: (n,) m from the nearest person, at most `_FAR`."""
    return [
        [
            (run, np.minimum(min_clearance(s.footprint, s.path[run], s.bodies, s.moving_obstacles[run]), _FAR))
            for run in s.runs()
        ]
        for s in _among(trial)
    ]


@measure
def person_distance(trial: Trial) -> float:
    """Smallest distance between the outlines of the robot and of a person, m; of an unfinished trial only if it is 0, as MDO."""
    return edge_to_edge(trial, PEOPLE)


def _within(zone: float) -> Measure:
    @measure
    def time_within(trial: Trial) -> float:
        """For how long the nearest person was nearer than `zone`, s; between samples the distance is taken to change evenly."""
        parts = _among(trial)
        if unseen_clearance(trial, parts, PEOPLE) < zone:
            raise NotComputable(lost(trial))
        return sum(
            _below(zone, scene.drive.t[run], d)
            for scene, runs in zip(parts, _distances(trial), strict=True)
            for run, d in runs
        )

    return time_within


def _below(zone: float, t: FloatArray, d: FloatArray) -> float:
    """For how long the distance `d` (n,) [m] at times `t` (n,) [s] was below `zone` [m], s."""
    low, high = np.minimum(d[:-1], d[1:]), np.maximum(d[:-1], d[1:])
    share = np.clip((zone - low) / np.maximum(high - low, 1e-12), 0.0, 1.0)
    return float((share * np.diff(t)).sum())


@measure
def person_speed(trial: Trial) -> float:
    """How fast the robot was at the sample at which a person was nearest, at the first of several, m/s."""
    parts, found = _among(trial), _distances(trial)
    nearest, fastest = math.inf, 0.0
    for scene, runs in zip(parts, found, strict=True):
        v = speed(scene.drive)
        for run, d in runs:
            k = int(d.argmin())
            if d[k] < nearest:
                nearest, fastest = float(d[k]), float(v[run][k])
    if nearest >= _FAR:
        raise NotComputable("nobody was there while a scored leg was driven")
    if unseen_clearance(trial, parts, PEOPLE) < nearest:
        raise NotComputable(lost(trial))
    return fastest


def _time_to_collision(kinds: frozenset[BodyKind], whom: str) -> Measure:
    @measure
    def time_to_collision(trial: Trial) -> float:
        """Smallest time to collision with such a body, s."""
        parts = _among(trial, kinds)
        least = min((float(t.min()) for scene in parts for t in _times(scene)), default=math.inf)
        if not least <= _unseen(trial, parts, kinds):
            raise NotComputable(lost(trial))
        if math.isinf(least):
            raise NotComputable(f"no collision course with {whom}")
        return least

    return time_to_collision


def _unseen(trial: Trial, parts: list[Scene], kinds: frozenset[BodyKind]) -> float:
    """No time to collision can have been shorter than this while the robot or a body was not seen, s; NaN: nobody knows."""
    nearest = unseen_clearance(trial, parts, kinds)
    if math.isinf(nearest):
        return nearest
    assert trial.attempt.footprint is not None
    robot, bodies = ways(trial, kinds, trial.attempt.footprint)
    closing = robot.speed + max(body.speed for body in bodies)
    return nearest / closing if closing > 0.0 else math.nan


def _times(scene: Scene) -> Iterator[FloatArray]:
    """For each body and stretch in which both were seen: (n,) time to collision at each sample, s, inf on no such course."""
    fixed = [body for body in scene.bodies if body.pose is not None]
    moving = [body for body in scene.bodies if body.pose is None]
    for run in scene.runs():
        t, path = scene.drive.t[run], scene.path[run]
        if len(t) < 2 or t[-1] <= t[0]:
            continue
        v = np.gradient(path[:, :2], t, axis=0)
        for body in fixed:
            assert body.pose is not None
            yield _until(scene.footprint, path, body.pose[:2] - path[:, :2], -v, body.shape)
        for k, body in enumerate(moving):
            at = scene.moving_obstacles[run, k, :2]
            for there in _stretches(known_rows(at), scene.drive.carried[run.start : run.stop - 1, scene.columns[k]]):
                w = np.gradient(at[there], t[there], axis=0) - v[there]
                yield _until(scene.footprint, path[there], at[there] - path[there, :2], w, body.shape)


def _stretches(known: npt.NDArray[np.bool_], carried: npt.NDArray[np.bool_]) -> list[slice]:
    """Where at least two in a row of the samples (n,) are known, and it was not carried from one to the next (n - 1,)."""
    joined = known[:-1] & known[1:] & ~carried
    edges = np.flatnonzero(np.diff(np.concatenate([[False], joined, [False]])))
    return [slice(a, b + 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _until(footprint: Shape, path: FloatArray, at: FloatArray, v: FloatArray, shape: Shape) -> FloatArray:
    """(n,) s until a disc around `shape` touches the footprint; `at` and `v`: its place [m] and velocity [m/s] against the robot's
    (n, 2), along the map's axes."""
    cos, sin = np.cos(path[:, 2]), np.sin(path[:, 2])
    x, w = (np.stack([cos * a[:, 0] + sin * a[:, 1], cos * a[:, 1] - sin * a[:, 0]], axis=1) for a in (at, v))
    radius = circumscribed_radius(shape)
    if isinstance(footprint, Circle):
        return _to_disc(x, w, footprint.radius + radius)
    corners = footprint.array
    least = np.full(len(x), math.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        least = np.minimum(least, np.minimum(_to_disc(x - a, w, radius), _to_edge(x - a, w, b - a, radius)))
    return least


def _to_disc(x: FloatArray, w: FloatArray, radius: float) -> FloatArray:
    """(n,) s until points at `x` [m] that move with `w` [m/s], both (n, 2), are within `radius` [m] of the origin."""
    a, b, c = (w**2).sum(axis=1), (x * w).sum(axis=1), (x**2).sum(axis=1) - radius**2
    root = b**2 - a * c
    meets = (root >= 0) & (b < 0) & (a > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(meets, c / (-b + np.sqrt(np.maximum(root, 0.0))), math.inf)
    return np.where(c <= 0, 0.0, found)


def _to_edge(x: FloatArray, w: FloatArray, edge: FloatArray, radius: float) -> FloatArray:
    """The same until they are within `radius` of the straight line from the origin to `edge` (2,), met beside it."""
    length = float(np.hypot(*edge))
    along, across = edge / length, np.array([-edge[1], edge[0]]) / length
    far, closing = x @ across, w @ across
    side = np.where(far >= 0, 1.0, -1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(side * closing < 0, (radius - side * far) / (side * closing), math.inf)
    t = np.where(side * far <= radius, 0.0, t)
    with np.errstate(invalid="ignore"):
        met = x @ along + (w @ along) * t
    return np.where(np.isfinite(t) & (met >= 0) & (met <= length), t, math.inf)


_HALL = "Hall 1966, outline to outline"
_TTC = "Francis et al. 2023 (TTC), constant velocities, outline to outline"

OF_PEOPLE = (
    Indicator("person_distance", "smallest distance from a person", "m", _HALL, "higher", person_distance),
    Indicator("social_time", "time within 3.6 m of a person", "s", _HALL, "lower", _within(SOCIAL)),
    Indicator("personal_time", "time within 1.2 m of a person", "s", _HALL, "lower", _within(PERSONAL)),
    Indicator("intimate_time", "time within 0.45 m of a person", "s", _HALL, "lower", _within(INTIMATE)),
    Indicator(
        "person_speed", "speed when nearest to a person", "m/s", "Neggers et al. 2022: comfort falls with it", "lower", person_speed
    ),
    Indicator(
        "person_ttc", "smallest time to collision with a person", "s", _TTC, "higher", _time_to_collision(PEOPLE, "a person")
    ),
)  # fmt: skip
"""Of a trial without people nothing is said of these."""

OF_MOVING = (
    Indicator(
        "ttc", "smallest time to collision with whatever moves", "s", _TTC, "higher", _time_to_collision(MOVING, "anything that moves")
    ),
)  # fmt: skip
"""Of a trial in which nothing moves nothing is said of these."""

ALL = (*OF_PEOPLE, *OF_MOVING)
