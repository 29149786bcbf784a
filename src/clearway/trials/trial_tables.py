"""A trial as Arrow tables and back, losslessly: what the files of a results directory hold.

Numbers stay float64. What a trial doesn't know (None) is null, never NaN: NaN is a moving obstacle that is absent.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.contract import Diagnostics, EventKind
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.trials.attempt_json import (
    attempt_from_json,
    attempt_to_json,
    body_to_json,
    count_of_fixed,
    dumps,
    to_json,
    to_number,
    to_text,
)
from clearway.trials.store_tables import FILES, FLOAT, OPTIONAL, SIDEWAYS, SIGMA, TIE, Tables
from clearway.trials.trial import Errand, Event, Instants, Outcome, Snapshot, Span, Trial

_WIDTH = {"polyline": 2, "circles": 3, "tube": 3, "tree": 4}


def to_tables(index: int, trial: Trial) -> Tables:
    """The trial as tables; `index` goes into their column `trial`."""
    m = trial.moving_obstacles.shape[1]
    known = [name for name in (*OPTIONAL, "cut", "sigma", "tie") if getattr(trial, name) is not None]
    known += [column for name, column in SIDEWAYS.items() if _sideways(trial, name) is not None]
    fixed = count_of_fixed(trial.attempt.bodies)
    bodies = dumps([body_to_json(b) for b in trial.attempt.bodies[:fixed]])
    key = hashlib.sha256(bodies.encode()).hexdigest()[:16]
    attempt = attempt_to_json(trial.attempt, fixed) | {"known": known, "moving_obstacles": m, "reason": trial.reason}
    if trial.errands:
        attempt["errands"] = [[e.body, e.place, *map(to_number, astuple(e)[2:])] for e in trial.errands]
    row = {
        "trial": index,
        "outcome": trial.outcome.value,
        "attempt": dumps(attempt),
        "fixtures": key,
        "spans": dumps([[s.leg, to_number(s.start), to_number(s.end), s.reached] for s in trial.spans]),
        "events": dumps([[to_number(e.t), e.kind, e.detail, e.body] for e in trial.events]),
        "provenance": dumps(to_json(trial.provenance)),
    }
    snapshots, drawings = _snapshots(index, trial.snapshots)
    columns = {
        "robot": _robot(index, trial),
        "obstacles": _obstacles(index, trial),
        "between": _between(index, trial.between, m),
        "thinking": _thinking(index, trial.thinking),
    }
    rows = {
        "attempts": [row],
        "fixtures": [{"fixtures": key, "bodies": bodies}],
        "snapshots": snapshots,
        "drawings": drawings,
        "timing": [{"trial": index, "name": name, "value": float(value)} for name, value in trial.timing.items()],
    }
    tables = {name: pa.table(held, schema=FILES[name].schema) for name, held in columns.items()}
    return tables | {name: pa.Table.from_pylist(held, schema=FILES[name].schema) for name, held in rows.items()}


def from_tables(tables: Tables) -> Trial:
    """The trial again, of tables that hold the rows of one trial only."""
    robot, row = tables["robot"], tables["attempts"].to_pylist()[0]
    attempt = json.loads(row["attempt"])
    n, m = robot.num_rows, attempt["moving_obstacles"]
    optional: dict[str, FloatArray | None] = {
        name: _matrix(robot, _columns_of(name, attempt["known"])) if name in attempt["known"] else None
        for name in OPTIONAL
    }
    fixtures = json.loads(tables["fixtures"].column("bodies")[0].as_py())
    return Trial(
        attempt=attempt_from_json(attempt, fixtures),
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
        tie=_matrix(robot, TIE) if "tie" in attempt["known"] else None,
        sigma=_read_sigma(tables, n, m) if "sigma" in attempt["known"] else None,
        cut=robot["cut"].to_numpy().astype(np.bool_) if "cut" in attempt["known"] else None,
        snapshots=_read_snapshots(tables["snapshots"], tables["drawings"]),
        provenance=json.loads(row["provenance"]),
        timing={r["name"]: r["value"] for r in tables["timing"].to_pylist()},
        thinking=_vector(tables["thinking"], "seconds").astype(np.float64) if tables["thinking"].num_rows else None,
        between=_read_between(tables["between"], m),
        errands=tuple(Errand(k, place, *map(float, how)) for k, place, *how in attempt.get("errands", ())),
    )


def _robot(index: int, trial: Trial) -> dict[str, Any]:
    n, sigma = len(trial.t), trial.sigma
    columns = {"trial": np.full(n, index, np.int32), "t": trial.t, **_named(("x", "y", "theta"), trial.pose)}
    for name, own in OPTIONAL.items():
        values = getattr(trial, name)
        columns |= _named_or_null(own, None if values is None else values[:, : len(own)], n)
    for name, column in SIDEWAYS.items():
        columns |= _named_or_null((column,), _sideways(trial, name), n)
    columns |= _named_or_null(tuple(SIGMA), None if sigma is None else sigma[:, 0], n)
    columns |= _named_or_null(TIE, trial.tie, n)
    columns["leg"] = np.asarray(trial.leg, dtype=np.int32)
    columns["cut"] = pa.nulls(n, pa.bool_()) if trial.cut is None else np.asarray(trial.cut, dtype=np.bool_)
    return columns


def _obstacles(index: int, trial: Trial) -> dict[str, Any]:
    n, m, _ = trial.moving_obstacles.shape
    return {
        "trial": np.full(n * m, index, np.int32),
        "t": np.repeat(np.asarray(trial.t, dtype=np.float64), m),
        "obstacle": np.tile(np.arange(m, dtype=np.int32), n),
        **_named(("x", "y", "theta"), trial.moving_obstacles),
        **_named_or_null(tuple(SIGMA), None if trial.sigma is None else trial.sigma[:, 1:], n * m),
    }


def _sideways(trial: Trial, name: str) -> FloatArray | None:
    """(n, 1) what the trial knows of `name` to the left; None: it knows nothing of it."""
    values = getattr(trial, name)
    return None if values is None or values.shape[1] < 3 else values[:, 2:]


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
    sideways = SIDEWAYS.get(name)
    return OPTIONAL[name] + ((sideways,) if sideways in known and sideways is not None else ())


def _read_sigma(tables: Tables, n: int, m: int) -> FloatArray:
    robot, moving_obstacles = (_matrix(tables[name], tuple(SIGMA)) for name in ("robot", "obstacles"))
    return np.concatenate([robot.reshape(n, 1, 2), moving_obstacles.reshape(n, m, 2)], axis=1)


def _snapshots(index: int, snapshots: Sequence[Snapshot]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    rows: list[dict[str, Any]] = []
    drawings: list[dict[str, Any]] = []
    for k, snapshot in enumerate(snapshots):
        d = snapshot.diagnostics
        row = {"trial": index, "snapshot": k, "t": float(snapshot.t), "status": to_text(d.status)}
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
                "name": to_text(name),
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


def _named(names: Sequence[str], values: FloatArray) -> dict[str, FloatArray]:
    columns = np.ascontiguousarray(np.asarray(values, dtype=np.float64).reshape(-1, len(names)).T)
    return dict(zip(names, columns, strict=True))


def _named_or_null(names: Sequence[str], values: FloatArray | None, n: int) -> dict[str, Any]:
    return dict.fromkeys(names, pa.nulls(n, FLOAT)) if values is None else _named(names, values)


def _vector(table: pa.Table, column: str) -> FloatArray:
    return np.array(table.column(column).to_numpy())


def _matrix(table: pa.Table, columns: Sequence[str]) -> FloatArray:
    out = np.empty((table.num_rows, len(columns)))
    for i, column in enumerate(columns):
        out[:, i] = table.column(column).to_numpy()
    return out
