"""C3D, the exchange format of motion capture: Vicon, Qualisys, Optotrak, Motive and others write it.

Read and written with numpy, block by block: a damaged file can't bring a parser down, and analog channels, which are
often most of a file, are stepped over. A point whose residual is negative was not seen (C3D user guide, c3d.org).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.reading import opened
from clearway.recordings.formats import beside
from clearway.recordings.formats.c3d_parameters import (
    BLOCK,
    KEY,
    PROCESSORS,
    UP,
    Head,
    read_head,
    reals,
    words,
)
from clearway.recordings.formats.c3d_writer import write
from clearway.recordings.formats.capture_fields import is_unlabelled, unique, unit, wanted_of
from clearway.recordings.formats.format import Format
from clearway.recordings.recording import Contents, Points, Recording, Want, describe
from clearway.validation import Table

CHUNK = 4 << 20
"""Bytes of data that are held at a time."""

OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
"""Parameters of POINT that name points which are no positions: what a body model computed."""


class Hints(Table):
    """What a C3D file may leave out, in a TOML beside it.

    Attributes:
        units: Unit of length of the points; None: what the file says.
        up: The axis that points up; None: what the file says.
    """

    units: Literal["m", "dm", "cm", "mm", "in", "ft"] | None = None
    up: Literal["+X", "-X", "+Y", "-Y", "+Z", "-Z", "x", "y", "z"] | None = None


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where everything of one file is. names: (m) of the points that are positions, index: (m,) which points they are.
    metres: that one unit is. turn: (3, 3) to the z-up frame."""

    head: Head
    names: tuple[str, ...]
    index: Any
    first: int
    frames: int
    rate: float
    metres: float
    scale: float
    turn: FloatArray
    start: int
    notes: tuple[str, ...]
    up: str
    up_said: bool

    @property
    def width(self) -> int:
        """Bytes of a value."""
        return 4 if self.scale < 0 else 2

    @property
    def stride(self) -> int:
        """Bytes of a frame, analog data included."""
        return (4 * self.head.points + self.head.analog) * self.width

    def time(self, start: int, stop: int) -> FloatArray:
        """t [s] of the frames `start` to `stop`; t = 0 is frame number 1, or 0 where the file counts from 0."""
        return (np.arange(start, stop) + self.first - min(self.first, 1)) / self.rate


def sniff(path: Path, head: bytes) -> bool:
    """Whether it begins as a C3D file does."""
    if len(head) < BLOCK or head[1] != KEY or head[0] < 2:
        return False
    at = (head[0] - 1) * BLOCK
    return head[at + 3] in PROCESSORS if at + 4 <= len(head) else path.suffix.lower() == ".c3d"


def read(path: Path, want: Want) -> Recording:
    """Every wanted point of a C3D file; of those that nobody labelled only what is asked for by name.

    Raises:
        ClearwayError: it is damaged or truncated, names no unit, or lacks a wanted point.
    """
    with opened(path) as source:
        layout = _layout(source, os.fstat(source.fileno()).st_size, path, up=want.up)
        for name in sorted(want.names or ()):
            if name not in layout.names:
                raise unknown("marker", name, layout.names, file=path)
        wanted = set(wanted_of(layout.names, want))
        chosen = [i for i, name in enumerate(layout.names) if name in wanted]
        layout = replace(layout, names=tuple(layout.names[i] for i in chosen), index=layout.index[chosen])
        start, stop = 0, layout.frames
        if want.span is not None:
            times = layout.time(0, layout.frames)
            start = int(np.searchsorted(times, want.span[0]))
            stop = max(start, int(np.searchsorted(times, want.span[1], side="right")))
        xyz = np.empty((stop - start, len(chosen), 3))
        zeros = 0
        for at, values, seen, empty in _chunks(source, layout, start, stop, path):
            zeros += int(empty.sum())
            values[~seen] = np.nan
            xyz[at - start : at - start + len(values)] = values
    notes = layout.notes
    if zeros:
        notes += (f"{zeros} samples at exactly 0, 0, 0 that no camera saw were taken as unseen",)
    points = Points(layout.names, layout.time(start, stop), xyz)
    return Recording(path, "c3d", points, notes=notes, up=layout.up, up_said=layout.up_said)


