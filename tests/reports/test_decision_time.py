"""A navigator that is too slow for its robot is told so wherever its results are shown; one that isn't, not."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway.contract import Command, Observation, Task
from clearway.reports import text
from clearway.reports.decision_time import decision_times, table, warnings
from clearway.reports.findings import Findings
from clearway.robots import Robot


class Stands:
    """Gives up after a second; every fifth decision takes longer than `rescue`'s period of 0.15 s."""

    waits = 0.0

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.count = 0

    def step(self, observation: Observation) -> Command:
        self.count += 1
        if self.count == 1 or self.count % 5 == 0:  # the first does not count
            time.sleep(self.waits)
        return Command(0.0, 0.0, gave_up="that is all" if self.count == 11 else None)


class Slow(Stands):
    waits = 0.2


@pytest.mark.slow
def test_who_could_not_have_kept_up_is_told_so(tmp_path: Path) -> None:
    slow, quick = (f"{Path(__file__)}:{name}" for name in ("Slow", "Stands"))
    results = clearway.run(
        "sar-case1", navigators=[slow, quick], configurations=["scenario-1"], workers=0, out=tmp_path / "out"
    )
    f = Findings(results)
    took = {system.navigator: of for system, of in decision_times(f).items()}
    assert took[slow].overrun == pytest.approx(2 / 10)  # the fifth and the tenth
    assert took[slow].longest >= 0.2
    assert took[slow].period == 0.15
    assert not took[slow].kept_up
    assert took[quick].overrun == 0.0
    assert took[quick].kept_up
    assert [system.navigator for system in warnings(f)] == [slow]
    said = text.decision_times(results)
    assert "20.00 % longer than the control period of 150 ms" in said
    assert said.count("could not have kept up on this machine: 20.0 % of its decisions") == 1
    grid = table(f)
    assert grid is not None
    assert [row[-1].text for row in grid.rows] == ["20.00 %", "0.00 %"]
    page = results.report().read_text(encoding="utf-8")
    assert page.count("Too slow for its period.") == 1
    assert 'id="decisions"' in page
    assert "decision-times.csv" in {file.name for file in (results.path / "report" / "tables").iterdir()}
