"""What in one scan may be a body that moves: clusters in no map that are small enough, and the circles of those that are round."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.contract import Scan
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.perception.arcs import LEAST, LEAST_KNOWN, arc
from clearway.perception.clusters import PERSON, ClusterParameters, IntArray, Returns, by_label
from clearway.robots import Robot

CENTRE = 0.75
"""Standard deviation of a circle's centre along the line of sight over that of a range: measured on discs and squares
of 0.2 to 0.6 m at 1.5 to 3.5 m; across it is a fifth of that."""
EXACT = 0.005
"""m: no range and no radius is taken to be known better."""


class Candidates(NamedTuple):
    """Clusters that may be bodies.

    Attributes:
        rows: (n,) which clusters.
        circle: (n, 3) x, y, radius, m.
        variance: (n,) of a coordinate of the centre, m^2.
        cut: (n,) whether only a part of it is in view.
        legs: (n,) whether it is two legs.
    """

    rows: IntArray
    circle: FloatArray
    variance: FloatArray
    cut: npt.NDArray[np.bool_]
    legs: npt.NDArray[np.bool_]


@kernel
def _candidates(
    returns: Returns, increment: float, variance: float, least: int, largest: float, most: int
) -> Candidates:  # fmt: skip
    """Clusters that are in no map and no larger than a body, at most so many.

    Args:
        returns: What was seen.
        increment: Between two beams, rad.
        variance: Of a coordinate of a circle's centre, of the noise of ranges alone, m^2.
        least: Returns of a body.
        largest: Radius of a body, m.
        most: Candidates; those that are nearest.
    """
    k = returns.size.shape[0]
    unknown = np.ones(k, dtype=np.bool_)
    for j in range(returns.label.shape[0]):
        if returns.known[j]:
            unknown[returns.label[j]] = False
    chosen = unknown & (returns.size >= least) & (returns.circles[:, 2] <= largest)
    rows = np.flatnonzero(chosen)
    if rows.shape[0] > most:
        chosen[rows[np.argsort(returns.far[rows], kind="mergesort")[most:]]] = False
        rows = np.flatnonzero(chosen)
    n = rows.shape[0]
    found = Candidates(rows, np.empty((n, 3)), np.empty(n), np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_))
    for j in range(n):
        c = rows[j]
        spacing = increment * returns.far[c]
        found.circle[j], found.variance[j] = returns.circles[c], variance + spacing * spacing / 12.0
        found.cut[j], found.legs[j] = returns.cut[c] != 0, returns.legs[c] != 0
    return found


def found_in(returns: Returns, scan: Scan, p: ClusterParameters, sigma: float) -> Candidates:
    """What may be a body in a scan; `sigma`: standard deviation of a range, m."""
    return _candidates(
        returns, scan.angle_increment, (CENTRE * sigma) ** 2, p.body_returns, p.body_radius, p.discs // 4
    )  # fmt: skip


def sizes_of(robot: Robot, p: ClusterParameters) -> tuple[float, float]:
    """Least and largest radius of a round body, m: what is smaller may be somebody's legs, where these are what is seen of people."""
    assert robot.lidar is not None
    return PERSON if robot.lidar.sees_legs else 0.0, p.body_radius


@kernel
def rounded(
    found: Candidates, returns: Returns, at: IntArray, disc: FloatArray, doubt: FloatArray, sizes: tuple[float, float],
    sigma: float,
) -> FloatArray:  # fmt: skip
    """Put in place of the circles of those that are round the ones of which their returns are an arc.

    Args:
        found: They change. A round body of which too little is seen for that counts as cut.
        returns: What was seen.
        at: (n,) which body each is; -1: a new one.
        disc: (m,) radius of each body that is known to be round, m.
        doubt: (m,) variance of that, m^2; inf: it isn't, or nobody knows. It changes: two legs are not round.
        sizes: Least and largest radius of a round body, m.
        sigma: Standard deviation of a range, m.

    Returns:
        (n,) variance of the radius of those that are round, m^2; inf of the others.
    """
    order, first = by_label(returns.label, returns.size.shape[0])
    variance = np.full(at.shape[0], math.inf)
    for j in range(at.shape[0]):
        i, c = at[j], found.rows[j]
        if found.legs[j]:
            if i >= 0:
                doubt[i] = math.inf
            continue
        known = i >= 0 and doubt[i] < math.inf
        members = order[first[c] : first[c + 1]]
        if members.shape[0] >= (LEAST_KNOWN if known else LEAST):
            r = found.circle[j, 2]
            a = arc(
                returns.raw,
                members,
                returns.sensor,
                sigma,
                disc[i] if known else r,
                doubt[i] if known else 0.25 * r * r,
            )
            if a.fits and sizes[0] <= a.radius <= sizes[1]:
                found.circle[j, 0], found.circle[j, 1], found.circle[j, 2] = a.x, a.y, a.radius
                found.variance[j] = max(a.variance, EXACT * EXACT)
                variance[j] = max(a.radius_variance, EXACT * EXACT)
        found.cut[j] = (found.cut[j] or known) and variance[j] == math.inf
    return variance
