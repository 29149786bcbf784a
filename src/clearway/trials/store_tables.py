"""A trial as Arrow tables and back, losslessly: what the files of a results directory hold.

Numbers stay float64. What a trial doesn't know (None) is null, never NaN: NaN is a moving obstacle that is absent.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

import numpy as np
import pyarrow as pa

from clearway.contract import PLACED, BodyKind, Diagnostics, EventKind
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import Circle, FloatArray, Polygon, Shape
from clearway.robots.drive_limits import DriveLimits, shares_of
from clearway.trials.trial import Attempt, Body, Event, Instants, Labels, Leg, Outcome, Snapshot, Span, Trial, Wish
from clearway.tuning import Tuned

Tables: TypeAlias = dict[str, pa.Table]
"""By name, as in `FILES`: the rows of one trial or of several."""


def _schema(**columns: tuple[Any, str]) -> pa.Schema:
    return pa.schema(
        [pa.field(n, kind, metadata={"unit": unit} if unit else None) for n, (kind, unit) in columns.items()]
    )


_F, _I, _S = pa.float64(), pa.int32(), pa.string()
_POSE = {"x": (_F, "m"), "y": (_F, "m"), "theta": (_F, "rad")}
_TIE = ("tie_xy", "tie_theta")
_SIGMA = {"sigma_xy": (_F, "m"), "sigma_theta": (_F, "rad")}
_SIDEWAYS = {"velocity": "v_y", "command": "cmd_v_y"}
_OPTIONAL = {"velocity": ("v", "omega"), "estimate": ("est_x", "est_y", "est_theta"), "command": ("cmd_v", "cmd_omega")}
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
            t=(_F, "s"),
            **_POSE,
            **{c: (_F, _UNITS[c.rpartition("_")[2]]) for columns in _OPTIONAL.values() for c in columns},
            leg=(_I, ""),
            cut=(pa.bool_(), ""),
            **_SIGMA,
            tie_xy=(_F, "m"),
            tie_theta=(_F, "rad"),
            **dict.fromkeys(_SIDEWAYS.values(), (_F, "m/s, to the left; null but of an omnidirectional base")),
        ),
    ),
    "obstacles": TableFile(
        "trajectories/obstacles.parquet", _schema(trial=(_I, ""), t=(_F, "s"), obstacle=(_I, ""), **_POSE, **_SIGMA)
    ),
    "between": TableFile(
        "trajectories/between.parquet", _schema(trial=(_I, ""), t=(_F, "s"), body=(_I, "-1: the robot"), **_POSE)
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
            t=(_F, "s"),
            status=(_S, ""),
            iterations=(pa.int64(), ""),
            field=(pa.binary(), "int8 cells, row by row"),
            rows=(_I, ""),
            cols=(_I, ""),
            resolution=(_F, "m"),
            origin_x=(_F, "m"),
            origin_y=(_F, "m"),
        ),
    ),
    "drawings": TableFile(
        "diagnostics/drawings.parquet",
        _schema(
            trial=(_I, ""),
            snapshot=(_I, ""),
            kind=(_S, "polyline: x, y; circles, tube: x, y, radius; tree: x0, y0, x1, y1"),
            name=(_S, ""),
            values=(pa.list_(_F), "m, point by point"),
        ),
    ),
    "timing": TableFile(
        "timing.parquet",
        _schema(
            trial=(_I, ""), name=(_S, ""), value=(_F, "s of wall clock; but decide_count, and decide_overrun: a share")
        ),
    ),
    "thinking": TableFile(
        "thinking.parquet", _schema(trial=(_I, ""), seconds=(pa.float32(), "s of wall clock, by sample"))
    ),
}
"""The files of a results directory beside `trials.parquet`. `fixtures` has one row a floor plan, the others any
number a trial, in order."""

_WIDTH = {"polyline": 2, "circles": 3, "tube": 3, "tree": 4}


def to_tables(index: int, trial: Trial) -> Tables:
    """The trial as tables; `index` goes into their column `trial`."""
    n, m = len(trial.t), trial.moving_obstacles.shape[1]
    known = [name for name in (*_OPTIONAL, "cut", "sigma", "tie") if getattr(trial, name) is not None]
    robot: dict[str, Any] = {"trial": np.full(n, index, np.int32), "t": trial.t}
    robot |= dict(zip(("x", "y", "theta"), _columns(trial.pose, 3), strict=True))
    for name, columns in _OPTIONAL.items():
        values = getattr(trial, name)
        robot |= (
            dict.fromkeys(columns, pa.nulls(n, _F)) if values is None else _named(columns, values[:, : len(columns)])
        )
    for name, column in _SIDEWAYS.items():
        values = getattr(trial, name)
        sideways = values is not None and values.shape[1] > 2
        known += [column] if sideways else []
        robot[column] = np.ascontiguousarray(values[:, 2]) if sideways else pa.nulls(n, _F)
    robot["leg"] = np.asarray(trial.leg, dtype=np.int32)
    robot["cut"] = pa.nulls(n, pa.bool_()) if trial.cut is None else np.asarray(trial.cut, dtype=np.bool_)
    moving_obstacles = np.ascontiguousarray(trial.moving_obstacles, dtype=np.float64).reshape(n * m, 3)
    obstacles = {
        "trial": np.full(n * m, index, np.int32),
        "t": np.repeat(np.asarray(trial.t, dtype=np.float64), m),
        "obstacle": np.tile(np.arange(m, dtype=np.int32), n),
        **_named(("x", "y", "theta"), moving_obstacles),
    }
    fixed = _fixed(trial.attempt.bodies)
    bodies = _dumps([_body(b) for b in trial.attempt.bodies[:fixed]])
    key = hashlib.sha256(bodies.encode()).hexdigest()[:16]
    sigma = np.zeros((n, 1 + m, 2)) if trial.sigma is None else np.asarray(trial.sigma, dtype=np.float64)
    robot |= _named(tuple(_SIGMA), sigma[:, 0]) if trial.sigma is not None else dict.fromkeys(_SIGMA, pa.nulls(n, _F))
    robot |= dict.fromkeys(_TIE, pa.nulls(n, _F)) if trial.tie is None else _named(_TIE, trial.tie)
    obstacles |= (
        _named(tuple(_SIGMA), sigma[:, 1:].reshape(n * m, 2))
        if trial.sigma is not None
        else dict.fromkeys(_SIGMA, pa.nulls(n * m, _F))
    )
    attempt = _attempt(trial.attempt, fixed) | {"known": known, "moving_obstacles": m, "reason": trial.reason}
    row = {
        "trial": index,
        "outcome": trial.outcome.value,
        "attempt": _dumps(attempt),
        "fixtures": key,
        "spans": _dumps([[s.leg, _number(s.start), _number(s.end), s.reached] for s in trial.spans]),
        "events": _dumps([[_number(e.t), e.kind, e.detail, e.body] for e in trial.events]),
        "provenance": _dumps(_jsonable(trial.provenance)),
    }
    snapshots, drawings = _snapshots(index, trial.snapshots)
    return {
        "robot": pa.table(robot, schema=FILES["robot"].schema),
        "obstacles": pa.table(obstacles, schema=FILES["obstacles"].schema),
        "between": pa.table(_between(index, trial.between, m), schema=FILES["between"].schema),
        "attempts": pa.Table.from_pylist([row], schema=FILES["attempts"].schema),
        "fixtures": pa.Table.from_pylist([{"fixtures": key, "bodies": bodies}], schema=FILES["fixtures"].schema),
        "snapshots": pa.Table.from_pylist(snapshots, schema=FILES["snapshots"].schema),
        "drawings": pa.Table.from_pylist(drawings, schema=FILES["drawings"].schema),
        "timing": pa.Table.from_pylist(
            [{"trial": index, "name": k, "value": float(v)} for k, v in trial.timing.items()],
            schema=FILES["timing"].schema,
        ),
        "thinking": pa.table(_thinking(index, trial.thinking), schema=FILES["thinking"].schema),
    }


def from_tables(tables: Tables) -> Trial:
    """The trial again, of tables that hold the rows of one trial only."""
    robot, row = tables["robot"], tables["attempts"].to_pylist()[0]
    attempt = json.loads(row["attempt"])
    n, m = robot.num_rows, attempt["moving_obstacles"]
    optional: dict[str, FloatArray | None] = {
        name: _matrix(robot, _columns_of(name, attempt["known"])) if name in attempt["known"] else None
        for name in _OPTIONAL
    }
    fixtures = json.loads(tables["fixtures"].column("bodies")[0].as_py())
    return Trial(
        attempt=_read_attempt(attempt, fixtures),
        t=_vector(robot, "t"),
        pose=_matrix(robot, ("x", "y", "theta")),
        velocity=optional["velocity"],
        estimate=optional["estimate"],
        command=optional["command"],
        leg=_vector(robot, "leg").astype(np.int64),
        moving_obstacles=_matrix(tables["obstacles"], ("x", "y", "theta")).reshape(n, m, 3),
        spans=tuple(Span(leg, float(a), float(b), reached) for leg, a, b, reached in json.loads(row["spans"])),
        events=tuple(
            Event(float(t), EventKind(kind), detail, body) for t, kind, detail, body in json.loads(row["events"])
        ),
        outcome=Outcome(row["outcome"]),
        reason=attempt["reason"],
        tie=_matrix(robot, _TIE) if "tie" in attempt["known"] else None,
        sigma=_read_sigma(tables, n, m) if "sigma" in attempt["known"] else None,
        cut=robot["cut"].to_numpy().astype(np.bool_) if "cut" in attempt["known"] else None,
        snapshots=_read_snapshots(tables["snapshots"], tables["drawings"]),
        provenance=json.loads(row["provenance"]),
        timing={r["name"]: r["value"] for r in tables["timing"].to_pylist()},
        thinking=_vector(tables["thinking"], "seconds").astype(np.float64) if tables["thinking"].num_rows else None,
        between=_read_between(tables["between"], m),
    )


def _thinking(index: int, thinking: FloatArray | None) -> dict[str, Any]:
    seconds = np.zeros(0, np.float32) if thinking is None else np.asarray(thinking, np.float32)
    return {"trial": np.full(len(seconds), index, np.int32), "seconds": seconds}


def _between(index: int, between: Instants | None, m: int) -> dict[str, Any]:
    """A row for the robot and one for each body that moves, instant by instant."""
    times = np.zeros(0) if between is None else np.repeat(between.t, 1 + m)
    poses = (
        np.zeros((0, 3)) if between is None else np.concatenate([between.pose[:, None], between.moving_obstacles], 1)
    )
    return {
        "trial": np.full(len(times), index, np.int32),
        "t": times,
        "body": np.tile(np.arange(-1, m, dtype=np.int32), len(times) // (1 + m)),
        **_named(("x", "y", "theta"), poses.reshape(-1, 3)),
    }


def _read_between(table: pa.Table, m: int) -> Instants | None:
    if not table.num_rows:
        return None
    poses = _matrix(table, ("x", "y", "theta")).reshape(-1, 1 + m, 3)
    return Instants(_vector(table, "t")[:: 1 + m], poses[:, 0].copy(), poses[:, 1:].copy())


def _columns_of(name: str, known: Sequence[str]) -> tuple[str, ...]:
    """The columns of the robot's table that hold what a trial calls `name`."""
    sideways = _SIDEWAYS.get(name)
    return _OPTIONAL[name] + ((sideways,) if sideways in known and sideways is not None else ())


