"""Rigid bodies from markers: batched least-squares fits, how surely they place a point, and the layout learnt from a capture.

The fit is Kabsch's (1976, Acta Cryst. A32) with Umeyama's determinant fix (1991, IEEE PAMI 13(4)), the layout a
generalised Procrustes mean (Gower 1975, Psychometrika 40). Millions of fits take seconds, in bounded memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from clearway.geometry.shapes import FloatArray

Seen = npt.NDArray[np.bool_]

SPREAD = 0.01
"""m; markers whose rms distance from their best line is less fix no rotation about it: with 0.5 mm of noise on three
of them the body would tilt by 1.7 degrees."""

CHUNK = 16384
"""Frames that are fitted at once: with eight markers some 20 MB."""

FARTHEST = 1e5
"""m; a marker that is farther from the origin is a damaged number."""

SAMPLE = 2000
"""Frames that a layout is learnt from."""

FLOOR = 1e-6
"""m; noise below this is rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Poses of a body: a point x of the model lies at rotation @ x + translation.

    Attributes:
        rotation: (n, 3, 3) rotation of each frame's fit, NaN with too few markers.
        translation: (n, 3) its translation, m, NaN with too few markers.
        used: (n, m) which markers were fitted.
        residual: (n,) root of the mean squared distance of the used markers from their fit, m.
    """

    rotation: FloatArray
    translation: FloatArray
    used: Seen
    residual: FloatArray

    @property
    def freedom(self) -> Any:
        """(n,) int degrees of freedom of the residual: three a marker, less six of the pose; 0 where nothing was fitted."""
        return np.where(np.isfinite(self.residual), 3 * self.used.sum(axis=1) - 6, 0)

    @property
    def squares(self) -> FloatArray:
        """(n,) m^2, sum of the squared residuals."""
        return np.asarray(self.residual**2 * self.used.sum(axis=1))


def seen_in(xyz: FloatArray) -> Seen:
    """Which markers of (n, m, 3) are there: (n, m)."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(xyz) < FARTHEST).all(axis=2))


def fit(xyz: FloatArray, model: FloatArray, use: Seen | None = None) -> Fit:
    """Fit `model` (m, 3) to the markers `xyz` (n, m, 3) [m, NaN where unseen] of every frame, over those of `use` (n, m).

    A frame with fewer than three markers, or with markers on a line, has no pose.
    """
    use = seen_in(xyz) if use is None else use
    n = len(xyz)
    rotation, translation = np.full((n, 3, 3), np.nan), np.full((n, 3), np.nan)
    residual = np.full(n, np.nan)
    kinds, which = patterns(use)
    enough = (spread(model, kinds) >= SPREAD)[which]
    for start in range(0, n, CHUNK):
        rows = start + np.flatnonzero(enough[start : start + CHUNK])
        if len(rows):
            rotation[rows], translation[rows], residual[rows] = _fit(xyz[rows], model, use[rows])
    return Fit(rotation, translation, use & enough[:, None], residual)


