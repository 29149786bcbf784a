"""Regulated pure pursuit against what nav2_regulated_pure_pursuit_controller itself, compiled, made of the same inputs."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pursuit_recorded import COUNT, FREQUENCY, case_of, view_of

from clearway.navigators.nav2.controllers.parameters import RegulatedPurePursuitParameters
from clearway.navigators.nav2.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from clearway.navigators.nav2.seams import ControllerFailed, NoValidControl, Tolerances, Velocity

pytestmark = pytest.mark.slow  # compiles for long

RECORDED = np.load(Path(__file__).parent / "recordings" / "pursuit.npz")["made"]


def made_of(number: int) -> tuple[int, float, float, bool]:
    """What ours makes of a case, as `recorder/pursuit.cpp` writes it."""
    case = case_of(number)
    controller = RegulatedPurePursuit(RegulatedPurePursuitParameters(**case.own), 1.0 / FREQUENCY)
    controller._last = Velocity(case.last[0], 0.0, case.last[1])
    if case.cancelling:
        controller.cancel()
    controller.set_speed_limit(case.limit, True)
    measured, tolerances = Velocity(case.measured[0], 0.0, case.measured[1]), Tolerances(0.25, 0.25, case.there)
    try:
        found = controller.compute(0.0, case.pose, measured, case.path, case.path[-1], tolerances, view_of(case))
    except ControllerFailed:
        return 1, 0.0, 0.0, False
    except NoValidControl:
        return 2, 0.0, 0.0, controller._at_rest
    return 0, found.v_x, found.omega, controller._at_rest


def test_same_as_the_real_one() -> None:
    """To 1e-7: Nav2 takes one of its logarithms in 32 bits."""
    assert len(RECORDED) == COUNT
    kinds: Counter[str] = Counter()
    for number in range(COUNT):
        recorded = RECORDED[number]
        assert made_of(number) == pytest.approx(tuple(recorded), abs=1e-7), number
        end, v, _, finished = recorded
        kinds[
            "collision" if end == 2 else "off" if end == 1 else "forth" if v > 0 else "back" if v < 0 else "turns"
        ] += 1
        kinds["came to rest"] += int(finished)
    assert min(kinds[kind] for kind in ("collision", "off", "forth", "back", "turns", "came to rest")) >= 5
