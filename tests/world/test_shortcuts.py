"""What is left out, since it would change nothing: a second drive where nobody can be met, one decision at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from worlds import Pilot, constant, make_robot, make_scenario, run_among

from clearway.contract import Command
from clearway.trials import Outcome, Trial
from clearway.world import plant
from clearway.world.traffic import Traffic
from clearway.world.world import World


def among(rule: str, pilot: Pilot, seed: int) -> Trial:
    """Six who walk through each other round the robot."""
    angles = np.arange(6) * np.pi / 3 + 0.1 * seed
    people: list[dict[str, Any]] = [
        {"name": f"p{k}", "start": (4 * np.cos(a), 4 * np.sin(a)), "speed": 1.1, "behaviour": rule, "loop": True,
         "route": [{"at": (-4 * np.cos(a), -4 * np.sin(a))}, {"at": (4 * np.cos(a), 4 * np.sin(a))}]}
        for k, a in enumerate(angles)
    ]  # fmt: skip
    legs = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 12.0}]
    scenario = make_scenario(people=people, start=(-1.5, -3.0, 0.5), legs=legs, seed=seed)
    return run_among((), pilot, scenario, make_robot())


def bits(trial: Trial) -> tuple[Any, ...]:
    arrays = trial.t, trial.pose, trial.velocity, trial.moving_obstacles
    between = () if trial.between is None else (trial.between.t, trial.between.pose, trial.between.moving_obstacles)
    return trial.outcome, trial.reason, trial.errands, [a.tobytes() for a in (*arrays, *between)]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("rule", ["orca", "social-force", "headed-social-force"])
def test_the_bits_are_those_of_the_long_way(rule: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pilot = Pilot(lambda s: Command(0.6, 0.4)) if seed % 2 else constant(0.5)
    short = among(rule, pilot, seed)

    def drive(self: World, t: float) -> tuple[float, Any]:
        """Everybody is looked at in each step of the plant."""
        all_of_it, leg = self.ride, self._traffic.leg
        all_of_it.state[:], all_of_it.setting.moving.slack[:] = all_of_it.began, 0.0
        hit = plant.drive_period(all_of_it.state, self._count, leg, t, all_of_it.setting)
        self._far = False
        return self._driven(hit)

    monkeypatch.setattr(World, "drive", drive)
    began = Traffic.__init__

    def apart(self: Traffic, *args: Any, **more: Any) -> None:
        began(self, *args, **more)
        self._together = False

    monkeypatch.setattr(Traffic, "__init__", apart)
    assert bits(among(rule, pilot, seed)) == bits(short)
    assert short.outcome in (Outcome.TIMEOUT, Outcome.COLLISION)
