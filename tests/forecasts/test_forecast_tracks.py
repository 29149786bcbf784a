"""Whatever perception does: identities, gaps, times, and numbers that are none."""

from __future__ import annotations

import time

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.forecaster import Forecaster, PerfectForecaster
from clearway.forecasts.parameters import ForecastParameters
from perceived import obstacles

T = 0.15


def forecaster(**changes: float | bool) -> Forecaster:
    return Forecaster(ForecastParameters(**changes), T, 0.1, 10)  # type: ignore[arg-type]


def sound(f: Forecast) -> None:
    """What holds of every forecast."""
    n = len(f.identity)
    for name in ("path", "sigma", "weight", "radius", "centre", "reach", "speed", "age"):
        a = getattr(f, name)
        assert len(a) == n, name
        assert np.isfinite(a).all(), name
        assert a.flags.c_contiguous, name
    assert (np.diff(f.weight, axis=1) <= 0.0).all()
    np.testing.assert_allclose(f.weight.sum(axis=1), 1.0)
    assert len(set(f.identity.tolist())) == n
    assert (f.sigma > 0.0).all()


def test_nothing_is_perceived() -> None:
    f, told = forecaster().update(0.0, obstacles(np.zeros((0, 2))))
    assert told == ()
    assert f.path.shape == (0, 3, 11, 2)
    assert f.still.shape == (0, 3)
    sound(f)


def test_five_hundred_are_perceived_in_bounded_time() -> None:
    rng = np.random.default_rng(0)
    it, at, v = forecaster(), rng.uniform(0.0, 30.0, (500, 2)), rng.normal(0.0, 0.5, (500, 2))
    it.update(0.0, obstacles(at))
    for i in range(1, 6):
        begun = time.thread_time()
        f, told = it.update(T * i, obstacles(at + T * i * v))
        assert time.thread_time() - begun < 0.1
        assert told == ()
        assert len(f.identity) == 500
    sound(f)
    crowd, told = it.update(6 * T, obstacles(rng.uniform(0.0, 30.0, (500, 2))))  # all of them jump
    assert len(told) > 400
    sound(crowd)


