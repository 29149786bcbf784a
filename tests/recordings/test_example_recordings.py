"""The example's recordings, as examples/06_score_recordings/make.py put them together."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.indicators import score_row
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.lab import Lab
from clearway.reports.selection import with_uncertainty
from clearway.trials import Outcome

PLAN = Path(__file__).parents[2] / "examples" / "06_score_recordings" / "plan.toml"


@pytest.fixture(scope="module")
def lab():
    return Lab(PLAN)


def test_the_robots_own_log_is_on_the_captures_clock(lab):
    """The log begins with the trial, the cameras 1.5 s before it."""
    trial = assemble(lab, 0)
    assert trial.provenance["clock"]["log"]["seconds"] == pytest.approx(1.5, abs=0.1)
    assert trial.outcome is Outcome.REACHED
    row = score_row(trial)
    assert row["DE_self"] == pytest.approx(row["DE"], abs=0.1)  # AMCL is off by centimetres


def test_a_gap_of_three_millimetres_is_a_possible_contact(lab):
    trial = assemble(lab, 2)
    assert [e.kind for e in trial.events] == ["possible contact"]
    row = score_row(trial)
    assert row["MDO"] == pytest.approx(0.003, abs=row["MDO_U"])
    for name, digits, most in (("CT", 1, 0.5), ("PL", 2, 0.1), ("TCS", 1, 5.0)):
        assert 0 < row[f"{name}_U"] < most, name
        assert " ± " in with_uncertainty(row, name, digits)
    assert trial.outcome is Outcome.REACHED


def test_an_attempt_without_a_file_counts(lab):
    trial = assemble(lab, 3)
    assert trial.outcome is Outcome.ABORTED
    assert score_row(trial)["success"] is False