def _fit(xyz: FloatArray, model: FloatArray, use: Seen) -> tuple[FloatArray, FloatArray, FloatArray]:
    weight = use[:, :, None].astype(np.float64)
    count = weight.sum(axis=1)
    there = np.where(use[:, :, None], xyz, 0.0)
    centre, origin = there.sum(axis=1) / count, (weight * model).sum(axis=1) / count
    there = (there - centre[:, None]) * weight
    body = (model - origin[:, None]) * weight
    u, _, vt = np.linalg.svd(body.transpose(0, 2, 1) @ there)
    u[:, :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[:, None]  # a rotation, never a reflection
    rotation = (u @ vt).transpose(0, 2, 1)
    left = there - body @ rotation.transpose(0, 2, 1)
    residual = np.sqrt((left**2).sum(axis=(1, 2)) / count[:, 0])
    return rotation, centre - (rotation @ origin[:, :, None])[:, :, 0], residual


def patterns(use: Seen) -> tuple[Seen, Any]:
    """The different rows of `use` (n, m): (p, m), and for every row which of them it is: (n,) int."""
    packed = np.ascontiguousarray(np.packbits(use, axis=1))
    rows = packed.view(np.dtype((np.void, packed.shape[1]))).ravel()
    _, first, which = np.unique(rows, return_index=True, return_inverse=True)
    return use[first], which


def _scatter(model: FloatArray, kinds: Seen) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of each pattern (p, m): number of markers (p,), their centroid (p, 3), sum of r r^T about it (p, 3, 3)."""
    weight = kinds.astype(np.float64)
    count = weight.sum(axis=1)
    centroid = weight @ model / np.maximum(count, 1)[:, None]
    outer = model[:, :, None] * model[:, None, :]
    second = np.tensordot(weight, outer, axes=1)
    return count, centroid, second - count[:, None, None] * centroid[:, :, None] * centroid[:, None, :]


def spread(model: FloatArray, kinds: Seen) -> FloatArray:
    """How far the markers of each pattern (p, m) lie from their best line: rms distance, m; 0 below three markers."""
    centred = model - model.mean(axis=0)  # spares digits
    count, _, second = _scatter(centred, kinds)
    values = np.maximum(np.linalg.eigvalsh(second), 0.0)
    wide = np.sqrt(values[:, :2].sum(axis=1) / np.maximum(count, 1))
    return np.asarray(np.where(count >= 3, wide, 0.0))


def variance_at(model: FloatArray, kinds: Seen, point: FloatArray) -> FloatArray:
    """How a marker's noise reaches the pose, of each pattern: (p, 2), NaN where there is no pose.

    To be multiplied with the variance of a marker's coordinate: the variance of the horizontal position of `point` (3,)
    [m, model frame, z up], along one axis (the mean of both), and of the heading [rad^2 / m^2]. From the normal equations of
    the fit: the rotation's covariance is the inverse of sum(|r|^2 I - r r^T) about the seen markers' centroid c, and
    the point's that of c plus the rotation's over the lever arm point - c.
    """
    out = np.full((len(kinds), 2), np.nan)
    good = np.flatnonzero(spread(model, kinds) >= SPREAD)
    if not len(good):
        return out
    middle = model.mean(axis=0)
    count, centroid, second = _scatter(model - middle, kinds[good])
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    turning = np.linalg.inv(inertia)
    x, y, z = (point - middle - centroid).T
    zero = np.zeros_like(x)
    cross = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), axis=1).reshape(-1, 3, 3)  # d theta x arm, up to sign
    swing = cross @ turning @ cross.transpose(0, 2, 1)
    out[good, 0] = 1 / count + (swing[:, 0, 0] + swing[:, 1, 1]) / 2
    out[good, 1] = turning[:, 2, 2]
    return out


def noise_of(done: Fit) -> float | None:
    """Standard deviation of a marker's coordinate from the residuals, m, None without any.

    The median over frames of sum / median of chi^2 with 3 k - 6 degrees of freedom: frames with swapped or strayed
    markers don't move it.
    """
    freedom = done.freedom
    rows = np.flatnonzero(freedom > 0)
    if not len(rows):
        return None
    usual = scipy.stats.chi2.median(np.arange(freedom.max() + 1))
    return max(FLOOR, float(np.sqrt(np.median(done.squares[rows] / usual[freedom[rows]]))))


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Where the markers sit on a body.

    Attributes:
        model: (m, 3) where the markers sit, m, NaN for one that is not kept.
        kept: (m,) which are kept.
        never: (m,) which were never seen together with the kept ones.
        loose: (m,) which are not rigidly connected to them.
    """

    model: FloatArray
    kept: Seen
    never: Seen
    loose: Seen


def learn(xyz: FloatArray, limit: float) -> Layout:
    """The layout that a capture (n, m, 3) itself shows, z up, origin in the centroid, x towards the first marker.

    Distances between markers (their medians: a swapped pair doesn't move them) make a first layout by classical
    scaling (Torgerson 1952), a Procrustes mean over the frames refines it. A marker whose distances to the others vary
    by more than `limit` [m] is loose and left out. Fewer than three kept ones: no layout (`kept` says which).
    """
    seen = seen_in(xyz)
    rows = frames_to_learn(seen)
    xyz, seen = np.where(seen[rows][:, :, None], xyz[rows], np.nan), seen[rows]
    distance, vary = _distances(xyz)
    kept = seen.any(axis=0)
    never, loose = ~kept, np.zeros_like(kept)
    while (missing := np.isnan(distance[np.ix_(kept, kept)]).sum(axis=1)).any():
        worst = np.flatnonzero(kept)[missing.argmax()]
        kept[worst], never[worst] = False, True
    while kept.sum() > 2 and (typical := np.median(vary[np.ix_(kept, kept)], axis=1)).max() > limit:
        worst = np.flatnonzero(kept)[typical.argmax()]
        kept[worst], loose[worst] = False, True
    model = np.full((len(kept), 3), np.nan)
    if kept.sum() >= 3:
        first = _scaled(distance[np.ix_(kept, kept)])
        if spread(first, np.ones((1, len(first)), dtype=bool))[0] >= SPREAD:
            both = (first, first * np.array((1.0, 1.0, -1.0)))
            scores = [float(np.nanmedian(fit(xyz[:, kept], one).residual)) for one in both]
            model[kept] = _levelled(*refine(xyz[:, kept], both[int(np.argmin(scores))]))
        else:
            model[kept] = first
    return Layout(model, kept, never, loose)


def frames_to_learn(seen: Seen) -> Any:
    """Frames to learn from: evenly over the capture, of those that show the most markers."""
    count = seen.sum(axis=1)
    good = np.flatnonzero(count >= 3)
    full = good[count[good] == count.max()] if len(good) else good
    rows = full if len(full) >= min(SAMPLE, len(good)) / 4 else good
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(SAMPLE, len(rows))).round().astype(int))]


