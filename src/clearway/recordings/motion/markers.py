"""From markers to motion: which markers make a body, names put right, poses fitted, gaps, filter, uncertainty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.errors import ClearwayError, nearest
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import rigid
from clearway.recordings.motion.base import Base
from clearway.recordings.motion.cleaning import clean
from clearway.recordings.motion.gaps import known, runs, seen_in_part, usual_step
from clearway.recordings.motion.motion import Motion, MotionSpec, NeverSeen, Quality
from clearway.recordings.motion.repair import repair
from clearway.recordings.motion.tracks import motion_of_track, tilt_note, unwrapped
from clearway.recordings.recording import Points

__all__ = ["MarkerSet", "learnt", "motion_of_markers", "motion_of_track", "resolve"]

MANY = 64
"""Markers of one body: more is a prefix that holds several bodies, or a damaged file."""

LEAP = (0.3, 10.0)
"""rad, rad/s: a heading that changes by more than the first and the second times the time between has leapt."""

ENOUGH = 20
"""Frames in which a marker must be seen for its place on the body to be refined."""


@dataclass(frozen=True, slots=True, eq=False)
class MarkerSet:
    """The markers of one rigid body.

    Attributes:
        names: (m) names, as the file has them.
        model: (m, 3) where they sit, m, z up, in a frame of the body (base_link's, if its `base` is to be None), NaN
            for one that is not used; None: learnt from the capture.
    """

    names: tuple[str, ...]
    model: FloatArray | None = None


def resolve(
    names: Sequence[str], wanted: Sequence[str] | str, *, file: object = None, field: str | None = None
) -> tuple[str, ...]:
    """The markers out of a file's `names` that `wanted` says: names, or a prefix that ends in `:`.

    Raises:
        ClearwayError: no such marker or prefix (the closest one is suggested), one named twice, fewer than three.
    """
    if isinstance(wanted, str):
        found = tuple(n for n in names if n.startswith(wanted))
        if not found:
            prefixes = sorted({n[: n.rindex(":") + 1] for n in names if ":" in n})
            close = nearest(wanted, prefixes, 0.4)
            hint = f"did you mean {close!r}? " if close else ""
            known = f"prefixes: {', '.join(prefixes)}" if prefixes else f"no prefixes, but markers: {_some(names)}"
            raise ClearwayError(f"no marker begins with {wanted!r}; {hint}the file has {known}", file=file, field=field)
    else:
        found = tuple(wanted)
        for name in found:
            if name not in names:
                same_end = [n for n in names if n.rpartition(":")[2] == name]
                guess = same_end[0] if same_end else nearest(name, names, 0.4)
                hint = f"did you mean {guess!r}? " if guess else ""
                raise ClearwayError(f"no marker {name!r}; {hint}the file has {_some(names)}", file=file, field=field)
            if found.count(name) > 1:
                raise ClearwayError(f"marker {name!r} is named twice", file=file, field=field)
    _count(found, file, field)
    return found


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(names[:30])
    return f"{shown} and {len(names) - 30} more" if len(names) > 30 else shown or "no markers"


def _count(names: Sequence[str], file: object, field: str | None) -> None:
    if len(names) < 3:
        raise ClearwayError(
            f"{len(names)} marker{'s' * (len(names) != 1)} ({', '.join(names)}) can't tell a body's pose; at least three that"
            " don't lie on one line are needed",
            file=file,
            field=field,
        )
    if len(names) > MANY:
        raise ClearwayError(
            f"{len(names)} markers are too many for one body; at most {MANY}, named one by one or by a narrower prefix",
            file=file,
            field=field,
        )


def learnt(
    points: Points, spec: MarkerSet, cleaning: MotionSpec, *, file: object = None, field: str | None = None
) -> MarkerSet:
    """The set with the layout that the capture itself shows (`rigid.learn`): z up, origin in the centroid, x towards the
    first marker. A `spec` with a model comes back as it is. Learn once and use it for all trials of a body: what ties
    it to base_link is given in this frame.

    Raises:
        ClearwayError: fewer than three markers are seen together, they lie on a line, or move against each other.
    """
    if spec.model is not None:
        return spec
    names = resolve(points.names, spec.names, file=file, field=field)
    layout = rigid.learn(_columns(points, names), cleaning.residual)
    if layout.kept.sum() < 3:
        why = []
        if layout.never.any():
            why.append(f"never seen together with the others: {_listed(names, layout.never)}")
        if layout.loose.any():
            why.append(
                f"distances to the others that vary by more than {cleaning.residual * 1e3:.0f} mm:"
                f" {_listed(names, layout.loose)}"
            )
        raise ClearwayError(
            f"no rigid body of at least three markers; {'; '.join(why)}; name markers that are fixed to one body and seen"
            " together",
            file=file,
            field=field,
        )
    _off_line(layout.model[layout.kept], names, file, field)
    return MarkerSet(names, layout.model)


def _listed(names: Sequence[str], which: rigid.Seen) -> str:
    return ", ".join(name for name, yes in zip(names, which, strict=True) if yes)


def _off_line(model: FloatArray, names: Sequence[str], file: object, field: str | None) -> None:
    wide = rigid.spread(model, np.ones((1, len(model)), dtype=bool))[0]
    if wide < rigid.SPREAD:
        raise ClearwayError(
            f"the markers {', '.join(names)} lie on a line to within {wide * 1e3:.1f} mm (rms), about which the body could"
            f" turn unseen; at least {rigid.SPREAD * 1e3:.0f} mm are needed: put one well beside the line",
            file=file,
            field=field,
        )


def _columns(points: Points, names: Sequence[str]) -> FloatArray:
    at = {name: i for i, name in enumerate(points.names)}
    return points.xyz[:, [at[name] for name in names]]


def motion_of_markers(
    points: Points,
    spec: MarkerSet,
    cleaning: MotionSpec,
    base: Base | None,
    *,
    file: object = None,
    field: str | None = None,
) -> Motion:
    """How a body moved on the floor, from its markers; base None: the motion of the model's own frame.

    The layout is refined by the capture (its frame stays that of `spec.model`), every frame is fitted, changed names
    are put right (`repair`), then the pose is cleaned (`cleaning.clean`). `sigma` holds the marker noise as the residuals
    show it, through the fit with its lever arm and through the filter; the error of the layout, if it was given; and
    the base's own. Poses are those of base_link projected onto the floor (z up).

    Raises:
        ClearwayError: markers that the file doesn't have, too few, on a line, or that fit no rigid body.
    """
    names = resolve(points.names, spec.names, file=file, field=field)
    xyz = _columns(points, names)
    given = spec.model is not None
    model = learnt(points, spec, cleaning, file=file, field=field).model
    assert model is not None
    kept = known(model)
    notes = []
    if not kept.all():
        notes.append(f"left out, as not fixed to the body or never seen with the others: {_listed(names, ~kept)}")
        names = tuple(n for n, yes in zip(names, kept, strict=True) if yes)
        xyz, model = xyz[:, kept], model[kept]
        _count(names, file, field)
    _off_line(model, names, file, field)
    _two(xyz, names, file, field)
    own, error = _refined(xyz, model, cleaning, names, given, file, field)
    first = rigid.fit(xyz, own)
    noise = rigid.noise_of(first)
    if noise is None:
        raise ClearwayError("the markers that are seen together lie on a line in every frame", file=file, field=field)
    # where most frames are bad, the noise that they show would excuse them
    mended = repair(points.t, xyz, own, first, min(noise, cleaning.residual / 3), cleaning.residual)
    done = mended.fit
    noise = rigid.noise_of(done) or noise
    fitted = np.isfinite(done.residual)
    if not fitted.any():
        raise ClearwayError(
            f"no frame shows a rigid body: residuals are {np.nanmedian(first.residual) * 1e3:.0f} mm, at most"
            f" {cleaning.residual * 1e3:.0f} mm is believed; are the markers those of one body, and is z up?",
            file=file,
            field=field,
        )
    turn = np.eye(3) if base is None else base.rotation
    point = np.zeros(3) if base is None else base.point
    pose, leaning = _planar(done, turn, point)
    variance, fixed = _variances(done, own, point, noise, error)
    correlation = _correlation(xyz, own, done, noise)
    cleaned = clean(points.t, pose, variance, cleaning, correlation=correlation)
    own_sigma = (0.0, 0.0) if base is None else base.sigma
    sigma = np.sqrt(cleaned.variance + fixed + np.square(own_sigma))
    partly = fitted & ~done.used.all(axis=1)
    lacking = seen_in_part(points.t, partly, cleaning.spline)
    gaps = tuple(sorted((*lacking, *cleaned.gaps), key=lambda g: (g.start, g.end)))
    if partly.any():
        notes.append(
            f"in {partly.mean():.1%} of the frames at least one marker was hidden: the pose comes from the others"
        )
    notes += _told(mended.swapped, mended.thinned, mended.refused, error)
    notes += _leaps(points.t, pose)
    notes += tilt_note(leaning[fitted])
    if base is not None:
        notes.append(base.note)
    step = usual_step(points.t)
    squares, count = done.squares[fitted], done.used[fitted].sum(axis=1)
    quality = Quality(
        rate=1 / step if step else 0.0,
        seen=float(fitted.mean()),
        gaps=gaps,
        residual=math.sqrt(float(squares.sum() / count.sum())),
        residual_max=float(done.residual[fitted].max()),
        swapped=int(mended.swapped.sum()),
        refused=int(mended.refused.sum()),
        noise=noise,
        cutoff=cleaned.cutoff,
    )
    said = (*notes, *cleaned.notes)
    return Motion(points.t, cleaned.pose, cleaned.velocity, sigma, quality, said, done.residual)


def _two(xyz: FloatArray, names: Sequence[str], file: object, field: str | None) -> None:
    most = int(rigid.seen_in(xyz).sum(axis=1).max(initial=0))
    if most < 3:
        raise NeverSeen(
            f"never more than {most} of the markers {', '.join(names)} are seen at once; at least three are needed in a frame",
            file=file,
            field=field,
        )


def _refined(
    xyz: FloatArray,
    model: FloatArray,
    cleaning: MotionSpec,
    names: Sequence[str],
    given: bool,
    file: object,
    field: str | None,
) -> tuple[FloatArray, float]:
    """The layout as the capture shows it, in the frame of `model`, and the rms error of a coordinate of `model` [m].

    Coordinates that were taken with a tape are wrong by more than a capture's noise; fitted as they are, the pose would
    leap whenever a marker is hidden. Learnt ones have no error against themselves.
    """
    if not given:
        return model, 0.0
    seen = rigid.seen_in(xyz)
    rows = rigid.frames_to_learn(seen)
    sample = np.where(seen[rows][:, :, None], xyz[rows], np.nan)
    better, _ = rigid.refine(sample, model)
    often = np.isfinite(sample[:, :, 0]).sum(axis=0) >= ENOUGH
    if often.sum() < 3 or rigid.spread(better, often[None])[0] < rigid.SPREAD:
        return model, 0.0
    back = rigid.fit(better[None], model, often[None])
    residual = float(back.residual[0])
    if residual > 2 * cleaning.residual:
        moved = (better - back.translation[0]) @ back.rotation[0]
        off = np.where(often, np.linalg.norm(moved - model, axis=1), 0.0)
        worst = int(off.argmax())
        raise ClearwayError(
            f"the coordinates of the markers don't fit what was seen: {residual * 1e3:.0f} mm off (rms), most of all"
            f" {names[worst]!r} with {off[worst] * 1e3:.0f} mm; at most {2e3 * cleaning.residual:.0f} mm would be right"
            f"{_why_not(better[often], model[often], 2 * cleaning.residual)}",
            file=file,
            field=field,
        )
    own = np.where(often[:, None], (better - back.translation[0]) @ back.rotation[0], model)
    count = int(often.sum())
    return own, residual * math.sqrt(count / max(3 * count - 6, 1))


def _why_not(seen: FloatArray, model: FloatArray, allowed: float) -> str:
    """The mistake in a layout by which it would fit what was seen, behind a semicolon; empty where none of the usual ones explains it."""
    sizes = [float(np.linalg.norm(points - points.mean(axis=0))) for points in (model, seen)]
    power = 10.0 ** round(math.log10(sizes[0] / sizes[1]))
    all_seen = np.ones((1, len(seen)), dtype=bool)

    def fits(tried: FloatArray) -> bool:
        return float(rigid.fit(seen[None], tried, all_seen).residual[0]) <= allowed

    if power != 1.0 and fits(model / power):
        return f"; divided by {power:g} they fit: are the coordinates or the recording in another unit?"
    if fits(model * np.array([1.0, -1.0, 1.0])):
        return "; mirrored they fit: is the sign of all x, y or z, or an axis of the recording, the other way?"
    return ""


def _planar(done: rigid.Fit, turn: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The floor pose (n, 3) of base_link and its lean (n,) [rad]."""
    rotation = done.rotation @ turn
    at = done.translation + done.rotation @ point
    pose = np.empty((len(at), 3))
    pose[:, :2] = at[:, :2]
    pose[:, 2] = unwrapped(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))
    return pose, np.arccos(np.clip(rotation[:, 2, 2], -1.0, 1.0))


