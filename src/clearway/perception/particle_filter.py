"""Kernels of the particle filter behind AMCL: motion, likelihood field, KLD resampling, clusters.

Particles are (n, 3) poses in the map frame; their headings are not wrapped. Behaviour after ROS's `amcl`
(`pf.c`, `pf_kdtree.c`, `amcl_odom.cpp`, `amcl_laser.cpp`), which follows Thrun, Burgard and Fox, *Probabilistic
Robotics* (2005), tables 5.6, 6.3 and 8.4, and Fox, *KLD-sampling* (2001).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray

BIN_XY, BIN_YAW = 0.5, math.radians(10.0)
"""Edges of the histogram's bins, m and rad (fixed in `pf_kdtree.c`)."""

_EMPTY = -1
_OFFSET = 1 << 20  # bins are counted from here, so that their packed key is never negative


@kernel
def move(
    poses: FloatArray,
    old: FloatArray,
    new: FloatArray,
    alpha: FloatArray,
    corrected: bool,
    rng: np.random.Generator,
) -> None:
    """Move every particle by the odometry's step from `old` to `new` (3,), each with an error of its own.

    Args:
        poses: (n, 3), changed in place.
        alpha: (4,) odom_alpha1..4.
        corrected: `diff-corrected`; else `diff`, which takes the variances for standard deviations, as ROS does.
    """
    dx, dy = new[0] - old[0], new[1] - old[1]
    translation = math.hypot(dx, dy)
    first = wrap(math.atan2(dy, dx) - old[2]) if translation >= 0.01 else 0.0
    second = wrap(wrap(new[2] - old[2]) - first)
    # driving backwards is a motion, not half a turn
    first_noise = min(abs(first), abs(wrap(first - math.pi)))
    second_noise = min(abs(second), abs(wrap(second - math.pi)))
    t2, f2, s2 = translation**2, first_noise**2, second_noise**2
    spread_first = alpha[0] * f2 + alpha[1] * t2
    spread_t = alpha[2] * t2 + alpha[3] * (f2 + s2)
    spread_second = alpha[0] * s2 + alpha[1] * t2
    if corrected:
        spread_first, spread_t, spread_second = math.sqrt(spread_first), math.sqrt(spread_t), math.sqrt(spread_second)
    for i in range(poses.shape[0]):
        a = first - spread_first * rng.standard_normal()
        d = translation - spread_t * rng.standard_normal()
        b = second - spread_second * rng.standard_normal()
        poses[i, 0] += d * math.cos(poses[i, 2] + a)
        poses[i, 1] += d * math.sin(poses[i, 2] + a)
        poses[i, 2] += a + b


@kernel
def move_anywhere(
    poses: FloatArray,
    old: FloatArray,
    new: FloatArray,
    alpha: FloatArray,
    corrected: bool,
    rng: np.random.Generator,
) -> None:
    """`move` for a base that moves to its sides as well: `omni` and, where `corrected`, `omni-corrected`.

    Args:
        poses: (n, 3), changed in place.
        alpha: (5,) odom_alpha1..5.
    """
    dx, dy = new[0] - old[0], new[1] - old[1]
    translation, turn = math.hypot(dx, dy), wrap(new[2] - old[2])
    course = math.atan2(dy, dx) - old[2]
    t2, r2 = translation**2, turn**2
    along, across = alpha[2] * t2 + alpha[0] * r2, alpha[4] * t2 + alpha[0] * r2
    about = alpha[3] * r2 + alpha[1] * t2
    if corrected:
        along, across, about = math.sqrt(along), math.sqrt(across), math.sqrt(about)
    for i in range(poses.shape[0]):
        c, s = math.cos(poses[i, 2] + course), math.sin(poses[i, 2] + course)
        d = translation + along * rng.standard_normal()
        turned = turn + about * rng.standard_normal()
        aside = across * rng.standard_normal()
        poses[i, 0] += d * c + aside * s
        poses[i, 1] += d * s - aside * c
        poses[i, 2] += turned


