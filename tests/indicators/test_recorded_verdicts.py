"""How a recorded trial is judged, what touched what in it, and what a person has to look at."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from indicator_trials import box, shuttle
from recorded_trials import holed, lost, recorded

from clearway.indicators import INDICATORS, score_row
from clearway.trials import Event, Outcome


def test_too_close_to_a_tolerance_is_said_but_does_not_decide():
    trial = recorded(shuttle(stop=(4.799, 0.1)), sigma=(0.001, 0.001))
    row = score_row(trial)
    assert (row["failure"], row["success"]) == ("DE", False)
    assert row["near_tolerance"] == "DE of leg forth is 0.201 ± 0.002 m, 0.2 m allowed"
    assert row["to_confirm"] == "", "nobody can confirm it"
    assert score_row(recorded(shuttle(stop=(4.799, 0.1)), sigma=(0.0004, 0.001)))["near_tolerance"] == ""
    assert score_row(shuttle(stop=(4.7999999, 0.1)))["near_tolerance"] == ""
    twice = score_row(recorded(shuttle(stop=(4.801, 0.1)), sigma=(0.001, 0.11)))
    assert twice["success"] is True
    assert twice["near_tolerance"].count(";") == 2  # OE of both legs is 0 +- 0.22, 0.2 allowed


def test_a_possible_contact_is_no_failure():
    events = (Event(4.21, "possible contact", "box 2.5 0.4 +- 0.1"), Event(5.0, "possible contact"))
    row = score_row(recorded(replace(shuttle(), events=events)))
    assert row["success"] is True
    assert row["to_confirm"] == "possible contact at 4.2 s (box 2.5 0.4 ± 0.1); possible contact at 5.0 s"
    assert row["source"] == "recorded"
    assert score_row(shuttle())["source"] == "simulated"
    assert score_row(replace(shuttle(), provenance={"note": "wet floor"}))["note"] == "wet floor"


def test_the_geometry_tells_that_nothing_was_touched():
    """Also where a gap leaves MDO between two bounds, and of walls where the test has no obstacle."""
    gap = holed(recorded(shuttle(bodies=[box(2.5, 1.5)])), 5.0, 5.8)
    row = score_row(gap)
    assert row["MDO"] is None
    assert 0.0 < row["MDO_at_least"] < row["MDO_at_most"]
    assert row["contacts"] == 0
    near = holed(recorded(shuttle(bodies=[box(2.5, 0.5)])), 4.5, 6.5)  # it may have come there
    assert score_row(near)["contacts"] is None
    walled = score_row(recorded(shuttle(bodies=[box(2.5, 3.0, kind="wall")])))
    assert (walled["MDO"], walled["contacts"]) == (None, 0)
    assert score_row(recorded(shuttle()))["contacts"] is None  # nobody knows of anything


def test_a_recording_that_cannot_be_right_is_to_be_looked_at():
    right = recorded(shuttle())
    assert score_row(right)["to_confirm"] == ""
    hasty = replace(right, t=0.1 * right.t, velocity=10.0 * right.velocity, spans=tuple(
        replace(s, start=0.1 * s.start, end=0.1 * s.end) for s in right.spans
    ))  # fmt: skip
    assert "drives at 5 m/s where 0.5 m/s is set" in score_row(hasty)["to_confirm"]
    spins = right.velocity * np.array([1.0, 57.3])
    assert "turns at 45 rad/s" in score_row(replace(right, velocity=spins))["to_confirm"]
    assert score_row(replace(hasty, attempt=replace(hasty.attempt, source="simulated")))["to_confirm"] == ""


def test_a_recording_that_begins_elsewhere_is_to_be_looked_at():
    """Put down elsewhere, tied wrongly, markers turned on it: none of them is a failure of the robot's."""
    right = recorded(shuttle())
    said = "begins leg forth 0.50 m and 0° from where its start is said to be"
    assert said in score_row(replace(right, pose=right.pose + np.array([0.5, 0.0, 0.0])))["to_confirm"]
    assert score_row(replace(right, pose=right.pose + np.array([0.2, 0.0, 0.3])))["to_confirm"] == "", (
        "people aren't exact"
    )
    turned = replace(right, pose=right.pose + np.array([0.0, 0.0, math.pi]))
    assert "begins leg forth 0.00 m and 180° from" in score_row(turned)["to_confirm"]
    unknown = replace(right.attempt.legs[0], start=np.full(3, np.nan))
    legs = (unknown, *right.attempt.legs[1:])
    assert score_row(replace(turned, attempt=replace(turned.attempt, legs=legs)))["to_confirm"] == ""
    lead = replace(right, t=np.append(right.t[0], right.t + 9.0), pose=np.vstack([right.pose[:1] - [4.0, 0, 0], right.pose]),
        velocity=np.vstack([right.velocity[:1], right.velocity]), leg=np.append(right.leg[0], right.leg),
        sigma=np.vstack([right.sigma[:1], right.sigma]), moving_obstacles=np.zeros((len(right.t) + 1, 0, 3)),
        estimate=None, command=None, spans=tuple(replace(s, start=s.start + 9.0, end=s.end + 9.0) for s in right.spans),
    )  # fmt: skip
    assert score_row(lead)["to_confirm"] == "", "it was brought to its start, and arrived"
    failed = replace(lead, outcome=Outcome.ABORTED, spans=lead.spans[:1])
    assert "drove 4.0 m before leg forth, which begins at 9.0 s" in score_row(failed)["to_confirm"]


