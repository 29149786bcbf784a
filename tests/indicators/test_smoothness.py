"""Jerk and standing: by hand, and against a plain reading of random motions."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from indicator_trials import shuttle

from clearway.indicators import score_row
from clearway.indicators.smoothness import OVER


def test_a_trapezoid_has_jerk_at_its_corners_only():
    """Three a leg at 0.5 m/s^2, as nobody knows what was before its start; one between two instants is shared by two."""
    row = score_row(shuttle())
    assert row["jerk_max"] == pytest.approx(0.5 / OVER)
    instants = math.floor(11.3 / OVER) - 1 + math.floor(11.1 / OVER) - 1
    assert row["jerk"] == pytest.approx(2 * 3 * 0.5 / OVER / instants)


def test_it_stands_at_the_end_of_each_leg():
    """Half a second each, of which the turn begins with the last sample of the first; it does not count itself."""
    assert score_row(shuttle())["stopped_time"] == pytest.approx(0.4 + 0.5)


def test_whoever_turns_on_the_spot_does_not_stand():
    trial = shuttle()
    velocity = trial.velocity.copy()
    velocity[:, 1] = 0.2
    assert score_row(replace(trial, velocity=velocity))["stopped_time"] == 0.0


def test_a_swerve_at_even_speed_has_jerk():
    trial = shuttle()
    pose = trial.pose.copy()
    pose[:, 2] += 0.3 * np.sin(2.0 * trial.t)
    assert score_row(replace(trial, pose=pose))["jerk"] > 2 * score_row(trial)["jerk"]


def test_noise_is_no_jerk():
    trial = shuttle()
    row = score_row(replace(trial, attempt=replace(trial.attempt, source="recorded")))
    assert row["jerk"] is row["jerk_max"] is None
    assert "jerk" not in json.loads(row["not_computable"])
    assert row["stopped_time"] is not None


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=15, deadline=None)
def test_against_a_plain_reading_of_random_motions(seed, sideways):
    rng = np.random.default_rng(seed)
    trial = shuttle()
    velocity = np.where(rng.random((len(trial.t), 1)) < 0.3, 0.0, rng.normal(0.0, 0.3, (len(trial.t), 3)))
    velocity = velocity if sideways else velocity[:, :2]
    pose = trial.pose + np.array([0.0, 0.0, 1.0]) * rng.normal(0.0, 0.5, (len(trial.t), 1)).cumsum(axis=0)
    row = score_row(replace(trial, velocity=velocity, pose=pose))
    sizes, stood = [], 0.0
    for span in (trial.spans[0], trial.spans[2]):
        at = [i for i, t in enumerate(trial.t) if span.start - 1e-9 <= t <= span.end + 1e-9]
        still = [math.hypot(*np.delete(velocity[i], 1)) < 0.01 and abs(velocity[i, 1]) < 0.01 for i in at]
        stood += sum(
            trial.t[j] - trial.t[i] for i, j, a, b in zip(at, at[1:], still, still[1:], strict=False) if a and b
        )

        def over_ground(t, at=at):
            j = next((k for k in range(1, len(at)) if trial.t[at[k]] >= t - 1e-12), len(at) - 1)
            share = (t - trial.t[at[j - 1]]) / (trial.t[at[j]] - trial.t[at[j - 1]])
            both = [turned(velocity[i], pose[i, 2]) for i in (at[j - 1], at[j])]
            return both[0] + share * (both[1] - both[0])

        n = math.floor((span.end - span.start) / OVER + 1e-9) - 1
        for k in range(n):
            a, b, c = (over_ground(span.start + (k + m) * OVER) for m in range(3))
            sizes.append(float(np.hypot(*(c - 2 * b + a))) / OVER**2)
    assert row["stopped_time"] == pytest.approx(stood, abs=1e-6)
    assert row["jerk"] == pytest.approx(np.mean(sizes), rel=1e-6)
    assert row["jerk_max"] == pytest.approx(max(sizes), rel=1e-6)


def turned(velocity, theta):
    """(2,) a base's velocity, which may have a part to the left, along the map's axes."""
    across = velocity[2] if len(velocity) > 2 else 0.0
    return np.array(
        [
            velocity[0] * math.cos(theta) - across * math.sin(theta),
            velocity[0] * math.sin(theta) + across * math.cos(theta),
        ]
    )
