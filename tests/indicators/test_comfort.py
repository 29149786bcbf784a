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

from clearway.contract import BodyKind, EventKind
from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, rectangle
from clearway.indicators import score_row
from clearway.indicators.comfort import _until
from clearway.trials import Body, Event, Instants, Outcome

NAMES = ("person_distance", "social_time", "personal_time", "intimate_time", "person_speed", "person_ttc")


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
    assert row["social_time"] == pytest.approx(22.4, abs=0.01), "all the way"
    assert row["person_speed"] == pytest.approx(0.5)
    assert row["person_ttc"] is row["ttc"] is None
    assert why(row, "person_ttc") == "no collision course with a person"
    near = score_row(shuttle(bodies=(person(2.5, 0.9),)))
    assert near["intimate_time"] == pytest.approx(4 * math.sqrt(0.97**2 - 0.9**2) / 0.5, abs=0.05)


@pytest.mark.parametrize("footprint", [Circle(0.27), rectangle(0.54, 0.4)])
def test_time_to_collision_is_least_where_it_begins_to_brake(footprint):
    row = score_row(shuttle(bodies=(person(6.0, 0.0),), footprint=footprint))
    assert row["person_ttc"] == pytest.approx((6.0 - 4.65 - 0.52) / 0.5, rel=0.03)


def coming(t):
    return np.stack([9.0 - 0.3 * t, np.zeros_like(t), np.full_like(t, math.nan)], axis=1)[:, None]


def test_one_who_walks_towards_the_robot():
    trial = shuttle(bodies=(walker(),), moving_obstacles=coming)
    t, x = trial.t, trial.pose[:, 0]
    gap = 9.0 - 0.3 * t - x - 0.52
    first = t <= trial.spans[0].end
    v = np.gradient(x, t)
    assert gap[first].min() > 0
    row = score_row(trial)
    assert row["person_ttc"] <= (gap / (v + 0.3))[first].min() * 1.05
    assert row["ttc"] == row["person_ttc"]


def test_time_to_collision_with_what_else_moves_is_no_persons():
    row = score_row(shuttle(bodies=(replace(walker(), kind=BodyKind.ROBOT),), moving_obstacles=coming))
    assert row["ttc"] == score_row(shuttle(bodies=(walker(),), moving_obstacles=coming))["person_ttc"]
    assert row["person_ttc"] is None


@pytest.mark.parametrize("seen", ["by its speed", "by the instant between"])
def test_who_is_elsewhere_at_once_was_on_no_course(seen):
    """Somebody stands beside the way, then, from one sample to the next, on its other side: nobody came across."""

    def there(t):
        side = 4.0 if seen == "by its speed" else 0.4
        return np.stack([np.full_like(t, 6.0), np.where(t < 5.0, -side, side), np.full_like(t, math.nan)], axis=1)[
            :, None
        ]

    trial = shuttle(bodies=(walker(),), moving_obstacles=there)
    if seen == "by the instant between":
        between = Instants(np.array([4.95]), np.array([[2.2, 0.0, 0.0]]), np.full((1, 1, 3), math.nan))
        assert score_row(trial)["ttc"] is not None
        trial = replace(trial, between=between)
    row = score_row(trial)
    standing = score_row(shuttle(bodies=(person(*there(np.array([9.0]))[0, 0, :2]),)))
    assert row["ttc"] == standing["person_ttc"]


def wandering(rng, t):
    """(n, 2, 3) two who walk at random about the robot's way."""
    steps = rng.normal(0.0, 0.1, (len(t), 2, 2)).cumsum(axis=0) + rng.uniform([0.0, 0.8], [5.0, 2.0], (2, 2))
    return np.concatenate([steps, np.zeros((len(t), 2, 1))], axis=2)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_the_indicators_of_people_against_a_plain_reading(seed):
    """Sample by sample and person by person, with times from looking finely between samples."""

    def moving(t):
        return wandering(np.random.default_rng(seed), t)

    bodies = (walker(), replace(walker(), name="bert"))
    trial = shuttle(bodies=bodies, moving_obstacles=moving)
    row = score_row(trial)
    zones = {"social_time": 3.6, "personal_time": 1.2, "intimate_time": 0.45}
    seconds, near, fast = dict.fromkeys(zones, 0.0), math.inf, math.nan
    for leg in (trial.spans[0], trial.spans[2]):
        at = [i for i, t in enumerate(trial.t) if leg.start - 1e-9 <= t <= leg.end + 1e-9]
        gaps = []
        for i in at:
            x, y = trial.pose[i, :2]
            gap = min(max(math.hypot(px - x, py - y) - 0.52, 0.0) for px, py, _ in trial.moving_obstacles[i])
            if gap < near:
                near, fast = gap, abs(trial.velocity[i, 0])
            gaps.append(gap)
        fine = np.interp(np.arange(trial.t[at[0]], trial.t[at[-1]], 1e-3), trial.t[at], gaps)
        for name, zone in zones.items():
            seconds[name] += 1e-3 * float((fine < zone).sum())
    for name in zones:
        assert row[name] == pytest.approx(seconds[name], abs=0.02)
    assert row["person_speed"] == pytest.approx(fast, abs=1e-9)
    assert row["person_distance"] <= near + 1e-4


def test_obstacles_are_no_people_and_without_people_nothing_is_said():
    row = score_row(shuttle(bodies=(box(2.5, 1.0),)))
    assert [row[n] for n in NAMES] == [None] * len(NAMES)
    assert not set(NAMES) & set(json.loads(row["not_computable"]))
    assert row["MDO"] is not None


def test_a_person_is_an_obstacle_too():
    row = score_row(shuttle(bodies=(person(2.5, 1.0), box(2.5, 3.0))))
    assert row["MDO"] == row["person_distance"]


def test_who_was_touched_was_at_no_distance_though_the_trial_is_unfinished():
    trial = shuttle(bodies=(person(2.5, 0.4),))
    n = int(np.flatnonzero(trial.pose[:, 0] > 2.2)[0])
    cut = replace(
        trial, t=trial.t[:n], pose=trial.pose[:n], velocity=trial.velocity[:n], estimate=None, command=None, leg=trial.leg[:n],
        moving_obstacles=trial.moving_obstacles[:n], spans=(replace(trial.spans[0], end=float(trial.t[n - 1]), reached=False),),
        outcome=Outcome.COLLISION, events=(Event(float(trial.t[n - 1]), EventKind.CONTACT, "", 0),),
    )  # fmt: skip
    row = score_row(cut)
    assert row["person_distance"] == row["MDO"] == 0.0
    assert (row["touched"], row["touched_body"], row["personal_time"]) == ("person", "anna", None)


def test_one_who_gave_up_was_near_nobody_for_no_time():
    trial = shuttle(bodies=(person(2.5, 1.0),))
    spans = (replace(trial.spans[0], reached=False), *trial.spans[1:])
    row = score_row(replace(trial, spans=spans, outcome=Outcome.ABORTED))
    assert [row[n] for n in NAMES] == [None] * len(NAMES)
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
