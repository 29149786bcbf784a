"""The suite `replayed` sends a robot through people who walk as they were recorded."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.shapes import circumscribed_radius
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.replay import Replay, Walk
from clearway.scenarios.replayed import made
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import Selection, load_suite

TIAGO = load_robot("tiago")
ACROSS = Walk("anna", tuple((float(t), 0.0, t - 20.0) for t in range(10, 41)))
"""From (0, -10) at 10 s to (0, 20) at 40 s."""
STANDS = Walk("bert", ((0.0, 3.0, 3.0), (60.0, 3.0, 3.0)))


def built(replay: Replay | None = None, **selection: object) -> list[Scenario]:
    return load_suite("replayed").build(TIAGO, Selection(replay=replay, **selection), 1)  # type: ignore[arg-type]


def sent(*walks: Walk, start: tuple[float, float, float] = (-5.0, 0.0, 0.0), goal: tuple[float, ...] = (5.0, 0.0), at: tuple[float, ...] = ()) -> list[Scenario]:  # fmt: skip
    return built(Replay("some.txt", walks, start, goal, at))


def test_the_recording_that_comes_with_it_is_sound() -> None:
    scenarios = built()
    assert [s.labels.configuration for s in scenarios] == [f"time-{k}" for k in range(1, 11)]
    assert len(made().walks) == 30
    for scenario in scenarios:
        assert check_scenario(scenario, TIAGO) == []
        assert all(p.behaviour == "recorded" and not p.sees_robots for p in scenario.people)
        inside = [p for p in scenario.people if p.track[0][0] <= 8.0 <= p.track[-1][0]]
        assert len(inside) >= 2


def test_people_are_where_they_were_when_the_robot_starts_later() -> None:
    (scenario,) = sent(ACROSS, at=(15.5,))
    (anna,) = scenario.people
    t, x, y = np.array(anna.track).T
    for later in (0.0, 0.5, 7.3, 24.5):
        assert (np.interp(later, t, x), np.interp(later, t, y)) == pytest.approx((0.0, 15.5 + later - 20.0))
    assert -1.0 <= t[0] <= 0.0
    assert t[-1] == 24.5


def test_who_has_gone_or_comes_too_late_is_not_there() -> None:
    (scenario,) = sent(ACROSS, STANDS, Walk("late", ((500.0, 1.0, 1.0), (600.0, 1.0, 2.0))), at=(45.0,))
    assert [p.name for p in scenario.people] == ["person bert"]


def test_ten_times_are_spread_over_the_recording() -> None:
    scenarios = sent(STANDS, ACROSS)
    begun = [-s.people[0].track[0][0] for s in scenarios]
    assert begun == pytest.approx([(60.0 - 10.0 / 0.6) * k / 10 for k in range(10)])
    assert len({s.seed for s in scenarios}) == 10


def test_the_robot_waits_until_its_start_is_free() -> None:
    """At 25 s, the fifth of ten times, Anna is at (0, 5) and walks on at 1 m/s."""
    scenarios = sent(STANDS, ACROSS, start=(0.0, 5.0, 0.0), goal=(6.0, 5.0))
    times = [-s.people[0].track[0][0] for s in scenarios]
    assert [k for k in range(10) if times[k] != pytest.approx(5.0 * k)] == [5]
    assert 0.35 <= times[5] - 25.0 - circumscribed_radius(TIAGO.shape) <= 0.56


def test_the_heading_at_the_goal_is_free_unless_it_is_said() -> None:
    (free,), (said,) = sent(STANDS, at=(1.0,)), sent(STANDS, goal=(5.0, 0.0, 1.0), at=(1.0,))
    assert free.legs[0].yaw_tolerance == math.inf
    assert (said.legs[0].goal[2], said.legs[0].yaw_tolerance) == (1.0, None)


def test_what_was_recorded_elsewhere_needs_a_larger_floor() -> None:
    (near,), (far,) = (
        sent(STANDS, at=(1.0,)),
        sent(STANDS, ACROSS, Walk("far", ((0.0, 0.0, 40.0), (60.0, 0.0, 44.0))), at=(1.0,)),
    )
    assert (near.floor_plan, far.floor_plan) == ("open-25", "open-50")


@pytest.mark.parametrize(
    ("start", "goal", "at", "says"),
    [
        ((3.1, 3.0, 0.0), (5.0, 0.0), (5.0,), "'bert' is where 'tiago' is to start at 5 s"),
        ((3.1, 3.0, 0.0), (5.0, 0.0), (), "finds no room"),
        ((-50.0, 0.0, 0.0), (5.0, 0.0), (), "(-50, 0) is 50 m from where anybody walks"),
        ((-5.0, 0.0, 0.0), (5.0, 90.0), (), "(5, 90) is 70 m from where anybody walks"),
        ((-5.0, 0.0, 0.0), (5.0, 0.0), (61.0,), "nobody walks at 61 s; people do from 0 to 60 s"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(
    start: tuple[float, float, float], goal: tuple[float, float], at: tuple[float, ...], says: str
) -> None:
    with pytest.raises(ClearwayError) as refused:
        sent(ACROSS, STANDS, start=start, goal=goal, at=at)
    assert says in str(refused.value)


def test_a_recording_far_from_its_origin_is_refused() -> None:
    with pytest.raises(ClearwayError, match=r"up to 640 m from the origin .* is it in metres\?"):
        sent(Walk("pixel", ((0.0, 600.0, 300.0), (9.0, 640.0, 300.0))))


def test_other_suites_have_no_recorded_people() -> None:
    with pytest.raises(ClearwayError, match="the suite 'people' has no recorded people; 'replayed' has"):
        load_suite("people").build(TIAGO, Selection(replay=made()), 1)


def test_the_page_says_that_people_are_blind() -> None:
    assert "its effect on them is zero by construction" in load_suite("replayed").about()["source"]
