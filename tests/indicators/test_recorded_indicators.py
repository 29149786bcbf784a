"""What a recording leaves unknown loses just the indicators that need it, and what was measured has an uncertainty."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from indicator_trials import box, moved, shuttle
from recorded_trials import NEVER, SPEEDS, holed, lost, recorded

from clearway.geometry.shapes import Circle, rectangle
from clearway.indicators import INDICATORS, score_row
from clearway.trials import Body, Event


def with_legs(trial, **changes):
    return replace(trial, attempt=replace(trial.attempt, legs=tuple(replace(g, **changes) for g in trial.attempt.legs)))


def crossing(t):
    """A moving obstacle that passes 0.5 m ahead of x = 2.5 at t = 5.5 s, at 0.4 m/s, and is there throughout."""
    return np.stack([2.5 + 0 * t, 0.77 + 0.4 * np.abs(t - 5.5), 0 * t], -1)[:, None]


CART = Body("cart", "moving obstacle", Circle(0.2), None)


def test_without_a_heading_all_but_the_heading_is_computed():
    trial = recorded(shuttle(bodies=[box(2.5, 1.0)]))
    blind = replace(trial, pose=np.column_stack([trial.pose[:, :2], np.full(len(trial.t), np.nan)]))
    whole, row = score_row(trial), score_row(blind)
    assert set(lost(row)) == {
        "success", "success_slack", "OE", "OE_forth", "OE_back", "OE_max", "OE_literal", "OE_U",
    }  # fmt: skip
    assert lost(row)["OE"] == "the heading at the end of leg forth is unknown"
    for name in set(INDICATORS) - set(lost(row)) - NEVER:
        assert row[name] == pytest.approx(whole[name], abs=1e-9), name
    square = replace(blind, attempt=replace(blind.attempt, footprint=rectangle(0.5, 0.5)))
    why = lost(score_row(square))
    assert why["MDO"] == why["MDO_U"] == why["space"] == "the heading is unknown"
    assert "MDO_centre" not in why
    assert "PL" not in why


def test_a_gap_in_the_heading_only():
    trial = recorded(shuttle(footprint=rectangle(0.5, 0.5), bodies=[box(2.5, 1.0)]))
    row = score_row(holed(trial, 5.0, 6.0, [2]))
    assert lost(row)["MDO"] == "the heading has gaps (1.0 s)"
    assert set(lost(row)) == {"MDO", "MDO_walls", "MDO_U", "space", "space_rel"}
    far = score_row(holed(trial, 1.0, 1.8, [2]))
    assert set(lost(far)) == {"space", "space_rel"}, "it cannot have come near the box there"
    assert far["MDO"] == score_row(trial)["MDO"]


def test_a_gap_inside_a_leg_leaves_what_hangs_on_its_ends():
    trial = recorded(shuttle(bodies=[box(2.5, 1.0)]))
    gap = holed(trial, 5.0, 5.8)
    row = score_row(gap)
    assert lost(row)["PL"] == "the pose has gaps (0.8 s)"
    assert set(lost(row)) == {
        "PL", "PL_norm", "PL_forth", "PL_U", "MDO", "MDO_centre", "MDO_walls", "MDO_U", "space", "space_rel", "T_approach", "T_rotation",
    }  # fmt: skip
    assert (row["CT"], row["success"]) == (pytest.approx(22.4), True)
    turning = score_row(holed(trial, 12.0, 12.5))
    assert lost(turning) == {}, "the turn does not count"
    at_end = score_row(holed(trial, 11.0, 11.6))
    assert lost(at_end)["DE"] == "the pose at the end of leg forth is unknown"
    assert at_end["success"] is None


def test_missing_samples_are_a_gap_in_a_recording():
    whole = shuttle(bodies=[box(2.5, 1.0)])
    keep = (whole.t < 1.0 - 1e-6) | (whole.t > 2.5 + 1e-6)
    thinned = replace(
        whole, t=whole.t[keep], pose=whole.pose[keep], velocity=whole.velocity[keep], estimate=whole.estimate[keep], leg=whole.leg[keep],
        command=None, moving_obstacles=whole.moving_obstacles[keep],
    )  # fmt: skip
    row = score_row(recorded(thinned))
    assert lost(row)["PL"] == "the pose has gaps (1.7 s)"
    assert lost(row)["TCS"] == "the velocity has gaps (1.7 s)"
    assert row["MDO"] == score_row(recorded(whole))["MDO"], "it cannot have come nearer meanwhile"
    assert row["DE"] == pytest.approx(0.1)
    assert lost(score_row(thinned)) == {}, "a simulator may step as it likes"
    slow = recorded(shuttle(dt=0.5), period=0.5)
    assert "PL" not in lost(score_row(slow)), "2 Hz is its rate"


def test_a_gap_in_the_speed():
    trial = recorded(shuttle())
    velocity = trial.velocity.copy()
    velocity[30:34] = np.nan
    row = score_row(replace(trial, velocity=velocity))
    assert set(lost(row)) - {"MDO", "MDO_centre", "MDO_U", "MDO_walls"} == SPEEDS | {"stopped_time"}
    assert lost(row)["TCS"] == "the velocity has gaps (0.5 s)"


def test_unknown_goal_and_tolerance():
    trial = recorded(shuttle())
    row = score_row(with_legs(trial, goal=np.full(3, np.nan), start=np.full(3, np.nan)))
    assert lost(row)["DE"] == "the goal of leg forth is unknown"
    assert lost(row)["success"] == "the goal of leg forth is unknown"
    assert "T_acceleration" not in lost(row)
    assert "T_cruise" not in lost(row)
    assert {"T_approach", "T_rotation", "space", "DE_U"} <= set(lost(row))
    row = score_row(with_legs(trial, xy_tolerance=math.nan))
    assert lost(row)["success"] == "the tolerance of leg forth is unknown"
    assert lost(row)["T_rotation"] == "the tolerance of leg forth is unknown"
    assert row["DE"] == pytest.approx(0.1)
    assert score_row(with_legs(trial, goal=np.array([4.0, 0.0, np.nan])))["failure"] == "DE", (
        "certain without the heading"
    )


def test_no_set_speed():
    trial = recorded(shuttle(), speed_limit=None)
    trial = replace(trial, attempt=replace(trial.attempt, labels=replace(trial.attempt.labels, speed=None)))
    row = score_row(trial)
    assert row["speed"] is None
    assert lost(row)["TCS"] == "the set speed is unknown"
    assert set(lost(row)) - {"MDO", "MDO_centre", "MDO_U", "MDO_walls"} == SPEEDS


def test_a_body_whose_shape_nobody_knows():
    unknown = Body("bed", "obstacle", Circle(0.0), np.array([2.5, 1.0, math.nan]), outlined=False)
    row = score_row(recorded(shuttle(bodies=[unknown, box(2.5, -1.0)])))
    assert (
        lost(row)["MDO"]
        == lost(row)["MDO_U"]
        == lost(row)["MDO_walls"]
        == "the shape of bed is unknown, or where that is on its markers"
    )
    assert row["MDO_centre"] == pytest.approx(1.0)


def test_what_a_standing_obstacle_lacks():
    turned = replace(box(2.5, 1.0), name="table", pose=np.array([2.5, 1.0, math.nan]))
    assert lost(score_row(recorded(shuttle(bodies=[turned]))))["MDO"] == "the heading of table is unknown"
    disc = replace(turned, shape=Circle(0.1))
    assert score_row(recorded(shuttle(bodies=[disc])))["MDO"] == pytest.approx(1.0 - 0.27 - 0.1, abs=1e-9)
    away = replace(turned, pose=np.full(3, math.nan))
    assert lost(score_row(recorded(shuttle(bodies=[away]))))["MDO_centre"] == "the place of table is unknown"


def test_an_obstacle_lost_from_sight():
    def seen(hidden):
        def moving_obstacles(t):
            track = crossing(t)
            track[hidden(t)] = np.nan
            return track

        return shuttle(bodies=[CART], moving_obstacles=moving_obstacles)

    gap = seen(lambda t: (t > 5.0 + 1e-6) & (t < 6.0 - 1e-6))
    assert lost(score_row(recorded(gap)))["MDO"] == "the pose of cart has gaps (1.0 s)"
    assert "MDO" not in lost(score_row(gap)), "in a simulation it was away"
    late = score_row(recorded(seen(lambda t: t < 4.0)))
    assert late["MDO"] == score_row(recorded(shuttle(bodies=[CART], moving_obstacles=crossing)))["MDO"]
    blind = recorded(
        shuttle(
            bodies=[replace(CART, shape=rectangle(0.4, 0.4))], moving_obstacles=lambda t: crossing(t) * [1, 1, np.nan]
        )
    )
    assert lost(score_row(blind))["MDO"] == "the heading of cart is unknown"


def test_uncertainty_of_the_goal_errors():
    trial = recorded(shuttle(bodies=[box(2.5, 1.0)]))
    row = score_row(trial)
    assert (row["DE_U"], row["OE_U"]) == (pytest.approx(0.004), pytest.approx(0.008))
    forth = trial.sigma.copy()
    forth[trial.t < 12.0, 0] = [0.006, 0.010]  # errors are common to both legs, so U is the mean
    row = score_row(replace(trial, sigma=forth))
    assert (row["DE_U"], row["OE_U"]) == (
        pytest.approx(2 * (0.006 + 0.002) / 2),
        pytest.approx(2 * (0.010 + 0.004) / 2),
    )
    simulated = score_row(shuttle(bodies=[box(2.5, 1.0)]))
    assert (simulated["DE_U"], simulated["OE_U"], simulated["MDO_U"]) == (0.0, 0.0, 0.0)
    silent = lost(score_row(replace(trial, sigma=None)))
    assert silent == dict.fromkeys(("DE_U", "MDO_U", "PL_U"), "the uncertainty of the pose is unknown") | {
        "OE_U": "the uncertainty of the heading is unknown"
    }


def test_uncertainty_of_time_and_path_with_spans_that_were_given():
    row = score_row(recorded(shuttle()))
    assert row["CT_U"] == pytest.approx(2 * math.sqrt(4 * 0.1**2 / 12))
    assert row["PL_U"] == pytest.approx(2 * math.sqrt(4 * 0.002**2), rel=0.05), "straight: no chords, no noise"
    assert row["TCS_U"] == pytest.approx(row["TCS"] * row["CT_U"] / row["CT"], rel=0.05)
    simulated = score_row(shuttle())
    assert (simulated["CT_U"], simulated["PL_U"], simulated["TCS_U"]) == (0.0, 0.0, 0.0)


def test_uncertainty_of_ends_that_the_robot_told_is_that_of_its_clock():
    forth, turn, back = ("forth: goal sent at 0.00 s", "turn: span given in the plan", "back: goal sent at 15.10 s")
    clock = {"log": {"seconds": 3.0, "sigma": 0.03}}
    whole = [
        f"{forth}; called reached at 11.10 s by the robot",
        turn,
        f"{back}; called reached at 26.20 s by the robot",
    ]
    assert score_row(replace(recorded(shuttle()), provenance={"legs": whole, "clock": clock}))["CT_U"] == 0.0
    half = replace(recorded(shuttle()), provenance={"legs": [whole[0], turn, back], "clock": clock})
    # it stands 0.5 s before its end, and drives 0.02 m/s 0.04 s before that
    seen = ((0.5 + 0.04) / math.sqrt(3)) ** 2 + 0.1**2 / 12
    assert score_row(half)["CT_U"] == pytest.approx(2 * math.sqrt(seen + 0.03**2), rel=0.02)


def test_an_end_that_did_not_show_has_no_uncertainty():
    by_motion = replace(recorded(shuttle()), provenance={})
    assert lost(score_row(by_motion))["CT_U"] == "the end of leg forth did not show", "the turn begins at once"
    hidden = Event(
        0.0, "unseen departure", "leg forth: the robot was not seen for 0.5 s about its start; give its span"
    )
    assert lost(score_row(replace(by_motion, events=(hidden,))))["PL_U"] == "the start of leg forth did not show"


def test_uncertainty_of_the_clearance():
    stands = Body("box", "obstacle", rectangle(0.3, 0.3), np.array([2.5, 1.0, 0.0]), sigma=0.003)
    far = replace(stands, name="far", pose=np.array([2.5, -2.0, 0.0]), sigma=0.9)
    assert score_row(recorded(shuttle(bodies=[far, stands])))["MDO_U"] == pytest.approx(2 * math.hypot(0.002, 0.003))
    square = shuttle(bodies=[stands], footprint=rectangle(0.6, 0.8))  # the heading moves a corner 0.5 m away
    assert score_row(recorded(square))["MDO_U"] == pytest.approx(2 * math.hypot(0.002, 0.5 * 0.004, 0.003))
    passing = recorded(shuttle(bodies=[CART], moving_obstacles=crossing))
    assert score_row(passing)["MDO_U"] == pytest.approx(2 * math.hypot(0.002, 0.001)), "a disc may turn"
    unsure = passing.sigma * np.array([[1.0], [np.nan]])
    assert lost(score_row(replace(passing, sigma=unsure))) == {
        "MDO_U": "the uncertainty of the pose of cart is unknown"
    }


def test_uncertainty_is_of_the_instant_of_closest_approach():
    trial = recorded(shuttle(bodies=[CART], moving_obstacles=crossing))
    nearest = float(trial.t[np.argmin(np.hypot(*(trial.moving_obstacles[:, 0, :2] - trial.pose[:, :2]).T))])
    sigma = trial.sigma.copy()
    sigma[np.abs(trial.t - nearest) > 0.3] = 1.0
    assert score_row(replace(trial, sigma=sigma))["MDO_U"] == pytest.approx(2 * math.hypot(0.002, 0.001))


def test_what_no_recording_can_have_is_no_reason():
    assert not NEVER & set(json.loads(score_row(recorded(shuttle()))["not_computable"]))
    labels = replace(shuttle().attempt.labels, suite="barn", family="barn")
    barn = json.loads(score_row(recorded(shuttle(labels=labels, reference_length=None)))["not_computable"])
    assert barn["barn_score"] == "the test has no reference length"
    assert "cut" not in barn


@settings(max_examples=60)
@given(st.data())
def test_whatever_is_unknown_nothing_raises_and_nothing_becomes_a_number_that_was_not_one(data):
    """Holes anywhere: every value that remains is the value of the whole trial."""
    trial = recorded(shuttle(bodies=[CART, box(2.5, -1.0)], moving_obstacles=crossing, dt=0.2))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))

    def holes(values):
        out = np.array(values)
        for _ in range(data.draw(st.integers(0, 2))):
            i = int(rng.integers(len(out)))
            out[i : i + int(rng.integers(1, 20)), ..., rng.permutation(out.shape[-1])[: rng.integers(1, 4)]] = np.nan
        return out

    spoilt = replace(trial, pose=holes(trial.pose), velocity=holes(trial.velocity), sigma=holes(trial.sigma),
                     estimate=holes(trial.estimate))  # fmt: skip
    spoilt = moved(spoilt, 1.0, 2.0, 0.5) if data.draw(st.booleans()) else spoilt
    whole, row = score_row(trial), score_row(spoilt)
    for name in INDICATORS:
        assert row[name] is None or name in NEVER or row[name] == pytest.approx(whole[name], abs=1e-6), name
        assert row[name] is not None or name in NEVER or json.loads(row["not_computable"])[name]
