"""Packs trials small enough that hundreds replay inside one page.

A trial becomes a JSON object. Its samples are columns of whole numbers (millimetres, 0.1 mrad, milliseconds), stored
as differences, deflated and put in base64: about 10 bytes a sample. A floor plan, which many trials meet, is stored once,
in `floors`. `templates/decode.js` is the reader.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.contract import PLACED, BodyKind
from clearway.geometry.compiled import kernel
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.indicators.legs import ground_speed, missed
from clearway.robots import Robot
from clearway.trials import Body, Snapshot, Trial

MILLI, ANGLE = 1e-3, 1e-4
"""Units of a stored length [m], time [s] or speed [m/s, rad/s]; and of an angle [rad]."""
LONGEST = 4000
"""Samples kept of a trial; a longer one is thinned evenly."""
SIMPLIFY = 0.01
"""m; a plan's line is stored with no more points than it needs to be this right."""
MOST_EDGES, MOST_DISCS, FIELD_CELLS = 800, 300, 32
"""Of a tree, of a kind of circles, and of a side of a field: what the replay keeps of a snapshot."""
CROSS: dict[str, Any] = {"r": 0.0, "cross": True}
"""What stands for a shape that nobody knows."""
_GAP16, _GAP32 = -(2**15), -(2**31)


@dataclass(slots=True)
class Shelf:
    """What trials share, stored once.

    Attributes:
        things: The things; each is known by the number of its place.
    """

    things: list[Any] = field(default_factory=list)
    _places: dict[str, int] = field(default_factory=dict)

    def place(self, thing: Any) -> int:
        """The number of `thing` (a JSON value), added if it is new."""
        key = json.dumps(thing, separators=(",", ":"))
        if key not in self._places:
            self._places[key] = len(self.things)
            self.things.append(thing)
        return self._places[key]


@dataclass(slots=True)
class Packer:
    """Packs trials of one report.

    Attributes:
        known: The campaign's robots by name, None for one of which nobody has a file.
        floors: What stands in a floor plan, each once.
        robots: The robots that drove, each once.
    """

    known: Mapping[str, Robot | None] = field(default_factory=dict)
    floors: Shelf = field(default_factory=Shelf)
    robots: Shelf = field(default_factory=Shelf)

    def pack(self, trial: Trial, index: int, row: dict[str, Any]) -> dict[str, Any]:
        """A trial as a JSON object for the replay.

        Args:
            index: Its number in the table.
            row: What else the page says of it (indicators by name).
        """
        a, trial = trial.attempt, broken(trial)
        keep = _thin(len(trial.t))
        fixed = [b for b in a.bodies if b.pose is not None and np.isfinite(b.pose[:2]).all()]
        moving = [b for b in a.bodies if b.pose is None]
        return {
            "index": index,
            "robot": self.robots.place(_robot(a.robot, self.known.get(a.robot), a.footprint)),
            "floor": self.floors.place([_body(b) for b in fixed if b.kind not in PLACED]),
            "obstacles": [_body(b) for b in fixed if b.kind in PLACED],
            "movingObstacles": [_moving(b) for b in moving],
            "legs": [
                {
                    "name": leg.name,
                    "start": _list(leg.start, 4),
                    "goal": _list(leg.goal, 4),
                    "xy": leg.xy_tolerance if math.isfinite(leg.xy_tolerance) else None,
                    "yaw": leg.yaw_tolerance if math.isfinite(leg.yaw_tolerance) else None,
                }
                for leg in a.legs
            ],
            "spans": [[s.leg, round(s.start, 3), round(s.end, 3), s.reached] for s in trial.spans],
            "events": [
                [round(e.t, 3), e.kind, e.detail.replace("+-", "±").strip().splitlines()[-1:] or [""]]
                for e in trial.events[:500]
            ],
            **({"recorded": True} if a.source == "recorded" else {}),
            "outcome": trial.outcome.value,
            "reason": trial.reason,
            "speed": a.speed_limit,
            "row": row,
            "samples": pack_columns(_columns(trial, keep)),
            "thoughts": _deflate(json.dumps(_thoughts(trial.snapshots), separators=(",", ":")).encode()),
        }


