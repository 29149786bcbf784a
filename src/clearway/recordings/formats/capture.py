"""From a text capture's header to a recording: which columns hold what, in which unit, with which axis up.

The readers of Vicon's, Motive's, Qualisys' and TRC files only understand headers; here their numbers become metres in
a right-handed z-up frame. A frame whose y is up is turned about x by a quarter turn, (x, y, z) -> (x, -z, y), and so are
the bodies' own axes, so that a body that stands upright in the one frame stands upright in the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.beside import beside
from clearway.recordings.formats.capture_fields import is_unlabelled, wanted_of
from clearway.recordings.formats.format import Format
from clearway.recordings.formats.text import Block, Lines, gather, opened, rows
from clearway.recordings.recording import Contents, Entry, Points, Recording, Track, Want, describe
from clearway.recordings.times import in_order, must_be

_TURN = Rotation.from_euler("x", 90, degrees=True)
_RISE = 0.5


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body's columns.

    Attributes:
        name: The body's name in the file.
        columns: Columns of the block, the first three its position.
        turn: Makes the other columns (n, k - 3) into the orientation (n, 4) xyzw in the file's frame; None: it has
            none. Rows of zeros or NaN need not be unit.
    """

    name: str
    columns: tuple[int, ...]
    turn: Callable[[FloatArray], FloatArray | None] | None = None


@dataclass(frozen=True, slots=True)
class Layout:
    """What a header says of the block of numbers behind it.

    Attributes:
        block: Where the numbers are.
        lead: Columns that tell time; with none `clock` is given the rows' running numbers (n, 1).
        clock: Makes time of them, (n, k) -> (n,) s.
        points: The markers' names, each with its x, y, z columns.
        bodies: The rigid bodies.
        raster: Which of the lead columns counts frames, and at what rate [Hz]: times that only are these, rounded, are
            made exact.
        scale: Metres in the file's unit of length.
        up: The axis that points up, `y` or `z`.
        axes: What the reader says of that, a sentence; not said where the user says which it is.
        zero: Whether a thing at exactly 0, 0, 0 was not seen.
        epoch: UNIX time of t = 0, s; None if the file doesn't say.
        promised: Number of frames that the header announces, if it does.
        notes: What the reader noticed, in sentences.
    """

    block: Block
    lead: tuple[int, ...]
    clock: Callable[[FloatArray], FloatArray]
    points: tuple[tuple[str, tuple[int, int, int]], ...]
    bodies: tuple[Body, ...] = ()
    raster: tuple[int, float] | None = None
    scale: float = 0.001
    up: str = "z"
    zero: bool = False
    epoch: float | None = None
    promised: float | None = None
    notes: tuple[str, ...] = field(default=())
    axes: str = ""

    def said(self, want: Want | None = None) -> tuple[str, ...]:
        """Its notes, with that about the axes unless `want` says which is up."""
        return (self.axes, *self.notes) if self.axes and (want is None or want.up is None) else self.notes


def text_format(
    name: str,
    title: str,
    suffixes: tuple[str, ...],
    sniff: Callable[[Path, bytes], bool],
    layouts: Callable[[Lines], Sequence[Layout]],
    write: Callable[[Path, Recording], None],
) -> Format:
    """The format of text captures whose headers `layouts` understands; the other arguments as of `Format`."""

    def read(path: Path, want: Want) -> Recording:
        with opened(path) as lines:
            return _read(lines, layouts(lines), name, want)

    def look(path: Path) -> Contents:
        with opened(path) as lines:
            return _look(lines, layouts(lines), name)

    return Format(name, title, suffixes, sniff, read, look, write)


def by_name_only(path: Path, head: bytes) -> bool:
    """The `sniff` of a format that no file is taken for by itself."""
    return False


