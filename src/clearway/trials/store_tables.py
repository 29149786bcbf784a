"""The files of a results directory beside `trials.parquet`, and their columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import pyarrow as pa

Tables: TypeAlias = dict[str, pa.Table]
"""By name, as in `FILES`: the rows of one trial or of several."""


def _schema(**columns: tuple[Any, str]) -> pa.Schema:
    return pa.schema(
        [pa.field(n, kind, metadata={"unit": unit} if unit else None) for n, (kind, unit) in columns.items()]
    )


FLOAT, _I, _S = pa.float64(), pa.int32(), pa.string()
_POSE = {"x": (FLOAT, "m"), "y": (FLOAT, "m"), "theta": (FLOAT, "rad")}
TIE = ("tie_xy", "tie_theta")
SIGMA = {"sigma_xy": (FLOAT, "m"), "sigma_theta": (FLOAT, "rad")}
SIDEWAYS = {"velocity": "v_y", "command": "cmd_v_y"}
OPTIONAL = {"velocity": ("v", "omega"), "estimate": ("est_x", "est_y", "est_theta"), "command": ("cmd_v", "cmd_omega")}
_UNITS = {"v": "m/s", "v_y": "m/s", "omega": "rad/s", "x": "m", "y": "m", "theta": "rad"}


@dataclass(frozen=True, slots=True)
class TableFile:
    """A table of a results directory.

    Attributes:
        path: Where it lies, seen from the directory.
        schema: Its columns, an Arrow schema.
    """

    path: str
    schema: Any


FILES: dict[str, TableFile] = {
    "robot": TableFile(
        "trajectories/robot.parquet",
        _schema(
            trial=(_I, ""),
            t=(FLOAT, "s"),
            **_POSE,
            **{c: (FLOAT, _UNITS[c.rpartition("_")[2]]) for columns in OPTIONAL.values() for c in columns},
            leg=(_I, ""),
            cut=(pa.bool_(), ""),
            **SIGMA,
            tie_xy=(FLOAT, "m"),
            tie_theta=(FLOAT, "rad"),
            **dict.fromkeys(SIDEWAYS.values(), (FLOAT, "m/s, to the left; null but of an omnidirectional base")),
        ),
    ),
    "obstacles": TableFile(
        "trajectories/obstacles.parquet", _schema(trial=(_I, ""), t=(FLOAT, "s"), obstacle=(_I, ""), **_POSE, **SIGMA)
    ),
    "between": TableFile(
        "trajectories/between.parquet", _schema(trial=(_I, ""), t=(FLOAT, "s"), body=(_I, "-1: the robot"), **_POSE)
    ),
    "attempts": TableFile(
        "trajectories/attempts.parquet",
        _schema(
            trial=(_I, ""),
            outcome=(_S, ""),
            attempt=(_S, "JSON: robot, shapes, legs, goals, tolerances (m, rad, s)"),
            fixtures=(_S, "key in fixtures.parquet"),
            spans=(_S, "JSON: leg, start, end (s), reached"),
            events=(_S, "JSON: t (s), kind, detail, index of the body"),
            provenance=(_S, "JSON"),
        ),
    ),
    "fixtures": TableFile(
        "trajectories/fixtures.parquet",
        _schema(fixtures=(_S, ""), bodies=(_S, "JSON: walls and furniture of a floor plan (m, rad)")),
    ),
    "snapshots": TableFile(
        "diagnostics/snapshots.parquet",
        _schema(
            trial=(_I, ""),
            snapshot=(_I, ""),
            t=(FLOAT, "s"),
            status=(_S, ""),
            iterations=(pa.int64(), ""),
            field=(pa.binary(), "int8 cells, row by row"),
            rows=(_I, ""),
            cols=(_I, ""),
            resolution=(FLOAT, "m"),
            origin_x=(FLOAT, "m"),
            origin_y=(FLOAT, "m"),
        ),
    ),
    "drawings": TableFile(
        "diagnostics/drawings.parquet",
        _schema(
            trial=(_I, ""),
            snapshot=(_I, ""),
            kind=(_S, "polyline: x, y; circles, tube: x, y, radius; tree: x0, y0, x1, y1"),
            name=(_S, ""),
            values=(pa.list_(FLOAT), "m, point by point"),
        ),
    ),
    "timing": TableFile(
        "timing.parquet",
        _schema(
            trial=(_I, ""),
            name=(_S, ""),
            value=(FLOAT, "s of wall clock; but decide_count, and decide_overrun: a share"),
        ),
    ),
    "thinking": TableFile(
        "thinking.parquet", _schema(trial=(_I, ""), seconds=(pa.float32(), "s of wall clock, by sample"))
    ),
}
"""The files of a results directory beside `trials.parquet`. `fixtures` has one row a floor plan, the others any
number a trial, in order."""