def _variances(
    done: rigid.Fit, model: FloatArray, point: FloatArray, noise: float, error: float
) -> tuple[FloatArray, FloatArray]:
    """Variance of the raw pose of each frame (n, 2), and that of a layout wrong by `error` [m] (2,), the same in all."""
    kinds, which = rigid.patterns(done.used)
    unit = rigid.variance_at(model, kinds, point)[which]
    with np.errstate(invalid="ignore"):  # a frame that fits worse than noise explains is less sure (Birge's ratio)
        worse = np.maximum(1.0, done.squares / np.maximum(done.freedom, 1) / noise**2 / 3)
    whole = rigid.variance_at(model, np.ones((1, len(model)), dtype=bool), point)[0]
    return unit * (noise**2 * worse)[:, None], whole * error**2


def _correlation(xyz: FloatArray, model: FloatArray, done: rigid.Fit, noise: float) -> float:
    """Of the noise of neighbouring frames, in [0, 0.98]: from the residuals of up to 20 stretches of 1,000 frames."""
    n = len(xyz)
    with np.errstate(invalid="ignore"):
        sound = done.used.all(axis=1) & (done.residual < 5 * noise)
    top, bottom = 0.0, 0.0
    for a, b in runs(sound)[: 20 * 50]:
        if b - a < 50 or b > n:
            continue
        rows = slice(int(a), int(min(b, a + 1000)))
        fitted = model @ done.rotation[rows].transpose(0, 2, 1) + done.translation[rows][:, None]
        left = (xyz[rows] - fitted) @ done.rotation[rows]
        left = left - left.mean(axis=0)
        top += float((left[1:] * left[:-1]).sum())
        bottom += float((left**2).sum())
    return float(np.clip(top / bottom, 0.0, 0.98)) if bottom > 0 else 0.0


def _leaps(t: FloatArray, pose: FloatArray) -> list[str]:
    """A warning of headings that leap: a regular figure of markers whose names went round fits as well."""
    there = np.flatnonzero(np.isfinite(pose[:, 2]))
    turned, apart = np.abs(np.diff(pose[there, 2])), np.diff(t[there])
    leapt = turned > LEAP[0] + LEAP[1] * apart
    if not leapt.any():
        return []
    return [
        f"the heading leaps {int(leapt.sum())} times, by up to {math.degrees(float(turned[leapt].max())):.0f} degrees: do the"
        " markers look the same after a turn, and did their names go round?"
    ]


def _told(swapped: rigid.Seen, thinned: rigid.Seen, refused: rigid.Seen, error: float) -> list[str]:
    notes = []
    if swapped.any():
        notes.append(f"two markers had each other's names in {int(swapped.sum())} frames; put right")
    if thinned.any():
        notes.append(f"one or two strayed markers left out in {int(thinned.sum())} frames")
    if refused.any():
        notes.append(f"{int(refused.sum())} frames show no rigid body; left open")
    if error > 0.0005:
        notes.append(
            f"the coordinates of the markers are {error * 1e3:.1f} mm off what was seen; the capture's layout is used"
        )
    return notes
