"""Whatever a motion holds: an answer or a `ClearwayError`, nothing else."""

from __future__ import annotations

import contextlib
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, rectangle
from clearway.recordings.alignment import clocks, frames
from clearway.recordings.lab import contacts
from clearway.recordings.lab.legs import find_legs
from clearway.recordings.motion.motion import Motion, Quality
from clearway.trials import Attempt, Body, Labels, Leg

NUMBER = st.one_of(st.floats(-10, 10), st.sampled_from([np.nan, 0.0, 1e6, 1e-9]))


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(0, 60))
    t = np.cumsum(rng.choice([0.001, 0.1, 0.1, 0.5, 30.0], n)) - draw(st.sampled_from([0.0, 1e6]))
    pose = np.cumsum(rng.normal(size=(n, 3)) * rng.choice([0, 0, 0.01, 1.0], (n, 1)), axis=0)
    velocity = rng.normal(size=(n, 2)) * rng.choice([0, 0.01, 1.0], (n, 1))
    for values in (pose, velocity):
        values[rng.random(n) < draw(st.sampled_from([0.0, 0.2, 1.0]))] = np.nan
    if draw(st.booleans()):
        pose[:, 2] = np.nan
    return Motion(t, pose, velocity, None if draw(st.booleans()) else np.abs(pose[:, :2]), Quality(10.0, 1.0))


LEGS = st.lists(
    st.builds(
        lambda s, g, xy, yaw: Leg("leg", np.array(s), np.array(g), xy, yaw),
        st.tuples(NUMBER, NUMBER, NUMBER), st.tuples(NUMBER, NUMBER, NUMBER),
        st.sampled_from([0.0, 0.2, np.inf, np.nan]), st.sampled_from([0.0, 0.2, np.inf, np.nan]),
    ),
    max_size=4,
)  # fmt: skip


@settings(max_examples=120, deadline=None)
@given(motions(), LEGS)
def test_legs(motion: Motion, legs: list[Leg]) -> None:
    with contextlib.suppress(ClearwayError):
        found = find_legs(motion, legs)
        assert all(f.start <= f.end for f in found)
        assert [f.leg for f in found] == list(range(len(found)))
        assert all(a.end <= b.start + 1e-6 for a, b in pairwise(found))


@settings(max_examples=100, deadline=None)
@given(motions(), motions())
def test_clocks(a: Motion, b: Motion) -> None:
    with contextlib.suppress(ClearwayError):
        found = clocks.offset(a, b)
        assert np.isfinite([found.seconds, found.sigma]).all()
    at = np.linspace(-1, 10, 20)
    assert clocks.resample(a, at).pose.shape == (20, 3)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER), max_size=5), motions())
def test_frames(pairs: list[tuple[float, ...]], motion: Motion) -> None:
    both = np.array(pairs).reshape(-1, 6)
    for tie in (
        lambda: frames.tie_by_static_poses(both[:, :3], both[:, 3:]),
        lambda: frames.tie_by_points(both[:, :2], both[:, 3:5]),
        lambda: frames.given(both[0, :3] if len(both) else np.zeros(2), (0.01, 0.01)),
    ):
        with contextlib.suppress(ClearwayError):
            found = tie()
            assert np.isfinite(found.pose).all()
            assert np.isfinite(found.sigma).all()
            frames.apply(found, motion)
    with contextlib.suppress(ClearwayError):
        frames.static_pose(motion)


@settings(max_examples=60, deadline=None)
@given(motions(), st.sampled_from([Circle(0.3), rectangle(0.5, 0.4)]))
def test_contacts(motion: Motion, footprint: Circle) -> None:
    n = len(motion.t)
    bodies = (
        Body("a", "obstacle", rectangle(0.3, 0.3), np.array([0.5, 0, 0])),
        Body("b", "moving obstacle", Circle(0.2), None),
    )
    attempt = Attempt(
        Labels("own", "own", "own", None), "r", "n", "l", footprint, (), bodies, None, 0.1, source="recorded"
    )
    sigma = None if motion.sigma is None else np.stack([motion.sigma] * 2, axis=1)
    events = contacts.assess(attempt, motion.t, motion.pose, motion.pose[:, None] + 0.4, sigma)
    assert {e.kind for e in events} <= {"contact", "possible contact"}
    assert n or not events
