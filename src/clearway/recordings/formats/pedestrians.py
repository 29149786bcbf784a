"""Pedestrians as text: `frame id x y` and its kin, as the ETH and UCY sets and what was made of them are kept.

Understood are: four columns `frame id x y`; the ETH set's own `obsmat.txt` of eight, `frame id x z y vx vz vy`
(Pellegrini et al. 2009; the ground is x, y and z points up); and any text table with a line of names, also as a
comment, in which a frame or a time, an id, x and y are found, such as the Jülich archive's `#ID FR X Y Z`; that order without names is
told from the other by people's paths, which don't leap.

Nobody's heading is measured in such a set. Frame numbers become seconds by a stated rate: of a TOML beside the file
(`rate = 25`, frame numbers a second), or of a comment in it (`framerate: 16`). Else the sets' convention is taken,
and said: annotated people are 0.4 s apart (2.5 Hz), whatever their frame numbers are. If people then walk as nobody
does, the file is refused until the rate is given.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats import beside
from clearway.recordings.formats.delimited import (
    Codes,
    Dialect,
    dialect_of,
    first_lines,
    head_of,
    header_of,
    is_number,
    pieces,
    split,
    stacked,
)
from clearway.recordings.formats.format import Format
from clearway.recordings.formats.text import encoding_of
from clearway.recordings.recording import Contents, Entry, Recording, Track, Want, contents_of
from clearway.recordings.times import in_order
from clearway.validation import Table

STEP = 0.4
"""s between two annotations of the ETH and UCY sets (2.5 Hz: every 10th frame at 25 frames a second; ETH's own files
every 6th at 15)."""

SLOWEST, FASTEST = 0.2, 4.0
"""m/s; the upper quartile of people's speeds has to be within, else a rate or a unit that nobody stated can't be right."""

BRISK = 2.2
"""m/s; an upper quartile beyond it is worth a word."""

EPOCH = 1e8
"""s; a time beyond it (1973) is taken for UNIX time."""

NAMES = {
    "frame": ("frame", "frame_id", "frame_number", "frame_num", "frame_no", "frameid", "fr", "frames"),
    "time": ("time", "t", "timestamp", "stamp", "time_s", "times", "sec", "seconds"),
    "id": (
        "id",
        "pedestrian_id",
        "ped_id",
        "pedid",
        "ped",
        "agent_id",
        "agent",
        "person_id",
        "person",
        "personid",
        "track_id",
        "trackid",
        "pedestrian",
        "pid",
        "agentid",
    ),
    "x": ("x", "pos_x", "x_m", "position_x", "world_x", "xcenter", "x_pos", "px", "center_x"),
    "y": ("y", "pos_y", "y_m", "position_y", "world_y", "ycenter", "y_pos", "py", "center_y"),
}
"""What the columns of such files are called."""

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}


class Hints(Table):
    """What a pedestrian set doesn't say itself, in a TOML beside it."""

    rate: float | None = Field(default=None, gt=0, le=1e6, description="frame numbers a second")
    units: Literal["m", "cm", "mm"] | None = Field(default=None, description="of x and y; default: metres")
    frame: str = Field(default="", description="name of the frame that x and y are in")


@dataclass(frozen=True, slots=True)
class _Layout:
    """Which column is what. clock: `frame` or `time`. rate: that a comment states. units: that a name states.
    swapped: whether it was found by people's paths that the id stands first."""

    dialect: Dialect
    clock: str
    columns: tuple[str, str, str, str]
    rate: float | None = None
    units: str | None = None
    swapped: bool = False


def sniff(path: Path, head: bytes) -> bool:
    """Whether its beginning has one of the known layouts."""
    return _layout(head) is not None


def _layout(head: bytes) -> _Layout | None:
    lines = first_lines(head, 400)
    dialect = dialect_of(lines, encoding_of(head))
    if dialect is None:
        return None
    comments = [line.lstrip() for line in lines if line.lstrip().startswith("#")]
    stated = (re.search(r"frame ?_?rate\D{0,12}?(\d+\.?\d*|\.\d+)", c, re.IGNORECASE) for c in comments)
    rate = next((float(m[1]) for m in stated if m), None) or None
    body = [split(x, dialect.separator) for x in lines if x.strip() and not x.lstrip().startswith("#")]
    if dialect.header == "line":
        return _by_names(body[0], dialect, rate)
    if dialect.header == "comment":
        return _by_names(split(comments[-1].lstrip("# "), dialect.separator), dialect, rate)
    try:
        values = np.array([[float(w.replace(dialect.decimal, ".")) for w in row] for row in body])
    except ValueError:
        return None
    return _by_numbers(values, dialect, rate)


