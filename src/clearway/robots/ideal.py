"""A robot some of whose errors, of its sensors and its motors, are left out: what each costs shows beside the robot as it is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, get_args

from clearway.errors import unknown
from clearway.robots.robot import Robot

RobotError = Literal["sweep", "legs", "mixed-pixels", "lost-returns", "bias", "noise", "odometry", "lag", "slip", "all"]
"""What can be left out; `all`: all of them."""
ERRORS: dict[str, dict[str, dict[str, Any]]] = {
    "sweep": {"lidar": {"sweep": 0.0}},
    "legs": {"lidar": {"height": None}},
    "mixed-pixels": {"lidar": {"divergence": 0.0}},
    "lost-returns": {"lidar": {"dropout": 0.0}},
    "bias": {"lidar": {"bias": 0.0}},
    "noise": {"lidar": {"sigma": 0.0}},
    "odometry": {
        "odometry": {
            "translation_per_metre": 0.0, "rotation_per_metre": 0.0, "rotation_per_radian": 0.0, "scale": 0.0,
            "turn_scale": 0.0, "curvature": 0.0, "speed_noise": 0.0, "yaw_rate_noise": 0.0,
        }
    },
    "lag": {"drive": {"lag": 0.0}},
    "slip": {"drive": {"slip_ratio": 0.0, "turn_slip_ratio": 0.0}},
}  # fmt: skip
"""Name -> part of a robot's file -> what its values are without the error."""


def errors_named(names: Iterable[str]) -> tuple[str, ...]:
    """Names of `ERRORS` that `names` stand for, each once and in their order.

    Raises:
        ClearwayError: a name that is none.
    """
    asked = tuple(names)
    for name in asked:
        if name not in get_args(RobotError):
            raise unknown("error of a robot", name, get_args(RobotError), field="ideal")
    return tuple(name for name in ERRORS if name in asked or "all" in asked)


def ideal(robot: Robot, errors: Iterable[str]) -> Robot:
    """`robot` without these `errors`: as the world has it; whoever drives it knows the robot as it is, but is told of its lag, as of all
    latency, what holds in this world."""
    parts: dict[str, dict[str, Any]] = {}
    for name in errors_named(errors):
        for part, values in ERRORS[name].items():
            parts.setdefault(part, {}).update(values)
    change = {part: _without(getattr(robot, part), values) for part, values in parts.items()}
    return robot.model_copy(update=change) if change else robot


def _without(part: Any, values: Mapping[str, Any]) -> Any:
    return None if part is None else part.model_copy(update=values)