@pytest.mark.parametrize("what", ["position", "radius", "error"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_left_out(what: str, value: float) -> None:
    o = obstacles([[0.0, 0.0], [5.0, 5.0]])
    getattr(o, what)[0] = value
    f, told = forecaster().update(0.0, o)
    assert f.identity.tolist() == [1]
    assert told == ()
    sound(f)


def test_an_error_below_zero_is_left_out() -> None:
    o = obstacles([[0.0, 0.0], [5.0, 5.0]])
    o.error[0] = -0.1
    assert forecaster().update(0.0, o)[0].identity.tolist() == [1]


def test_what_stands_is_told_with_its_error_and_not_tracked() -> None:
    f, _ = forecaster().update(0.0, obstacles([[1.0, 2.0], [3.0, 4.0]], error=0.02, moving=[False, True]))
    assert f.still.tolist() == [[1.0, 2.0, 0.35 + 0.02]]
    assert f.identity.tolist() == [1]


def test_one_that_stops_and_goes_again_keeps_its_track() -> None:
    it = forecaster()
    for i in range(10):
        it.update(T * i, obstacles([[T * i, 0.0]], identity=[4]))
    for i in range(10, 14):
        f, told = it.update(T * i, obstacles([[T * i, 0.0]], identity=[4], moving=False))
        assert len(f.identity) == 0
        assert len(f.still) == 1
        assert told == ()
    f, told = it.update(T * 14, obstacles([[T * 14, 0.0]], identity=[4]))
    assert told == ()
    assert f.identity.tolist() == [4]
    assert f.path[0, 0, 10, 0] == pytest.approx(T * 14 + 1.0, abs=0.1)  # its velocity was not forgotten


def test_one_that_stands_for_long_is_tracked_no_more() -> None:
    it = forecaster(memory=1.0)
    it.update(0.0, obstacles([[0.0, 0.0]]))
    for i in range(1, 9):
        it.update(T * i, obstacles([[0.0, 0.0]], moving=False))
    f, told = it.update(T * 9, obstacles([[0.0, 0.0]]))
    assert f.speed[0] == 4.4  # a new one: nothing is known of its velocity
    assert told == ()


def test_one_out_of_view_goes_on_less_certain_and_is_dropped() -> None:
    it = forecaster(memory=1.0)
    for i in range(10):
        seen, _ = it.update(T * i, obstacles([[T * i, 2.0]], identity=[7]))
    none = obstacles(np.zeros((0, 2)))
    gone, told = it.update(T * 13, none)
    assert told == ()
    assert gone.identity.tolist() == [7]
    assert gone.age[0] == pytest.approx(4 * T)
    assert gone.path[0, 0, 0] == pytest.approx([T * 13, 2.0], abs=0.05)
    assert gone.sigma[0, 0, 0] > 3.0 * seen.sigma[0, 0, 0]
    assert gone.reach[0, 0] > 4.0 * seen.reach[0, 0]
    sound(gone)
    back, told = it.update(T * 14, obstacles([[T * 14, 2.0]], identity=[7]))
    assert told == ()
    assert back.age[0] == 0.0
    assert back.path[0, 0, 10, 0] == pytest.approx(T * 14 + 1.0, abs=0.15)
    later, _ = it.update(T * 14 + 1.1, none)
    assert len(later.identity) == 0


def test_two_that_swap_identities_are_put_right() -> None:
    it = forecaster()
    for i in range(12):
        a, b = [T * i, 0.0], [T * i, 1.0]
        swapped = i >= 8
        f, told = it.update(T * i, obstacles([b, a] if swapped else [a, b], identity=[1, 2]))
        sound(f)
        if i == 8:
            assert set(told) == {
                "obstacle 1: perceived under the identity 2", "obstacle 2: perceived under the identity 1",
            }  # fmt: skip
        else:
            assert told == ()
    at = {int(k): f.path[j, 0, 10] for j, k in enumerate(f.identity)}
    assert at[1] == pytest.approx([T * 11 + 1.0, 0.0], abs=0.05)
    assert at[2] == pytest.approx([T * 11 + 1.0, 1.0], abs=0.05)


def test_one_that_takes_the_identity_of_another_out_of_view_is_put_right() -> None:
    it = forecaster()
    for i in range(8):
        it.update(T * i, obstacles([[T * i, 0.0], [T * i, 3.0]], identity=[1, 2]))
    f, told = it.update(T * 8, obstacles([[T * 8, 0.0]], identity=[2]))  # the first, under the second's name
    assert told == ("obstacle 1: perceived under the identity 2",)
    assert sorted(f.identity.tolist()) == [1, 2]
    f, told = it.update(T * 9, obstacles([[T * 9, 0.0], [T * 9, 3.0]], identity=[2, 1]))
    assert told == ()
    sound(f)


def test_a_teleport_is_told_and_begins_anew() -> None:
    it = forecaster()
    for i in range(8):
        it.update(T * i, obstacles([[T * i, 0.0]], identity=[5]))
    f, told = it.update(T * 8, obstacles([[9.0, 9.0]], identity=[5]))
    assert len(told) == 1
    assert told[0].startswith("obstacle 5: faster than 4.4 m/s (")
    assert f.path[0, 0, 0] == pytest.approx([9.0, 9.0], abs=0.02)
    assert f.identity.tolist() == [5]
    assert f.sigma[0, 0, 10] > 0.5  # its velocity is not known any more
    sound(f)


def test_a_new_one_does_not_take_the_track_of_one_out_of_view() -> None:
    it = forecaster()
    for i in range(5):
        it.update(T * i, obstacles([[0.0, 0.0]], identity=[1]))
    f, told = it.update(T * 5, obstacles([[0.01, 0.0]], identity=[2]))
    assert sorted(f.identity.tolist()) == [1, 2]
    assert told == ()


def test_one_identity_twice_at_once_is_two_obstacles() -> None:
    f, told = forecaster().update(0.0, obstacles([[0.0, 0.0], [5.0, 0.0]], identity=[3, 3]))
    assert f.identity.tolist() == [3, -1]
    assert told == ()


def test_a_time_that_stands_still_tells_nothing_new() -> None:
    it = forecaster()
    for i in range(6):
        f, _ = it.update(T * i, obstacles([[T * i, 0.0]]))
    again, told = it.update(T * 5, obstacles([[T * 5, 0.0]]))
    assert told == ()
    np.testing.assert_array_equal(again.path, f.path)
    np.testing.assert_array_equal(again.sigma, f.sigma)


def test_a_time_that_goes_back_begins_all_anew() -> None:
    it = forecaster()
    for i in range(6):
        it.update(T * i, obstacles([[T * i, 0.0]]))
    back, told = it.update(0.0, obstacles([[0.0, 0.0]]))
    assert told == ("time went back by 0.75 s: all obstacles are tracked anew",)
    fresh, _ = forecaster().update(0.0, obstacles([[0.0, 0.0]]))
    np.testing.assert_array_equal(back.path, fresh.path)
    np.testing.assert_array_equal(back.reach, fresh.reach)


@pytest.mark.parametrize("skipped", [1, 3, 8])
def test_a_period_that_is_missed_is_taken_as_it_is(skipped: int) -> None:
    it = forecaster()
    for i in [*range(8), *range(8 + skipped, 12 + skipped)]:
        f, told = it.update(T * i, obstacles([[1.2 * T * i, 0.0]]))
        assert told == ()
    assert f.path[0, 0, 10, 0] == pytest.approx(1.2 * (T * (11 + skipped) + 1.0), abs=0.05)


def test_all_is_forgotten_after_a_long_gap() -> None:
    it = forecaster()
    it.update(0.0, obstacles([[0.0, 0.0]]))
    f, told = it.update(60.0, obstacles([[9.0, 9.0]]))  # the same identity, but who knows
    assert told == ()
    assert f.speed[0] == 4.4


@pytest.mark.parametrize("t", [np.nan, np.inf])
def test_a_time_that_is_none_is_refused(t: float) -> None:
    with pytest.raises(ClearwayError, match="no time to forecast from"):
        forecaster().update(t, obstacles([[0.0, 0.0]]))


@pytest.mark.parametrize(("period", "step", "count"), [(0.0, 0.1, 5), (np.nan, 0.1, 5), (0.1, 0.0, 5), (0.1, 0.1, -1)])
def test_limits_of_zero_are_refused(period: float, step: float, count: int) -> None:
    with pytest.raises(ClearwayError):
        Forecaster(ForecastParameters(), period, step, count)


def test_a_reset_forgets_everything() -> None:
    it = forecaster()
    one, _ = it.update(3.0, obstacles([[0.0, 0.0]]))
    it.reset()
    other, told = it.update(0.0, obstacles([[0.0, 0.0]]))
    assert told == ()
    np.testing.assert_array_equal(one.path, other.path)


def test_a_known_velocity_is_used_at_first_sight() -> None:
    o = obstacles([[0.0, 0.0]])
    o.velocity[0], o.velocity_error[0] = (1.0, 0.0), 0.2
    f, _ = forecaster().update(0.0, o)
    assert np.einsum("h,hc->c", f.weight[0], f.path[0, :, 10]) == pytest.approx([1.0, 0.0], abs=0.15)


def truth(t: float) -> np.ndarray:
    """Two that move and one that comes and goes."""
    return np.array([[t, 0.0, 0.35, 1.0], [0.0, 5.0 + t * t, 0.35, 1.0], [8.0, 8.0, 0.35, float(t < 1.0)]])


def test_a_perfect_forecast_is_the_truth_of_what_was_seen() -> None:
    it = PerfectForecaster(ForecastParameters(), truth, 0.5, 4)
    f, told = it.update(0.0, obstacles([[0.0, 5.01]], identity=[17]))
    assert told == ()
    assert f.identity.tolist() == [17]
    assert f.path[0, 0, :, 1].tolist() == [5.0, 5.25, 6.0, 7.25, 9.0]
    assert f.weight.tolist() == [[1.0, 0.0, 0.0]]
    assert f.speed[0] == pytest.approx(3.5)
    f, _ = it.update(0.5, obstacles([[0.51, 0.0]], identity=[4]))
    assert sorted(f.identity.tolist()) == [4, 17]  # the other is remembered
    sound(f)


def test_a_perfect_forecast_of_what_vanishes_holds_it() -> None:
    it = PerfectForecaster(ForecastParameters(), truth, 0.5, 4)
    f, _ = it.update(0.0, obstacles([[8.0, 8.0]], identity=[2]))
    assert (f.path[0, 0] == [8.0, 8.0]).all()
    f, _ = it.update(2.0, obstacles(np.zeros((0, 2))))
    assert len(f.identity) == 0


@pytest.mark.parametrize(("velocities", "least", "most"), [(True, 0.0, 0.1), (False, 0.3, 9.0)])
def test_a_lidar_that_sees_another_part_of_a_body_does_not_change_its_velocity(
    velocities: bool, least: float, most: float
) -> None:
    it = forecaster(velocities=velocities)
    for i in range(21):
        aside = 0.2 if i == 20 else 0.0  # the middle of what is seen has jumped
        o = obstacles([[0.6 * T * i, aside]], error=0.04)
        o.velocity[0], o.velocity_error[0] = (0.6, 0.0), 0.1
        f, told = it.update(T * i, o)
    assert len(told) == 1
    assert "accelerates" in told[0]
    path = np.einsum("h,hkc->kc", f.weight[0], f.path[0])
    assert least <= np.hypot(*(path[10] - path[0] - [0.6, 0.0])) <= most
