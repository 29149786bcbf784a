"""Kernels of the mapper: matching a scan with a particle's map, the improved proposal, drawing the map.

A particle's map holds, for each cell, how many beams ended there and the mean of their ends: ROS's GMapping, too,
keeps the free cells out of the filter and draws them once, at the end, along the best particle's path
(`gridslamprocessor`, `scanmatcher`, `smmap.h`; Grisetti, Stachniss and Burgard, *Improved techniques for grid
mapping with Rao-Blackwellized particle filters*, 2007).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

NO_HIT = -0.5
"""Log-likelihood of a beam that ends near no wall, before it is divided by lsigma (`ScanMatcher::nullLikelihood`)."""

CONDITIONING_XY, CONDITIONING_YAW = 0.01, 0.001
"""Added to the odometry's covariance, m^2 and rad^2 (`motionmodel.cpp`)."""

Cells = npt.NDArray[np.float32]
"""A particle's map (3, rows, cols): mean x and y of the ends in a cell, m from the map's origin (inf: none); their number."""


@kernel
def predict(poses: FloatArray, old: FloatArray, new: FloatArray, noise: FloatArray, rng: np.random.Generator) -> None:
    """Move every particle (n, 3) in place by the odometry's step from `old` to `new`, each with an error of its own.

    Args:
        noise: (4,) srr, srt, str, stt; standard deviations proportional to the step.
    """
    c, s = math.cos(old[2]), math.sin(old[2])
    dx, dy, da = new[0] - old[0], new[1] - old[1], wrap(new[2] - old[2])
    x, y = c * dx + s * dy, c * dy - s * dx
    srr, srt, str_, stt = noise[0], noise[1], noise[2], noise[3]
    spread_x = srr * abs(x) + str_ * abs(da) + 0.3 * srr * abs(y)
    spread_y = srr * abs(y) + str_ * abs(da) + 0.3 * srr * abs(x)
    spread_a = stt * abs(da) + srt * math.hypot(x, y)
    for i in range(poses.shape[0]):
        nx = x + spread_x * rng.standard_normal()
        ny = y + spread_y * rng.standard_normal()
        na = da + spread_a * rng.standard_normal()
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        poses[i, 0] += c * nx - s * ny
        poses[i, 1] += s * nx + c * ny
        poses[i, 2] = wrap(poses[i, 2] + na)


@kernel
def beams(
    ranges: FloatArray, angle_min: float, angle_increment: float, mount: FloatArray, usable: float, farthest: float
) -> FloatArray:
    """The scan's beams (n, 5) in base_link: end x, y; direction x, y; whether a wall was hit there (1) or not (0).

    A beam longer than `farthest` (or without return) is dropped, one longer than `usable` is cut off there.
    """
    out = np.empty((ranges.shape[0], 5))
    n = 0
    for i in range(ranges.shape[0]):
        r = ranges[i]
        if not 0.0 < r <= farthest:
            continue
        angle = mount[2] + angle_min + i * angle_increment
        c, s = math.cos(angle), math.sin(angle)
        length = min(r, usable)
        out[n, 0], out[n, 1] = mount[0] + length * c, mount[1] + length * s
        out[n, 2], out[n, 3] = c, s
        out[n, 4] = 1.0 if r < usable else 0.0
        n += 1
    return out[:n]


@kernel
def fit(
    cells: Cells,
    origin: FloatArray,
    delta: float,
    scan: FloatArray,
    pose: FloatArray,
    around: tuple[int, ...],
    sigma: float,
    lsigma: float,
) -> tuple[float, float]:
    """How well a scan fits a map from a pose: the score that is climbed, and the log-likelihood.

    For each beam, the nearest mean end in the cells around its end counts. GMapping's source also asks that the cell
    in front of it be free, but looks that up at a place where the map is empty; done as meant, the check drags the
    robot towards the near side of a thickening wall, so it is left out.

    Args:
        cells: (3, rows, cols) a particle's map.
        origin: (2,) of its lower-left corner, m.
        scan: (n, 5) from `beams`, hits only.
        around: Offsets of the cells to search, -k to k; a tuple, so that the loops over them are unrolled.
        sigma: Standard deviation for the score, m; 0: the score is not wanted. It is documented as such; GMapping's source
            divides d^2 by sigma itself, which has no consistent unit and gives a score so flat that small errors add up.
        lsigma: Standard deviation for the likelihood, m.
    """
    _, rows, cols = cells.shape
    reach = len(around) // 2
    per_metre = 1.0 / delta
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x0, y0 = pose[0] - origin[0], pose[1] - origin[1]
    score = likelihood = 0.0
    missed = NO_HIT / lsigma
    nothing: Any = np.float32(np.inf)
    for i in range(scan.shape[0]):
        x = x0 + c * scan[i, 0] - s * scan[i, 1]
        y = y0 + s * scan[i, 0] + c * scan[i, 1]
        col, row = int(x * per_metre), int(y * per_metre)
        best = nothing
        if reach <= row < rows - reach and reach <= col < cols - reach:
            px, py = np.float32(x), np.float32(y)
            for j in around:
                for k in around:
                    r, q = np.uint64(row + j), np.uint64(col + k)  # unsigned: no wrap-around to check
                    dx, dy = px - cells[0, r, q], py - cells[1, r, q]
                    best = min(best, dx * dx + dy * dy)
        if best < nothing:
            if sigma > 0.0:
                score += math.exp(-best / (2.0 * sigma * sigma))
            likelihood -= best / (2.0 * lsigma * lsigma)
        else:
            likelihood += missed
    return score, likelihood