def _by_names(words: list[str], dialect: Dialect, rate: float | None) -> _Layout | None:
    """The layout of a file whose columns are named `words`."""
    plain, units = [], []
    for word in words:
        unit = re.search(r"(?:[\[(/_ ])(mm|cm|m)[\])]?$", word.strip(), re.I)
        units.append(unit[1].lower() if unit else None)
        plain.append(re.sub(r"[\[(/].*$", "", word.strip().lower()).strip().replace(" ", "_"))
        if unit and plain[-1].endswith("_" + unit[1].lower()):
            plain[-1] = plain[-1][: -1 - len(unit[1])]
    found = {role: next((i for i, w in enumerate(plain) if w in names), None) for role, names in NAMES.items()}
    clock = "time" if found["time"] is not None else "frame"
    at = [found[role] for role in (clock, "id", "x", "y")]
    if any(i is None for i in at):
        return None
    a, b, c, d = (words[i] for i in at if i is not None)
    return _Layout(dialect, clock, (a, b, c, d), rate, units[at[2]] if at[2] is not None else None)


def _by_numbers(values: FloatArray, dialect: Dialect, rate: float | None) -> _Layout | None:
    """The layout of a file without names, from its first rows."""
    if not np.isfinite(values).all() or values.shape[1] not in (4, 5, 8) or len(values) < 2:
        return None
    whole = (values[:, :2] == np.rint(values[:, :2])).all() and (values[:, :2] >= 0).all()
    # A person is annotated once a frame; a path of x, y that is all whole numbers is in pixels, or no path at all.
    once = len(np.unique(values[:, :2], axis=0)) == len(values)
    if not whole or not once or (values[:, 2:4] == np.rint(values[:, 2:4])).all():
        return None
    if values.shape[1] == 8:
        flat = np.ptp(values[:, 3]) < 1e-3 and np.ptp(values[:, 6]) < 1e-3
        return _Layout(dialect, "frame", ("1", "2", "3", "5"), rate) if flat else None
    swapped = _leap(values, 0) < 0.2 * _leap(values, 1)
    if values.shape[1] == 5 and not swapped:
        return None
    return _Layout(dialect, "frame", ("2", "1", "3", "4") if swapped else ("1", "2", "3", "4"), rate, swapped=swapped)


def _leap(values: FloatArray, column: int) -> float:
    """By how much, on the median, one's next step differs from the last, were the ids in this column, m."""
    rows = values[np.lexsort((values[:, 1 - column], values[:, column]))]
    same = (np.diff(rows[:, column]) == 0)[1:] & (np.diff(rows[:, column]) == 0)[:-1]
    with np.errstate(all="ignore"):
        turns = np.hypot(*np.diff(rows[:, 2:4], n=2, axis=0)[same].T)
    return float(np.median(turns)) if len(turns) else float(np.hypot(*np.ptp(values[:, 2:4], axis=0)))


def read(path: Path, want: Want) -> Recording:
    """Every wanted person of a pedestrian set, each a track named by the id.

    Raises:
        ClearwayError: it is no such file, a value is missing, or its frame numbers can't be turned into seconds.
    """
    return _read(path, want, _known_layout(path), beside.hints(path, Hints))


def _known_layout(path: Path) -> _Layout:
    layout = _layout(head_of(path))
    if layout is None:
        raise ClearwayError(
            "is none of the known pedestrian texts: `frame id x y`, ETH's `frame id x z y vx vz vy`, or columns with a "
            "line of names such as frame, id, x, y; describe it as a table instead",
            file=path,
        )
    return layout


def _read(path: Path, want: Want, layout: _Layout, hints: Hints) -> Recording:
    header = header_of(path, layout.dialect)
    if missing := [c for c in layout.columns if c not in header]:
        raise ClearwayError(
            f"its lines don't all have the columns of its beginning: {missing[0]!r} is missing", file=path
        )
    clock, who, x, y = layout.columns
    numbers, ids = [clock, x, y], Codes()
    notes: list[str] = []
    parts = pieces(path, layout.dialect, numbers, [who], notes)
    rows = stacked((np.column_stack([*(p[n] for n in numbers), ids.of(p[who])]) for p in parts), 4)
    if not len(rows):
        raise ClearwayError("holds no one", file=path)
    for column, what in ((0, layout.clock), (3, "id")):
        if (bad := ~np.isfinite(rows[:, column])).any():
            raise ClearwayError(f"line {int(bad.argmax()) + 1} of its data has no {what}", file=path, field=clock)
    units = hints.units or layout.units or "m"
    rows[:, 1:3] *= UNITS[units]
    # 7, 7.0 and 7.0000000e+00 are one person.
    names, merged = np.unique([_name(text) for text in ids.names], return_inverse=True)
    rows[:, 3] = merged[rows[:, 3].astype(np.intp)]
    rows = rows[np.lexsort((rows[:, 0], rows[:, 3]))]
    number = rows[:, 3].astype(np.intp)
    rows = rows[:, :3]
    if not hints.units and not layout.units:
        notes.append("x and y were taken as metres; nothing says so")
    if layout.swapped:
        notes.append("its first column was taken for the id, its second for the frame: else people would leap")
    epoch: float | None = None
    if layout.clock == "frame":
        interval, note = _interval(rows, number, hints.rate or layout.rate, path)
        rows[:, 0] *= interval
        notes.append(note)
    elif abs(first := float(rows[:, 0].min())) > EPOCH:
        rows[:, 0] -= (epoch := first)
    timed = layout.clock == "time" or bool(hints.rate or layout.rate)
    if not (timed and (hints.units or layout.units)):
        notes.append(_pace(rows, number, path, slowest=0.0 if timed else SLOWEST))
    return _tracks(path, want, hints.frame, rows, number, names.tolist(), epoch, notes)