def _read(lines: Lines, layouts: Sequence[Layout], format: str, want: Want) -> Recording:
    """What is wanted of a capture, whose header said `layouts`."""
    chosen = _chosen(lines.file, layouts, want)
    points: Points | None = None
    tracks: dict[str, Track] = {}
    notes: list[str] = []
    for layout, markers, bodies in chosen:
        notes += layout.said(want)
        if not markers and not bodies:
            continue
        t, values, found = _taken(lines, layout, [*(c for _, c in markers), *(b.columns for b in bodies)], want)
        notes += found
        at = 0
        if markers:
            xyz = values[:, : 3 * len(markers)].reshape(len(t), len(markers), 3)
            at = 3 * len(markers)
            _place(xyz, layout)
            points = Points(tuple(name for name, _ in markers), t, xyz)
        for body in bodies:
            track = _track(body, layout, t, values[:, at : at + len(body.columns)])
            tracks[body.name] = track
            at += len(body.columns)
        notes += _left_out(layout, markers, want)
    epoch = next((layout.epoch for layout in layouts if layout.epoch is not None), None)
    if points is not None and want.up is None:
        _check_up(lines.file, format, points, next(layout for layout, markers, _ in chosen if markers))
    up = next((layout.up for layout in layouts), "z")
    return Recording(lines.file, format, points, tracks, epoch=epoch, notes=tuple(dict.fromkeys(notes)), up=up)


def _look(lines: Lines, layouts: Sequence[Layout], format: str) -> Contents:
    """What a capture holds, a few thousand rows in memory at a time."""
    entries: list[Entry] = []
    notes: list[str] = []
    ends: list[float] = []
    for layout in layouts:
        notes += layout.said()
        things: list[tuple[str, str, Sequence[int]]] = [(name, "marker", c) for name, c in layout.points]
        things += [(b.name, "body", b.columns[:3]) for b in layout.bodies]
        t, seen, found = _seen(lines, layout, [c for _, _, c in things])
        notes += found
        if len(t):
            ends += [float(t[0]), float(t[-1])]
        for i, (name, kind, _) in enumerate(things):
            detail = "unlabelled" if kind == "marker" and is_unlabelled(name) else ""
            entries.append(describe(name, kind, t, seen[:, i], detail))
    epoch = next((layout.epoch for layout in layouts if layout.epoch is not None), None)
    first, last = (min(ends), max(ends)) if ends else (None, None)
    return Contents(lines.file, format, first, last, epoch, tuple(entries), tuple(dict.fromkeys(notes)))


def to_file(points: Points, up: str, scale: float, digits: int) -> list[FloatArray]:
    """The columns x, y, z of every marker, as a file with that axis up and that unit [m] has them."""
    xyz = points.xyz if up == "z" else np.stack((points.xyz[..., 0], points.xyz[..., 2], -points.xyz[..., 1]), axis=-1)
    flat = np.round(xyz.reshape(len(points.t), -1) / scale, digits)
    return [flat[:, i] for i in range(flat.shape[1])]


def track_to_file(track: Track, up: str, scale: float, digits: int) -> tuple[FloatArray, FloatArray]:
    """A track's position (n, 3) in a file's unit and its orientation (n, 4) xyzw (NaN where there is none) in its axes."""
    position = track.position if up == "z" else _TURN.inv().apply(track.position)
    none = np.full((len(track.t), 4), np.nan)
    turned = none if track.orientation is None else track.orientation.copy()
    known = np.isfinite(turned).all(axis=1)
    if up == "y" and known.any():
        turned[known] = (_TURN.inv() * Rotation.from_quat(turned[known]) * _TURN).as_quat()
    return np.round(position / scale, digits), turned


def frames_of(t: FloatArray, *, file: Path) -> tuple[FloatArray, float]:
    """Frame numbers (n,) from 1 at t = 0, and the rate [Hz] that they count in.

    Raises:
        ClearwayError: there are no samples, or they aren't on one raster.
    """
    if len(t) == 0:
        raise ClearwayError("there is nothing to write: no samples", file=file)
    rate = 1 / float(np.median(np.diff(t))) if len(t) > 1 else 100.0
    if len(t) > 1:
        steps = np.rint((t - t[0]) * rate)
        rate = float(steps[-1] / (t[-1] - t[0])) if steps[-1] else rate
    rate = float(round(rate, 3)) or rate
    frames = np.rint(t * rate) + 1
    if (np.diff(frames) < 1).any() or np.abs((frames - 1) / rate - t).max() > 0.25 / rate:
        raise ClearwayError(f"the samples aren't {rate:g} a second throughout; resample them before writing", file=file)
    return frames, rate


