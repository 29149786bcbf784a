"""Ours beside the real move_base, period by period, in what was recorded of it (`recordings/`): the same commands and plans."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmark_modules import load_benchmark
from clearway.navigators.move_base.parameters import Parameters
from clearway.robots import load_robot

RECORDINGS = Path(__file__).with_name("recordings")


@pytest.fixture(scope="module")
def recording() -> Any:
    """Who reads them."""
    return load_benchmark("real_move_base.recording")


def parameters(robot: str, per_metre: bool = False, latched: bool = False) -> Parameters:
    found = Parameters.read(load_robot(robot))
    planner = found.TrajectoryPlannerROS.model_copy(update={"meter_scoring_honoured": per_metre})
    node = found.move_base.model_copy(update={"latch_xy_goal_tolerance": latched})
    return found.model_copy(update={"TrajectoryPlannerROS": planner, "move_base": node})


@pytest.mark.parametrize(
    ("name", "robot", "speed", "per_metre"),
    [
        ("jackal-cells", "jackal", None, False),
        ("jackal-metres", "jackal", None, True),
        ("tiago", "tiago", 0.6, False),
        ("hosbot", "hosbot", 0.6, False),
    ],
)
def test_it_commands_and_plans_what_the_real_one_did(
    recording: Any, name: str, robot: str, speed: float | None, per_metre: bool
) -> None:
    file = RECORDINGS / f"{name}.bin"
    commands = list(recording.answers(file, load_robot(robot), speed, parameters(robot, per_metre)))
    assert len(commands) >= 14
    assert len({tuple(one.real.round(6)) for one in commands}) > 8  # the real one did not just drive on
    assert all(one.same for one in commands)
    plans = list(recording.plans(file, load_robot(robot)))
    assert plans
    for theirs, ours, cell in plans:
        assert len(theirs) > 2
        assert recording.apart(theirs, ours) <= cell


@pytest.mark.parametrize("per_metre", [False, True])
def test_what_the_weights_count_per_shows_before_a_gap(recording: Any, per_metre: bool) -> None:
    """So the recordings tell the two readings of `meter_scoring` apart."""
    other = RECORDINGS / f"jackal-{'cells' if per_metre else 'metres'}.bin"
    commands = list(recording.answers(other, load_robot("jackal"), None, parameters("jackal", per_metre)))
    assert np.mean([one.same for one in commands]) < 0.5


def test_the_real_one_looks_for_the_latch_of_dwa_beside_its_group_not_in_it(recording: Any) -> None:
    """It was recorded with `DWAPlannerROS/latch_xy_goal_tolerance` true, which it did not read."""
    commands = recording.answers(
        RECORDINGS / "hosbot.bin", load_robot("hosbot"), 0.6, parameters("hosbot", latched=True)
    )
    assert not all(one.same for one in commands)
