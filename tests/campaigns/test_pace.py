"""`clearway check` says of a navigator that decides late whether a robot could drive by it; the clock here is the test's own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import own_navigators
import pytest

from clearway.campaigns import conformance
from clearway.campaigns.conformance import Finding, check_navigator
from clearway.contract import Command, Observation
from clearway.robots import load_robot


def _pace(monkeypatch: pytest.MonkeyPatch, late: int, first: float = 0.001) -> Finding:
    """What is said of one of which every `late`-th decision takes ten periods of TIAGo, and the first of each drive `first` seconds."""
    now = [0.0]

    class Late(own_navigators.Drives):
        decisions = 0

        def reset(self, *arguments: Any) -> None:
            super().reset(*arguments)
            self.takes = first

        def step(self, o: Observation) -> Command:
            self.decisions += 1
            now[0] += 1.0 if self.decisions % late == 0 else self.takes
            self.takes = 0.001
            return super().step(o)

    monkeypatch.setattr(conformance, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    monkeypatch.setattr(conformance, "SITUATIONS", conformance.SITUATIONS[:1] * 3)
    [found] = [f for f in check_navigator(Late, load_robot("tiago")) if f.name == "keeps up with its control period"]
    return found


@pytest.mark.parametrize(("late", "share"), [(20, 5.0), (3, 33.0)])
def test_who_is_late_too_often_does_not_keep_up_however_fast_the_median_is(
    monkeypatch: pytest.MonkeyPatch, late: int, share: float
) -> None:
    found = _pace(monkeypatch, late)
    assert found.passed is False
    assert float(found.detail.split()[0]) == pytest.approx(share, abs=1.0)
    assert "% longer than the control period of 100 ms; median 1 ms" in found.detail


def test_a_first_decision_may_compile_and_a_machine_may_be_busy_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _pace(monkeypatch, 10**6, first=5.0).detail.startswith("0 % longer")
    once = _pace(monkeypatch, 150)
    assert (once.passed, once.detail.startswith("0 %")) == (True, False), once.detail