def look(path: Path) -> Contents:
    """The points of a C3D file, their rate and gaps.

    Raises:
        ClearwayError: as for `read`; only the unit may be missing.
    """
    with opened(path) as source:
        layout = _layout(source, os.fstat(source.fileno()).st_size, path, units=False)
        there = np.zeros((layout.frames, len(layout.names)), dtype=bool)
        for at, _, seen, _ in _chunks(source, layout, 0, layout.frames, path):
            there[at : at + len(seen)] = seen
    t = layout.time(0, layout.frames)
    details = ["unlabelled" if is_unlabelled(name) else "" for name in layout.names]
    entries = tuple(describe(n, "marker", t, there[:, i], details[i]) for i, n in enumerate(layout.names))
    start, end = (float(t[0]), float(t[-1])) if len(t) else (None, None)
    return Contents(path, "c3d", start, end, None, entries, layout.notes)


def _layout(source: BinaryIO, size: int, path: Path, *, units: bool = True, up: str | None = None) -> _Layout:
    """What the file says of itself; `units`: it has to say those too, else a note is made of it; `up`: the axis that is."""
    head = read_head(source, size, path)
    hints = beside.hints(path, Hints)
    notes: list[str] = []
    scale = head.number("POINT:SCALE")
    scale = head.scale if scale is None or scale == 0 else scale
    if not np.isfinite(scale) or scale == 0 or (head.scale and (scale < 0) != (head.scale < 0)):
        raise ClearwayError(
            f"is {scale:g}, in the header {head.scale:g}; both must be the size of an integer's unit, or negative where "
            "the data are real numbers",
            file=path,
            field="POINT:SCALE",
        )
    if scale > 0 and _differ(scale, head.scale):
        notes.append(f"POINT:SCALE says {scale:g}, the header {head.scale:g}; the parameter was taken")
    rate = head.number("POINT:RATE")
    rate = head.rate if rate is None or rate == 0 else rate
    if not 1e-3 <= rate <= 1e6:
        raise ClearwayError(f"is {rate:g}; it has to be the frames a second", file=path, field="POINT:RATE")
    if _differ(rate, head.rate):
        notes.append(f"POINT:RATE says {rate:g} Hz, the header {head.rate:g}; the parameter was taken")
    head, settled = _agreed(head, rate, 4 if scale < 0 else 2, size, path)
    names, index, said = _names(head)
    notes += (*settled, *said)
    metres = 1.0
    try:
        metres = _metres(head, hints.units, path) if names else 1.0
    except ClearwayError as error:
        if units:
            raise
        notes.append(f"not to be read yet: {error.field} {error.problem}")
    axis, axis_said, note = _up(head, up or hints.up)
    turn = np.array(UP[axis], dtype=np.float64)
    start = (head.data_block - 1) * BLOCK
    layout = _Layout(
        head, names, index, 1, 0, rate, metres, scale, turn, start, (), axis.lower().lstrip("+"), axis_said
    )
    first, frames, why = _frames(head, layout.stride, size - start, path)
    notes += [n for n in (why, note) if n]
    if first > 1:
        notes.append(f"it begins with frame {first}: t = 0 is frame 1, at {rate:g} frames a second")
    return replace(layout, first=first, frames=frames, notes=tuple(notes))


def _differ(parameter: float, header: float) -> bool:
    """Whether both are given, and are not the same number with the precision of a file's real numbers."""
    return header > 0 and abs(parameter - header) > 1e-3 * header