def _read_sigma(tables: Tables, n: int, m: int) -> FloatArray:
    robot, moving_obstacles = (_matrix(tables[name], tuple(_SIGMA)) for name in ("robot", "obstacles"))
    return np.concatenate([robot.reshape(n, 1, 2), moving_obstacles.reshape(n, m, 2)], axis=1)


# --- attempt ---------------------------------------------------------------------------------------------------------

_PLAIN = (
    "robot",
    "navigator",
    "localisation",
    "tracking",
    "floor_plan",
    "scenario",
    "seed",
    "privileged",
    "source",
    "run",
    "member",
)
_NUMBERS = ("speed_limit", "period", "reference_length", "optimal_time", "shortest_path")
_LABEL_NUMBERS = ("speed", "obstacle_speed", "size", "gap")


def _attempt(a: Attempt, fixed: int) -> dict[str, Any]:
    labels = {
        name: getattr(a.labels, name) for name in ("suite", "family", "batch", "configuration", "repetition", "setup")
    }
    return {
        **{name: getattr(a, name) for name in _PLAIN},
        **{name: _number(getattr(a, name)) for name in _NUMBERS},
        "labels": labels | {name: _number(getattr(a.labels, name)) for name in _LABEL_NUMBERS},
        "footprint": None if a.footprint is None else _shape(a.footprint),
        "limits": None if a.limits is None else _limits(a.limits),
        "sight": _number(a.sight),
        "tuned": a.tuned,
        "legs": [_leg(leg) for leg in a.legs],
        "bodies": [_body(b) for b in a.bodies[fixed:]],
    }