def _distances(xyz: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Median distance between each pair of markers and its usual deviation, m: (m, m) each, NaN where never together."""
    m = xyz.shape[1]
    distance, vary = np.full((m, m), np.nan), np.full((m, m), np.nan)
    for i in range(m):
        apart = np.sqrt(((xyz - xyz[:, i : i + 1]) ** 2).sum(axis=2))
        for j in range(m):
            values = apart[:, j][np.isfinite(apart[:, j])]
            if len(values):
                distance[i, j] = np.median(values)
                vary[i, j] = 1.4826 * np.median(np.abs(values - distance[i, j]))
    return distance, vary


def _scaled(distance: FloatArray) -> FloatArray:
    """Points (m, 3) with these distances (m, m), up to a motion and a reflection."""
    m = len(distance)
    centring = np.eye(m) - 1 / m
    values, vectors = np.linalg.eigh(-0.5 * centring @ distance**2 @ centring)
    return np.asarray(vectors[:, -3:] * np.sqrt(np.maximum(values[-3:], 0.0)))


def refine(xyz: FloatArray, model: FloatArray, rounds: int = 10) -> tuple[FloatArray, FloatArray]:
    """The Procrustes mean (m, 3) of the frames' markers, begun from `model`, and the rotations (k, 3, 3) of the good ones.

    Frames whose residual is more than three times the usual one (swapped, strayed) are left out. Where a marker is
    never seen, its place in `model` stays. A mean's frame is that of the rounds before: it may drift by the noise.
    """
    rotation = np.empty((0, 3, 3))
    for _ in range(rounds):
        done = fit(xyz, model)
        usual = np.nanmedian(done.residual) if np.isfinite(done.residual).any() else 0.0
        with np.errstate(invalid="ignore"):
            good = done.residual <= 3 * usual + FLOOR
        if not good.any():
            break
        rotation = done.rotation[good]
        back = (xyz[good] - done.translation[good][:, None]) @ rotation
        count = np.isfinite(back[:, :, 0]).sum(axis=0)[:, None]
        mean = np.where(count > 0, np.nansum(back, axis=0) / np.maximum(count, 1), model)
        change = float(np.abs(mean - model).max())
        model = mean
        if change < 1e-6:
            break
    return model, rotation


def _levelled(model: FloatArray, rotation: FloatArray) -> FloatArray:
    """The layout in its own frame: z is what was up in most frames, origin the centroid, x towards the first marker
    that is at least half as far from the axis as the farthest."""
    up = np.median(rotation[:, 2, :], axis=0) if len(rotation) else np.array((0.0, 0.0, 1.0))
    z = up / np.linalg.norm(up)
    centred = model - model.mean(axis=0)
    flat = centred - (centred @ z)[:, None] * z
    far = np.linalg.norm(flat, axis=1)
    x = flat[int(np.argmax(far >= 0.5 * far.max()))]
    x = x / np.linalg.norm(x)
    return np.asarray(centred @ np.stack((x, np.cross(z, x), z), axis=1))
