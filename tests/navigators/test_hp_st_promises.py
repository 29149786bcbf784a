"""docs/guarantee.md promises texts for what violates the assumptions: each of them is told, and nothing else is."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from space_time_scenes import PERIOD, begun, goal, observation, obstacles

from clearway.contract import Obstacles
from clearway.navigators.hp_st import HpSt
from clearway.navigators.hp_st.guarantee.tube import drive
from clearway.robots import load_robot

PAGE = Path(__file__).parents[2] / "docs" / "guarantee.md"
NOTHING = obstacles()


def without_numbers(text: str) -> str:
    return re.sub(r"-?\b\d+(\.\d+)?\b", "#", text)


def promised() -> list[str]:
    section = PAGE.read_text(encoding="utf-8").split("## When an assumption does not hold")[1].split("\n## ")[0]
    return re.findall(r"^- `([^`]+)`", section, re.MULTILINE)


def periods(
    *seen: Obstacles, off: Sequence[float] = (0.0, 0.0, 0.0), velocity: Sequence[float] | None = None,
    times: Sequence[float] = (), robot: str = "rescue",
) -> list[str]:  # fmt: skip
    """What is told of a drive in which `seen` is perceived, one look after the other.

    Args:
        off: how far the robot is from where it was commanded, at each look but the first. velocity: measured, default: as
        commanded. times: of the looks, default: one a period.
    """
    navigator: HpSt = begun(load_robot(robot))
    period = load_robot(robot).period
    pose, aim, texts = np.zeros(3), goal(9.0, 0.0), []
    before = measured = np.zeros(2)
    for k, now in enumerate(seen):
        command = navigator.step(observation(times[k] if times else k * period, pose, aim, now, measured))
        texts += command.violated
        told = np.array([[command.v, command.omega]])
        driven = drive(np.concatenate((pose, before)), told, navigator._safety.limits, period)
        pose, before = driven.states[1] + off, driven.velocities[1]
        measured = before if velocity is None else np.array(velocity)
    return texts


def at(x: float, y: float = 3.0, **more: Any) -> Obstacles:
    return obstacles([(x, y)], **{"names": [3], "radius": 0.2, **more})


PROVOKED: dict[str, Callable[[], list[str]]] = {
    "disturbance: ended # m": lambda: periods(NOTHING, NOTHING, off=(0.0, 0.023, 0.0)),
    "disturbance: turned # rad": lambda: periods(NOTHING, NOTHING, off=(0.0, 0.0, 0.02)),
    "command: v is": lambda: periods(NOTHING, NOTHING, velocity=(5.0, 3.0)),
    "command: omega is": lambda: periods(NOTHING, NOTHING, velocity=(5.0, 3.0)),
    "period: ": lambda: periods(NOTHING, NOTHING, times=(0.0, 2 * PERIOD)),
    "time went back": lambda: periods(NOTHING, NOTHING, times=(0.0, -PERIOD)),
    "obstacle #: faster than": lambda: periods(at(0.0), at(0.0), at(1.5)),
    "obstacle #: accelerates by": lambda: periods(*[at(0.0)] * 3, *[at(0.4 * k) for k in (1, 2)]),
    "obstacle #: perceived under the identity": lambda: periods(
        *[obstacles([(-2.0, 3.0), (2.0, 3.0)], names=n) for n in ([3, 7], [3, 7], [7, 3])]
    ),
    "obstacle #: moves, but": lambda: periods(at(0.0, moving=False, error=0.0), at(0.0)),
    "obstacle #: appeared within sight": lambda: periods(NOTHING, at(1.1, 0.0)),
    "obstacle #: stands # m within sight": lambda: periods(NOTHING, at(2.0, moving=False, error=0.0)),
    "surface: stands # m": lambda: periods(NOTHING, at(2.0, 1.0, moving=False, error=0.0), robot="tiago"),
    "base: the certificate covers": lambda: periods(NOTHING, robot="f1tenth"),
}
"""How each text begins, and how to make it happen."""


def test_the_page_promises_what_is_provoked_here() -> None:
    texts = [without_numbers(text) for text in promised()]
    assert len(texts) == len(set(texts)) == len(PROVOKED) == 14
    assert all(sum(text.startswith(begins) for begins in PROVOKED) == 1 for text in texts)


@pytest.mark.parametrize("begins", PROVOKED)
def test_each_text_that_is_promised_is_told(begins: str) -> None:
    texts = {without_numbers(text) for text in PROVOKED[begins]()}
    assert [text for text in map(without_numbers, promised()) if text.startswith(begins) and text in texts] != []
    assert texts <= {without_numbers(text) for text in promised()}


def test_nothing_is_told_of_a_drive_as_it_is_assumed() -> None:
    for robot in ("rescue", "tiago", "hosbot"):
        period = load_robot(robot).period
        assert periods(*[at(0.5 * math.sin(0.5 * k * period)) for k in range(20)], robot=robot) == []