def _read_attempt(d: Mapping[str, Any], fixtures: Sequence[Any]) -> Attempt:
    labels = dict(d["labels"]) | {name: _read_number(d["labels"][name]) for name in _LABEL_NUMBERS}
    rest: dict[str, Any] = {name: d[name] for name in _PLAIN} | {name: _read_number(d[name]) for name in _NUMBERS}
    return Attempt(
        labels=Labels(**labels),
        footprint=None if d["footprint"] is None else _read_shape(d["footprint"]),
        limits=None if d["limits"] is None else _read_limits(d["limits"]),
        sight=_read_number(d["sight"]),
        tuned=Tuned(d["tuned"]),
        legs=tuple(_read_leg(leg) for leg in d["legs"]),
        bodies=tuple(_read_body(b) for b in (*fixtures, *d["bodies"])),
        **rest,
    )


def _limits(limits: DriveLimits) -> dict[str, Any]:
    """What bounds the base; of what only another kind of base has nothing."""
    usual = DriveLimits._field_defaults
    said = {name: value for name, value in limits._asdict().items() if name not in usual or value != usual[name]}
    return {name: [*map(_number, v)] if isinstance(v, tuple) else _number(v) for name, v in said.items()}


def _read_limits(d: Mapping[str, Any]) -> DriveLimits:
    told: dict[str, Any] = {
        name: shares_of([*map(float, v)]) if isinstance(v, list) else float(v) for name, v in d.items()
    }
    return DriveLimits(**told)


