"""MDO, minimum distance from obstacles: edge to edge between exact footprints, 0 in a collision.

Paper A's eq. 6 says "any obstacle in its surroundings": the headline takes the obstacles that the test placed (static
and moving), so that the room does not decide it; `MDO_walls` takes everything that can be hit, `MDO_centre` is the
distance between centres. The turn at B does not count. A robot that gives up far from any obstacle is not a safe one:
an unfinished trial has an MDO only if it is 0. A test without obstacles (batch NO) has none. Between two samples the
robot is taken to drive the arc that joins them: what is missed is below 1 mm.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from clearway.geometry.distance import path_clearance
from clearway.geometry.shapes import Shape
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import Drive, begun, finished, track
from clearway.trials import Body, Trial

PLACED = frozenset({"obstacle", "mover"})
"""Kinds of bodies that the test placed."""
TOUCH = 1e-5
"""m; a smaller gap is contact and counts as 0 (no measurement tells them apart; the simulated world stops there)."""
FASTEST = 10.0
"""m/s; an obstacle that moves faster between two samples was carried."""


def _bodies(trial: Trial, kinds: Iterable[str] | None) -> tuple[list[Body], list[int]]:
    """The static bodies of these kinds (None: all), and the columns of the moving ones in `Trial.movers`."""
    wanted = [body for body in trial.attempt.bodies if kinds is None or body.kind in kinds]
    if not wanted:
        raise NotComputable("the test has no obstacle")
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    columns = [i for i, body in enumerate(moving) if any(body is other for other in wanted)]
    return [body for body in wanted if body.pose is not None], columns


def _present(trial: Trial, drives: tuple[Drive, ...], fixed: list[Body], columns: list[int]) -> None:
    if not fixed and not any(np.isfinite(drive.movers[:, columns]).all(axis=2).any() for drive in drives):
        raise NotComputable("no obstacle was present while a scored leg was driven")


def _edge_to_edge(trial: Trial, kinds: Iterable[str] | None) -> float:
    footprint = trial.attempt.footprint
    if footprint is None:
        raise NotComputable("the footprint is unknown")
    fixed, columns = _bodies(trial, kinds)
    drives = begun(trial)
    _present(trial, drives, fixed, columns)
    moving = [body for body in trial.attempt.bodies if body.pose is None]
    nearest = min(_nearest(footprint, drive, fixed, [moving[c] for c in columns], columns) for drive in drives)
    if nearest > 0:
        finished(trial)  # else it would be an upper bound only
    return nearest


def _nearest(footprint: Shape, drive: Drive, fixed: list[Body], moving: list[Body], columns: list[int]) -> float:
    movers = drive.movers[:, columns]
    if len(movers) > 1:  # an obstacle that starts anew with the leg did not sweep the way back to its start
        leap = np.hypot(*np.moveaxis(movers[1, :, :2] - movers[0, :, :2], 1, 0))
        movers[0, leap > FASTEST * (drive.t[1] - drive.t[0])] = np.nan
    nearest = float(path_clearance(footprint, track(drive), [*fixed, *moving], movers).min())
    return 0.0 if nearest < TOUCH else nearest


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
    fixed, columns = _bodies(trial, PLACED)
    drives = finished(trial)
    _present(trial, drives, fixed, columns)
    nearest = np.inf
    for drive in drives:
        at = track(drive)[:, None, :2]
        for body in fixed:
            assert body.pose is not None
            nearest = min(nearest, float(np.hypot(*(at[:, 0] - body.pose[:2]).T).min()))
        apart = np.hypot(*np.moveaxis(drive.movers[:, columns, :2] - at, 2, 0))
        nearest = min([nearest, *apart[np.isfinite(apart)].tolist()])
    return nearest


ALL = (
    Indicator(
        "MDO", "minimum distance from obstacles", "m", "paper A, eq. 6, edge to edge", "higher", minimum_distance
    ),
    Indicator("MDO_centre", "MDO, centre to centre", "m", "paper A, eq. 6", "higher", minimum_distance_centre),
    Indicator("MDO_walls", "MDO, walls included", "m", "paper A, eq. 6", "higher", minimum_distance_walls),
)
