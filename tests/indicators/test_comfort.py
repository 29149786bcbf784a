"""People: how near, for how long, how short of running into them; worked out by hand, and against stepping forward."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from indicator_trials import box, shuttle

from clearway.contract import BodyKind
from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, rectangle
from clearway.indicators import score_row
from clearway.indicators.comfort import _until
from clearway.trials import Body, Outcome

NAMES = ("person_distance", "personal_time", "intimate_time", "person_ttc")


def person(x: float, y: float) -> Body:
    return Body("anna", BodyKind.PERSON, Circle(0.25), np.array([x, y, 0.0]))


def walker(visits: bool = True) -> Body:
    return Body("anna", BodyKind.PERSON, Circle(0.25), None, visits=visits)


def why(row, name):
    return json.loads(row["not_computable"]).get(name)


def test_a_person_beside_the_way():
    row = score_row(shuttle(bodies=(person(2.5, 1.0),)))
    assert row["person_distance"] == pytest.approx(1.0 - 0.27 - 0.25, abs=1e-4)
    half = math.sqrt((1.2 + 0.52) ** 2 - 1.0)
    assert row["personal_time"] == pytest.approx(2 * 2 * half / 0.5, abs=0.01)
    assert row["intimate_time"] == 0
    assert row["person_ttc"] is None
    assert why(row, "person_ttc") == "no collision course with a person"
    near = score_row(shuttle(bodies=(person(2.5, 0.9),)))
    assert near["intimate_time"] == pytest.approx(4 * math.sqrt(0.97**2 - 0.9**2) / 0.5, abs=0.05)


@pytest.mark.parametrize("footprint", [Circle(0.27), rectangle(0.54, 0.4)])
def test_time_to_collision_is_least_where_it_begins_to_brake(footprint):
    row = score_row(shuttle(bodies=(person(6.0, 0.0),), footprint=footprint))
    assert row["person_ttc"] == pytest.approx((6.0 - 4.65 - 0.52) / 0.5, rel=0.03)


def test_one_who_walks_towards_the_robot():
    def coming(t):
        return np.stack([9.0 - 0.3 * t, np.zeros_like(t), np.full_like(t, math.nan)], axis=1)[:, None]

    trial = shuttle(bodies=(walker(),), moving_obstacles=coming)
    t, x = trial.t, trial.pose[:, 0]
    gap = 9.0 - 0.3 * t - x - 0.52
    first = t <= trial.spans[0].end
    v = np.gradient(x, t)
    assert gap[first].min() > 0
    assert score_row(trial)["person_ttc"] <= (gap / (v + 0.3))[first].min() * 1.05


def test_obstacles_are_no_people_and_without_people_nothing_is_said():
    row = score_row(shuttle(bodies=(box(2.5, 1.0),)))
    assert [row[n] for n in NAMES] == [None] * 4
    assert not set(NAMES) & set(json.loads(row["not_computable"]))
    assert row["MDO"] is not None


def test_a_person_is_an_obstacle_too():
    row = score_row(shuttle(bodies=(person(2.5, 1.0), box(2.5, 3.0))))
    assert row["MDO"] == row["person_distance"]


def test_one_who_gave_up_was_near_nobody_for_no_time():
    trial = shuttle(bodies=(person(2.5, 1.0),))
    spans = (replace(trial.spans[0], reached=False), *trial.spans[1:])
    row = score_row(replace(trial, spans=spans, outcome=Outcome.ABORTED))
    assert [row[n] for n in NAMES] == [None] * 4
    assert "leg forth was not finished" in why(row, "personal_time")


def walking(far: float):
    """A recorded person who walks along, and is not seen for 2 s while the robot passes."""

    def poses(t):
        at = np.stack([np.full_like(t, 2.5), far + 0.02 * t, np.full_like(t, math.nan)], axis=1)
        at[(t > 4.0) & (t < 6.0)] = math.nan
        return at[:, None]

    trial = shuttle(bodies=(walker(),), moving_obstacles=poses)
    return replace(trial, attempt=replace(trial.attempt, source="recorded"))


def test_unseen_near_by_is_unknown_and_far_away_is_no_time():
    near, far = score_row(walking(1.5)), score_row(walking(6.0))
    assert "the pose of anna has gaps" in why(near, "personal_time")
    assert (far["personal_time"], far["intimate_time"]) == (0, 0)


@given(
    st.floats(-3, 3),
    st.floats(-3, 3),
    st.floats(0, 6.28),
    st.floats(0.1, 1.5),
    st.floats(0.05, 0.6),
    st.floats(0, 6.28),
)
@settings(max_examples=60)
def test_time_to_collision_is_that_of_stepping_forward(x, y, way, speed, radius, yaw):
    footprint, disc = rectangle(0.8, 0.5), Circle(radius)
    v = speed * np.array([math.cos(way), math.sin(way)])
    path = np.array([[0.0, 0.0, yaw]])
    if clearance(footprint, path[0], disc, np.array([x, y, 0.0])) == 0:
        return
    found = _until(footprint, path, np.array([[x, y]]), v[None], disc)[0]
    for t in np.arange(0.0, 8.0, 0.02):
        gap = clearance(footprint, path[0], disc, np.array([x + v[0] * t, y + v[1] * t, 0.0]))
        if t < found - 1e-6:
            assert gap > 0
        elif t > found + 0.05:
            assert clearance(footprint, path[0], disc, np.array([x + v[0] * found, y + v[1] * found, 0.0])) < 1e-6
            return