def _interval(rows: FloatArray, number: Any, rate: float | None, path: Path) -> tuple[float, str]:
    """Seconds from one frame number to the next, and what is to be said of it. rows: (n, 3) frame, x, y by person."""
    if rate:
        return 1 / rate, f"{rate:g} frame numbers a second, as stated"
    steps = np.diff(rows[:, 0])[np.diff(number) == 0]
    steps = steps[steps > 0]
    if not len(steps):
        raise ClearwayError(
            f"nobody is in two frames: how long one takes can't be told; {_ask(path)}", file=path, field="rate"
        )
    step = float(np.median(steps))
    return STEP / step, (
        f"no frame rate is stated: took the ETH/UCY convention of {STEP} s from one annotation to the next, which are "
        f"{step:g} frame numbers apart ({step / STEP:g} a second)"
    )


def _ask(path: Path) -> str:
    return (
        f"write what is true into {beside.beside(path).name} beside it: rate = 25 (frame numbers a second), "
        'units = "m" (or cm, mm)'
    )


def _pace(rows: FloatArray, number: Any, path: Path, *, slowest: float) -> str:
    """At what speed people walk if rate and units are right. rows: (n, 3) t, x, y by person. slowest: m/s; in a jam,
    timed for sure, they may stand.

    Raises:
        ClearwayError: as nobody walks.
    """
    same = np.diff(number) == 0
    with np.errstate(all="ignore"):
        speeds = np.hypot(*np.diff(rows[:, 1:], axis=0)[same].T) / np.diff(rows[:, 0])[same]
    speeds = speeds[np.isfinite(speeds)]
    pace = float(np.quantile(speeds, 0.75)) if len(speeds) else 0.0
    right = slowest <= pace <= FASTEST
    said = f"a quarter of its steps {'are' if right else 'would be'} faster than {pace:.3g} m/s"
    if not right:
        raise ClearwayError(
            f"says neither its frame rate nor its units for sure, and as they were taken {said}; {_ask(path)}",
            file=path,
            field="rate",
        )
    return f"{said}, which is more than a walk: check the rate and the units" if pace > BRISK else said


def _tracks(
    path: Path,
    want: Want,
    frame: str,
    rows: FloatArray,
    number: Any,
    names: list[str],
    epoch: float | None,
    notes: list[str],
) -> Recording:
    """The recording of rows (n, 3) t, x, y, sorted by person and time. number: (n,) whose of `names` they are."""
    for name in sorted(want.names or ()):
        if name not in names:
            raise unknown("person", name, names, file=path)
    tracks: dict[str, Track] = {}
    dropped = 0
    ends = np.searchsorted(number, np.arange(len(names) + 1))
    # Of sorted ids the first to appear comes first, numbers in their order.
    for i in sorted(range(len(names)), key=lambda i: (len(names[i]), names[i])):
        if not want.has(names[i]):
            continue
        mine = rows[ends[i] : ends[i + 1]]
        if want.span is not None:
            mine = mine[(mine[:, 0] >= want.span[0]) & (mine[:, 0] <= want.span[1])]
        keep, _ = in_order(mine[:, 0], file=path, field=f"person {names[i]}")
        dropped += len(mine) - len(keep)
        mine = mine[keep]
        position = np.column_stack((mine[:, 1:], np.where(np.isnan(mine[:, 1]), np.nan, 0.0)))
        tracks[names[i]] = Track("person", frame, "", np.ascontiguousarray(mine[:, 0]), position)
    if dropped:
        notes.append(f"{dropped} lines had the time of another one of the same person; dropped")
    return Recording(path, "pedestrians", tracks=tracks, epoch=epoch, notes=tuple(notes))


def _name(text: str) -> str:
    """An id as people write it: 7 for 7.0 and 7.0000000e+00."""
    if is_number(text) and abs(value := float(text)) < 1e15 and value == round(value):
        return str(round(value))
    return text


def look(path: Path) -> Contents:
    """Who is in the set, when, at what rate; without times where the frames' rate is not known yet.

    Raises:
        ClearwayError: as for `read`; only the rate and the units may be missing.
    """
    layout, hints = _known_layout(path), beside.hints(path, Hints)
    try:
        return contents_of(_read(path, Want(), layout, hints))
    except ClearwayError as error:
        if error.field != "rate":
            raise
        frames = contents_of(_read(path, Want(), layout, Hints(rate=1000, units="m")))
        entries = tuple(
            Entry(
                e.name,
                e.kind,
                e.count,
                detail="" if e.start is None or e.end is None else f"frames {1000 * e.start:.0f} to {1000 * e.end:.0f}",
            )
            for e in frames.entries
        )
        return Contents(path, "pedestrians", None, None, None, entries, (f"not to be read yet: it {error.problem}",))


FORMATS = (Format("pedestrians", "Pedestrian text", (".txt",), sniff, read, look),)
