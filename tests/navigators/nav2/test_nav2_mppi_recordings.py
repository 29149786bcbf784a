"""MPPI against what nav2_mppi_controller itself, compiled, made of the same inputs (`recordings/README.md`)."""

import numpy as np
import pytest
from mppi_recorded import CASES, FOLDER, STEPS, decisions_of, noise_of, spaces_of, table_of, view_of

from clearway.navigators.nav2.controllers.mppi.optimizer import Optimizer
from clearway.navigators.nav2.controllers.mppi.parameters import MPPIParameters, motion_model_of
from clearway.navigators.nav2.seams import Tolerances, Velocity

RECORDED = np.load(FOLDER / "mppi.npz")


class Heard:
    """A critic, and what it added when it was last asked."""

    def __init__(self, critic):
        self._critic = critic
        self.added = None

    def score(self, rollouts, costs):
        before = costs.copy()
        fails = self._critic.score(rollouts, costs)
        self.added = costs - before
        return fails


@pytest.mark.parametrize("name", CASES)
def test_same_as_the_real_one(name):
    case = CASES[name]
    parameters, spaces = MPPIParameters.model_validate(table_of(case)), spaces_of(case)
    optimizer = Optimizer(parameters, spaces, motion_model_of(parameters, spaces), case.frequency, np.uint64(0))
    optimizer.noise = noise_of(case)
    optimizer.set_speed_limit(case.limit, True)
    optimizer.critics = tuple(Heard(critic) for critic in optimizer.critics)
    view = view_of(case)
    for k, (pose, velocity, path) in enumerate(decisions_of(case)):
        recorded = {key: RECORDED[f"{name}/{key}"][k] for key in ("command", "ends", "critics", "costs", "control")}
        command = optimizer.decide(pose, Velocity(*velocity), path, Tolerances(0.25, 0.25), view)
        for ours, theirs in zip(optimizer.samples[-3:], recorded["ends"], strict=True):
            np.testing.assert_allclose(ours[[STEPS // 2, STEPS - 1]], theirs, atol=3e-6)
        for critic, theirs in zip(optimizer.critics, recorded["critics"], strict=True):
            np.testing.assert_allclose(
                critic.added, theirs, rtol=2e-5, atol=2e-5 * max(1.0, np.abs(recorded["costs"]).max())
            )
        np.testing.assert_allclose(optimizer.costs, recorded["costs"], rtol=2e-5, atol=1e-5)
        np.testing.assert_allclose(optimizer.control, recorded["control"], atol=2e-5)
        np.testing.assert_allclose(command, recorded["command"], atol=2e-5)


def test_every_critic_speaks_in_a_recording():
    spoke = set()
    for name, case in CASES.items():
        added = np.abs(RECORDED[f"{name}/critics"]).max(axis=(0, 2))
        spoke |= {critic for critic, most in zip(table_of(case)["critics"], added, strict=True) if most > 0.0}
    assert len(spoke) == 11