def _fixed(bodies: Sequence[Body]) -> int:
    """How many bodies at the front belong to the floor plan: they are stored once a plan."""
    return next((i for i, b in enumerate(bodies) if b.kind in PLACED), len(bodies))


def _shape(shape: Shape) -> dict[str, Any]:
    if isinstance(shape, Circle):
        return {"circle": _number(shape.radius)}
    return {"polygon": [[_number(x), _number(y)] for x, y in shape.vertices]}


def _read_shape(d: Mapping[str, Any]) -> Shape:
    if "circle" in d:
        return Circle(float(d["circle"]))
    return Polygon(tuple((float(x), float(y)) for x, y in d["polygon"]))


def _body(b: Body) -> dict[str, Any]:
    pose = None if b.pose is None else [_number(v) for v in b.pose]
    return {
        "name": b.name,
        "kind": b.kind,
        "shape": _shape(b.shape),
        "pose": pose,
        "sigma": _number(b.sigma),
        "measured": b.measured,
        "outlined": b.outlined,
        **({"visits": True} if b.visits else {}),
        **({"wish": {**asdict(b.wish), "speed": _number(b.wish.speed)}} if b.wish else {}),
    }


def _read_body(d: Mapping[str, Any]) -> Body:
    pose = None if d["pose"] is None else np.array([float(v) for v in d["pose"]])
    return Body(
        d["name"], BodyKind(d["kind"]), _read_shape(d["shape"]), pose, float(d["sigma"]), d["outlined"], d["measured"],
        d.get("visits", False), _read_wish(d["wish"]) if "wish" in d else None,
    )  # fmt: skip


def _read_wish(d: Mapping[str, Any]) -> Wish:
    return Wish(_read_number(d["speed"]), tuple((float(x), float(y)) for x, y in d["route"]), d["group"])


def _leg(leg: Leg) -> dict[str, Any]:
    return {
        "name": leg.name,
        "start": [_number(v) for v in leg.start],
        "goal": [_number(v) for v in leg.goal],
        "xy_tolerance": _number(leg.xy_tolerance),
        "yaw_tolerance": _number(leg.yaw_tolerance),
        "scored": leg.scored,
        "time_limit": _number(leg.time_limit),
        "planner_xy_tolerance": _number(leg.planner_xy_tolerance),
        "planner_yaw_tolerance": _number(leg.planner_yaw_tolerance),
    }


def _read_leg(d: Mapping[str, Any]) -> Leg:
    rest: dict[str, Any] = {name: np.array([float(v) for v in d[name]]) for name in ("start", "goal")}
    rest |= {name: float(d[name]) for name in ("xy_tolerance", "yaw_tolerance", "time_limit")}
    told = ("planner_xy_tolerance", "planner_yaw_tolerance")  # results from before it was recorded don't have it
    rest |= {name: float(d.get(name, math.nan)) for name in told}
    return Leg(name=d["name"], scored=d["scored"], **rest)


