"""What was attempted, as JSON: every number stays what it was to the last bit, infinities and NaN too."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from clearway.contract import PLACED, BodyKind
from clearway.geometry.shapes import Circle, Polygon, Shape
from clearway.robots.drive_limits import DriveLimits, shares_of
from clearway.trials.trial import Attempt, Body, Labels, Leg, Wish
from clearway.tuning import Tuned

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


def attempt_to_json(a: Attempt, fixed: int) -> dict[str, Any]:
    labels = {
        name: getattr(a.labels, name) for name in ("suite", "family", "batch", "configuration", "repetition", "setup")
    }
    return {
        **{name: getattr(a, name) for name in _PLAIN},
        **{name: to_number(getattr(a, name)) for name in _NUMBERS},
        "labels": labels | {name: to_number(getattr(a.labels, name)) for name in _LABEL_NUMBERS},
        "footprint": None if a.footprint is None else _shape(a.footprint),
        "limits": None if a.limits is None else _limits(a.limits),
        "sight": to_number(a.sight),
        "tuned": a.tuned,
        "legs": [_leg(leg) for leg in a.legs],
        "bodies": [body_to_json(b) for b in a.bodies[fixed:]],
    }


def attempt_from_json(d: Mapping[str, Any], fixtures: Sequence[Any]) -> Attempt:
    labels = dict(d["labels"]) | {name: from_number(d["labels"][name]) for name in _LABEL_NUMBERS}
    rest: dict[str, Any] = {name: d[name] for name in _PLAIN} | {name: from_number(d[name]) for name in _NUMBERS}
    return Attempt(
        labels=Labels(**labels),
        footprint=None if d["footprint"] is None else _read_shape(d["footprint"]),
        limits=None if d["limits"] is None else _read_limits(d["limits"]),
        sight=from_number(d["sight"]),
        tuned=Tuned(d["tuned"]),
        legs=tuple(_read_leg(leg) for leg in d["legs"]),
        bodies=tuple(_read_body(b) for b in (*fixtures, *d["bodies"])),
        **rest,
    )


def _limits(limits: DriveLimits) -> dict[str, Any]:
    """What bounds the base; of what only another kind of base has nothing."""
    usual = DriveLimits._field_defaults
    # Compared as they are written: -0.0 equals 0.0, and is another value.
    said = {
        name: value for name, value in limits._asdict().items() if name not in usual or str(value) != str(usual[name])
    }
    return {name: [*map(to_number, v)] if isinstance(v, tuple) else to_number(v) for name, v in said.items()}


def _read_limits(d: Mapping[str, Any]) -> DriveLimits:
    told: dict[str, Any] = {
        name: shares_of([*map(float, v)]) if isinstance(v, list) else float(v) for name, v in d.items()
    }
    return DriveLimits(**told)


def count_of_fixed(bodies: Sequence[Body]) -> int:
    """How many bodies at the front belong to the floor plan: they are stored once a plan."""
    return next((i for i, b in enumerate(bodies) if b.kind in PLACED), len(bodies))


def _shape(shape: Shape) -> dict[str, Any]:
    if isinstance(shape, Circle):
        return {"circle": to_number(shape.radius)}
    return {"polygon": [[to_number(x), to_number(y)] for x, y in shape.vertices]}


def _read_shape(d: Mapping[str, Any]) -> Shape:
    if "circle" in d:
        return Circle(float(d["circle"]))
    return Polygon(tuple((float(x), float(y)) for x, y in d["polygon"]))


def body_to_json(b: Body) -> dict[str, Any]:
    pose = None if b.pose is None else [to_number(v) for v in b.pose]
    return {
        "name": b.name,
        "kind": b.kind,
        "shape": _shape(b.shape),
        "pose": pose,
        "sigma": to_number(b.sigma),
        "measured": b.measured,
        "outlined": b.outlined,
        **({"visits": True} if b.visits else {}),
        **({"wish": {**asdict(b.wish), "speed": to_number(b.wish.speed)}} if b.wish else {}),
    }


def _read_body(d: Mapping[str, Any]) -> Body:
    pose = None if d["pose"] is None else np.array([float(v) for v in d["pose"]])
    return Body(
        d["name"], BodyKind(d["kind"]), _read_shape(d["shape"]), pose, float(d["sigma"]), d["outlined"], d["measured"],
        d.get("visits", False), _read_wish(d["wish"]) if "wish" in d else None,
    )  # fmt: skip


def _read_wish(d: Mapping[str, Any]) -> Wish:
    return Wish(from_number(d["speed"]), tuple((float(x), float(y)) for x, y in d["route"]), d["group"])


def _leg(leg: Leg) -> dict[str, Any]:
    return {
        "name": leg.name,
        "start": [to_number(v) for v in leg.start],
        "goal": [to_number(v) for v in leg.goal],
        "xy_tolerance": to_number(leg.xy_tolerance),
        "yaw_tolerance": to_number(leg.yaw_tolerance),
        "scored": leg.scored,
        "time_limit": to_number(leg.time_limit),
        "planner_xy_tolerance": to_number(leg.planner_xy_tolerance),
        "planner_yaw_tolerance": to_number(leg.planner_yaw_tolerance),
    }


def _read_leg(d: Mapping[str, Any]) -> Leg:
    rest: dict[str, Any] = {name: np.array([float(v) for v in d[name]]) for name in ("start", "goal")}
    rest |= {name: float(d[name]) for name in ("xy_tolerance", "yaw_tolerance", "time_limit")}
    told = ("planner_xy_tolerance", "planner_yaw_tolerance")  # results from before it was recorded don't have it
    rest |= {name: float(d.get(name, math.nan)) for name in told}
    return Leg(name=d["name"], scored=d["scored"], **rest)


def dumps(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def to_number(value: Any) -> float | str | None:
    """A number that strict JSON can hold: inf and NaN become text, which float() reads back."""
    if value is None:
        return None
    number = float(value)
    return number if math.isfinite(number) else repr(number)


def from_number(value: Any) -> float | None:
    return None if value is None else float(value)


def to_json(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): to_json(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_json(v) for v in value]
    if isinstance(value, str | bool | int | None):
        return value
    return to_number(value) if isinstance(value, float) else str(value)


def to_text(text: str) -> str:
    """Text that UTF-8 can hold."""
    return text.encode("utf-8", "replace").decode()
