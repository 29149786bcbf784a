"""The few lines of TOML that say what the columns of a plain table are."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from clearway.recordings.formats.axes import Axis
from clearway.recordings.formats.delimited import MISSING, Header
from clearway.validation import Table

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}

Column = str
"""A column's name in the header; "1", "2", ... where there is none."""


class TimeSpec(Table):
    """The column that says when."""

    column: Column
    unit: Literal["s", "ms", "us", "ns", "frame", "date"] = Field(
        default="s",
        description="frame: numbers of frames, at `rate`; date: as 2026-03-01T12:00:00.250, UTC unless stated",
    )
    rate: float | None = Field(default=None, gt=0, le=1e9, description="frames a second")

    @model_validator(mode="after")
    def _rate_of_frames(self) -> TimeSpec:
        if (self.unit == "frame") != (self.rate is not None):
            raise ValueError('a rate in frames a second is needed with unit = "frame", and with no other')
        return self


class BodySpec(Table):
    """The columns of one thing that moves. Without yaw and quaternion it has no heading."""

    x: Column
    y: Column
    z: Column | None = None
    yaw: Column | None = Field(
        default=None, description="heading about the axis that is up, or down, as the file has it"
    )
    angle: Literal["rad", "deg"] = Field(default="rad", description="unit of yaw and omega")
    quaternion: tuple[Column, Column, Column, Column] | None = None
    order: Literal["xyzw", "wxyz"] = Field(default="xyzw", description="of the quaternion's columns as named here")
    v: Column | None = Field(default=None, description="measured speed along its own x, unit of length a second")
    omega: Column | None = Field(default=None, description="measured turning rate, `angle` a second")
    sigma: Column | None = Field(default=None, description="standard uncertainty of the position, unit of length")
    sigma_yaw: Column | None = Field(default=None, description="standard uncertainty of the heading, `angle`")

    @model_validator(mode="after")
    def _one_heading(self) -> BodySpec:
        if self.yaw is not None and self.quaternion is not None:
            raise ValueError("say yaw or quaternion, not both")
        return self

    def columns(self) -> tuple[Column, ...]:
        """Every column that it names."""
        single = (self.x, self.y, self.z, self.yaw, self.v, self.omega, self.sigma, self.sigma_yaw)
        return tuple(c for c in (*single, *(self.quaternion or ())) if c is not None)

    def prefixed(self, prefix: str) -> BodySpec:
        """The same columns with `prefix` before each name."""
        one = {
            k: prefix + v
            for k in ("x", "y", "z", "yaw", "v", "omega", "sigma", "sigma_yaw")
            if (v := getattr(self, k)) is not None
        }
        four = self.quaternion and tuple(prefix + c for c in self.quaternion)
        return self.model_copy(update={**one, "quaternion": four})


class TableSpec(Table):
    """How a plain table (CSV) is to be read. Give `bodies`, or `markers`, or both.

    Several bodies may have their own columns (`[bodies.robot]`, `[bodies.cart]`), the same columns with a prefix
    before each name (`[bodies.each]`, `prefixes = ["robot_", "cart_"]`), or lines of their own, told apart by a column
    (`[bodies.each]`, `id = "agent"`).
    """

    separator: str | None = Field(default=None, min_length=1, max_length=1, description='" ": blanks; default: found')
    decimal: Literal[".", ","] | None = Field(default=None, description="default: found")
    encoding: str | None = Field(default=None, description="default: found")
    skip: int = Field(default=0, ge=0, le=10_000, description="lines before the header")
    header: Header | None = Field(
        default=None,
        description='what names the columns: the first line, the last comment before the data, or none: then they are "1", '
        '"2", ...; default: found',
    )
    comment: str = Field(default="#", description="lines that begin so are left out; empty: none")
    missing: tuple[str, ...] = Field(default=MISSING, description="words for no value")
    units: Literal["m", "dm", "cm", "mm", "in", "ft"] = "m"
    up: Axis = Field(
        default="z",
        description="axis that points up; -z: z points down, as in PX4's logs, or y runs down the picture that x and y "
        "were taken from; -y: a camera's axes",
    )
    frame: str = Field(default="", description="name of the frame that poses are in")
    time: TimeSpec
    bodies: dict[str, BodySpec] = Field(default={})
    id: Column | None = Field(default=None, description="the column that says whose line it is")
    prefixes: tuple[str, ...] = Field(default=(), description="of the columns of bodies.each, one a body")
    markers: dict[str, tuple[Column, Column, Column]] = Field(default={}, description="columns of x, y and z of each")
    marker_suffixes: tuple[str, str, str] | None = Field(
        default=None, description='such as ["_x", "_y", "_z"]: all columns that end so are markers'
    )

    @model_validator(mode="after")
    def _something_to_read(self) -> TableSpec:
        if not (self.bodies or self.markers or self.marker_suffixes):
            raise ValueError("says neither bodies nor markers; give the columns of at least one")
        if self.id is not None and self.prefixes:
            raise ValueError("say id or prefixes, not both")
        if (self.id is not None or self.prefixes) and set(self.bodies) != {"each"}:
            raise ValueError("with id or prefixes, the columns stand in [bodies.each] and nowhere else")
        if self.id is not None and (self.markers or self.marker_suffixes):
            raise ValueError("markers can't stand in a table that has a line a body")
        return self