def near_box(*events):
    """Passes 6 mm from a box on the way forth, at 5.5 s."""
    return recorded(replace(shuttle(bodies=[box(2.5, 0.426), box(2.5, 3.0, kind="wall")]), events=events))


def test_a_contact_ends_a_recorded_trial_as_it_ends_a_simulated_one():
    possible = Event(5.5, "possible contact", "obstacle 'box 2.5 0.426': measured clearance 0.006 m +- 0.007 m", 0)
    row = score_row(near_box(possible))
    assert (row["success"], row["MDO"]) == (True, pytest.approx(0.006))
    assert "possible contact" in row["to_confirm"]

    seen = score_row(near_box(possible, Event(5.5, "contact", "observed by the operator")))
    assert (seen["failure"], seen["to_confirm"]) == ("collision", "")
    assert (seen["MDO"], seen["MDO_walls"]) == (0.0, 0.0)
    why = lost(seen)
    for name in ("CT", "CT_forth", "PL", "DE", "OE", "TCS", "space", "T_acceleration"):
        assert (seen[name], why[name]) == (None, "leg forth was not finished (collision)"), name
    assert why["T_turn"] == "the turn was not finished (collision)"

    late = score_row(near_box(possible, Event(20.0, "contact", "observed by the operator")))
    assert late["CT"] is None
    assert late["CT_forth"] == pytest.approx(11.3), "it ended before the contact"
    assert late["T_turn"] == pytest.approx(4.0)
    assert lost(late)["CT_back"] == "leg back was not finished (collision)"
    unknown = score_row(near_box(Event(99.0, "contact", "observed by the operator")))
    assert unknown["CT_forth"] is None, "nobody knows on which leg it was"
    assert unknown["MDO"] is None, "nor what it touched"


def test_what_a_real_robot_does_after_the_contact_does_not_decide_how_it_was():
    def hit(when):
        trial = recorded(shuttle(bodies=[box(2.5, 0.3)], outcome=Outcome.COLLISION, events=(Event(when, "contact"),)))
        return score_row(trial)

    under_way, turning, unknown = hit(5.5), hit(13.0), hit(99.0)
    assert (under_way["failure"], under_way["moved_at_contact"]) == ("collision", "robot")
    assert turning["moved_at_contact"] == "neither", "a disc that turns on the spot stays where it is"
    assert (unknown["failure"], unknown["moved_at_contact"]) == ("collision", ""), (
        "it stood at the end of the recording"
    )
    stood = hit(11.1)
    assert (stood["failure"], stood["cause"]) == ("collision at rest", "contact at rest")


def test_a_confirmed_contact_with_the_wall_is_none_with_an_obstacle():
    wall = Event(5.5, "possible contact", "wall 'box 2.5 3.0': measured clearance 0.001 m +- 0.04 m", 1)
    row = score_row(near_box(wall, Event(5.5, "contact")))
    assert (row["MDO"], row["MDO_walls"]) == (None, 0.0)


def empty(trial):
    """An attempt of which there is no recording."""
    m = trial.moving_obstacles.shape[1]
    return replace(
        trial, t=np.empty(0), pose=np.empty((0, 3)), velocity=None, estimate=None, command=None, leg=np.empty(0, np.int64),
        moving_obstacles=np.empty((0, m, 3)), spans=(), sigma=None, outcome=Outcome.ABORTED, reason="not recorded",
    )  # fmt: skip


@pytest.mark.parametrize("outcome", [o for o in Outcome if o is not Outcome.SCENARIO_FAILED])  # real people don't raise
def test_an_attempt_without_a_recording_counts(outcome):
    contact = (Event(0.0, "contact", "seen by the operator"),) if outcome is Outcome.COLLISION else ()
    row = score_row(replace(empty(recorded(shuttle(bodies=[box(2.5, 1.0)]))), outcome=outcome, events=contact))
    assert row["success"] is False
    assert row["failure"] == ("unfinished" if outcome is Outcome.REACHED else outcome.value)
    assert all(row[name] is None for name in INDICATORS if not name.startswith("success"))
    assert set(json.loads(row["not_computable"]).values()) == {"not recorded"}


@pytest.mark.parametrize(
    ("legs", "by_motion"),
    [(["forth: goal sent at 1.0 s, moved off at 1.4 s", "back: span given in the plan"], False),
     (["forth: goal sent at 1.0 s", "back: moved off at 20.1 s after 0.4 s of rest"], True), (None, False), ([{"a": 1}], False)],
)  # fmt: skip
def test_whether_a_leg_was_found_by_motion(legs, by_motion):
    told = {} if legs is None else {"legs": legs}
    assert score_row(replace(recorded(shuttle()), provenance=told))["legs_by_motion"] is by_motion
    assert score_row(replace(shuttle(), provenance=told))["legs_by_motion"] is False


def test_nobody_can_tell_why_a_recorded_robot_touched_something():
    trial = recorded(shuttle(outcome=Outcome.COLLISION, events=(Event(5.0, "contact", "seen"),)), limits=None)
    assert score_row(trial)["failure"] == "collision"
    assert score_row(trial)["cause"] == ""
    lost_speed = replace(trial, velocity=np.full_like(trial.velocity, np.nan))
    assert score_row(lost_speed)["moved_at_contact"] == ""