@kernel
def beam_ends(
    ranges: FloatArray,
    angle_min: float,
    angle_increment: float,
    mount: FloatArray,
    step: int,
    range_min: float,
    range_max: float,
) -> FloatArray:
    """Ends (k, 2) in base_link of every `step`-th beam that returned something between the two ranges."""
    ends = np.empty((ranges.shape[0] // step + 1, 2))
    k = 0
    for i in range(0, ranges.shape[0], step):
        r = ranges[i]
        if range_min < r < range_max:  # false for nan
            angle = mount[2] + angle_min + i * angle_increment
            ends[k, 0] = mount[0] + r * math.cos(angle)
            ends[k, 1] = mount[1] + r * math.sin(angle)
            k += 1
    return ends[:k]


@kernel
def weigh(
    poses: FloatArray,
    weights: FloatArray,
    ends: FloatArray,
    field: FloatArray,
    outside: float,
    origin_x: float,
    origin_y: float,
    resolution: float,
    product: bool,
) -> float:
    """Multiply the weights by the likelihood of a scan and normalise them; their mean before that.

    Args:
        poses: (n, 3) of the particles.
        weights: (n,), changed in place.
        ends: (k, 2) of `beam_ends`.
        field: (rows, cols) what a beam that ends in this cell contributes.
        outside: The same off the map.
        product: Contributions are logarithms of factors; else they are added to 1, as `likelihood_field` does.
    """
    n, k = poses.shape[0], ends.shape[0]
    rows, cols = field.shape
    total: float = 0.0
    for i in range(n):
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        x, y = poses[i, 0] - origin_x, poses[i, 1] - origin_y
        p = 0.0
        for j in range(k):
            col = math.floor((x + c * ends[j, 0] - s * ends[j, 1]) / resolution)
            row = math.floor((y + s * ends[j, 0] + c * ends[j, 1]) / resolution)
            p += field[row, col] if 0 <= row < rows and 0 <= col < cols else outside
        weights[i] *= math.exp(p) if product else 1.0 + p
        total += weights[i]
    if total > 0.0:
        for i in range(n):
            weights[i] /= total
    else:
        weights[:] = 1.0 / n
    return float(total / n)


@kernel
def resample(
    poses: FloatArray,
    weights: FloatArray,
    drawn: FloatArray,
    free: FloatArray,
    cell: float,
    random_share: float,
    bounds: npt.NDArray[np.int64],
    kld_err: float,
    kld_z: float,
    rng: np.random.Generator,
) -> int:
    """Draw particles by weight until the KLD bound holds for the bins that they fill.

    Args:
        poses: (n, 3) of the particles.
        weights: (n,), sum 1.
        drawn: (bounds[1], 3), filled.
        free: (k, 2) lower corners of free cells of edge `cell`; a share `random_share` is drawn from there instead.
        bounds: Fewest and most particles.

    Returns:
        How many were drawn.
    """
    n = poses.shape[0]
    cumulative = np.empty(n)
    total = 0.0
    for i in range(n):
        total += weights[i]
        cumulative[i] = total
    keys = np.full(_table_size(drawn.shape[0]), _EMPTY, np.int64)
    bins = count = limit = 0
    while count < bounds[1]:
        if random_share > 0.0 and rng.random() < random_share:
            i = int(rng.random() * free.shape[0])
            drawn[count, 0] = free[i, 0] + cell * rng.random()
            drawn[count, 1] = free[i, 1] + cell * rng.random()
            drawn[count, 2] = math.pi * (2.0 * rng.random() - 1.0)
        else:
            aim = rng.random() * total
            low, high = 0, n - 1  # the first whose cumulative weight exceeds the aim
            while low < high:
                middle = (low + high) // 2
                if cumulative[middle] > aim:
                    high = middle
                else:
                    low = middle + 1
            drawn[count, 0], drawn[count, 1], drawn[count, 2] = poses[low, 0], poses[low, 1], poses[low, 2]
        key = _bin(drawn[count, 0], drawn[count, 1], drawn[count, 2])
        slot = _slot(keys, key)
        if keys[slot] == _EMPTY:
            keys[slot] = key
            bins += 1
            limit = kld_limit(bins, bounds[0], bounds[1], kld_err, kld_z)
        count += 1
        if count > limit:
            break
    return count


@kernel
def kld_limit(bins: int, fewest: int, most: int, kld_err: float, kld_z: float) -> int:
    """How many particles hold the KLD error below `kld_err` when they fill `bins` bins (Fox 2001, eq. 7).

    A single bin says nothing about the spread: it asks for the most, as in `pf.c`.
    """
    if bins <= 1:
        return most
    b = 2.0 / (9.0 * (bins - 1))
    n = math.ceil((bins - 1) / (2.0 * kld_err) * (1.0 - b + math.sqrt(b) * kld_z) ** 3)
    return int(min(max(n, fewest), most))


@kernel
def best_cluster(poses: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted mean pose (3,) of the heaviest cluster: bins that touch, also at a corner, belong together."""
    n = poses.shape[0]
    size = _table_size(n)
    keys = np.full(size, _EMPTY, np.int64)
    labels = np.full(size, -1, np.int64)
    slots = np.empty(n, np.int64)
    filled = np.empty(n, np.int64)
    bins = 0
    for i in range(n):
        key = _bin(poses[i, 0], poses[i, 1], poses[i, 2])
        slot = _slot(keys, key)
        if keys[slot] == _EMPTY:
            keys[slot] = key
            filled[bins] = slot
            bins += 1
        slots[i] = slot

    clusters = 0
    stack = np.empty(bins, np.int64)
    for f in range(bins):
        if labels[filled[f]] >= 0:
            continue
        labels[filled[f]] = clusters
        stack[0] = filled[f]
        depth = 1
        while depth > 0:
            depth -= 1
            key = keys[stack[depth]]
            for dx in range(-1, 2):
                for dy in range(-1, 2):
                    for da in range(-1, 2):
                        slot = _slot(keys, key + (dx << 42) + (dy << 21) + da)
                        if keys[slot] != _EMPTY and labels[slot] < 0:
                            labels[slot] = clusters
                            stack[depth] = slot
                            depth += 1
        clusters += 1

    sums = np.zeros((clusters, 5))
    for i in range(n):
        w, label = weights[i], labels[slots[i]]
        sums[label, 0] += w
        sums[label, 1] += w * poses[i, 0]
        sums[label, 2] += w * poses[i, 1]
        sums[label, 3] += w * math.cos(poses[i, 2])
        sums[label, 4] += w * math.sin(poses[i, 2])
    best = sums[np.argmax(sums[:, 0])]
    return np.array((best[1] / best[0], best[2] / best[0], math.atan2(best[4], best[3])))


@light
def _bin(x: float, y: float, yaw: float) -> int:
    column, row = math.floor(x / BIN_XY) + _OFFSET, math.floor(y / BIN_XY) + _OFFSET
    turn = math.floor(yaw / BIN_YAW) + _OFFSET
    return int((column << 42) | (row << 21) | turn)


@light
def _slot(keys: npt.NDArray[np.int64], key: int) -> int:
    """Where `key` stands in the open-addressing table, or the empty slot where it would stand."""
    mask = keys.shape[0] - 1
    mixed = (key ^ (key >> 21) * 73856093 ^ (key >> 42) * 19349663) * 83492791
    slot = int((mixed ^ (mixed >> 23)) & mask)
    while keys[slot] != _EMPTY and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@kernel
def _table_size(n: int) -> int:
    """A power of two that leaves at least half of the table empty."""
    size = 64
    while size < 2 * n:
        size *= 2
    return size