def broken(trial: Trial) -> Trial:
    """The trial with a sample of which nothing is known wherever a recording has none for too long, so that lines break."""
    after = np.flatnonzero(missed(trial, trial.t)) + 1
    if not len(after):
        return trial

    def torn(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else np.insert(np.asarray(values, dtype=np.float64), after, np.nan, axis=0)

    t = np.insert(trial.t, after, (trial.t[after] + trial.t[after - 1]) / 2)
    pose, moving_obstacles = torn(trial.pose), torn(trial.moving_obstacles)
    assert pose is not None
    assert moving_obstacles is not None
    return replace(
        trial, t=t, pose=pose, moving_obstacles=moving_obstacles, velocity=torn(trial.velocity), estimate=torn(trial.estimate), command=None,
        leg=np.insert(trial.leg, after, trial.leg[after - 1]), cut=None, sigma=None, thinking=None,
    )  # fmt: skip


def clearance_over_time(trial: Trial) -> FloatArray | None:
    """(n,) edge-to-edge distance in m from the footprint to the nearest body, NaN where there is none."""
    from clearway.geometry.distance import min_clearance

    a = trial.attempt
    if a.footprint is None or not a.bodies:
        return None
    placed = np.isfinite(trial.moving_obstacles[..., :2]).all(axis=-1)
    headed = np.isfinite(trial.moving_obstacles[placed]).all() and all(
        b.pose is None or np.isfinite(b.pose).all() for b in a.bodies
    )
    if np.isfinite(trial.pose).all() and headed and all(b.outlined for b in a.bodies):
        out = min_clearance(a.footprint, trial.pose, a.bodies, trial.moving_obstacles)
    else:
        out = _clearance_of_what_is_known(trial, a.footprint)
    return np.where(np.isfinite(out), out, np.nan)


def _clearance_of_what_is_known(trial: Trial, footprint: Shape) -> FloatArray:
    """(n,) distance from the bodies whose outline is known, NaN where the robot's is not."""
    from clearway.geometry.distance import min_clearance

    pose, moving_obstacles = trial.pose.copy(), trial.moving_obstacles.copy()
    if isinstance(footprint, Circle):
        pose[np.isnan(pose[:, 2]), 2] = 0.0
    bodies, columns, m = [], [], 0
    for body in trial.attempt.bodies:
        if body.pose is None:
            if body.outlined:
                bodies.append(body)
                columns.append(m)
                if isinstance(body.shape, Circle):
                    moving_obstacles[np.isnan(moving_obstacles[:, m, 2]), m, 2] = 0.0
            m += 1
        elif body.outlined and np.isfinite(body.pose[:2]).all():
            heading = float(body.pose[2])
            if math.isfinite(heading):
                bodies.append(body)
            elif isinstance(body.shape, Circle):
                bodies.append(replace(body, pose=np.array([*body.pose[:2], 0.0])))
    known = np.isfinite(pose).all(axis=1)
    out = np.full(len(pose), np.nan)
    moving_obstacles = np.where(np.isfinite(moving_obstacles).all(axis=2, keepdims=True), moving_obstacles, np.nan)
    out[known] = min_clearance(footprint, pose[known], bodies, moving_obstacles[known][:, columns])
    return out


def _columns(trial: Trial, keep: npt.NDArray[np.int64]) -> dict[str, tuple[FloatArray, float]]:
    """Name -> (values (n,), unit of storage), in the order of storage."""
    columns: dict[str, tuple[FloatArray, float]] = {"t": (trial.t, MILLI)}

    def poses(name: str, values: FloatArray) -> None:
        columns[f"{name}x"] = (values[:, 0], MILLI)
        columns[f"{name}y"] = (values[:, 1], MILLI)
        columns[f"{name}a"] = (unwrapped(values[:, 2]), ANGLE)

    poses("", trial.pose)
    if trial.estimate is not None:
        poses("e", trial.estimate)
    if trial.velocity is not None:
        v = trial.velocity[:, 0] if trial.velocity.shape[1] < 3 else ground_speed(trial.velocity)
        columns["v"], columns["w"] = (v, MILLI), (trial.velocity[:, 1], MILLI)
    clearance = clearance_over_time(trial)
    if clearance is not None:
        columns["c"] = (np.minimum(clearance, 30.0), MILLI)
    if trial.thinking is not None and np.isfinite(trial.thinking).any():
        columns["d"] = (1e3 * trial.thinking, 1e-2)  # ms
    columns["leg"] = (np.asarray(trial.leg, dtype=np.float64), 1.0)
    for m in range(trial.moving_obstacles.shape[1]):
        poses(f"m{m}", trial.moving_obstacles[:, m])
    return {name: (np.asarray(values)[keep], unit) for name, (values, unit) in columns.items()}


def pack_columns(columns: dict[str, tuple[FloatArray, float]]) -> dict[str, Any]:
    """Columns of equal length n, NaN for a gap, as whole multiples of their units: first value, then differences.

    A difference is to the last value that is not a gap. int16 where every difference fits, else int32.
    """
    n = len(next(iter(columns.values()))[0])
    whole = [_differences(values, unit) for values, unit in columns.values()]
    wide = any(int(np.abs(d).max(initial=0)) >= 2**15 for _, d, _ in whole)
    kind, gap = ("<i4", _GAP32) if wide else ("<i2", _GAP16)
    block = b"".join(np.where(missing, gap, d).astype(kind).tobytes() for _, d, missing in whole)
    return {
        "n": n,
        "wide": wide,
        "columns": [
            [name, first, unit] for (name, (_, unit)), (first, _, _) in zip(columns.items(), whole, strict=True)
        ],
        "data": _deflate(block),
    }


def _differences(values: FloatArray, unit: float) -> tuple[int, npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    missing = ~np.isfinite(values)
    out = np.zeros(len(values), dtype=np.int64)
    whole = np.rint(values[~missing] / unit).astype(np.int64)
    if not len(whole):
        return 0, out, missing
    out[~missing] = np.diff(whole, prepend=whole[0])
    return int(whole[0]), out, missing


def unwrapped(angle: FloatArray) -> FloatArray:
    """The angle without jumps of a turn, gaps left as they are."""
    out = np.array(angle, dtype=np.float64)
    known = np.isfinite(out)
    out[known] = np.unwrap(out[known])
    return out


def _thin(n: int) -> npt.NDArray[np.int64]:
    every = max(1, math.ceil(n / LONGEST))
    keep = np.arange(0, n, every, dtype=np.int64)
    return keep if not n or keep[-1] == n - 1 else np.append(keep, n - 1)


def _deflate(block: bytes) -> str:
    return base64.b64encode(zlib.compress(block, 6)).decode()


def _list(values: FloatArray, digits: int = 3) -> list[float | None]:
    """As JSON; None where a value is unknown."""
    return [round(float(v), digits) if math.isfinite(v) else None for v in values]


def _shape(shape: Shape) -> dict[str, Any]:
    if isinstance(shape, Circle):
        return {"r": round(shape.radius, 4)}
    return {"p": [[round(x, 4), round(y, 4)] for x, y in shape.vertices]}


def _moving(body: Body) -> dict[str, Any]:
    """A moving body: its name and outline, and whether it is a person whose shoulders the disc is around."""
    if not body.outlined:
        return {"name": body.name, **CROSS}
    person = {"person": True} if body.kind is BodyKind.PERSON and isinstance(body.shape, Circle) else {}
    robot = {"robot": True} if body.kind is BodyKind.ROBOT else {}
    return {"name": body.name, **_shape(body.shape), **person, **robot}


def _body(body: Body) -> dict[str, Any]:
    assert body.pose is not None
    lies = body.outlined and (isinstance(body.shape, Circle) or math.isfinite(body.pose[2]))
    shape = _shape(body.shape) if lies else CROSS
    return {"name": body.name, "kind": body.kind, "at": _list(body.pose, 4), **shape}


def _robot(name: str, robot: Robot | None, footprint: Shape | None) -> dict[str, Any]:
    lidar = robot.lidar if robot is not None else None
    return {
        "name": name if robot is None else robot.title,
        **({} if footprint is None else {"footprint": _shape(footprint)}),
        **(
            {}
            if lidar is None
            else {
                "lidar": {
                    "beams": min(lidar.beams, 720),
                    "from": lidar.angle_min,
                    "to": lidar.angle_max,
                    "near": lidar.range_min,
                    "far": lidar.range_max,
                    "mount": list(lidar.mount),
                }
            }
        ),
    }


def _thoughts(snapshots: tuple[Snapshot, ...]) -> list[dict[str, Any]]:
    """What the navigator showed, each line simplified and stored once while it stays the same."""
    out: list[dict[str, Any]] = []
    last: dict[str, Any] = {}
    for snapshot in snapshots:
        d = snapshot.diagnostics
        lines: dict[str, Any] = {}
        for name, points in d.polylines.items():
            line = _line(np.asarray(points, dtype=np.float64))
            lines[name] = 0 if last.get(name) == line else line  # 0: as in the snapshot before
            last[name] = line
        entry: dict[str, Any] = {"t": round(snapshot.t, 3), "lines": lines}
        if d.status:
            entry["status"] = d.status
        if d.circles:
            entry["circles"] = {k: _centimetres(v[:MOST_DISCS]) for k, v in d.circles.items()}
        if d.tube is not None:
            entry["tube"] = _centimetres(d.tube)
        if d.tree is not None:
            entry["tree"] = _centimetres(d.tree[:MOST_EDGES])
        if d.field is not None:
            entry["field"] = _field(d.field)
        out.append(entry)
    return out


def _centimetres(values: FloatArray) -> list[list[int]]:
    rows: list[list[int]] = np.rint(np.asarray(values, dtype=np.float64) / 0.01).astype(np.int64).tolist()
    return rows


def _field(grid: OccupancyGrid) -> dict[str, Any]:
    """A coarse copy: at most `FIELD_CELLS` a side, values -1..100 as bytes 0..101."""
    step = -(-max(grid.data.shape) // FIELD_CELLS)
    coarse = grid.data[::step, ::step]
    values = (np.clip(coarse.astype(np.int64), -1, 100) + 1).astype(np.uint8)
    return {
        "at": [round(float(v), 3) for v in grid.origin],
        "cell": round(step * grid.resolution, 4),
        "rows": values.shape[0],
        "cols": values.shape[1],
        "data": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode(),
    }


def _line(points: FloatArray) -> list[int]:
    """x, y in cm, first absolute, then differences."""
    if len(points) == 0:
        return []
    whole = np.rint(simplify(points) / 0.01).astype(np.int64)
    return [int(v) for v in np.diff(whole, axis=0, prepend=np.zeros((1, 2), np.int64)).ravel()]


def simplify(points: FloatArray, tolerance: float = SIMPLIFY) -> FloatArray:
    """The line (n, 2) with the points left out that lie within `tolerance` [m] of it without them (Douglas-Peucker)."""
    points = np.ascontiguousarray(points, dtype=np.float64)
    return points[_needed(points, tolerance)] if len(points) > 2 else points


@kernel
def _needed(points: FloatArray, tolerance: float) -> npt.NDArray[np.bool_]:
    """Which of the points (n, 2), n >= 2, the simplified line needs."""
    n = len(points)
    keep = np.zeros(n, dtype=np.bool_)
    keep[0] = keep[n - 1] = True
    stack = np.empty((n, 2), dtype=np.int64)
    stack[0, 0], stack[0, 1], depth = 0, n - 1, 1
    while depth > 0:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        length = dx * dx + dy * dy
        worst, farthest = -1, tolerance
        for i in range(a + 1, b):
            x, y = points[i, 0] - points[a, 0], points[i, 1] - points[a, 1]
            share = min(max((x * dx + y * dy) / length, 0.0), 1.0) if length > 0.0 else 0.0
            off = np.hypot(x - share * dx, y - share * dy)
            if off > farthest:
                worst, farthest = i, off
        if worst >= 0:
            keep[worst] = True
            stack[depth, 0], stack[depth, 1] = a, worst
            stack[depth + 1, 0], stack[depth + 1, 1] = worst, b
            depth += 2
    return keep