def _agreed(head: Head, rate: float, width: int, size: int, path: Path) -> tuple[Head, list[str]]:
    """The header with the number of points and analog values a frame and the first block of data that the file's size
    bears out, where it and the parameters disagree, and what is to be said of that.

    Args:
        rate: Frames in a second, Hz.
        width: Bytes of a value.
        size: Bytes of the file.
    """
    used, block = head.number("POINT:USED"), head.number("POINT:DATA_START")
    points = head.points if used is None or not np.isfinite(used) else int(used)
    analog = _analog(head, rate)
    if analog is None:  # a header that is wrong is believed no more where only no channels at all fit
        fit = [_fits((points, n, head.data_block), head, width, size, path) for n in (head.analog, 0)]
        analog = 0 if fit == [False, True] else head.analog
    # Some programs leave DATA_START empty.
    starts = [head.data_block] if block is None or not 2 <= block <= size // BLOCK else [head.data_block, int(block)]
    sides = [("points a frame", head.points, points), ("analog values a frame", head.analog, analog)]
    sides.append(("the first block of its data", head.data_block, starts[-1]))
    claims = list(dict.fromkeys(product(*(dict.fromkeys(pair) for _, *pair in sides))))
    fitting = [claim for claim in claims if len(claims) > 1 and _fits(claim, head, width, size, path)]
    if len(claims) > 1 and len(fitting) != 1:
        differences = "; ".join(f"{what}: {a}, by its parameters {b}" for what, a, b in sides if a != b)
        raise ClearwayError(
            f"its header and its parameters disagree, and its {size} bytes don't tell which is right: {differences}; it is "
            "truncated or damaged",
            file=path,
        )
    points, analog, start = (fitting or claims)[0]
    if start < 2 or (start - 1) * BLOCK > size:
        raise ClearwayError(
            f"its data are said to begin in block {start}, but it has {size} bytes: it is truncated or damaged",
            file=path,
        )
    notes = [
        f"{what}: {a} by its header, {b} by its parameters; {taken} was taken, by the file's size"
        for (what, a, b), taken in zip(sides, (points, analog, start), strict=True)
        if a != b
    ]
    return replace(head, points=points, analog=analog, data_block=start), notes


def _analog(head: Head, rate: float) -> int | None:
    """Analog values a frame, by the parameters; None if they don't say."""
    channels, analog_rate = head.number("ANALOG:USED"), head.number("ANALOG:RATE")
    if channels is None or not np.isfinite(channels):
        return None
    if analog_rate and 0 < analog_rate < np.inf:
        return int(channels) * max(1, round(analog_rate / rate))
    return int(channels) * max(1, head.samples)


def _fits(claim: tuple[int, ...], head: Head, width: int, size: int, path: Path) -> bool:
    """Whether frames of so many points and analog values, from that block on, fill the file to its last block."""
    points, analog, block = claim
    stride, left = (4 * points + analog) * width, size - (block - 1) * BLOCK
    try:
        _, frames, _ = _frames(head, stride, left, path)
    except ClearwayError:
        return False
    return frames > 0 and 0 <= left - frames * stride < BLOCK


def _frames(head: Head, stride: int, left: int, path: Path) -> tuple[int, int, str]:
    """Number of the first frame, how many there are, and a note where the file contradicts itself.

    16-bit counts end at 65535. Longer captures say theirs as two words in TRIAL, or in POINT:LONG_FRAMES.
    """
    if stride == 0:
        return 1, 0, ""
    plain = head.last - head.first + 1
    start, end = head.numbers("TRIAL:ACTUAL_START_FIELD"), head.numbers("TRIAL:ACTUAL_END_FIELD")
    said: list[tuple[str, int, int]] = []
    if len(start) == len(end) == 2:
        first, last = (int(w[0]) + 65536 * int(w[1]) for w in (start, end))
        said.append(("TRIAL:ACTUAL_END_FIELD", first, last - first + 1))
    for name in ("POINT:LONG_FRAMES", "POINT:FRAMES"):
        count = head.number(name)
        if count is not None and np.isfinite(count) and not (name == "POINT:FRAMES" and count >= 65535):
            said.append((name, head.first, int(count)))
    said.append(("the header", head.first, plain))
    said = [s for s in said if s[2] > 0] or [("the header", head.first, 0)]
    name, first, frames = said[0]
    if frames * stride > left:
        # Of counts that contradict each other one may still be that of the data, to the block.
        exact = [s for s in said if 0 <= left - s[2] * stride < BLOCK]
        if not exact:
            raise ClearwayError(
                f"promises {frames} frames of {stride} bytes, but {left} bytes of data are left, {left // stride} frames: "
                "it is truncated or damaged",
                file=path,
            )
        name, first, frames = exact[0]
    others = {f"{n}: {k}" for n, _, k in said if k != frames and not (k == 65535 and frames > 65535)}
    note = f"its counts of frames differ; {name}: {frames} was taken, not {', '.join(sorted(others))}" if others else ""
    return first, frames, note


