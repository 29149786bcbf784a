"""A synthetic campaign, and its report."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from synthetic_results import write_campaign

from clearway.contract import EventKind
from clearway.scenarios.suites import Selection
from clearway.trials import Trial
from clearway.trials.store import Results

HOSTILE = "</script><img src=x onerror=\"document.title='pwned'\"> $\\frac{$"


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Both robots, every configuration, two sizes and speeds."""
    selection = Selection(speeds=(0.6, 1.0), sizes=(0.15, 0.3), gaps=(1.0,), repetitions=2)
    return write_campaign(tmp_path_factory.mktemp("results") / "out", selection=selection)


@pytest.fixture(scope="session")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Names that try to break out of the page, everywhere that a name can stand."""

    def poison(trial: Trial) -> Trial:
        a = trial.attempt
        labels = replace(a.labels, configuration=a.labels.configuration + HOSTILE)
        bodies = tuple(replace(b, name=HOSTILE) for b in a.bodies)
        attempt = replace(
            a, labels=labels, robot=HOSTILE, navigator=HOSTILE, floor_plan=HOSTILE, scenario=HOSTILE, bodies=bodies
        )
        return replace(trial, attempt=attempt, reason=HOSTILE, events=(*trial.events, _event(HOSTILE)))

    out = tmp_path_factory.mktemp("hostile") / "out"
    return write_campaign(
        out, robots=("tiago",), selection=Selection(batches=("NO", "MO"), speeds=(0.6,)), change=poison
    )


def _event(text: str) -> Any:
    from clearway.trials import Event

    return Event(1.0, EventKind.STATUS, text)


@pytest.fixture(scope="session")
def report(results: Results) -> Path:
    from clearway.reports import write_report

    return write_report(results.path)
