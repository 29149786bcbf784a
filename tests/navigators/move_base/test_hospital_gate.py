"""Both robots of paper A drive around the protocol's obstacles without loitering in front of them."""

from __future__ import annotations

import pytest

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import granted_map
from clearway.navigators.move_base import MoveBase
from clearway.perception import make_localiser
from clearway.robots import load_robot
from clearway.scenarios.hospital import D_AB, undisturbed
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome
from clearway.world import simulate


@pytest.mark.parametrize("name", ["tiago", "hosbot"])
def test_around_a_gate_in_less_than_twice_the_undisturbed_time(name: str) -> None:
    """Two thin poles 1 x d_base apart: too narrow, so the way is around them. ROS's weights since Melodic make HOSBOT
    turn on the spot for half a minute here: a cell's cost under its outline outweighs any progress.
    """
    robot = load_robot(name)
    chosen = Selection(configurations=("perpendicular",), speeds=(0.6,), sizes=(0.03,), gaps=(1.0,), repetitions=1)
    (scenario,) = load_suite("hospital").build(robot, chosen, 0)
    pilot = compose(MoveBase(), make_localiser("truth", robot))
    trial = simulate(
        scenario, robot, pilot, navigator="move-base", localisation="truth", map=granted_map(None, scenario)
    )
    assert trial.outcome is Outcome.REACHED
    for span in trial.spans:
        if trial.attempt.legs[span.leg].scored:
            assert span.end - span.start < 2 * undisturbed(robot, 0.6, D_AB)
