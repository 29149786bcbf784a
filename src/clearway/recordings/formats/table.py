"""A plain table (CSV), described by a few lines of TOML: `FILE.csv.toml` or `FILE.toml` beside it, or named in the plan.

Without a description nothing is guessed: the error lists the columns and suggests a description to be corrected.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.reading import read_toml
from clearway.recordings.formats import beside, pedestrians, tum
from clearway.recordings.formats.axes import turn_of
from clearway.recordings.formats.delimited import (
    Codes,
    Dialect,
    dialect_of,
    first_lines,
    head_of,
    header_of,
    pieces,
    stacked,
    written,
)
from clearway.recordings.formats.format import Format
from clearway.recordings.formats.table_proposal import NOTHING, proposal, quaternion_of, quoted, rows_of
from clearway.recordings.formats.table_spec import (
    METRES,
    BodySpec,
    TableSpec,
    TimeSpec,
)
from clearway.recordings.formats.text import encoding_of
from clearway.recordings.recording import Contents, Entry, Points, Recording, Track, Want, contents_of
from clearway.recordings.times import SECONDS, must_be

SUFFIXES = (".csv", ".tsv", ".dat")

EPOCH = 1e8
"""s; a stamp beyond it (1973) is taken for UNIX time."""


def sniff(path: Path, head: bytes) -> bool:
    """Whether it is described by a TOML beside it, or looks like a table with a line of names."""
    lines = first_lines(head)
    if not lines:
        return False
    if (description := _description(path)) is not None and describes_a_table(description):
        return True
    dialect = dialect_of(lines, encoding_of(head))
    if dialect is None or pedestrians.sniff(path, head):
        return False
    return dialect.header != "none" or path.suffix.lower() in SUFFIXES


def _description(path: Path) -> Path | None:
    if not path.name:  # a folder such as `.`
        return None
    own, other = beside.beside(path), path.with_suffix(".toml")
    if own.is_file():
        return own
    return other if other != path and other.is_file() and describes_a_table(other) else None


def describes_a_table(description: Path) -> bool:
    """Whether a TOML has what every description of a table must have; others may stand beside a file too."""
    try:
        return isinstance(read_toml(description).get("time"), dict)
    except ClearwayError:
        return False


def read(path: Path, want: Want) -> Recording:
    """What the description beside the table says is in it.

    Raises:
        ClearwayError: there is no description, or as for `read_with`.
    """
    description = _description(path)
    if description is None:
        columns, suggestion = _suggestion(path)
        what_to_do = f". Put this, corrected, into {beside.beside(path).name} beside it:\n{suggestion}"
        raise ClearwayError(
            f"is a plain table; say what its columns are. They are: {', '.join(columns)}"
            + (
                what_to_do
                if suggestion
                else f". {NOTHING}; a description of them would stand in {beside.beside(path).name}"
            ),
            file=path,
        )
    return read_with(path, description, want)


def read_with(path: Path, description_path: Path, want: Want) -> Recording:
    """What the description `description_path` (a `TableSpec` in TOML) says is in the table `path`.

    Raises:
        ClearwayError: the description is wrong, names columns that aren't there, or a value is no number.
    """
    spec = beside.load(description_path, TableSpec)
    if want.up is not None:
        spec = spec.model_copy(update={"up": want.up})
    dialect = _dialect(head_of(path), spec)
    header = header_of(path, dialect)
    bodies = {n.rstrip("_.:- ") or n: spec.bodies["each"].prefixed(n) for n in spec.prefixes} or dict(spec.bodies)
    bodies, notes = _with_headings(bodies, header, alone=len(bodies) == 1 and not spec.prefixes)
    markers = _markers(spec, header, description_path)
    asked = [
        spec.time.column,
        *(c for b in bodies.values() for c in b.columns()),
        *(c for m in markers.values() for c in m),
    ]
    for column in (*asked, *([spec.id] if spec.id else [])):
        if column not in header:
            raise unknown("column", column, header, file=description_path)
    if spec.id is None and want.names is not None:
        for name in sorted(want.names):
            if name not in bodies and name not in markers:
                raise unknown("body or marker", name, (*bodies, *markers), file=path)
        bodies = {k: b for k, b in bodies.items() if k in want.names}
        markers = {k: m for k, m in markers.items() if k in want.names}
    data, number, names, epoch = _load(path, dialect, spec, bodies, markers, want, notes)
    if spec.up != "z":
        notes.append(f"its {spec.up.upper()} axis is up: turned to z-up")
    if spec.units != "m":
        notes.append(f"{spec.units} were scaled to metres")
    tracks: dict[str, Track] = {}
    if spec.id is not None:
        for name in sorted(want.names or ()):
            if name not in names:
                raise unknown("body", name, names, file=path)
        order = np.argsort(number, kind="stable")
        ends = np.searchsorted(number[order], np.arange(len(names) + 1))
        for i, name in enumerate(names):
            if want.has(name):
                mine = {c: v[order[ends[i] : ends[i + 1]]] for c, v in data.items()}
                tracks[name] = _track(mine, spec, bodies["each"], name, path, notes)
    else:
        tracks = {name: _track(data, spec, body, name, path, notes) for name, body in bodies.items()}
    points = _points(data, spec, markers, path, notes) if markers else None
    return Recording(
        path,
        "table",
        points,
        tracks,
        epoch=epoch,
        notes=tuple(dict.fromkeys(notes)),
        up=spec.up,
        up_said=want.up is not None or "up" in spec.model_fields_set,
    )


def _with_headings(
    bodies: dict[str, BodySpec], header: tuple[str, ...], *, alone: bool
) -> tuple[dict[str, BodySpec], list[str]]:
    """Bodies whose description says no heading get that of the quaternion that stands beside their position by its name."""
    found: dict[str, BodySpec] = {}
    notes: list[str] = []
    for name, body in bodies.items():
        four = quaternion_of(body.x, header, alone=alone) if body.yaw is None and body.quaternion is None else None
        found[name] = body if four is None else body.model_copy(update={"quaternion": four, "order": "xyzw"})
        if four is not None:
            notes.append(f"{name}: its heading is that of the columns {', '.join(four)}, as nothing else is said")
    return found, notes


def _dialect(head: bytes, spec: TableSpec) -> Dialect:
    encoding = spec.encoding or encoding_of(head)
    lines = first_lines(head)[spec.skip :]
    found = dialect_of(lines, encoding) or Dialect(encoding=encoding)
    return Dialect(
        spec.separator or found.separator,
        spec.decimal or (found.decimal if spec.separator in (None, found.separator) else "."),
        encoding,
        spec.skip,
        spec.header or found.header,
        spec.comment,
        spec.missing,
    )


def _markers(spec: TableSpec, header: tuple[str, ...], file: Path) -> dict[str, tuple[str, str, str]]:
    markers = dict(spec.markers)
    if spec.marker_suffixes is not None:
        a, b, c = spec.marker_suffixes
        for column in header:
            stem = column[: len(column) - len(a)]
            if column.endswith(a) and stem and stem + b in header and stem + c in header:
                markers.setdefault(stem, (column, stem + b, stem + c))
        if not markers:
            raise ClearwayError(
                f"no columns end so; there are: {', '.join(header)}", file=file, field="marker_suffixes"
            )
    return markers


def _load(
    path: Path,
    dialect: Dialect,
    spec: TableSpec,
    bodies: dict[str, BodySpec],
    markers: dict[str, tuple[str, str, str]],
    want: Want,
    notes: list[str],
) -> tuple[dict[str, FloatArray], Any, list[str], float | None]:
    """The wanted columns, `t` [s] among them as the empty name; whose line it is, as a number of the names; the epoch."""
    numbers = list(
        dict.fromkeys((*(c for b in bodies.values() for c in b.columns()), *(c for m in markers.values() for c in m)))
    )
    stamp = spec.time.column
    texts = [c for c in (spec.id, stamp if spec.time.unit == "date" else None) if c]
    wanted = numbers if spec.time.unit == "date" else list(dict.fromkeys((stamp, *numbers)))
    ids = Codes()
    epoch: float | None = None

    def rows(pieces_of: Iterable[dict[str, Any]]) -> Iterator[FloatArray]:
        nonlocal epoch
        read = 0
        for piece in pieces_of:
            t = _stamps(piece[stamp], spec.time, path)
            if (bad := ~np.isfinite(t)).any():
                raise ClearwayError(f"data line {read + int(bad.argmax()) + 1} has no time", file=path, field=stamp)
            if read == 0 and spec.time.unit != "frame" and len(t) and abs(t[0]) > EPOCH:
                epoch = float(t[0])
            read += len(t)
            t = t - (epoch or 0.0)
            columns = [t, *(piece[n] for n in numbers), *([ids.of(piece[spec.id])] if spec.id else [])]
            inside = slice(None) if want.span is None else (t >= want.span[0]) & (t <= want.span[1])
            yield np.column_stack(columns)[inside]

    pieces_of = pieces(path, dialect, wanted, list(dict.fromkeys(texts)), notes)
    read = stacked(rows(pieces_of), 1 + len(numbers) + bool(spec.id))
    data = {n: read[:, i] for i, n in enumerate(["", *numbers])}
    if spec.id and np.isnan(read[:, -1]).any():
        raise ClearwayError("a line doesn't say whose it is", file=path, field=spec.id)
    return data, read[:, -1].astype(np.intp) if spec.id else None, list(ids.names), epoch


def _stamps(column: Any, time: TimeSpec, path: Path) -> FloatArray:
    """Seconds (n,) of a column of stamps, as numbers or as texts."""
    if time.unit == "date":
        return _dates(column, path, time.column)
    return np.asarray(column * (1 / time.rate if time.rate else SECONDS[time.unit]), dtype=np.float64)


def _dates(texts: Any, path: Path, column: str) -> FloatArray:
    """UNIX time [s] of ISO dates, UTC where they state no zone."""
    if texts.null_count:
        raise ClearwayError("a line has no time", file=path, field=column)
    for kind in (pa.timestamp("ns"), pa.timestamp("ns", tz="UTC")):
        try:
            whole = pyarrow.compute.cast(texts, kind).cast(pa.int64()).to_numpy()
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            continue
        return np.asarray(whole // 1_000_000_000 + (whole % 1_000_000_000) * 1e-9, dtype=np.float64)
    raise ClearwayError(
        f"{texts[0].as_py()!r} ... are not all dates such as 2026-03-01T12:00:00.250", file=path, field=column
    )


_HOW = "say unit = {other} in its [time], or {unit} if that is right"


def _track(
    data: dict[str, FloatArray], spec: TableSpec, body: BodySpec, name: str, path: Path, notes: list[str]
) -> Track:
    scale = METRES[spec.units]
    if spec.time.unit in SECONDS:
        there = np.stack([data[c] if c else np.zeros(len(data[""])) for c in (body.x, body.y)], axis=1) * scale
        said = "unit" in spec.time.model_fields_set
        must_be(spec.time.unit, data[""], there, _HOW, file=path, field=f"time of {name}", said=said)
    keep, more = tum.ordered(data[""], path, f"time of {name}")
    notes += more
    at = [data[c][keep] if c else np.zeros(len(keep)) for c in (body.x, body.y, body.z)]
    position = np.stack(at, axis=1)
    position[~np.isfinite(position).all(axis=1)] = np.nan
    position = position * scale @ turn_of(spec.up).T
    turn = (np.pi / 180 if body.angle == "deg" else 1.0) * (-1 if spec.up.startswith("-") else 1)
    orientation: FloatArray | None = None
    if body.yaw is not None:
        half = data[body.yaw][keep] * turn / 2
        zero = np.where(np.isfinite(half), 0.0, np.nan)
        orientation = np.stack((zero, zero, np.sin(half), np.cos(half)), axis=1)
    elif body.quaternion is not None:
        x, y, z, w = body.quaternion if body.order == "xyzw" else (*body.quaternion[1:], body.quaternion[0])
        q = np.stack([data[c][keep] for c in (x, y, z, w)], axis=1)
        orientation, about = tum.orientations(q, position)
        notes += about
        if orientation is not None and spec.up != "z":
            turned = Rotation.from_matrix(turn_of(spec.up)).as_quat()
            orientation = _product(_product(turned, orientation), turned * (-1, -1, -1, 1))

    def two(a: str | None, b: str | None) -> FloatArray | None:
        """Columns of a length and an angle, NaN for one that isn't there; None without either."""
        none = np.full(len(keep), np.nan)
        length, angle = (data[c][keep] if c else none for c in (a, b))
        return None if a is None and b is None else np.stack((length * scale, angle * turn), axis=1)

    twist, sigma = two(body.v, body.omega), two(body.sigma, body.sigma_yaw)
    if sigma is not None:
        sigma = np.abs(sigma)
    return Track("table", spec.frame, "", np.ascontiguousarray(data[""][keep]), position, orientation, twist, sigma)


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of quaternions (..., 4) xyzw."""
    u, s, v, r = a[..., :3], a[..., 3:], b[..., :3], b[..., 3:]
    vector = s * v + r * u + np.cross(np.broadcast_to(u, np.broadcast_shapes(u.shape, v.shape)), v)
    return np.concatenate((vector, s * r - (u * v).sum(axis=-1, keepdims=True)), axis=-1)


def _points(
    data: dict[str, FloatArray], spec: TableSpec, markers: dict[str, tuple[str, str, str]], path: Path, notes: list[str]
) -> Points:
    if spec.time.unit in SECONDS:
        said = "unit" in spec.time.model_fields_set
        must_be(spec.time.unit, data[""], None, _HOW, file=path, field="time of markers", said=said)
    keep, more = tum.ordered(data[""], path, "time of markers")
    notes += more
    turn = turn_of(spec.up) * METRES[spec.units]
    xyz = np.empty((len(keep), len(markers), 3))
    for i, columns in enumerate(markers.values()):
        xyz[:, i] = np.stack([data[c][keep] for c in columns], axis=1) @ turn.T
    xyz[~np.isfinite(xyz).all(axis=2)] = np.nan
    return Points(tuple(markers), np.ascontiguousarray(data[""][keep]), xyz)


def look(path: Path) -> Contents:
    """What the described table holds; of one without a description, its columns.

    Raises:
        ClearwayError: it is no table, or its description is wrong.
    """
    if _description(path) is not None:
        return contents_of(read(path, Want()))
    columns, suggestion = _suggestion(path)
    note = f"not described yet; put this, corrected, into {beside.beside(path).name} beside it:\n{suggestion}"
    if not suggestion:
        note = f"not described yet; {NOTHING}"
    return Contents(
        path, "table", None, None, None, tuple(Entry(c, "other", 0, detail="column") for c in columns), (note,)
    )


def _suggestion(path: Path) -> tuple[tuple[str, ...], str]:
    """A table's columns, and a description that may do once it is corrected; empty, where nothing looks like poses."""
    head = head_of(path)
    lines = first_lines(head)
    dialect = dialect_of(lines, encoding_of(head))
    if dialect is None:
        raise ClearwayError(
            "is no table: its first lines don't have the same number of columns, split by comma, semicolon, tab or blanks; "
            "lines before the header are left out with `skip` in a description beside it",
            file=path,
        )
    columns = header_of(path, dialect)
    return columns, proposal(columns, rows_of(lines, dialect, len(columns)), dialect)


