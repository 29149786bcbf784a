"""Every indicator against values worked out by hand, and what it answers when a recording lacks something."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from indicator_trials import A, B, box, leg, moved, shuttle

from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Circle, rectangle
from clearway.indicators import HEADLINE, INDICATORS, row_schema, score_row
from clearway.indicators.cruise import time_within
from clearway.trials import Body, Event, Labels, Outcome, Span


def value(name, trial):
    answer = INDICATORS[name].function(trial)
    assert answer.value is not None, answer.why
    return answer.value


def why(name, trial):
    answer = INDICATORS[name].function(trial)
    assert answer.value is None
    return answer.why


def test_completion_time_leaves_the_turn_out():
    trial = shuttle()
    # 1 s up, (4.9 - 0.5) / 0.5 = 8.8 s, 1 s down, 0.5 s standing; back: 4.8 m, 0.2 s less
    assert value("CT_forth", trial) == pytest.approx(11.3)
    assert value("CT_back", trial) == pytest.approx(11.1)
    assert value("CT", trial) == pytest.approx(22.4)
    assert value("T_turn", trial) == pytest.approx(4.0)


def test_breakdown_of_the_time():
    trial = shuttle()
    # 90 % of 0.5 m/s at 0.5 m/s^2 is reached after 0.9 s, left 0.9 s before standing still; below 0.02 m/s for the
    # last 0.04 s of braking, of which no sample tells, and then 0.5 s standing
    assert value("T_acceleration", trial) == pytest.approx(1.8)
    assert value("T_cruise", trial) == pytest.approx(22.4 - 2 * (0.9 + 0.9 + 0.5))
    assert value("T_approach", trial) == pytest.approx(1.8)
    assert value("T_rotation", trial) == pytest.approx(1.0)
    parts = ("T_acceleration", "T_cruise", "T_approach", "T_rotation")
    assert sum(value(p, trial) for p in parts) == pytest.approx(value("CT", trial), abs=1e-12)
    assert "never reached" in why("T_cruise", replace(trial, attempt=replace(trial.attempt, speed_limit=0.6)))


def test_standing_away_from_the_goal_is_not_final_rotation():
    far = shuttle(stop=(4.7, 0.3))
    assert value("T_rotation", far) == 0.0
    assert value("T_approach", far) == pytest.approx(2 * (0.9 + 0.5))


def test_path_length():
    trial = shuttle()
    assert value("PL", trial) == pytest.approx(4.9 + 4.8)
    assert value("PL_forth", trial) == pytest.approx(4.9)
    assert value("PL_back", trial) == pytest.approx(4.8)
    assert value("PL_norm", trial) == pytest.approx(9.7 / 10)
    assert "reference length" in why("PL_norm", shuttle(reference_length=None))


def test_path_length_of_an_arc_is_short_by_the_chords_only():
    t = np.linspace(0.0, math.pi, 32)
    pose = np.stack([np.sin(t), 1 - np.cos(t), t], 1)
    half = leg("forth", A, np.array([0.0, 2.0, math.pi]))
    trial = replace(
        shuttle(legs=(half,)), t=t, pose=pose, spans=(Span(0, 0.0, math.pi, True),), velocity=None, estimate=None,
        moving_obstacles=np.empty((32, 0, 3)),
    )  # fmt: skip
    assert value("PL", trial) == pytest.approx(math.pi, rel=1e-3)
    assert value("PL", trial) < math.pi
    assert value("DE", trial) == pytest.approx(0.0, abs=1e-12)
    assert "velocity" in why("TCS", trial)
    assert "leg back" in why("CT_back", trial)


def test_goal_errors():
    trial = shuttle()
    assert value("DE_forth", trial) == pytest.approx(0.1)
    assert value("DE_back", trial) == pytest.approx(0.1)
    assert value("DE", trial) == pytest.approx(0.1)
    assert value("DE_literal", trial) == pytest.approx(0.5)  # |0.1 - 0.2| / 0.2
    assert value("OE", trial) == pytest.approx(0.0, abs=1e-12)
    assert value("OE_literal", trial) == pytest.approx(1.0)
    # the estimate is off by (0.03, 0.04): at B (-0.07, 0.04), at A (0.13, 0.04)
    mean = (math.hypot(0.07, 0.04) + math.hypot(0.13, 0.04)) / 2
    assert value("DE_self", trial) == pytest.approx(mean)
    assert value("OE_self", trial) == pytest.approx(0.02)
    uneven = shuttle(stop=(4.95, 0.15))
    assert value("DE", uneven) == pytest.approx(0.1)
    assert value("DE_max", uneven) == pytest.approx(0.15)


def test_orientation_error_is_wrapped():
    trial = shuttle()
    pose = trial.pose.copy()
    pose[-1, 2] = -math.pi + 0.05
    assert value("OE_back", replace(trial, pose=pose)) == pytest.approx(0.05)


def test_success_is_judged_by_the_truth_and_by_the_robot_apart():
    trial = shuttle(stop=(4.79, 0.1))  # 0.21 m from B, where the robot believes to be 0.18 + m away
    row = score_row(trial)
    assert row["success"] is False
    assert row["failure"] == "DE"
    assert row["success_self"] is True
    assert row["success_slack"] is True
    assert score_row(shuttle(stop=(4.77, 0.1)))["success_slack"] is False  # 0.23 m
    exact = shuttle(stop=(4.8, 0.2))
    assert score_row(exact)["success"] is True
    assert score_row(exact)["failure"] == ""


def test_reasons_of_failure():
    trial = shuttle()
    pose = trial.pose.copy()
    pose[-1] = [0.3, 0.0, 0.0]
    assert score_row(replace(trial, pose=pose))["failure"] == "DE+OE"
    touched = replace(trial, events=(Event(3.0, "contact", "box"),))
    assert score_row(touched)["failure"] == "collision"
    waiting = replace(touched, velocity=np.zeros_like(trial.velocity))
    assert score_row(waiting)["failure"] == "collision at rest"
    assert score_row(waiting)["success"] is False
    late = replace(trial, outcome=Outcome.TIMEOUT, spans=(*trial.spans[:2], replace(trial.spans[2], reached=False)))
    row = score_row(late)
    assert (row["failure"], row["success"], row["CT"]) == ("timeout", False, None)
    assert "leg back was not finished (timeout)" in json.loads(row["not_computable"])["CT"]
    assert row["CT_forth"] == pytest.approx(11.3)
    early = replace(trial, outcome=Outcome.REACHED, spans=trial.spans[:2])
    assert score_row(early)["failure"] == "unfinished"


def test_cruise_speed():
    trial = shuttle()
    # in the band from 0.45 m/s on: 0.9 s of each ramp is outside, and the last 0.5 s of each leg
    assert value("TCS", trial) == pytest.approx(100 * (22.4 - 4 * 0.9 - 2 * 0.5) / 22.4)
    assert value("TCS_20", trial) == pytest.approx(100 * (22.4 - 4 * 0.8 - 2 * 0.5) / 22.4)
    assert value("TCS_5", trial) == pytest.approx(100 * (22.4 - 4 * 0.95 - 2 * 0.5) / 22.4)


@pytest.mark.parametrize(
    ("v", "expected"),
    [
        ([1, 1, 1, 1], 3.0),
        ([0, 2, 0, 2], 0.0),  # crosses the band in 0.1 s each time
        ([0, 1, 1, 0], 1.2),  # 0.1 s of either ramp, joined to the second between
        ([1.2, 1.2, 1.2, 1.2], 0.0),
        ([1.1, 1.1, 2.0, 1.1], 1.0),  # the edge of the band belongs to it
    ],
)
def test_time_within_a_band(v, expected):
    assert time_within(np.arange(4.0), np.array(v, float), 0.9, 1.1) == pytest.approx(expected, abs=1e-6)


def test_dwell_leaves_short_stretches_out():
    t, v = np.array([0, 0.1, 0.2, 0.3, 0.4, 0.5]), np.array([0.0, 1, 1, 0, 1, 1])
    assert time_within(t, v, 0.99, 1.01, dwell=0.15) == pytest.approx(0.0, abs=1e-12)
    assert time_within(t, v, 0.99, 1.01, dwell=0.05) == pytest.approx(0.203, abs=1e-6)


def test_distance_between_centres():
    trial = shuttle(bodies=[box(2.5, 0.8), box(2.0, -1.1), box(2.5, 0.1, kind="wall")])
    assert value("MDO_centre", trial) == pytest.approx(0.8, abs=1e-3)  # a sample lies within 0.05 m of x = 2.5
    assert "no obstacle" in why("MDO_centre", shuttle())
    assert "no obstacle" in why("MDO", shuttle(bodies=[box(2.5, 2.0, kind="wall")]))


def test_a_moving_obstacle_counts_only_while_it_is_there_and_a_leg_is_driven():
    cart = Body("cart", "moving obstacle", Circle(0.3), None)

    def only_in_the_turn(t):
        poses = np.tile([4.9, 0.5, 0.0], (len(t), 1, 1))
        poses[(t < 11.5) | (t > 15.0)] = np.nan
        return poses

    hidden = shuttle(bodies=[cart], moving_obstacles=only_in_the_turn)
    assert "no obstacle was present" in why("MDO_centre", hidden)
    beside = shuttle(bodies=[cart], moving_obstacles=lambda t: np.tile([4.9, 0.5, 0.0], (len(t), 1, 1)))
    assert value("MDO_centre", beside) == pytest.approx(0.5)


def test_distance_edge_to_edge():
    # robot: a disc of 0.27 m on y = 0. Box at y = 0.8 with edge 0.3: 0.8 - 0.15 - 0.27. Turned by 45 degrees its
    # corner points at the robot: 0.8 - 0.15 sqrt 2 - 0.27. The wall at y = 0.5 counts only among the walls.
    wall = Body("wall", "wall", rectangle(10.0, 0.1), np.array([2.5, 0.5, 0.0]))
    trial = shuttle(bodies=[box(2.5, 0.8), wall])
    assert value("MDO", trial) == pytest.approx(0.38, abs=1e-3)
    assert value("MDO_walls", trial) == pytest.approx(0.45 - 0.27, abs=1e-3)
    assert value("MDO", shuttle(bodies=[box(2.5, 0.8, yaw=math.pi / 4)])) == pytest.approx(0.318, abs=1e-3)
    assert value("MDO", shuttle(bodies=[box(2.5, 0.2)])) == 0.0


def test_the_nearest_moment_between_two_samples_is_not_missed():
    # a disc crosses the robot's lane at right angles; sampled once a second, it is nearest between samples
    cart = Body("cart", "moving obstacle", Circle(0.1), None)
    t = np.arange(6.0)
    pose = np.stack([t, 0 * t, 0 * t], 1)
    cross = np.stack([np.full(6, 2.5), 3.0 - t, 0 * t], 1)[:, None, :]  # at t: (2.5, 3 - t), robot at (t, 0)
    trial = replace(
        shuttle(bodies=[cart], moving_obstacles=lambda t: np.empty((len(t), 1, 3)), legs=(leg("forth", A, B),)),
        t=t, pose=pose, velocity=None, estimate=None, moving_obstacles=cross, spans=(Span(0, 0.0, 5.0, True),),
    )  # fmt: skip
    # squared distance (2.5 - t)^2 + (3 - t)^2 is least at t = 2.75: 2 * 0.25^2, less both radii
    assert value("MDO", trial) == pytest.approx(max(0.0, math.sqrt(0.125) - 0.27 - 0.1), abs=1e-3)
    small = replace(trial, attempt=replace(trial.attempt, footprint=Circle(0.1)))
    assert value("MDO", small) == pytest.approx(math.sqrt(0.125) - 0.2, abs=1.1e-3)


def test_giving_up_far_from_the_obstacle_is_not_safe():
    trial = shuttle(bodies=[box(2.5, 0.8)])
    spans = (replace(trial.spans[0], end=2.0, reached=False),)
    gave_up = replace(trial, spans=spans, outcome=Outcome.ABORTED)
    for name in ("MDO", "MDO_centre", "MDO_walls"):
        assert "leg forth was not finished (aborted)" in why(name, gave_up)
    onto = shuttle(bodies=[box(0.8, 0.0)], outcome=Outcome.COLLISION)
    hit = replace(onto, spans=(replace(onto.spans[0], end=3.0, reached=False),))
    assert value("MDO", hit) == 0.0


def test_an_obstacle_that_is_put_back_between_legs_does_not_sweep_over_the_robot():
    cart = Body("cart", "moving obstacle", Circle(0.1), None)
    both = (leg("forth", A, B), leg("turn", B, B), leg("back", B, A))

    def put_back(t):  # across the lane at x = 4.9, right where the robot stands at 11.3 s
        y = np.where(t < 11.35, -2.0, 2.0)
        return np.stack([np.full_like(t, 4.9), y, 0 * t], 1)[:, None, :]

    trial = shuttle(bodies=[cart], moving_obstacles=put_back, legs=both)
    assert value("MDO", trial) == pytest.approx(2.0 - 0.27 - 0.1)


def test_manoeuvring_space():
    trial = shuttle(footprint=rectangle(0.6, 0.6))
    assert value("space", trial) == pytest.approx(0.0, abs=1e-9)
    pose = trial.pose.copy()
    pose[40, 1] = 0.2
    pose[60, 2] = math.pi / 4  # a corner of the square: 0.6 / sqrt 2 - 0.3 = 0.124 m
    assert value("space", replace(trial, pose=pose)) == pytest.approx(0.2)
    pose[40, 1] = 0.0
    assert value("space", replace(trial, pose=pose)) == pytest.approx(0.6 / math.sqrt(2) - 0.3)
    assert value("space_rel", replace(trial, pose=pose)) == pytest.approx(math.sqrt(2) / 2 - 0.5)
    assert "footprint" in why("space", shuttle(footprint=None))


def test_barn_score():
    barn = Labels("barn", "official", "world 0", 0.5, family="barn")
    one = (leg("forth", A, B, yaw_tolerance=math.inf, xy_tolerance=1.0),)
    trial = shuttle(labels=barn, reference_length=10.0)
    trial = replace(trial, attempt=replace(trial.attempt, legs=one), spans=trial.spans[:1])
    assert value("barn_time", trial) == pytest.approx(11.3)
    assert value("barn_score", trial) == pytest.approx(5.0 / 11.3)  # T = 5 s, and 10 <= 11.3 <= 40
    slow = replace(trial, attempt=replace(trial.attempt, reference_length=1.0))  # T = 0.5 s: 11.3 s counts as 4 s
    assert value("barn_score", slow) == pytest.approx(1 / 8)
    hit = replace(trial, outcome=Outcome.COLLISION)
    assert value("barn_score", hit) == 0.0
    assert "collision" in why("barn_time", hit)
    assert "free" in why("OE", trial)
    assert score_row(trial)["success"] is True
    assert "BARN" in why("barn_score", shuttle())


@pytest.mark.parametrize(
    ("lacking", "lost"),
    [
        (
            {"velocity": None},
            {
                "TCS",
                "TCS_5",
                "TCS_20",
                "TCS_U",
                "T_acceleration",
                "T_cruise",
                "T_approach",
                "T_rotation",
                "jerk",
                "jerk_max",
                "stopped_time",
            },
        ),
        ({"estimate": None}, {"DE_self", "OE_self", "success_self"}),
        (
            {"speed_limit": None},
            {"TCS", "TCS_5", "TCS_20", "TCS_U", "T_acceleration", "T_cruise", "T_approach", "T_rotation"},
        ),
        ({"footprint": None}, {"MDO", "MDO_U", "MDO_walls", "space", "space_rel"}),
        ({"reference_length": None}, {"PL_norm"}),
    ],
)
def test_what_a_recording_lacks_loses_only_what_needs_it(lacking, lost):
    whole = score_row(shuttle(bodies=[box(2.5, 1.0)]))
    row = score_row(shuttle(bodies=[box(2.5, 1.0)], **lacking))
    already = set(json.loads(whole["not_computable"]))
    assert already == {"barn_score", "barn_time", "PL_shortest", "CT_optimal", "cut"}
    assert set(json.loads(row["not_computable"])) - already == lost
    for name in set(INDICATORS) - lost - already:
        assert row[name] == whole[name]


def test_unknown_goal_or_a_gap_is_never_a_guess():
    trial = shuttle()
    nowhere = replace(trial.attempt.legs[0], goal=np.full(3, np.nan))
    row = score_row(replace(trial, attempt=replace(trial.attempt, legs=(nowhere, *trial.attempt.legs[1:]))))
    assert row["success"] is None
    assert row["failure"] is None
    assert row["CT"] == pytest.approx(22.4)
    assert "goal of leg forth is unknown" in json.loads(row["not_computable"])["DE"]
    pose = trial.pose.copy()
    pose[30] = np.nan
    gap = score_row(replace(trial, pose=pose))
    assert gap["PL"] is None
    assert gap["DE"] == pytest.approx(0.1)


def test_a_span_between_samples_is_cut_there():
    trial = shuttle()
    late = replace(trial.spans[0], start=2.05, end=8.05)
    clipped = replace(trial, spans=(late, *trial.spans[1:]))
    assert value("CT_forth", clipped) == pytest.approx(6.0)
    assert value("PL_forth", clipped) == pytest.approx(3.0)  # at 0.5 m/s throughout
    outside = replace(trial, spans=(replace(trial.spans[0], end=1e3), *trial.spans[1:]))
    assert "outside the recorded time" in why("CT", outside)


def test_row_has_every_column_of_the_schema_in_order():
    pa = pytest.importorskip("pyarrow")
    row, schema = score_row(shuttle()), row_schema()
    assert list(row) == schema.names
    table = pa.Table.from_pylist([row], schema=schema)
    assert table["CT"][0].as_py() == pytest.approx(22.4)
    assert schema.field("CT").metadata[b"unit"] == b"s"
    assert set(HEADLINE) <= set(INDICATORS)


def test_before_it_moved_nothing_is_computed_and_nothing_raises():
    trial = shuttle(outcome=Outcome.NAVIGATOR_FAILED, spans=(), reason="raised")
    row = score_row(trial)
    assert row["failure"] == "navigator_failed"
    assert row["success"] is False
    computed = {name for name in INDICATORS if row[name] is not None}
    assert computed == {"success", "success_self", "success_slack"}


@settings(max_examples=20, deadline=None)
@given(st.floats(0.5, 4.5), st.floats(-2, 2), st.floats(0.05, 0.6), st.floats(-3, 3))
def test_distance_is_at_most_the_first_one_and_bounded_by_the_centres(x, y, edge, yaw):
    trial = shuttle(bodies=[box(x, y, edge, yaw)])
    nearest, centre = value("MDO", trial), value("MDO_centre", trial)
    foot = trial.attempt.footprint
    body = trial.attempt.bodies[0]
    assert nearest <= clearance(foot, trial.pose[0], body.shape, body.pose) + 1e-9
    assert nearest <= value("MDO_walls", trial) + 1e-9
    assert max(0.0, centre - 0.27 - edge / math.sqrt(2)) - 1e-9 <= nearest <= max(0.0, centre - 0.27 - edge / 2) + 2e-3


poses = st.floats(-20, 20)


@settings(max_examples=25, deadline=None)
@given(poses, poses, st.floats(-math.pi, math.pi))
def test_a_rigid_motion_of_the_scene_changes_nothing(dx, dy, turn):
    trial = shuttle(bodies=[box(2.5, 0.9, yaw=0.3)], footprint=rectangle(0.7, 0.5))
    before, after = score_row(trial), score_row(moved(trial, dx, dy, turn))
    for name in INDICATORS:
        if name not in ("DE_self", "OE_self"):  # near its tolerance nothing jumps; the estimate moves along
            assert after[name] == pytest.approx(before[name], abs=1e-6), name


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(-1, 6), st.floats(-2, 2)), min_size=3, max_size=30))
def test_path_is_never_shorter_than_the_straight_line(points):
    n = len(points)
    pose = np.column_stack([np.array(points), np.zeros(n)])
    trial = shuttle(legs=(leg("forth", A, B),))
    trial = replace(
        trial, t=np.arange(n, dtype=float), pose=pose, velocity=None, estimate=None, moving_obstacles=np.empty((n, 0, 3)),
        spans=(Span(0, 0.0, n - 1.0, True),),
    )  # fmt: skip
    straight = math.dist(points[0], points[-1])
    assert value("PL", trial) >= straight - 1e-9
