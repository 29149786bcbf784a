"""What can be wrong with what a navigator answers and shows, and with what it leaves of its observation."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from clearway.contract import Command, Diagnostics
from clearway.geometry.grid import OccupancyGrid
from clearway.robots import Robot, possible

SLACK = 1e-6
"""By how much a command may exceed the robot's limits: rounding."""


def malformed(command: Any) -> str:
    """What makes an answer no command; empty for nothing."""
    if not isinstance(command, Command):
        return f"step() returned a {type(command).__name__}, not a clearway.contract.Command"
    for name in ("v", "omega", "v_y"):
        if isinstance(value := getattr(command, name), bool) or not isinstance(value, int | float | np.floating):
            return f"the command's {name} is {value!r}, not a number"
    if command.arrived is not None and not isinstance(command.arrived, bool | np.bool_):
        return f"the command's `arrived` is {command.arrived!r}, not True, False or None"
    if command.gave_up is not None and not isinstance(command.gave_up, str):
        return f"the command's `gave_up` is {command.gave_up!r}, not the reason as text, or None"
    return ""


def not_finite(c: Command) -> str:
    """A command that isn't finite; empty if it is."""
    told = f"v = {c.v}, omega = {c.omega}" + (f", v_y = {c.v_y}" if c.v_y != 0.0 else "")
    return "" if all(map(math.isfinite, (c.v, c.omega, c.v_y))) else told


def beyond(c: Command, robot: Robot, speed: float) -> str:
    """Which of the robot's limits a command breaks where `speed` [m/s] is set; empty for none."""
    d = robot.limits()
    top = min(speed, d.v_max)
    if not d.v_min - SLACK <= c.v <= top + SLACK:
        return f"v = {c.v:.4g} m/s; the robot and the set speed allow {d.v_min:g} to {top:g}"
    if abs(c.omega) > d.omega_max + SLACK:
        return f"omega = {c.omega:.4g} rad/s; the robot allows {d.omega_max:g}"
    told = (c.v, c.omega, c.v_y)
    kept = possible(d.capped(speed), *told)
    if any(abs(a - b) > SLACK for a, b in zip(told, kept, strict=True)):
        text = "v = {:.4g} m/s, omega = {:.4g} rad/s, v_y = {:.4g} m/s"
        return f"{text.format(*told)}; of that the base makes {text.format(*kept)}"
    return ""


def diagnostics_fault(shown: Any) -> str:
    """What is wrong with diagnostics; empty for nothing."""
    if not isinstance(shown, Diagnostics):
        return f"diagnostics() returned a {type(shown).__name__}, not a clearway.contract.Diagnostics"
    arrays = [(f"polyline {n!r}", a, 2) for n, a in shown.polylines.items()]
    arrays += [(f"circles {n!r}", a, 3) for n, a in shown.circles.items()]
    arrays += [("tube", shown.tube, 3)] if shown.tube is not None else []
    arrays += [("tree", shown.tree, 4)] if shown.tree is not None else []
    for name, values, width in arrays:
        found = np.asarray(values)
        if found.ndim != 2 or found.shape[1] != width or found.dtype != np.float64:
            return f"the {name} is {found.dtype} {found.shape}, not float64 (n, {width})"
        if not np.isfinite(found).all():
            return f"the {name} holds a number that is not finite"
    if shown.field is not None and not isinstance(shown.field, OccupancyGrid):
        return f"the field is a {type(shown.field).__name__}, not an OccupancyGrid"
    if not isinstance(shown.status, str) or not isinstance(shown.iterations, int | np.integer):
        return f"status {shown.status!r} must be text, iterations {shown.iterations!r} a whole number"
    return ""


def changed(before: Any, after: Any, where: str = "observation") -> str:
    """Which field of an observation the navigator wrote into."""
    if isinstance(before, np.ndarray):
        return "" if np.array_equal(before, after, equal_nan=True) else f"it wrote into {where}"
    if is_dataclass(before):
        found = (changed(getattr(before, f.name), getattr(after, f.name), f"{where}.{f.name}") for f in fields(before))
        return next((text for text in found if text), "")
    return ""
