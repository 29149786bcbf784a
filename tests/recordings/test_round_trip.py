"""Out to every format with made-up markers, in again, scored: within the issue's tolerances of what is known on paper.

The trial is a formula (`driven_trials`): CT, PL, DE, OE and MDO follow from it by hand. `benchmarks/round_trip.py` does
the same with simulated trials of the whole protocol.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from driven_trials import forth_and_back
from synthetic_session import record

from clearway.campaigns.scoring import score_plan
from clearway.indicators import score_row
from clearway.recordings.exports.export import CAPTURES, TARGETS
from clearway.recordings.exports.synthetic import LAB
from clearway.trials import Outcome

pytestmark = pytest.mark.slow

BY_HAND = {"PL": 10.08, "DE": 0.025, "OE": 0.0, "MDO": 0.38}


@pytest.fixture(scope="module")
def trial():
    return forth_and_back()


def scored(tmp_path, trials, to, *, spans, **how):
    session = record(tmp_path / "session", trials, to, replace(LAB, seed=11), **how)
    results = score_plan(session.write_plan(spans=spans), tmp_path / "results", workers=1)
    return results, results.trials.to_pylist()


def off(row, trial, sample):
    """What is beyond its tolerance."""
    known = score_row(trial)
    for name, value in BY_HAND.items():
        assert known[name] == pytest.approx(value, abs=1e-3)
    aims = {"CT": sample, "PL": 0.01 * known["PL"], "DE": 0.005, "MDO": 0.005, "OE": 0.01}
    return {
        name: (row[name], known[name])
        for name, aim in aims.items()
        if row[name] is None or abs(row[name] - known[name]) > aim + 1e-6
    }


@pytest.mark.parametrize("to", TARGETS)
def test_with_the_legs_given(tmp_path, trial, to):
    _, (row,) = scored(tmp_path, [trial], to, spans=True)
    assert not off(row, trial, 1 / LAB.rate if to in CAPTURES else trial.attempt.period)
    assert row["success"]
    assert row["outcome"] == "reached"


@pytest.mark.parametrize("to", ["vicon", "mcap"])
def test_with_the_legs_to_be_found(tmp_path, trial, to):
    """The formula stands still for at most a period at a leg's end, and moves off at once: CT is 0.1 s a leg off at most."""
    _, (row,) = scored(tmp_path, [trial], to, spans=False)
    assert not off(row, trial, 0.2)
    assert row["success"]


def test_base_link_by_a_static_pose_and_a_straight_drive(tmp_path, trial):
    _, (row,) = scored(tmp_path, [trial], "c3d", spans=True, coordinates=False)
    assert not off(row, trial, 1 / LAB.rate)


def test_the_uncertainty_covers_what_is_off(tmp_path, trial):
    """U covers about 95 %; a single trial may be off by a little more. It is of the order of the error, not a blanket."""
    _, (row,) = scored(tmp_path, [trial], "c3d", spans=True)
    for name, known in (("DE", BY_HAND["DE"]), ("MDO", BY_HAND["MDO"])):
        assert abs(row[name] - known) < 1.5 * row[f"{name}_U"]
        assert row[f"{name}_U"] < 0.005


def test_a_contact_that_was_seen_stays_one(tmp_path, trial):
    k = 40
    span = replace(trial.spans[0], end=float(trial.t[k]), reached=False)
    crashed = replace(
        trial, t=trial.t[: k + 1], pose=trial.pose[: k + 1], velocity=trial.velocity[: k + 1],
        estimate=trial.estimate[: k + 1], leg=trial.leg[: k + 1], moving_obstacles=trial.moving_obstacles[: k + 1], spans=(span,),
        outcome=Outcome.COLLISION,
    )  # fmt: skip
    results, rows = scored(tmp_path, [trial, crashed], "c3d", spans=True)
    assert [r["success"] for r in rows] == [True, False]
    assert rows[1]["CT"] is None
    assert "forth" in json.loads(rows[1]["not_computable"])["CT"]
    assert results.trial(1).outcome is Outcome.COLLISION
    assert math.isclose(results.trial(1).t[-1], trial.t[k] + LAB.lead + LAB.tail, abs_tol=0.011)