def _names(head: Head) -> tuple[tuple[str, ...], Any, tuple[str, ...]]:
    """Unique names of the points that are positions, which points they are, and what is to be said of that."""
    labels: list[str] = []
    number = 1
    while found := head.texts(f"POINT:LABELS{number if number > 1 else ''}"):
        labels += found
        number += 1
    labels = [name or f"point {i + 1}" for i, name in enumerate(labels[: head.points])]
    labels += [f"point {i + 1}" for i in range(len(labels), head.points)]
    outputs = {text for kind in OUTPUTS for text in head.texts(f"POINT:{kind}")}
    index = [i for i, name in enumerate(labels) if name not in outputs]
    names, notes = unique(labels[i] for i in index)
    if left_out := head.points - len(index):
        notes += (f"left out {left_out} points that are no positions (angles, forces and the like of a body model)",)
    return names, np.array(index, dtype=np.intp), notes


def _metres(head: Head, given: str | None, path: Path) -> float:
    texts = head.texts("POINT:UNITS")
    text = given or (texts[0] if texts else "")
    if not text:
        raise ClearwayError(
            f'is empty: the unit of its positions is not known and not guessed; write units = "mm" (or what is true) '
            f"into {beside.beside(path).name} beside it",
            file=path,
            field="POINT:UNITS",
        )
    return unit(text, file=path, field="POINT:UNITS")


def _up(head: Head, given: str | None) -> tuple[str, bool, str]:
    """The axis that is up, a key of `UP`, whether the file or somebody says so, and what was done.

    The parameter says which axis points up on a screen. Its sign is not to be trusted: Qualisys writes -Z for captures
    whose z grows upwards.
    """
    screen = head.texts("POINT:Y_SCREEN")
    said = (given or (screen[0] if screen else "")).upper()
    axis = said if given and said.startswith("-") else "+" + said.lstrip("+-")
    if axis not in UP:
        return (
            "+Z",
            False,
            "it doesn't say which axis is up (POINT:Y_SCREEN), z was taken; if it is y, write up = 'y' into FILE.c3d.toml beside it",
        )
    notes = []
    if said.startswith("-") and not given:
        notes.append(f"POINT:Y_SCREEN says {said}; {axis} was taken as up, as Qualisys means by it")
    if axis != "+Z":
        notes.append(f"its {axis} axis is up: turned to z-up")
    return axis, True, "; ".join(notes)


def _chunks(
    source: BinaryIO, layout: _Layout, start: int, stop: int, path: Path
) -> Iterator[tuple[int, Any, Any, Any]]:
    """Pieces of the data: the frame, positions (k, m, 3) m, z up, seen (k, m), zero and without a camera (k, m)."""
    stride, points, width = layout.stride, layout.head.points, layout.width
    at_once = max(1, CHUNK // max(stride, 1))
    unpack = reals if width == 4 else words
    chosen = slice(None) if len(layout.index) == points else layout.index
    axes = np.abs(layout.turn).argmax(axis=1)  # a turn by right angles: which axis comes where, and its sign
    factors = layout.turn.sum(axis=1) * layout.metres * (layout.scale if width == 2 else 1.0)
    for at in range(start, stop, at_once):
        count = min(at_once, stop - at)
        source.seek(layout.start + at * stride)
        data = source.read(count * stride)
        if len(data) < count * stride:
            raise ClearwayError(f"ends within frame {at + len(data) // stride}: it is truncated", file=path)
        body = np.frombuffer(data, np.uint8).reshape(count, stride)[:, : 4 * points * width]
        values = unpack(body.tobytes(), layout.head.processor).reshape(count, points, 4)[:, chosen]
        x, y, z, residual = (values[..., i] for i in range(4))
        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.isfinite(x * 1.0 + y + z + residual)  # NaN and infinities stay such in a sum
            empty = (x == 0) & (y == 0) & (z == 0) & (residual == 0)
            seen = finite & (residual >= 0) & ~empty
            xyz = values[..., axes].astype(np.float64)
            xyz *= factors
        yield at, xyz, seen, empty


FORMATS = (Format("c3d", "C3D motion capture", (".c3d",), sniff, read, look, write),)