# --- diagnostics -----------------------------------------------------------------------------------------------------


def _snapshots(index: int, snapshots: Sequence[Snapshot]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    rows: list[dict[str, Any]] = []
    drawings: list[dict[str, Any]] = []
    for k, snapshot in enumerate(snapshots):
        d = snapshot.diagnostics
        row = {"trial": index, "snapshot": k, "t": float(snapshot.t), "status": _text(d.status)}
        row["iterations"] = int(d.iterations)
        if (grid := d.field) is not None:
            rows_, cols = grid.data.shape
            row |= {"field": np.ascontiguousarray(grid.data, np.int8).tobytes(), "rows": rows_, "cols": cols}
            row |= {"resolution": grid.resolution, "origin_x": grid.origin[0], "origin_y": grid.origin[1]}
        rows.append(row)
        drawn = [("polyline", name, line) for name, line in d.polylines.items()]
        drawn += [("circles", name, discs) for name, discs in d.circles.items()]
        drawn += [(kind, "", v) for kind, v in (("tube", d.tube), ("tree", d.tree)) if v is not None]
        drawings += [
            {
                "trial": index,
                "snapshot": k,
                "kind": kind,
                "name": _text(name),
                "values": np.asarray(v, np.float64).ravel(),
            }
            for kind, name, v in drawn
        ]
    return rows, drawings


def _read_snapshots(snapshots: pa.Table, drawings: pa.Table) -> tuple[Snapshot, ...]:
    shown: list[dict[str, Any]] = [
        {"polylines": {}, "circles": {}, "tube": None, "tree": None} for _ in range(snapshots.num_rows)
    ]
    drawn = drawings.select(["snapshot", "kind", "name"]).to_pylist()
    values = drawings.column("values").combine_chunks()
    flat, ends = values.values.to_numpy(zero_copy_only=False), values.offsets.to_numpy()
    for i, row in enumerate(drawn):
        array = flat[ends[i] : ends[i + 1]].reshape(-1, _WIDTH[row["kind"]]).copy()
        into = shown[row["snapshot"]]
        if row["kind"] == "polyline":
            into["polylines"][row["name"]] = array
        elif row["kind"] == "circles":
            into["circles"][row["name"]] = array
        else:
            into[row["kind"]] = array
    return tuple(
        Snapshot(
            row["t"],
            Diagnostics(status=row["status"], iterations=row["iterations"], field=_read_field(row), **shown[k]),
        )
        for k, row in enumerate(snapshots.to_pylist())
    )


def _read_field(row: Mapping[str, Any]) -> OccupancyGrid | None:
    if row["field"] is None:
        return None
    data = np.frombuffer(row["field"], dtype=np.int8).reshape(row["rows"], row["cols"])
    return OccupancyGrid(data, row["resolution"], (row["origin_x"], row["origin_y"]))


# --- numbers, text, columns ------------------------------------------------------------------------------------------


def _dumps(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _number(value: Any) -> float | str | None:
    """A number that strict JSON can hold: inf and NaN become text, which float() reads back."""
    if value is None:
        return None
    number = float(value)
    return number if math.isfinite(number) else repr(number)


def _read_number(value: Any) -> float | None:
    return None if value is None else float(value)


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _jsonable(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(v) for v in value]
    if isinstance(value, str | bool | int | None):
        return value
    return _number(value) if isinstance(value, float) else str(value)


def _text(text: str) -> str:
    """Text that UTF-8 can hold."""
    return text.encode("utf-8", "replace").decode()


def _columns(values: FloatArray, width: int) -> FloatArray:
    return np.ascontiguousarray(np.asarray(values, dtype=np.float64).reshape(-1, width).T)


def _named(names: Sequence[str], values: FloatArray) -> dict[str, FloatArray]:
    return dict(zip(names, _columns(values, len(names)), strict=True))


def _vector(table: pa.Table, column: str) -> FloatArray:
    return np.array(table.column(column).to_numpy())


def _matrix(table: pa.Table, columns: Sequence[str]) -> FloatArray:
    out = np.empty((table.num_rows, len(columns)))
    for i, column in enumerate(columns):
        out[:, i] = table.column(column).to_numpy()
    return out