@kernel
def climb(
    cells: Cells,
    origin: FloatArray,
    delta: float,
    scan: FloatArray,
    pose: FloatArray,
    around: tuple[int, ...],
    sigma: float,
    lstep: float,
    astep: float,
    iterations: int,
) -> tuple[FloatArray, float]:
    """Climb the score from `pose` by steps along x, y and theta, halved whenever none helps; the pose and its score."""
    best = pose.copy()
    score, _ = fit(cells, origin, delta, scan, best, around, sigma, 1.0)
    halved = 0
    while halved < iterations:
        found = best
        found_score = score
        for axis in range(3):
            for sign in (1.0, -1.0):
                trial = best.copy()
                trial[axis] += sign * (astep if axis == 2 else lstep)
                trial_score, _ = fit(cells, origin, delta, scan, trial, around, sigma, 1.0)
                if trial_score > found_score:
                    found, found_score = trial, trial_score
        if found_score > score:
            best, score = found, found_score
        else:
            lstep, astep = 0.5 * lstep, 0.5 * astep
            halved += 1
    best[2] = wrap(best[2])
    return best, score


@kernel
def propose(
    cells: Cells,
    origin: FloatArray,
    delta: float,
    scan: FloatArray,
    matched: FloatArray,
    expected: FloatArray,
    step: FloatArray,
    noise: FloatArray,
    around: tuple[int, ...],
    lsigma: float,
    window: FloatArray,
    rng: np.random.Generator,
) -> tuple[FloatArray, float]:
    """Draw a pose from the improved proposal, and the log of the particle's weight (Grisetti 2007, eqs. 15-19).

    Points on a small lattice around the matched pose are weighed by the scan's likelihood and the odometry's; a
    Gaussian is fitted to them. The weight is their mean, with the odometry's density scaled to 1 at its peak, so that
    it compares with the plain likelihood of a particle whose matching failed.

    Args:
        matched: (3,) pose after matching.
        expected: (3,) pose by odometry alone.
        step: (2,) metres and radians moved.
        noise: (4,) srr, srt, str, stt.
        window: (4,) llsamplerange, llsamplestep, lasamplerange, lasamplestep.
    """
    spread_xy = noise[0] * step[0] + noise[2] * step[1]
    spread_yaw = noise[1] * step[0] + noise[3] * step[1]
    var_xy, var_yaw = spread_xy**2 + CONDITIONING_XY, spread_yaw**2 + CONDITIONING_YAW
    n, m = int(window[0] / window[1] + 1e-9), int(window[2] / window[3] + 1e-9)
    total = (2 * n + 1) ** 2 * (2 * m + 1)
    points = np.empty((total, 3))
    logs = np.empty(total)
    pose = np.empty(3)
    top = -np.inf
    k = 0
    for i in range(-n, n + 1):
        for j in range(-n, n + 1):
            for a in range(-m, m + 1):
                points[k, 0], points[k, 1], points[k, 2] = i * window[1], j * window[1], a * window[3]
                for axis in range(3):
                    pose[axis] = matched[axis] + points[k, axis]
                _, logs[k] = fit(cells, origin, delta, scan, pose, around, 0.0, lsigma)
                dx, dy, da = pose[0] - expected[0], pose[1] - expected[1], wrap(pose[2] - expected[2])
                logs[k] -= 0.5 * ((dx * dx + dy * dy) / var_xy + da * da / var_yaw)
                top = max(top, logs[k])
                k += 1
    mass = 0.0
    centre = np.zeros(3)
    for k in range(total):
        logs[k] = math.exp(logs[k] - top)  # from here on: shares
        mass += logs[k]
        for axis in range(3):
            centre[axis] += logs[k] * points[k, axis]
    for axis in range(3):
        centre[axis] /= mass
    cov = np.zeros((3, 3))
    for k in range(total):
        for i in range(3):
            for j in range(3):
                cov[i, j] += logs[k] / mass * (points[k, i] - centre[i]) * (points[k, j] - centre[j])
    for axis in range(3):
        cov[axis, axis] += 1e-12
    weight = top + math.log(mass / total)
    # the lower factor of cov, written out: three rows need no library
    l00 = math.sqrt(cov[0, 0])
    l10, l20 = cov[1, 0] / l00, cov[2, 0] / l00
    l11 = math.sqrt(max(cov[1, 1] - l10 * l10, 0.0)) + 1e-12
    l21 = (cov[2, 1] - l20 * l10) / l11
    l22 = math.sqrt(max(cov[2, 2] - l20 * l20 - l21 * l21, 0.0))
    e0, e1, e2 = rng.standard_normal(), rng.standard_normal(), rng.standard_normal()
    drawn = np.empty(3)
    drawn[0] = matched[0] + centre[0] + l00 * e0
    drawn[1] = matched[1] + centre[1] + l10 * e0 + l11 * e1
    drawn[2] = wrap(matched[2] + centre[2] + l20 * e0 + l21 * e1 + l22 * e2)
    return drawn, weight


