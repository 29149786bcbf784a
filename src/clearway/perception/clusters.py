"""A lidar's scan as clusters of returns, each in the smallest circle around it.

What such a circle means: it covers the returns that it is made of, not the body behind them. Of a square of edge e of which
one face is seen, the returns form a line, and their smallest circle has radius e / 2 and its centre on that face; the
two far corners stick out of it behind. They come into view before a robot that drives forward can reach them. Every
circle is grown by half the distance between beams where it was seen, as so much of a body may lie beside the outermost
beam that met it.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field
from scipy.ndimage import distance_transform_edt

from clearway.contract import Scan
from clearway.geometry.compiled import kernel, light
from clearway.geometry.enclosing import enclosing_circle
from clearway.geometry.frames import compose
from clearway.geometry.grid import OCCUPIED, OccupancyGrid
from clearway.geometry.shapes import FloatArray

IntArray = npt.NDArray[np.int64]

SIDES = 3
"""Neighbours on either side of a return over which its range is averaged: noise is less by the root of seven."""

JOIN = 4.5
"""Standard deviations of a difference of ranges that noise may make within a surface: at 3 one neighbour in 370 would
part, and with it a body of a hundred returns every few scans."""


LEG = 0.125
"""m: a cluster in a larger circle is no leg (Bellotto, Hu 2009: legs are 0.1 to 0.25 m wide in a scan)."""
PAIR = 0.4
"""m: the middles of one person's two legs lie no farther apart (the same: the most between them as someone walks)."""
PERSON = 0.25
"""m: radius of the disc around two legs: what stands above them (shoulders: 0.51 m, Gordon et al. 2014)."""
CALF = 0.062
"""m: radius of a leg: a calf of 0.39 m around (ANSUR II)."""
LEG_RETURNS = 2
"""A leg has at least so many: single ones are mixed pixels."""


class ClusterParameters(BaseModel):
    """How a scan becomes discs. No robot's file sets these: they are ours, unless a source is named."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    range_limit: float = Field(default=4.0, gt=0, description="farther returns are left out, m: as far as paper A's"
                               " TIAGo looks (raytrace_range)")  # fmt: skip
    grazing: float = Field(default=math.radians(10), gt=0, lt=math.pi / 2, description="lambda of the adaptive breakpoint"
                           " detector, rad: below this angle to the beam a surface falls apart (Borges, Aldon 2004)")  # fmt: skip
    known_within: float = Field(default=0.2, ge=0, description="a return this near to an occupied cell of the map is"
                                " known structure, m: the localisation's error, 0.05 m and 0.03 rad at 4 m")  # fmt: skip
    body_radius: float = Field(default=0.5, gt=0, description="a cluster in a larger circle is structure, not a body"
                               " that may move, m: HOSBOT's rack has 0.42 m")  # fmt: skip
    body_returns: int = Field(default=3, ge=1, description="a body that may move has at least so many")
    cell: float = Field(default=0.1, gt=0, description="cells in which structure is covered, m; a disc of one bulges at"
                        " most 0.71 cell before a wall")  # fmt: skip
    near: float = Field(default=1.5, ge=0, description="beyond this distance the cells are twice as large, m")
    discs: int = Field(default=300, ge=16, description="at most so many; cells grow until they are fewer")


class Returns(NamedTuple):
    """The returns of a scan and the clusters that they form.

    Attributes:
        points: (m, 2) in the frame that was asked for.
        distance: (m,) from the sensor, m.
        known: (m,) uint8, whether the map shows something there.
        label: (m,) index of the cluster.
        circles: (k, 3) smallest circle around each cluster: x, y, radius.
        size: (k,) returns in each.
        far: (k,) mean distance from the sensor, m.
        cut: (k,) uint8, whether it ends where the view does or behind something nearer.
        sensor: (3,) pose of the lidar in the same frame.
        legs: (k,) uint8, whether it is two legs, of a person.
        raw: (m, 2) the points before their noise was averaged out, which rounds corners and flattens arcs.
    """

    points: FloatArray
    distance: FloatArray
    known: npt.NDArray[np.uint8]
    label: IntArray
    circles: FloatArray
    size: IntArray
    far: FloatArray
    cut: npt.NDArray[np.uint8]
    sensor: FloatArray
    legs: npt.NDArray[np.uint8]
    raw: FloatArray


class KnownStructure(NamedTuple):
    """Where a map has structure.

    Attributes:
        cells: (rows, cols) uint8, which cells lie near an occupied one.
        origin: (2,) lower-left corner of cell (0, 0) in the map, m.
        resolution: Edge of a cell, m.
    """

    cells: npt.NDArray[np.uint8]
    origin: FloatArray
    resolution: float


NOTHING_KNOWN = KnownStructure(np.zeros((0, 0), dtype=np.uint8), np.zeros(2), 1.0)


@lru_cache(maxsize=4)
def known_structure(map: OccupancyGrid, within: float) -> KnownStructure:
    """Cells of `map` whose centre lies within `within` [m] of an occupied cell's; kept for the last few maps."""
    occupied = map.data == OCCUPIED
    near = distance_transform_edt(~occupied) * map.resolution <= within if occupied.any() else occupied
    return KnownStructure(near.astype(np.uint8), np.array(map.origin, dtype=np.float64), float(map.resolution))


