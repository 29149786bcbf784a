"""What is said on the wire, version 1: `docs/wire.md` specifies it."""

from __future__ import annotations

import math
from collections.abc import Callable, Set
from dataclasses import asdict, dataclass, fields
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from clearway.contract import Command, Goal, Need, Observation, Obstacles, Task
from clearway.errors import shown
from clearway.geometry.grid import OccupancyGrid
from clearway.live.encodings import Message
from clearway.live.line import WireError
from clearway.robots import DriveKind, Robot

VERSION = 1
"""Of the wire."""

Array = Callable[[npt.NDArray[Any]], Any]
"""How an encoding puts an array into a message."""

BYE: Message = {"type": "bye"}

_UNTOLD = {"sources", "presets", "conditions", "localisation", "mapping"}
"""What of a robot's file is nobody's business who drives it."""

_OBSTACLES = tuple(f.name for f in fields(Obstacles))
_COMMAND = frozenset(f.name for f in fields(Command))


@dataclass(frozen=True, slots=True)
class Hello:
    """How a navigator introduces itself.

    Attributes:
        needs: What observations must hold.
        drives: The kinds of bases that it drives.
    """

    needs: frozenset[str]
    drives: frozenset[str]


def hello_of(message: Message) -> Hello:
    """The `hello` that a message is.

    Raises:
        WireError: it is none, of another version, or asks for what there is not.
    """
    if message.get("type") != "hello":
        raise WireError(f"said {shown(message)} where its hello is expected")
    if (version := message.get("version")) != VERSION or isinstance(version, bool):
        raise WireError(f"speaks version {shown(version)} of the wire; version {VERSION} is spoken here")
    _refuse_unknown(message, {"version", "needs", "drives"}, "hello")
    needs = _some(message.get("needs"), get_args(Need), "needs")
    drives = _some(message.get("drives", ["differential"]), get_args(DriveKind), "drives")
    if not drives:
        raise WireError("says hello with drives = []; at least one kind of base is needed")
    return Hello(needs, drives)


def ready_of(message: Message) -> None:
    """Nothing, if a message is the answer to `reset`.

    Raises:
        WireError: it is not.
    """
    if message.get("type") != "ready":
        raise WireError(f"answered its reset with {shown(message)}; {{'type': 'ready'}} is expected")
    _refuse_unknown(message, frozenset(), "ready")


def command_of(message: Message) -> Command:
    """The command that a message is; what its values are is for who asked.

    Raises:
        WireError: it is none.
    """
    if message.get("type") != "command":
        raise WireError(f"answered a step with {shown(message)}; a command is expected")
    if not message.keys() <= _ALLOWED:
        _refuse_unknown(message, _COMMAND, "command")
    for name in ("v", "omega"):
        if name not in message:
            raise WireError(f"gave a command without {name!r}: {shown(message)}")
    given = {name: message[name] for name in message if name != "type"}
    if isinstance(violated := given.get("violated"), list):
        given["violated"] = tuple(violated)
    return Command(**given)


_ALLOWED = _COMMAND | {"type"}


def reset_of(task: Task, robot: Robot, rng: np.random.Generator, array: Array) -> Message:
    """The message `reset`.

    Args:
        task: What the navigator is told of its task.
        robot: Who it drives.
        rng: From which its seed is drawn.
        array: How arrays are written.
    """
    limits = robot.limits()
    return {
        "type": "reset",
        "seed": int(rng.integers(2**53)),  # a JSON reader may hold numbers as doubles
        "task": {
            "period": task.period,
            "speed_limit": task.speed_limit,
            "start": task.start.tolist(),
            "time_limit": task.time_limit,
            "area": None if task.area is None else list(task.area),
            "budget": asdict(task.budget),
            "latency": asdict(task.latency),
        },
        "robot": robot.model_dump(mode="json", exclude=_UNTOLD),
        "limits": {"kind": limits.kind, **limits._asdict()},
        "map": None if task.map is None else _map(task.map, array),
    }


def step_of(observation: Observation, goal: Message, array: Array) -> Message:
    """The message `step`.

    Args:
        observation: What the navigator is told.
        goal: What `goal_of` made of its goal.
        array: How arrays are written.
    """
    o = observation
    message = {
        "type": "step",
        "t": o.t,
        "pose": o.pose.tolist(),
        "velocity": o.velocity.tolist(),
        "odom_pose": o.odom_pose.tolist(),
        "goal": goal,
    }
    if (scan := o.scan) is not None:
        message["scan"] = {
            "ranges": array(scan.ranges),
            "angle_min": scan.angle_min,
            "angle_increment": scan.angle_increment,
            "range_min": scan.range_min,
            "range_max": scan.range_max,
            "mount": scan.mount.tolist(),
            "time_increment": scan.time_increment,
        }
    if (seen := o.obstacles) is not None:
        message["obstacles"] = {"count": len(seen)} | {name: array(getattr(seen, name)) for name in _OBSTACLES}
    return message


def goal_of(goal: Goal, number: int) -> Message:
    """A goal as it stands in a `step`; `number` counts those of a trial from 0."""
    return {
        "number": number,
        "pose": goal.pose.tolist(),
        "xy_tolerance": goal.xy_tolerance,
        "yaw_tolerance": goal.yaw_tolerance if math.isfinite(goal.yaw_tolerance) else None,
        "leg": goal.leg,
    }


def _map(grid: OccupancyGrid, array: Array) -> Message:
    rows, columns = grid.data.shape
    return {
        "rows": rows,
        "columns": columns,
        "resolution": grid.resolution,
        "origin": list(grid.origin),
        "cells": array(np.ascontiguousarray(grid.data, dtype=np.int8)),
    }


def _some(values: object, known: tuple[str, ...], field: str) -> frozenset[str]:
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise WireError(f"says hello with {field} = {shown(values)}; a list of some of {', '.join(known)} is expected")
    if strange := [value for value in values if value not in known]:
        raise WireError(f"says hello with {field} = {shown(strange[0])}; there is only {', '.join(known)}")
    return frozenset(values)


def _refuse_unknown(message: Message, known: Set[str], kind: str) -> None:
    if strange := sorted(message.keys() - known - {"type"}):
        raise WireError(
            f"gave {kind} a {shown(strange[0])}, which it has not; it has {', '.join(sorted(known)) or 'nothing'}"
        )