def _chosen(
    file: Path, layouts: Sequence[Layout], want: Want
) -> list[tuple[Layout, list[tuple[str, tuple[int, int, int]]], list[Body]]]:
    names = [n for layout in layouts for n in (*(p for p, _ in layout.points), *(b.name for b in layout.bodies))]
    for name in sorted(want.names or ()):
        if name not in names:
            raise unknown("marker or body", name, names, file=file)
    wanted = set(wanted_of(names, want))
    return [
        (layout, [p for p in layout.points if p[0] in wanted], [b for b in layout.bodies if want.has(b.name)])
        for layout in layouts
    ]


def _left_out(layout: Layout, markers: Sequence[Any], want: Want) -> tuple[str, ...]:
    n = len(layout.points) - len(markers)
    if want.names is not None or not n:
        return ()
    return (f"{n} unlabelled trajectories were left out; name them to have them",)


def _timed(lines: Lines, layout: Layout, wanted: Sequence[int]) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """The times (r,), frame numbers (r,) and wanted columns (r, k) of a block, in chunks."""
    n = 0
    for chunk in rows(lines, layout.block, [*layout.lead, *wanted]):
        k = len(layout.lead)
        lead = chunk[:, :k] if k else np.arange(n, n + len(chunk), dtype=np.float64)[:, None]
        n += len(chunk)
        with np.errstate(all="ignore"):
            t = layout.clock(lead)
        yield t, t if layout.raster is None else lead[:, layout.raster[0]], chunk[:, k:]
    if not n:
        raise ClearwayError("has a header, but no frames", file=lines.file)
    if layout.promised is not None and layout.promised > 2 * (lines.at - layout.block.start) + 1000:
        raise ClearwayError(
            f"announces {layout.promised:.0f} frames, more than it can hold; it has {n}", file=lines.file
        )


def _taken(
    lines: Lines, layout: Layout, groups: Sequence[Sequence[int]], want: Want
) -> tuple[FloatArray, FloatArray, list[str]]:
    """Times (n,), the groups' columns (n, k) within the span, and what was noticed."""
    flat = [i for group in groups for i in group]
    times: list[FloatArray] = []
    frames: list[FloatArray] = []
    counted, first, last = 0, np.inf, -np.inf

    def parts() -> Iterator[FloatArray]:
        nonlocal counted, first, last
        for t, frame, values in _timed(lines, layout, flat):
            counted += len(t)
            if np.isfinite(t).any():
                first, last = min(first, float(np.nanmin(t))), max(last, float(np.nanmax(t)))
            within = np.ones(len(t), dtype=bool)
            if want.span is not None:
                with np.errstate(invalid="ignore"):
                    within = (t >= want.span[0]) & (t <= want.span[1])
            times.append(t[within])
            frames.append(frame[within])
            yield values[within] if not within.all() else values

    start = layout.block.start
    values = gather(parts(), len(flat), lambda: (lines.at - start) / max(1, lines.size - start))
    t = _exact(np.concatenate(times), np.concatenate(frames), layout)
    if not len(t) and want.span is not None:
        raise ClearwayError(
            f"there is nothing between {want.span[0]:g} and {want.span[1]:g} s; it runs from {first:g} to {last:g} s",
            file=lines.file,
        )
    must_be("s", t, None, "mend its times, or its rate", file=lines.file, field="frames", said=False)
    order, notes = in_order(t, file=lines.file, field="frames")
    if len(order) < len(t):
        t, values = t[order], values[order]
    return t, values, [*notes, *_short(lines, layout, counted)]


