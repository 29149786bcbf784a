"""A test plan of small files whose motion is known by hand: out and back over 2 m, with a turn between."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from clearway.trials import Trial

RATE = 20.0
TABLE = """
time = { column = "t" }
[bodies.robot]
x = "x"
y = "y"
yaw = "th"
[bodies.cart]
x = "cx"
y = "cy"
yaw = "cth"
"""


def ramp(length: float, speed: float) -> np.ndarray:
    """Distance covered, sample by sample: accelerate at 1, cruise, brake at 1."""
    up = speed / 1.0
    whole = length / speed + up
    t = np.arange(0.0, whole + 1e-9, 1 / RATE)
    v = np.minimum(np.minimum(t, speed), np.maximum(whole - t, 0.0))
    s = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 / RATE)])
    return s * length / s[-1]


def drive(
    *, speed: float = 0.5, cart: tuple[float, float] = (1.0, 1.0), cart_drives: bool = False, rest: float = 1.0
) -> np.ndarray:
    """(n, 7) t, robot, cart: 2 s rest, forth, rest, turn, rest, back, 2 s rest."""
    s = ramp(2.0, speed)
    turn = ramp(math.pi, 1.0)
    parts = [
        np.tile([0.0, 0.0, 0.0], (int(2 * RATE), 1)),
        np.column_stack([s, np.zeros_like(s), np.zeros_like(s)]),
        np.tile([2.0, 0.0, 0.0], (int(rest * RATE), 1)),
        np.column_stack([np.full_like(turn, 2.0), np.zeros_like(turn), turn]),
        np.tile([2.0, 0.0, math.pi], (int(rest * RATE), 1)),
        np.column_stack([2.0 - s, np.zeros_like(s), np.full_like(s, math.pi)]),
        np.tile([0.0, 0.0, math.pi], (int(2 * RATE), 1)),
    ]
    robot = np.concatenate(parts)
    t = np.arange(len(robot)) / RATE
    beside = np.tile([*cart, 0.0], (len(t), 1))
    if cart_drives:
        beside[:, 1] += 0.3 * t / t[-1]
    return np.column_stack([t, robot, beside])


def write(folder: Path, name: str, rows: np.ndarray) -> None:
    np.savetxt(folder / name, rows, delimiter=",", header="t,x,y,th,cx,cy,cth", comments="", fmt="%.9f")
    (folder / name).with_suffix(".toml").write_text(TABLE, encoding="utf-8")


PLAN: dict[str, Any] = {
    "test": {"suite": "own", "robot": "tiago", "reference_length": 2.0},
    "poses": {"A": [0.0, 0.0, 0.0], "B": [2.0, 0.0, 0.0]},
    "sources": {"capture": {"format": "table", "frame": {"same": True}}},
    "robot": {"track": "robot"},
    "bodies": {"cart": {"track": "cart", "shape": {"kind": "square", "edge": 0.2}}},
    "motion": {"cutoff": "none"},
    "legs": [
        {"name": "forth", "start": "A", "goal": "B"},
        {"name": "turn", "goal": [2.0, 0.0, math.pi], "scored": False},
        {"name": "back", "goal": [0.0, 0.0, math.pi]},
    ],
}
Score = Callable[..., Trial]
"""A trial of the plan: what its [[trial]] says more, its rows, and the tables of the plan that are others."""
