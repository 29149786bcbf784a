"""Trees of transforms: chains, inverses and interpolation against rotation matrices, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from clearway.errors import ClearwayError
from clearway.recordings.formats.tf import TransformTree, multiply, rotate, split


def matrix(values: np.ndarray) -> np.ndarray:
    """4 x 4 of x, y, z, qx, qy, qz, qw, by scipy."""
    m = np.eye(4)
    m[:3, :3] = Rotation.from_quat(values[3:]).as_matrix()
    m[:3, 3] = values[:3]
    return m


def drawn(rng: np.random.Generator) -> np.ndarray:
    return np.concatenate([rng.normal(size=3), Rotation.random(rng=rng).as_quat()])


@given(st.integers(0, 2**32 - 1))
def test_a_chain_is_the_product_of_its_matrices_whichever_way_it_is_passed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = TransformTree()
    a, b, c = drawn(rng), drawn(rng), drawn(rng)
    for t in (0.0, 1.0):
        tree.add("map", "odom", t, a)
        tree.add("/odom", "/base_link", t, b)
    tree.add("base_link", "laser", 0.0, c, static=True)
    whole = matrix(a) @ matrix(b) @ matrix(c)
    for (parent, child), expected in ((("map", "laser"), whole), (("laser", "map"), np.linalg.inv(whole))):
        track, _ = tree.track(parent, child)
        found = matrix(np.concatenate([track.position[0], track.orientation[0]]))
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_between_samples_it_is_interpolated_as_slerp_and_beyond_them_unknown() -> None:
    rng = np.random.default_rng(1)
    slow, fast = [drawn(rng) for _ in range(3)], drawn(rng)
    tree = TransformTree()
    for i, values in enumerate(slow):
        tree.add("map", "odom", float(i), values)
    for t in np.arange(-0.5, 3.0, 0.125):
        tree.add("odom", "base_link", float(t), fast)
    track, _ = tree.track("map", "base_link")
    np.testing.assert_array_equal(track.t, np.arange(0.0, 2.01, 0.125))
    turned = Slerp([0, 1, 2], Rotation.from_quat([v[3:] for v in slow]))(track.t)
    place = np.array([np.interp(track.t, [0, 1, 2], [v[k] for v in slow]) for k in range(3)]).T
    np.testing.assert_allclose(track.position, place + turned.apply(fast[:3]), atol=1e-12)
    angle = (Rotation.from_quat(track.orientation).inv() * (turned * Rotation.from_quat(fast[3:]))).magnitude()
    np.testing.assert_allclose(angle, 0, atol=1e-7)


def test_quaternions_turn_as_scipy_says() -> None:
    rng = np.random.default_rng(2)
    p, q = Rotation.random(50, rng=rng), Rotation.random(50, rng=rng)
    x = rng.normal(size=(50, 3))
    np.testing.assert_allclose(rotate(p.as_quat(), x), p.apply(x), atol=1e-12)
    product = Rotation.from_quat(multiply(p.as_quat(), q.as_quat()))
    np.testing.assert_allclose((product.inv() * (p * q)).magnitude(), 0, atol=1e-7)


def test_pairs_are_what_a_base_is_known_by_and_what_moves_in_a_root() -> None:
    unit = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    tree = TransformTree()
    for t in (0.0, 1.0):
        for parent, child in (("map", "odom"), ("odom", "base_link"), ("base_link", "wheel"), ("world", "cart")):
            tree.add(parent, child, t, unit)
    tree.add("base_link", "laser", 0.0, unit, static=True)
    assert tree.pairs() == (("map", "base_link"), ("odom", "base_link"), ("map", "odom"), ("world", "cart"))


def test_once_settled_only_what_lies_between_the_wanted_frames_is_kept() -> None:
    unit = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    tree = TransformTree()
    for t in (0.0, 1.0, 2.0):
        tree.add("odom", "base_link", t, unit)
        tree.add("base_link", "wheel", t, unit)
        if t == 0.0:
            assert not tree.settle([("map", "base_link")])
        tree.add("map", "odom", t, unit)
        if t == 1.0:
            assert tree.settle([("map", "base_link")])
    assert tree.moving == (("map", "odom"), ("odom", "base_link"))
    np.testing.assert_array_equal(tree.track("map", "base_link")[0].t, [0, 1, 2])


def test_what_is_no_transform_is_left_out_and_told() -> None:
    tree = TransformTree()
    tree.add("a", "b", 0.0, [0, 0, 0, 0, 0, 0, 0])
    tree.add("a", "a", 0.0, [0, 0, 0, 0, 0, 0, 1])
    tree.add("a", "b", 0.0, [np.nan, 0, 0, 0, 0, 0, 1])
    assert tree.edges == ()
    assert "3 transforms were left out" in tree.notes[0]
    tree.add("a", "b", 0.0, [1, 0, 0, 0, 0, 0, 2])  # not of length 1, but a rotation
    assert tree.track("a", "b")[0].orientation[0].tolist() == [0, 0, 0, 1]
    tree.add("c", "b", 0.0, [1, 0, 0, 0, 0, 0, 1])
    assert "several parents" in tree.notes[1]
    with pytest.raises(ClearwayError, match="unknown frame 'bb'; did you mean 'b'"):
        tree.track("a", "bb")
    tree.add("a", "b", 1e6, [0, 0, 0, 0, 0, 0, 1])
    with pytest.raises(ClearwayError, match="time leaps"):
        tree.track("a", "b")


def test_transforms_that_were_never_known_at_once_are_told() -> None:
    unit = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    tree = TransformTree()
    for t in (0.0, 1.0):
        tree.add("map", "odom", t, unit)
        tree.add("odom", "base_link", t + 10, unit)
    with pytest.raises(ClearwayError, match="never known at once"):
        tree.track("map", "base_link")


def test_a_pair_is_told_by_its_arrow() -> None:
    assert split("/map -> base_link") == ("map", "base_link")
    assert split("/odom") is None
    assert split("->x") is None