def perceive(
    scan: Scan, pose: FloatArray, parameters: ClusterParameters, sigma: float = 0.0,
    known: KnownStructure = NOTHING_KNOWN, believed: FloatArray | None = None, legs: bool = False,
    around: bool | None = None,
) -> Returns:  # fmt: skip
    """The returns of `scan` within range, in clusters.

    A cluster ends where two neighbours are farther apart than a surface would have them that is met at the angle
    `grazing` (Borges and Aldon 2004, "Line extraction in 2D range images for mobile robotics"), and where what the
    map knows ends.

    Args:
        scan: What the lidar saw; a range that is NaN, inf or otherwise no return is left out.
        pose: (3,) of the robot in the frame that the points are wanted in.
        sigma: Standard deviation of a range, m; 0: the returns are taken as they are, else their noise is averaged out
            along surfaces.
        known: What the map shows.
        believed: (3,) pose of the robot in the map frame; default: `pose`.
        legs: Whether the lidar looks so low that it sees people's legs: two that are each other's nearest make one cluster,
            whose circle is a person's about the middle between them. That moves evenly while the legs swing.
        around: Whether the first beam is the last one's neighbour; default: as the angles say.
    """
    if around is None:
        around = looks_around(scan)
    at = pose if believed is None else believed
    return Returns(
        *_perceive(
            np.asarray(scan.ranges, dtype=np.float64), scan.angle_min, scan.angle_increment, scan.range_min,
            min(scan.range_max, parameters.range_limit), np.asarray(scan.mount, dtype=np.float64),
            np.asarray(pose, dtype=np.float64), np.asarray(at, dtype=np.float64),
            known.cells, known.origin, known.resolution, parameters.grazing, sigma, legs, around,
        )
    )  # fmt: skip


def looks_around(scan: Scan) -> bool:
    """Whether the first beam of `scan` is the last one's neighbour."""
    return 2.0 * math.pi - len(scan.ranges) * scan.angle_increment < 0.5 * scan.angle_increment


