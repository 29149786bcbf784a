"""The conformance check passes a sound navigator, and finds each fault that it is there to find."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clearway.campaigns.conformance import Finding, check_navigator
from clearway.contract import Command, Diagnostics, Observation
from clearway.errors import ClearwayError
from clearway.robots import load_robot

pytestmark = pytest.mark.slow

ROBOT = load_robot("tiago")


class Sound:
    """Turns to the goal and drives there, with a wobble drawn from its rng."""

    needs = frozenset({"scan", "map", "obstacles"})

    def reset(self, task: Any, robot: Any, rng: np.random.Generator) -> None:
        self.rng, self.v_max, self.calls = rng, min(task.speed_limit, robot.drive.v_max), 0

    def step(self, o: Observation) -> Command:
        self.calls += 1
        dx, dy = o.goal.pose[:2] - o.pose[:2]
        near = math.hypot(dx, dy) < o.goal.xy_tolerance
        error = math.remainder((o.goal.pose[2] if near else math.atan2(dy, dx)) - o.pose[2], math.tau)
        wobble = 0.01 * self.rng.uniform(-1, 1)
        v = 0.0 if near else max(0.0, math.cos(error)) * min(self.v_max, math.hypot(dx, dy))
        return Command(v, max(-1.0, min(1.0, error)) + wobble)

    def diagnostics(self) -> Diagnostics:
        return Diagnostics(polylines={"plan": np.zeros((2, 2))}, status="driving")


def broken(**methods: Any) -> type:
    return type("Broken", (Sound,), methods)


def step_of(change: Any) -> Any:
    return lambda self, o: change(self, o, Sound.step(self, o))


def failed(navigator: type) -> dict[str, str]:
    return {f.name: f.detail for f in check_navigator(navigator, ROBOT) if f.passed is False}


def test_a_sound_navigator_passes() -> None:
    findings = list(check_navigator(Sound, ROBOT))
    assert [f for f in findings if not f.passed] == []
    assert Finding("says what it needs", True, "map, obstacles, scan") in findings


def test_needs_must_be_known() -> None:
    assert "scans" in failed(broken(needs=frozenset({"scans"})))["says what it needs"]


@pytest.mark.parametrize("wants", [frozenset({"scans"}), frozenset({"obstacles"}), "scan"])
def test_what_it_wants_must_be_known(wants: Any) -> None:
    assert (
        "`wants` is a frozenset of some of scan"
        in failed(broken(wants=wants))["says what it wants besides, or nothing"]
    )


def test_its_parameters_are_read_for_the_robot() -> None:
    def read_parameters(self: Any, robot: Any) -> None:
        raise ClearwayError(f"{robot.name} is wrong", field="navigators.own.gain")

    said = failed(broken(read_parameters=read_parameters))
    assert said == {"reads its parameters": "navigators.own.gain: tiago is wrong"}


def test_it_is_called_as_it_is_named() -> None:
    said = [f.detail for f in check_navigator(broken(wants="scan"), ROBOT, name="exec:./own") if f.passed is False]
    assert [text.partition(" wants")[0] for text in said] == ["navigator 'exec:./own'"]


def test_the_privileged_flag_is_a_bool() -> None:
    assert "'yes'" in failed(broken(privileged="yes"))["says whether it is privileged"]


def test_an_exception_names_the_situation_and_the_line() -> None:
    def step(self: Any, o: Observation) -> Command:
        return Command(1 / len(o.obstacles.radius), 0.0)

    found = failed(broken(step=step))
    assert "ZeroDivisionError" in found["decides: a free way"]
    assert "test_conformance.py" in found["decides: a free way"]
    assert "decides: many obstacles" not in found


@pytest.mark.parametrize(
    ("step", "name", "says"),
    [
        (step_of(lambda s, o, c: (c.v, c.omega)), "decides: a free way", "returned a tuple"),
        (step_of(lambda s, o, c: Command(math.nan, 0.0)), "commands are finite", "v = nan"),
        (step_of(lambda s, o, c: Command(0.9, 0.0)), "commands keep the robot's limits", "v = 0.9 m/s"),
        (step_of(lambda s, o, c: Command(0.0, 9.0)), "commands keep the robot's limits", "omega = 9 rad/s"),
        (
            step_of(lambda s, o, c: o.pose.fill(0.0) or c),
            "leaves its observation alone",
            "read-only (test_conformance.py:",
        ),
        (
            step_of(lambda s, o, c: o.scan.ranges.fill(1.0) or c),
            "leaves its observation alone",
            "read-only (test_conformance.py:",
        ),
        (
            step_of(lambda s, o, c: Command(c.v, np.random.uniform(-1, 1))),  # noqa: NPY002 (that is the fault)
            "same seed, same commands, whatever came before",
            "draw only from the rng",
        ),
        (step_of(lambda s, o, c: Command(0.0, 0.0)), "reaches a goal in the open", "2.50 m from a goal"),
    ],
)
def test_each_fault_is_found(step: Any, name: str, says: str) -> None:
    assert says in failed(broken(step=step))[name]


def test_a_reset_that_remembers_is_found() -> None:
    def reset(self: Any, task: Any, robot: Any, rng: np.random.Generator) -> None:
        self.resets = getattr(self, "resets", 0) + 1
        Sound.reset(self, task, robot, rng)

    def step(self: Any, o: Observation) -> Command:
        c = Sound.step(self, o)
        return Command(c.v / self.resets, c.omega)

    assert (
        "reset() forget everything"
        in failed(broken(reset=reset, step=step))["same seed, same commands, whatever came before"]
    )


def test_diagnostics_keep_to_the_vocabulary() -> None:
    found = failed(broken(diagnostics=lambda self: Diagnostics(polylines={"plan": np.zeros((4, 3))})))
    assert "polyline 'plan' is float64 (4, 3)" in found["diagnostics in the vocabulary"]
    assert "returned a dict" in failed(broken(diagnostics=lambda self: {}))["diagnostics in the vocabulary"]