@kernel
def register(cells: Cells, origin: FloatArray, delta: float, scan: FloatArray, pose: FloatArray) -> None:
    """Add a scan's hits (n, 5) to a particle's map."""
    _, rows, cols = cells.shape
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(scan.shape[0]):
        x = pose[0] + c * scan[i, 0] - s * scan[i, 1] - origin[0]
        y = pose[1] + s * scan[i, 0] + c * scan[i, 1] - origin[1]
        col, row = math.floor(x / delta), math.floor(y / delta)
        if 0 <= row < rows and 0 <= col < cols:
            cells[2, row, col] += 1.0
            n = cells[2, row, col]
            cells[0, row, col] = x if n == 1.0 else cells[0, row, col] + (x - cells[0, row, col]) / n
            cells[1, row, col] = y if n == 1.0 else cells[1, row, col] + (y - cells[1, row, col]) / n


@kernel
def draw(
    hits: npt.NDArray[np.int32],
    visits: npt.NDArray[np.int32],
    origin: FloatArray,
    delta: float,
    mount: FloatArray,
    scan: FloatArray,
    pose: FloatArray,
) -> None:
    """Count a scan (n, 5) into a map: each cell that a beam crosses is visited, the one where it ends is also hit."""
    rows, cols = hits.shape
    c, s = math.cos(pose[2]), math.sin(pose[2])
    col0 = math.floor((pose[0] + c * mount[0] - s * mount[1] - origin[0]) / delta)
    row0 = math.floor((pose[1] + s * mount[0] + c * mount[1] - origin[1]) / delta)
    for i in range(scan.shape[0]):
        col1 = math.floor((pose[0] + c * scan[i, 0] - s * scan[i, 1] - origin[0]) / delta)
        row1 = math.floor((pose[1] + s * scan[i, 0] + c * scan[i, 1] - origin[1]) / delta)
        steps = max(abs(col1 - col0), abs(row1 - row0))
        for k in range(steps):  # the digital line from the sensor's cell up to, but not into, the last one
            col = col0 + math.floor(0.5 + k * (col1 - col0) / steps)
            row = row0 + math.floor(0.5 + k * (row1 - row0) / steps)
            if 0 <= row < rows and 0 <= col < cols:
                visits[row, col] += 1
        if scan[i, 4] > 0.0 and 0 <= row1 < rows and 0 <= col1 < cols:
            visits[row1, col1] += 1
            hits[row1, col1] += 1


@kernel
def extent(scan: FloatArray, poses: FloatArray, mount: FloatArray) -> FloatArray:
    """Smallest and largest x and y (4,) that a scan (n, 5) and its sensor reach from any of the poses (m, 3)."""
    box = np.array((np.inf, np.inf, -np.inf, -np.inf))
    for j in range(poses.shape[0]):
        c, s = math.cos(poses[j, 2]), math.sin(poses[j, 2])
        for i in range(-1, scan.shape[0]):
            ex, ey = (mount[0], mount[1]) if i < 0 else (scan[i, 0], scan[i, 1])
            x, y = poses[j, 0] + c * ex - s * ey, poses[j, 1] + s * ex + c * ey
            box[0], box[1] = min(box[0], x), min(box[1], y)
            box[2], box[3] = max(box[2], x), max(box[3], y)
    return box