@kernel
def _perceive(
    ranges: FloatArray, angle_min: float, increment: float, range_min: float, range_max: float,
    mount: FloatArray, pose: FloatArray, believed: FloatArray,
    cells: np.ndarray, origin: FloatArray, resolution: float, grazing: float, sigma: float, legs: bool,
    around: bool,
) -> tuple[
    FloatArray, FloatArray, np.ndarray, IntArray, FloatArray, IntArray, FloatArray, np.ndarray, FloatArray, np.ndarray,
    FloatArray,
]:  # fmt: skip
    """See `perceive`; the fields of `Returns`."""
    n = ranges.shape[0]
    sensor, seen_from = compose(pose, mount), compose(believed, mount)
    points, distance, known = np.empty((n, 2)), np.empty(n), np.zeros(n, dtype=np.uint8)
    beam, label = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    rows, columns = cells.shape
    m, k, step, sines = 0, 0, 0, (0.0, 0.0)
    for i in range(n):
        r = ranges[i]
        if not (range_min <= r <= range_max and r > 0.0):  # NaN is none of these
            continue
        bearing = angle_min + i * increment
        points[m, 0] = sensor[0] + r * math.cos(sensor[2] + bearing)
        points[m, 1] = sensor[1] + r * math.sin(sensor[2] + bearing)
        if not (math.isfinite(points[m, 0]) and math.isfinite(points[m, 1])):
            continue
        if rows > 0:
            column = math.floor((seen_from[0] + r * math.cos(seen_from[2] + bearing) - origin[0]) / resolution)
            row = math.floor((seen_from[1] + r * math.sin(seen_from[2] + bearing) - origin[1]) / resolution)
            known[m] = cells[row, column] if 0 <= row < rows and 0 <= column < columns else 0
        distance[m], beam[m] = r, i
        if m > 0 and i - beam[m - 1] != step:
            step = i - beam[m - 1]
            sines = math.sin(step * increment), math.sin(grazing - step * increment)
        if m == 0 or not _joined(points, distance, known, m - 1, m, step * increment, sines, grazing, sigma):
            k += 1
        label[m] = k - 1
        m += 1
    if around and k > 1:
        gap = (n - beam[m - 1] + beam[0]) * increment
        sines = math.sin(gap), math.sin(grazing - gap)
        if _joined(points, distance, known, m - 1, 0, gap, sines, grazing, sigma):
            last = k - 1
            for j in range(m):
                if label[j] == last:
                    label[j] = 0
            k -= 1
    raw = points[:m].copy()
    if sigma > 0.0:
        _smooth(points, distance, label, sensor, m, SIDES, JOIN * math.sqrt(2.0) * sigma)
    people = np.empty((0, 3))
    if legs:
        people = _pair_legs(points, label[:m], known, k, sensor)
        k = people.shape[0]
    circles, count, far, cut = np.empty((k, 3)), np.zeros(k, dtype=np.int64), np.zeros(k), np.zeros(k, dtype=np.uint8)
    paired = np.zeros(k, dtype=np.uint8)
    for j in range(m):
        i = beam[j]
        before, after = i - 1, i + 1
        if before < 0 or after >= n:
            if not around:
                cut[label[j]] = 1
                continue
            before, after = before % n, after % n
        nearer = distance[j] - hides(sigma)
        other = label[j - 1] if j > 0 and beam[j - 1] == before else -1
        if ranges[before] < nearer and other != label[j]:
            cut[label[j]] = 1
        other = label[j + 1] if j + 1 < m and beam[j + 1] == after else -1
        if ranges[after] < nearer and other != label[j]:
            cut[label[j]] = 1
    order, first = by_label(label[:m], k)
    for c in range(k):
        members = order[first[c] : first[c + 1]]
        count[c] = members.shape[0]
        circles[c, 0], circles[c, 1], circles[c, 2], far[c] = surrounded(points, distance, members, increment)
        if legs and people[c, 2] > 0.0:
            circles[c], paired[c] = people[c], 1
            circles[c, 2] += 0.5 * increment * far[c]
    return points[:m], distance[:m], known[:m], label[:m], circles, count, far, cut, sensor, paired, raw


@light
def hides(sigma: float) -> float:
    """How much nearer than its neighbour a return is, at least, that may hide a part of what that is of, m; `sigma`: of a range, m."""
    return 3.0 * sigma + 0.05


@kernel
def surrounded(
    points: FloatArray, distance: FloatArray, members: IntArray, increment: float
) -> tuple[float, float, float, float]:
    """The smallest circle around a cluster's `members` (n,), grown by half a beam's distance, x, y, radius, and how far they are on average, m."""
    far = 0.0
    for j in members:
        far += distance[j] / members.shape[0]
    x, y, r = enclosing_circle(points, members)
    return x, y, r + 0.5 * increment * far, far


@light
def middle_of_leg(x: float, y: float, r: float, sensor: FloatArray) -> tuple[float, float]:
    """The middle of a leg whose returns have a circle about (x, y) of radius `r`, m: beams that graze it are lost, and what is left of
    its outline lies before its middle."""
    dx, dy = x - sensor[0], y - sensor[1]
    behind = math.sqrt(max(0.0, CALF * CALF - r * r)) / max(math.hypot(dx, dy), 1e-9)
    return x + behind * dx, y + behind * dy


