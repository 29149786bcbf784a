"""One file a format. `MODULES` is the registry: a new format is a file with its `FORMATS` and one line here; another
package registers its own under the entry-point group `clearway.formats`.

A file's format is told by its contents first, by its ending second; where both fail, the error says what was tried.
"""

from __future__ import annotations

import importlib
import os
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Literal

from pydantic import Field

from clearway.errors import ClearwayError, unknown
from clearway.recordings.formats import axes, beside, table
from clearway.recordings.formats.delimited import head_of
from clearway.recordings.formats.format import Format
from clearway.recordings.recording import Contents, Recording, Want, believable, contents_of
from clearway.registry import Registry
from clearway.validation import Table

MODULES = (
    "c3d",
    "bag",
    "motive",
    "vicon",
    "qualisys",
    "qualisys_json",
    "trc",
    "tum",
    "kitti",
    "euroc",
    "table",
    "pedestrians",
)
"""Files of this folder, each with its `FORMATS`, the surest to recognise first."""


@cache
def formats() -> dict[str, Format]:
    """Every format by its name, in the order in which they are tried: those of other packages last.

    Raises:
        ClearwayError: another package registers one wrongly.
    """
    modules = [importlib.import_module(f"{__name__}.{m}") for m in MODULES]
    shipped = {f.name: f for module in modules for f in module.FORMATS}
    others = Registry("format", "clearway.formats", {}).all_of(Format)
    if twice := shipped.keys() & others.keys():
        raise ClearwayError(f"another package registers a format {min(twice)!r}, which Clearway has; rename it")
    return shipped | others


def identify(path: str | Path) -> Format:
    """The format of a file (or of a folder: a ROS 2 bag).

    Raises:
        ClearwayError: there is no such file, it is empty, or of no known format.
    """
    file = _named(path)
    head = _head(file)
    known = formats().values()
    for f in known:
        if f.sniff(file, head):
            return f
    ending = [f for f in known if file.suffix.lower() in f.suffixes]
    if len(ending) == 1:
        return ending[0]  # its reader says what is wrong with it
    if file.is_dir():
        raise ClearwayError("is a folder, but no ROS 2 bag: name the files in it", file=path)
    raise ClearwayError(f"is of no known format; name one of: {', '.join(formats())}", file=file, field="format")


def read(path: str | Path, want: Want | None = None, *, format: str | None = None) -> Recording:
    """Read a recording.

    Raises:
        ClearwayError: the file can't be read as `format` (None: the format that it looks like), or lacks what is wanted.
    """
    chosen = _format(path, format)
    asked = _as_said(_named(path), chosen, want or Want())
    if asked.time is not None and chosen.name not in UNTIMED:
        raise ClearwayError(f"a file of format {chosen.name!r} says its times itself", file=path, field="time")
    recording = believable(chosen.read(_named(path), asked))
    return recording if asked.up is None else replace(axes.turned(recording, asked.up), up_said=True)


class _Beside(Table):
    """What a file doesn't say itself, in a TOML beside it."""

    up: axes.Axis | None = Field(default=None, description="the axis that points up")
    time: Literal["s", "ms", "us", "ns"] | None = Field(default=None, description="unit of its stamps (tum)")


UNTIMED = ("tum",)
"""Formats that don't say the unit of their stamps."""
OWN = ("c3d", "kitti", "pedestrians", "table")
"""Formats whose readers take what stands beside a file themselves."""


def _as_said(file: Path, format: Format, want: Want) -> Want:
    """What is wanted, with what a TOML beside the file says of it."""
    description = beside.beside(file)
    if format.name in OWN or not description.is_file() or table.describes_a_table(description):
        return want
    said = beside.hints(file, _Beside)
    return replace(want, up=want.up or said.up, time=want.time or said.time)


def look(path: str | Path, *, format: str | None = None, time: str | None = None) -> Contents:
    """What a file holds: names, kinds, rates, gaps, duration; `time`: as of `Want`.

    Raises:
        ClearwayError: as for `read`.
    """
    chosen = _format(path, format)
    asked = _as_said(_named(path), chosen, Want(time=time))
    return chosen.look(_named(path)) if asked.time is None else contents_of(read(path, asked, format=chosen.name))


def _named(path: str | Path) -> Path:
    """The path with the name of what it leads to: `.` has none."""
    return Path(path) if Path(path).name else Path(path).resolve()


def _format(path: str | Path, name: str | None) -> Format:
    if name is None:
        return identify(path)
    if name not in formats():
        raise unknown("format", name, formats(), file=path)
    _head(Path(path))
    return formats()[name]


def _head(file: Path) -> bytes:
    return b"" if os.path.isdir(file) else head_of(file)


__all__ = ["MODULES", "Format", "formats", "identify", "look", "read"]
