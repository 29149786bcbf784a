"""Ties a source's frame to the map: by static poses of the robot at rest on known places, by surveyed points, or as given.

A tie is planar and rigid: no scale, no mirror. Both are looked for, as millimetres and left-handed or Y-up exports are
the common mistakes, and refused by name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Motion

REFUSED = 10.0
"""A residual above so many standard uncertainties is no scatter but a mistake."""
DOUBTFUL = 3.0
"""Above so many, it is said."""
BLOCK = 0.25
"""s; a static pose is averaged in stretches of this length, whose scatter shows what the mean is worth."""


@dataclass(frozen=True, slots=True, eq=False)
class Tie:
    """A source's frame in the map.

    Attributes:
        pose: (3,) pose of the source's frame in the map: x, y [m], theta [rad].
        sigma: (2,) standard uncertainty of a place at `pivot` [m] and of the heading [rad], NaN if unknown; farther off
            the lever arm adds.
        residuals: (k,) m, how far each static pose or point lies from where the tie puts it.
        note: What was done, in a sentence.
        pivot: (2,) x, y of the point at which `sigma` holds, m, in the source's frame.
    """

    pose: FloatArray
    sigma: FloatArray
    residuals: FloatArray
    note: str
    pivot: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class StaticPose:
    """The robot at rest.

    Attributes:
        pose: (3,) mean pose in the source's frame: x, y [m], theta [rad], NaN without a heading.
        sigma: (2,) standard uncertainty of that mean by its scatter alone: position [m], heading [rad].
    """

    pose: FloatArray
    sigma: FloatArray


def static_pose(
    motion: Motion, span: tuple[float, float] | None = None, *, moved: float = 0.005, turned: float = 0.01
) -> StaticPose:
    """Where the robot stood in `span` [s on the motion's clock; default: all of it], by medians.

    Raises:
        ClearwayError: it was seen for less than four blocks of `BLOCK`, or moved by more than `moved` [m] or `turned`
            [rad], as the medians of these blocks tell.
    """
    start, end = (float(motion.t[0]), float(motion.t[-1])) if span is None and len(motion.t) else span or (0.0, 0.0)
    there = (motion.t >= start) & (motion.t <= end) & np.isfinite(motion.pose[:, :2]).all(axis=1)
    t, pose = motion.t[there], motion.pose[there]
    blocks = np.floor((t - start) / BLOCK).astype(np.int64)
    medians = np.array([np.median(pose[blocks == b], axis=0) for b in np.unique(blocks)]).reshape(-1, 3)
    if len(medians) < 4:
        seen = len(medians) * BLOCK
        raise ClearwayError(
            f"the static pose from {start:g} s to {end:g} s shows the robot for {seen:g} s; at least {4 * BLOCK:g} s are needed"
        )
    middle = np.median(pose, axis=0)
    away = float(np.hypot(*(medians[:, :2] - middle[:2]).T).max())
    if away > moved:
        raise ClearwayError(
            f"the robot moved by {away:.3f} m in the static pose from {start:g} s to {end:g} s; at rest it may move by {moved:g} m. "
            + _longest_rest(t, pose, moved)
        )
    swing = float(np.abs(medians[:, 2] - middle[2]).max())
    if swing > turned:
        raise ClearwayError(
            f"the robot turned by {swing:.3f} rad in the static pose from {start:g} s to {end:g} s; at rest it may turn by "
            f"{turned:g} rad"
        )
    spread = medians.std(axis=0, ddof=1) * math.sqrt(math.pi / 2 / len(medians))  # of a median of medians
    return StaticPose(middle, np.array([math.hypot(spread[0], spread[1]) / math.sqrt(2), spread[2]]))


def _longest_rest(t: FloatArray, pose: FloatArray, moved: float) -> str:
    """For people: the longest stretch in which nothing left a square of `moved`."""
    thin = max(1, len(t) // 1000)
    t, pose = t[::thin], pose[::thin]
    best, first = (0.0, 0.0), 0
    for last in range(len(t)):
        while np.ptp(pose[first : last + 1, :2], axis=0).max() > moved:
            first += 1
        if t[last] - t[first] > best[1] - best[0]:
            best = float(t[first]), float(t[last])
    return f"It rested longest from {best[0]:.2f} s to {best[1]:.2f} s"


def tie_by_static_poses(measured: FloatArray, known: FloatArray, sigma: tuple[float, float] = (0.005, 0.01)) -> Tie:
    """From the robot at rest on known poses.

    Positions and headings weigh as their uncertainties say. One static pose will do with its heading, of two and more the
    residuals tell how well they agree.

    Args:
        measured: (k, 3) base_link in the source's frame.
        known: (k, 3) the same in the map. A heading may be NaN.
        sigma: Standard uncertainty of one pair, of known pose and measurement together: m (each axis), rad.

    Raises:
        ClearwayError: too little to tie by, places that fit only with another scale or as a mirror image, or a hold
            that doesn't fit the others.
    """
    a, b = _pairs(measured, known, 3, "static pose")
    return _tie(a, b, sigma, "static pose")


def tie_by_points(measured: FloatArray, known: FloatArray, sigma: float = 0.005) -> Tie:
    """From at least two surveyed places; from three on, a wrong one is named.

    Args:
        measured: (k, 2) in the source's frame.
        known: (k, 2) in the map.
        sigma: Standard uncertainty of one pair, m.

    Raises:
        ClearwayError: as `tie_by_static_poses`.
    """
    a, b = _pairs(measured, known, 2, "surveyed point")
    none = np.full((len(a), 1), np.nan)
    return _tie(np.hstack([a, none]), np.hstack([b, none]), (sigma, math.inf), "surveyed point")


def given(pose: FloatArray, sigma: tuple[float, float] | None = None) -> Tie:
    """The tie that somebody measured.

    Args:
        pose: (3,) of the source's frame in the map.
        sigma: Standard uncertainty, m at the frame's origin and rad; None if unknown: then that of every motion that is
            moved by it is.

    Raises:
        ClearwayError: not three finite numbers, or a negative uncertainty.
    """
    at = np.array(pose, dtype=np.float64)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise ClearwayError(f"the frame's pose {pose!r} is not x, y [m] and theta [rad]")
    if sigma is not None and not (sigma[0] >= 0 and sigma[1] >= 0):
        raise ClearwayError(f"the frame's uncertainty {sigma} is not two numbers (m, rad) of at least 0")
    unknown = "" if sigma is not None else "; its uncertainty is unknown"
    return Tie(at, np.array(sigma or (np.nan, np.nan), dtype=np.float64), np.zeros(0), f"as given in the plan{unknown}")


def uncertainty(tie: Tie, pose: FloatArray) -> FloatArray:
    """(n, 2) standard uncertainty [m, rad] that the tie alone makes at poses (n, 3) in the map; NaN if it is unknown."""
    c, s = math.cos(tie.pose[2]), math.sin(tie.pose[2])
    x, y = tie.pivot
    pivot = tie.pose[:2] + np.array([c * x - s * y, s * x + c * y])
    arm = np.hypot(*(pose[:, :2] - pivot).T)
    return np.stack([np.hypot(tie.sigma[0], tie.sigma[1] * arm), np.full(len(pose), tie.sigma[1])], axis=1)


def apply(tie: Tie, motion: Motion) -> Motion:
    """`motion` in the map. Its uncertainty grows by the tie's, in quadrature, that of the position by the lever arm as
    well; it is unknown where either is."""
    c, s = math.cos(tie.pose[2]), math.sin(tie.pose[2])
    x, y, theta = motion.pose.T
    pose = np.stack([tie.pose[0] + c * x - s * y, tie.pose[1] + s * x + c * y, theta + tie.pose[2]], axis=1)
    sigma = None
    if motion.sigma is not None and np.isfinite(tie.sigma).all():
        sigma = np.hypot(motion.sigma, uncertainty(tie, pose))
    return replace(motion, pose=pose, sigma=sigma, notes=(*motion.notes, f"frame: {tie.note}"))


def _pairs(measured: FloatArray, known: FloatArray, width: int, kind: str) -> tuple[Any, Any]:
    a, b = np.asarray(measured, dtype=np.float64), np.asarray(known, dtype=np.float64)
    if a.ndim != 2 or a.shape[1] != width or a.shape != b.shape:
        raise ClearwayError(f"{a.shape} measured and {b.shape} known {kind}s; as many of both, {width} numbers each")
    if not len(a):
        raise ClearwayError(f"no {kind} was given to tie the frame by")
    for i in range(len(a)):
        if not np.isfinite(np.concatenate([a[i, :2], b[i, :2]])).all():
            raise ClearwayError(f"{kind} {i + 1} has no finite x and y (measured {a[i]}, known {b[i]})")
    return a, b


@dataclass(frozen=True, slots=True)
class _Fit:
    """theta [rad], the pivots (complex), residuals (k,) m and (k,) rad (NaN without), what they weigh, the information
    on theta (1/rad^2)."""

    theta: float
    at: tuple[complex, complex]
    away: FloatArray
    turned: FloatArray
    badness: float
    information: float


def _fit(a: Any, b: Any, sigma: tuple[float, float]) -> _Fit:
    """Weighted least squares in closed form: places pull the heading by their lever arms, headings directly."""
    p, q = a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1]
    p0, q0 = p.mean(), q.mean()
    turn = b[:, 2] - a[:, 2]
    headings = np.exp(1j * turn[np.isfinite(turn)]).sum() / sigma[1] ** 2
    pull = (np.conj(p - p0) * (q - q0)).sum() / sigma[0] ** 2 + headings
    theta = float(np.angle(pull))
    away = np.abs(q - q0 - np.exp(1j * theta) * (p - p0))
    turned = np.abs(np.angle(np.exp(1j * (turn - theta))))
    badness = float((away**2).sum() / sigma[0] ** 2 + np.nansum(turned**2) / sigma[1] ** 2)
    return _Fit(theta, (complex(p0), complex(q0)), away, turned, badness, abs(pull))


def _tie(a: Any, b: Any, sigma: tuple[float, float], kind: str) -> Tie:
    k, headings = len(a), int(np.isfinite(b[:, 2] - a[:, 2]).sum())
    if not (sigma[0] > 0 and sigma[1] > 0):
        raise ClearwayError(f"the uncertainty of the {kind}s {sigma} has to be above 0 (m, rad)")
    spread = float(np.hypot(*(b[:, :2] - b[:, :2].mean(axis=0)).T).max())
    if headings == 0 and spread < REFUSED * sigma[0]:
        raise ClearwayError(
            f"{k} {kind}{'s' * (k > 1)} without a heading, none farther than {spread:.3f} m from their middle, can't tell how "
            "the frame is turned; two places far apart are needed" + (", or a heading" if kind == "static pose" else "")
        )
    fit = _fit(a, b, sigma)
    worst = _share(fit, sigma).max()
    if worst > REFUSED:
        raise _wrong(a, b, sigma, kind, fit)
    freedom = 2 * k + headings - 3
    scatter = math.sqrt(fit.badness / freedom) if freedom else 1.0
    # what the residuals show counts where it is more than what was promised
    grown = max(1.0, scatter)
    (p0, q0), theta = fit.at, fit.theta
    origin = q0 - np.exp(1j * theta) * p0
    note = f"by {k} {kind}{'s' * (k > 1)}"
    if freedom:
        i = int(_share(fit, sigma).argmax())
        note += f", residual {_rms(fit.away) * 1000:.1f} mm"
        if headings > 1 or (headings and k > 1):
            note += f" and {_rms(fit.turned[np.isfinite(fit.turned)]):.4f} rad"
        if worst > DOUBTFUL:
            note += f"; {kind} {i + 1} fits worst ({fit.away[i] * 1000:.1f} mm off), look at it"
    else:
        note += ", which leaves no residual to check it by"
    if _mirrored(a, b, sigma).badness <= fit.badness + DOUBTFUL**2:
        note += "; these places would fit a mirrored frame as well"
    return Tie(
        np.array([origin.real, origin.imag, wrap(theta)]),
        np.array([sigma[0] * grown / math.sqrt(k), grown / math.sqrt(fit.information)]),
        fit.away,
        note,
        (p0.real, p0.imag),
    )


def _share(fit: _Fit, sigma: tuple[float, float]) -> Any:
    """(k,) the residual of each in standard uncertainties, of place or heading, whichever is more."""
    turned = np.nan_to_num(fit.turned) / sigma[1]
    return np.maximum(fit.away / sigma[0], turned)


def _mirrored(a: Any, b: Any, sigma: tuple[float, float]) -> _Fit:
    return _fit(a * np.array([1.0, -1.0, -1.0]), b, sigma)


def _rms(values: FloatArray) -> float:
    return math.sqrt(float(np.mean(np.square(values)))) if len(values) else 0.0


def _wrong(a: Any, b: Any, sigma: tuple[float, float], kind: str, fit: _Fit) -> ClearwayError:
    """What is the matter with pairs that don't fit."""
    mirror = _mirrored(a, b, sigma)
    if _share(mirror, sigma).max() <= REFUSED:
        return ClearwayError(
            f"the {kind}s fit the map only as a mirror image (residual {_rms(mirror.away):.3f} m against "
            f"{_rms(fit.away):.3f} m): the capture's frame is left-handed, or Y-up and read as Z-up"
        )
    sizes = [float(_rms(np.hypot(*(x[:, :2] - x[:, :2].mean(axis=0)).T))) for x in (a, b)]
    scale = sizes[0] / sizes[1] if sizes[1] else 1.0
    scaled = np.hstack([a[:, :2] / scale, a[:, 2:]]) if scale > 0 else a
    if abs(scale - 1) > 0.02 and len(a) > 1 and _share(_fit(scaled, b, sigma), sigma).max() <= REFUSED:
        if len(a) > 2 or abs(scale - 1) > 0.5:
            return ClearwayError(
                f"the {kind}s lie {scale:.4g} times as far apart in the source as on the map: its unit of length is wrong"
            )
        return ClearwayError(
            f"the two {kind}s lie {np.hypot(*(a[1] - a[0])[:2]):.3f} m apart in the source, {np.hypot(*(b[1] - b[0])[:2]):.3f} m "
            "on the map: one of the places is wrong"
        )
    worst = int(_share(fit, sigma).argmax())
    if len(a) > 2:
        without = [_fit(np.delete(a, i, 0), np.delete(b, i, 0), sigma) for i in range(len(a))]
        worst = min(range(len(a)), key=lambda i: without[i].badness)
        rest = without[worst]
        if _share(rest, sigma).max() <= REFUSED:
            back = rest.at[1] + np.exp(1j * rest.theta) * (complex(*a[worst, :2]) - rest.at[0])
            off = abs(back - complex(*b[worst, :2]))
            turned = abs(wrap(float(a[worst, 2] + rest.theta - b[worst, 2])))
            how_far = f"{turned:.3f} rad turned from" if off <= REFUSED * sigma[0] else f"{off:.3f} m from"
            return ClearwayError(
                f"{kind} {worst + 1} lies {how_far} where the others put it: its known pose {_numbers(b[worst])} or its "
                "measurement is wrong"
            )
    and_turned = "" if math.isnan(fit.turned[worst]) else f" and {fit.turned[worst]:.3f} rad"
    return ClearwayError(
        f"the {kind}s don't fit the map: after the best turn and shift, {kind} {worst + 1} still lies "
        f"{fit.away[worst]:.3f} m{and_turned} off; their uncertainty is said to be {sigma[0]:g} m"
        + (f" and {sigma[1]:g} rad" if math.isfinite(sigma[1]) else "")
    )


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{v:g}" for v in values if math.isfinite(v)) + ")"
