from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import special, stats

from clearway.geometry.streams import bits, normal, normal_quantile, normals, stream, uniform


@given(st.floats(1e-300, 1.0 - 1e-12))
def test_normal_quantile_agrees_with_scipy(p: float) -> None:
    assert normal_quantile(p) == pytest.approx(special.ndtri(p), rel=2e-14, abs=1e-15)


def test_a_number_depends_on_its_key_alone() -> None:
    key = stream(7, "lidar")
    forwards = [normal(key, 3, i) for i in range(50)]
    backwards = [normal(key, 3, i) for i in reversed(range(50))]
    assert forwards == backwards[::-1]
    assert normal(stream(7, "odometry"), 3, 0) != forwards[0]
    assert normal(stream(8, "lidar"), 3, 0) != forwards[0]
    assert stream(10**40, "lidar") == stream(10**40, "lidar")


def test_numbers_are_distributed_as_they_should() -> None:
    key = stream(1, "test")
    u = np.array([[uniform(key, s, i) for i in range(100)] for s in range(200)])
    assert u.min() > 0.0
    assert u.max() < 1.0
    assert stats.kstest(u.ravel(), "uniform").pvalue > 0.01
    n = np.array([[normal(key, s, i) for i in range(100)] for s in range(200)])
    assert stats.kstest(n.ravel(), "norm").pvalue > 0.01
    # neither neighbours in a step nor neighbours in time are correlated: 3.5 standard errors
    assert abs(np.corrcoef(n[:, :-1].ravel(), n[:, 1:].ravel())[0, 1]) < 3.5 / np.sqrt(n.size)
    assert abs(np.corrcoef(n[:-1].ravel(), n[1:].ravel())[0, 1]) < 3.5 / np.sqrt(n.size)


def test_bits_do_not_collide_on_a_grid() -> None:
    key = stream(0, "x")
    assert len({int(bits(key, s, i)) for s in range(100) for i in range(100)}) == 10_000
    assert bits(key, 1, 2) != bits(key, 2, 1)


def test_many_normals_are_those_drawn_one_by_one() -> None:
    key, out = stream(7, "lidar"), np.empty(999)
    normals(key, 4, out, np.empty_like(out))
    assert out.tolist() == [normal(key, 4, i) for i in range(len(out))]