def _seen(lines: Lines, layout: Layout, groups: Sequence[Sequence[int]]) -> tuple[FloatArray, Any, list[str]]:
    """Times (n,), whether each group is there (n, g), and what was noticed."""
    flat = [i for group in groups for i in group]
    times: list[FloatArray] = []
    frames: list[FloatArray] = []
    there: list[Any] = []
    for t, frame, values in _timed(lines, layout, flat):
        xyz = values.reshape(len(t), len(groups), 3)
        seen = np.isfinite(xyz).all(axis=2)
        if layout.zero:
            seen &= (xyz != 0).any(axis=2)
        times.append(t)
        frames.append(frame)
        there.append(seen)
    t, seen = _exact(np.concatenate(times), np.concatenate(frames), layout), np.concatenate(there)
    order, notes = in_order(t, file=lines.file, field="frames")
    return t[order], seen[order], [*notes, *_short(lines, layout, len(t))]


def _exact(t: FloatArray, frames: FloatArray, layout: Layout) -> FloatArray:
    """Times (n,) [s] off the frame numbers' raster where they only are these, rounded to milliseconds or finer.

    A time column of three digits would make a speed at 150 Hz wrong by 8 %.
    """
    if layout.raster is None or not len(t) or not np.isfinite(t).all() or not np.isfinite(frames).all():
        return t
    rate = layout.raster[1]
    exact = frames / rate
    shift = float(np.median(t - exact))
    if abs(shift - round(shift * rate) / rate) < 2e-4:
        shift = round(shift * rate) / rate
    exact = exact + shift
    return exact if np.abs(exact - t).max() < min(6e-4, 0.2 / rate) else t


def _short(lines: Lines, layout: Layout, counted: int) -> tuple[str, ...]:
    cut_off = ("the last line has no end and lacks cells: taken as cut off and left out",) if lines.cut_off else ()
    if layout.promised is None or layout.promised == counted:
        return cut_off
    return (f"the header announces {layout.promised:.0f} frames, there are {counted}", *cut_off)


def _place(xyz: FloatArray, layout: Layout) -> None:
    """Bring positions (..., 3) as the file has them into metres, z up, in place; what wasn't seen becomes NaN."""
    if layout.zero:
        xyz[(xyz == 0).all(axis=-1)] = np.nan
    xyz[~np.isfinite(xyz).all(axis=-1)] = np.nan
    xyz *= layout.scale
    if layout.up == "y":
        y = xyz[..., 1].copy()
        xyz[..., 1] = -xyz[..., 2]
        xyz[..., 2] = y


def _track(body: Body, layout: Layout, t: FloatArray, values: FloatArray) -> Track:
    position = values[:, :3].copy()
    orientation = None if body.turn is None else body.turn(values[:, 3:])
    _place(position, layout)
    if orientation is not None:
        orientation[~np.isfinite(position[:, 0])] = np.nan
        known = np.isfinite(orientation).all(axis=1)
        orientation[~known] = np.nan
        if layout.up == "y" and known.any():
            orientation[known] = (_TURN * Rotation.from_quat(orientation[known]) * _TURN.inv()).as_quat()
    return Track("body", "", body.name, t, position, orientation)


def _check_up(file: Path, format: str, points: Points, layout: Layout) -> None:
    """Refuse a capture in which everything climbs and nothing moves sideways: it has another axis up.

    No header of these formats says which axis is up. Things that drive or walk rise by little.
    """
    xyz = points.xyz[:: max(1, len(points.t) // 2000)]
    seen = np.isfinite(xyz[..., 0]).any(axis=0)
    if not seen.any():
        return
    with np.errstate(all="ignore"):
        spread = np.nanmedian(np.nanmax(xyz[:, seen], axis=0) - np.nanmin(xyz[:, seen], axis=0), axis=0)
    x, y, z = (float(s) for s in spread)
    if z > _RISE and z > 5 * y:
        other = {"trc": "trc-y-up", "motive": "motive-z-up"}.get(format)
        which = "y" if layout.up == "z" else "z"
        way = f"; if so, say up = {which!r} in the test plan's source, or in {beside(file).name} beside it" + (
            f", or format = {other!r}" if other else ""
        )
        raise ClearwayError(
            f"with {layout.up} up, its markers rise by {z:.2f} m and move by {x:.2f} m and {y:.2f} m over the floor: "
            f"another axis seems to be up{way}",
            file=file,
            field="axes",
        )
