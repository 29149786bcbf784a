"""U of CT, PL and TCS against a Monte Carlo of the whole way: a motion known on paper is captured with noise again and again,
cleaned, its legs found, scored; what is stated has to cover about 95 % of what is off, and not be a blanket."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from driven_trials import SPEED, forth_and_back, profile

from clearway.indicators import INDICATORS
from clearway.indicators.cruise import BAND
from clearway.recordings.lab.legs import find_legs
from clearway.recordings.motion.motion import MotionSpec
from clearway.recordings.motion.tracks import motion_of_track
from clearway.recordings.recording import Track
from clearway.trials import Span, Trial

STAND = 3.0
"""s of standing before, between and after the legs."""
AROUND = 0.4
"""m that the way swings out to one side, halfway."""


def driven(t):
    """(n, 3) poses of 5 m forth, half a turn and 5 m back at `t`, and the spans of the three."""
    length = 5.0
    (_, _, straight), (_, _, turned) = (profile(w, v, np.zeros(1)) for w, v in ((length, SPEED), (math.pi, 1.0)))
    marks = np.cumsum([STAND, straight, STAND, turned, STAND, straight])
    (out, *_), (turn, *_), (home, *_) = (
        profile(w, v, t - at)
        for w, v, at in zip((length, math.pi, length), (SPEED, 1.0, SPEED), marks[::2], strict=True)
    )
    # the way is measured along x, and swings out smoothly: the speed along it is a little higher there
    x = out - home
    swing = AROUND * np.sin(math.pi * x / length) ** 2
    slope = AROUND * math.pi / length * np.sin(2 * math.pi * x / length)
    heading = np.arctan(slope) + turn
    return np.column_stack([x - 2.5, 1.0 + swing, heading]), marks.reshape(3, 2)


def on_paper():
    """CT, PL and TCS of it, by a fine grid."""
    t = np.arange(0.0, driven(np.zeros(1))[1][-1, 1] + STAND, 1e-4)
    pose, spans = driven(t)
    v = np.hypot(*np.gradient(pose[:, :2], t, axis=0).T)
    on_leg = sum(((t >= a) & (t < b)).astype(float) for a, b in spans[[0, 2]])
    took = float((spans[[0, 2], 1] - spans[[0, 2], 0]).sum())
    cruising = float((on_leg * (np.abs(v - SPEED) <= BAND * SPEED)).sum()) * 1e-4
    return {"CT": took, "PL": float((on_leg * v).sum()) * 1e-4, "TCS": 100 * cruising / took}


def captured(rng, *, noise, rate, given, cutoff=6.0) -> Trial:
    """One capture of it: noise [m] in each coordinate, four times as many radians, samples that begin anywhere."""
    end = driven(np.zeros(1))[1][-1, 1] + STAND
    t = np.arange(rng.uniform(0.0, 1 / rate), end, 1 / rate)
    pose, spans = driven(t)
    pose = pose + rng.normal(size=pose.shape) * noise * np.array([1.0, 1.0, 4.0])
    zero, half = np.zeros(len(t)), pose[:, 2] / 2
    track = Track(
        "body", "map", "robot", t, np.column_stack([pose[:, :2], zero]),
        np.column_stack([zero, zero, np.sin(half), np.cos(half)]),
    )  # fmt: skip
    motion = motion_of_track(track, MotionSpec(cutoff=cutoff), None)
    made = forth_and_back(moving_obstacle=False, square=False)
    legs = made.attempt.legs
    if given:  # read off the nearest sample
        cut = [tuple(float(t[np.argmin(np.abs(t - at))]) for at in span) for span in spans]
        words = [f"{leg.name}: span given in the plan" for leg in legs]
    else:
        found = find_legs(motion, legs)
        cut, words = [(f.start, f.end) for f in found], [f"{legs[f.leg].name}: {f.why}" for f in found]
    assert motion.sigma is not None
    return replace(
        made, attempt=replace(made.attempt, source="recorded", period=1 / rate), t=t - t[0], pose=motion.wrapped, estimate=None,
        velocity=motion.velocity, leg=np.zeros(len(t), dtype=np.int64), moving_obstacles=np.empty((len(t), 0, 3)),
        spans=tuple(Span(i, a - t[0], b - t[0], True) for i, (a, b) in enumerate(cut)), sigma=motion.sigma[:, None],
        provenance={"legs": words, "motion": {"robot": {"cutoff": motion.quality.cutoff}}},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("noise", "rate", "given"), [(0.0005, 100.0, False), (0.001, 100.0, False), (0.0005, 100.0, True), (0.001, 60.0, True)]
)  # fmt: skip
def test_the_uncertainty_covers_what_is_off_in_a_monte_carlo(noise, rate, given):
    rng, known = np.random.default_rng(5), on_paper()
    trials = [captured(rng, noise=noise, rate=rate, given=given) for _ in range(12)]
    for name, value in known.items():
        error = np.array([abs(INDICATORS[name].function(trial).value - value) for trial in trials])
        u = np.array([INDICATORS[f"{name}_U"].function(trial).value for trial in trials])
        assert (error <= u).sum() >= 11, (name, error, u)
        assert np.median(u) < 0.025 * value, "of the order of the error, not a blanket"
    assert np.median([INDICATORS["CT_U"].function(trial).value for trial in trials]) < (0.02 if given else 0.3)


@pytest.mark.parametrize(
    ("noise", "rate"), [(0.001, 10.0), (0.002, 20.0), (0.004, 20.0), (0.001, 40.0), (0.004, 60.0)]
)  # fmt: skip
def test_noise_that_looks_like_motion_is_filtered_however_seldom_it_is_sampled(noise, rate):
    """Its speed while it stands is up to 0.4 m/s as it is sampled."""
    rng, known = np.random.default_rng(6), on_paper()
    trials = [captured(rng, noise=noise, rate=rate, given=False, cutoff="residual") for _ in range(8)]
    for name, value in known.items():
        error = np.array([abs(INDICATORS[name].function(trial).value - value) for trial in trials])
        u = np.array([INDICATORS[f"{name}_U"].function(trial).value for trial in trials])
        assert (error <= u).sum() >= 7, (name, error, u)
        assert np.median(u) < 0.07 * value