@kernel
def _pair_legs(points: FloatArray, label: IntArray, known: np.ndarray, k: int, sensor: FloatArray) -> FloatArray:
    """Give the k clusters of `label` (m,) new labels, one to two legs of a person.

    Returns:
        (j, 3) of each of the j clusters then: x, y, radius of the person; radius 0 where it is not two legs.
    """
    order, first = by_label(label, k)
    leg, partner = np.full((k, 3), math.nan), np.full(k, -1, dtype=np.int64)
    for c in range(k):
        members = order[first[c] : first[c + 1]]
        if members.shape[0] >= LEG_RETURNS and not known[members[0]]:
            x, y, r = enclosing_circle(points, members)
            if r <= LEG:
                leg[c, 2] = r
                leg[c, 0], leg[c, 1] = middle_of_leg(x, y, r, sensor)
    for c in range(k):
        nearest = PAIR
        for d in range(k):
            apart = math.hypot(leg[c, 0] - leg[d, 0], leg[c, 1] - leg[d, 1])
            if d != c and apart <= nearest:  # never of one that is no leg: NaN
                nearest, partner[c] = apart, d
    renamed, people, j = np.full(k, -1, dtype=np.int64), np.zeros((k, 3)), 0
    for c in range(k):
        d = partner[c]
        if d >= 0 and partner[d] == c:
            if d < c:
                renamed[c] = renamed[d]
                continue
            people[j, 0], people[j, 1] = 0.5 * (leg[c, 0] + leg[d, 0]), 0.5 * (leg[c, 1] + leg[d, 1])
            apart = math.hypot(leg[c, 0] - leg[d, 0], leg[c, 1] - leg[d, 1])
            people[j, 2] = max(PERSON, 0.5 * apart + max(leg[c, 2], leg[d, 2]))
        renamed[c] = j
        j += 1
    for i in range(label.shape[0]):
        label[i] = renamed[label[i]]
    return people[:j]


@kernel
def _smooth(
    points: FloatArray, distance: FloatArray, label: IntArray, sensor: FloatArray, m: int, sides: int, tolerance: float
) -> None:
    """Replace each range by the mean over as many neighbours on either side, on the same surface: lines stay lines.

    A neighbour counts whose range differs by no more than noise makes of it [m], and only with its opposite.
    """
    smoothed = np.empty(m)
    for j in range(m):
        total, count = distance[j], 1
        for k in range(1, sides + 1):
            a, b = j - k, j + k
            if a < 0 or b >= m or label[a] != label[j] or label[b] != label[j]:
                break
            if abs(0.5 * (distance[a] + distance[b]) - distance[j]) > tolerance:
                break
            total += distance[a] + distance[b]
            count += 2
        smoothed[j] = total / count
    for j in range(m):
        for i in range(2):
            points[j, i] = sensor[i] + (points[j, i] - sensor[i]) * (smoothed[j] / distance[j])
        distance[j] = smoothed[j]


@light
def _joined(
    points: FloatArray, distance: FloatArray, known: np.ndarray, a: int, b: int,
    angle: float, sines: tuple[float, float], grazing: float, sigma: float,
) -> bool:  # fmt: skip
    """Whether two returns whose beams are `angle` apart lie on one surface; `sines`: of that and of what `grazing` is beyond it."""
    if known[a] != known[b] or angle >= 0.5 * grazing:
        return False
    near = min(distance[a], distance[b])
    apart = math.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
    return bool(apart <= near * sines[0] / sines[1] + JOIN * math.sqrt(2.0) * sigma)


@kernel
def by_label(label: IntArray, k: int) -> tuple[IntArray, IntArray]:
    """Indices of `label` (m,) sorted by it, stably, and where those of each of the `k` labels begin: (m,), (k + 1,)."""
    first = np.zeros(k + 1, dtype=np.int64)
    for j in range(label.shape[0]):
        first[label[j] + 1] += 1
    for c in range(k):
        first[c + 1] += first[c]
    at, order = first[:k].copy(), np.empty(label.shape[0], dtype=np.int64)
    for j in range(label.shape[0]):
        order[at[label[j]]] = j
        at[label[j]] += 1
    return order, first