def write(path: Path, recording: Recording) -> None:
    """The recording's first track, else its points, as a table of metres and seconds, and its description beside it.

    Raises:
        ClearwayError: there is neither, or a file can't be written.
    """
    if not recording.tracks and recording.points is None:
        raise ClearwayError("there is neither a track nor markers to write", file=path)
    columns: dict[str, FloatArray] = {}
    lines = ['separator = ","', 'decimal = "."', 'units = "m"', 'up = "z"']
    if recording.tracks:
        name, track = next(iter(recording.tracks.items()))
        lines += [f"frame = {quoted(track.frame)}", "", "[time]", 'column = "t"', "", f"[bodies.{quoted(name)}]"]
        columns = {"t": track.t, **dict(zip("xyz", track.position.T, strict=True))}
        lines += [f'{c} = "{c}"' for c in "xyz"]
        if track.orientation is not None:
            columns |= dict(zip(("qx", "qy", "qz", "qw"), track.orientation.T, strict=True))
            lines += ['quaternion = ["qx", "qy", "qz", "qw"]', 'order = "xyzw"']
        if track.twist is not None:
            columns |= {"v": track.twist[:, 0], "omega": track.twist[:, 1]}
            lines += ['v = "v"', 'omega = "omega"']
        if track.sigma is not None:
            columns |= {"sigma": track.sigma[:, 0], "sigma_yaw": track.sigma[:, 1]}
            lines += ['sigma = "sigma"', 'sigma_yaw = "sigma_yaw"']
    elif (points := recording.points) is not None:
        lines += ["", "[time]", 'column = "t"', "", "[markers]"]
        columns = {"t": points.t}
        for i, name in enumerate(points.names):
            columns |= {f"{name}_{axis}": points.xyz[:, i, k] for k, axis in enumerate("xyz")}
            lines.append(f"{quoted(name)} = [{', '.join(quoted(f'{name}_{axis}') for axis in 'xyz')}]")
    columns["t"] = columns["t"] + (recording.epoch or 0.0)
    with written(path) as f:
        f.write(",".join('"' + c.replace('"', '""') + '"' for c in columns) + "\n")
        np.savetxt(f, np.stack(list(columns.values()), axis=1), fmt="%.9f", delimiter=",")
    with written(beside.beside(path)) as f:
        f.write("\n".join(lines) + "\n")


FORMATS = (Format("table", "Table (CSV) with a description", SUFFIXES, sniff, read, look, write),)
