"""The suites `replayed` send a robot through people who walk as they were recorded."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from clearway.clairvoyant.space_time import shortest
from clearway.errors import ClearwayError
from clearway.geometry.shapes import circumscribed_radius
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.replay import Replay, Walk
from clearway.scenarios.replayed import FROZEN, made
from clearway.scenarios.replayed_draws import COUNTERFLOW, CROSSING, SIDE, Streams, draw, one_draw, solvable
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import Selection, load_suite

TIAGO = load_robot("tiago")
ACROSS = Walk("anna", tuple((float(t), 0.0, t - 20.0) for t in range(10, 41)))
"""From (0, -10) at 10 s to (0, 20) at 40 s."""
STANDS = Walk("bert", ((0.0, 3.0, 3.0), (60.0, 3.0, 3.0)))


def built(replay: Replay | None = None, suite: str = "replayed", **selection: object) -> list[Scenario]:
    return load_suite(suite).build(TIAGO, Selection(replay=replay, **selection), 1)  # type: ignore[arg-type]


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


BOTH = pytest.mark.parametrize("streams", [CROSSING, COUNTERFLOW], ids=lambda s: s.suite)


@BOTH
def test_seeds_draw_other_people_the_same_ones_each_time(streams: Streams) -> None:
    scenarios = built(suite=streams.suite, seeds=(0, 3))
    assert [(s.labels.batch, s.labels.configuration) for s in scenarios] == [
        (streams.batch, f"seed-{k}") for k in range(3)
    ]
    tracks = [p.track for s in scenarios for p in s.people]
    assert len(set(tracks)) == len(tracks)
    assert not {p.track for s in built(suite=streams.suite) for p in s.people} & set(tracks)
    for scenario in scenarios:
        assert check_scenario(scenario, TIAGO) == []
        assert all(p.behaviour == "recorded" and not p.sees_robots for p in scenario.people)
    (again,) = built(suite=streams.suite, seeds=(0, 10**6), scenarios=(scenarios[2].name,))
    assert again == scenarios[2]


@BOTH
def test_people_come_for_as_long_as_the_robot_has(streams: Streams) -> None:
    for scenario in built(suite=streams.suite, seeds=(5, 7)):
        for t in np.arange(0.0, scenario.legs[0].time_limit, 5.0):
            assert sum(p.track[0][0] <= t <= p.track[-1][0] for p in scenario.people) >= 3


@BOTH
def test_people_cross_the_floor_at_about_the_speed_that_they_prefer(streams: Streams) -> None:
    walks = draw(streams, 3).walks
    assert max(abs(v) for w in walks for _, *at in w.track for v in at) <= SIDE
    whole = [w for w in walks if w.track[-1][0] < 90.0]
    ways = np.array([np.subtract(w.track[-1][1:], w.track[0][1:]) for w in whole])
    turns = np.abs(np.arctan2(ways[:, 1], ways[:, 0]))
    assert ((turns < 0.6) | (np.abs(turns - streams.turn) < 0.6)).all()
    assert 0.3 < np.mean(turns < 0.6) < 0.7
    speed = [np.hypot(*way) / (w.track[-1][0] - w.track[0][0]) for w, way in zip(whole, ways, strict=True)]
    assert 0.75 * streams.speed[0] < np.mean(speed) < 1.05 * streams.speed[0]


def test_a_drawn_recording_is_the_same_after_it_was_written_down() -> None:
    generator = load_suite("replayed").generator
    assert generator is not None
    (call,) = generator.calls(Selection(seeds=(4, 5)))
    assert generator.read(json.loads(json.dumps(generator.written(generator(*call))))) == generator(*call)


def test_a_recording_in_which_the_robot_is_run_over_at_once_is_none() -> None:
    """Of crossings at seed 14: the first draw can't be got through."""
    assert not solvable(CROSSING, one_draw(CROSSING, 14, "held out"))
    assert draw(CROSSING, 14) == one_draw(CROSSING, 14, "held out", 1)
    alone = Walk("alone", ((0.0, 4.0, 4.0), (90.0, 4.0, 4.0)))
    waits = Walk("waits", ((0.0, -5.5, 0.0), (90.0, -5.5, 0.0)))
    on_the_goal = Walk("on the goal", ((0.0, 5.0, 0.0), (90.0, 5.0, 0.0)))
    for walk, well in ((alone, True), (waits, False), (on_the_goal, False)):
        assert solvable(CROSSING, Replay("x", (walk,), CROSSING.start, CROSSING.goal)) == well


def test_a_drawn_recording_stays_what_it_is() -> None:
    assert one_draw(COUNTERFLOW, 1, "frozen").walks[4].track[8] == (14.4, -2.75, -0.61)


def test_the_held_out_geometry_is_another_one_throughout() -> None:
    for name in ("suite", "batch", "turn", "every", "width", "speed", "start", "goal", "set_speed"):
        assert getattr(CROSSING, name) != getattr(COUNTERFLOW, name), name
    frozen = built(suite="replayed-held-out")
    assert [s.labels.configuration for s in frozen] == [f"recording-{k}" for k in range(1, FROZEN + 1)]
    assert len({s.people[0].track for s in frozen}) == FROZEN
    assert (frozen[0].speed, frozen[0].start, frozen[0].legs[0].goal[:2]) == (0.8, (0.0, -5.5, 1.5708), (0.0, 5.5))
    for scenario in frozen[::6]:
        assert check_scenario(scenario, TIAGO) == []


@pytest.mark.slow
def test_each_frozen_recording_held_out_can_be_crossed() -> None:
    """By a disc of the robot's size that knows everybody's future."""
    for scenario in built(suite="replayed-held-out"):
        t = 0.05 * np.arange(round(scenario.legs[0].time_limit / 0.05))
        at = [
            [np.interp(t, *np.array(p.track).T[[0, k]], left=math.nan, right=math.nan) for k in (1, 2)]
            for p in scenario.people
        ]
        way = shortest(
            np.array(scenario.start[:2]), np.array(scenario.legs[0].goal[:2]), goal_radius=TIAGO.tolerances.xy, v_max=0.8,
            static=np.zeros((0, 3)), moving=np.array(at).transpose(2, 0, 1), dt=0.05, bound=False,
            radii=np.full(len(at), 0.25 + circumscribed_radius(TIAGO.shape)),
        )  # fmt: skip
        assert way is not None, scenario.name


def test_of_somebody_s_own_recording_seeds_draw_times() -> None:
    replay = Replay("some.txt", (STANDS, ACROSS), (-5.0, 0.0, 0.0), (5.0, 0.0))
    begun = [-s.people[0].track[0][0] for s in built(replay, seeds=(0, 50))]
    assert {s.labels.batch for s in built(replay, seeds=(0, 2))} == {"own"}
    assert len(set(begun)) == 50
    assert min(begun) < 5.0
    assert 38.0 < max(begun) <= 60.0 - 10.0 / 0.6 + 0.2
    assert begun[7:9] == [-s.people[0].track[0][0] for s in built(replay, seeds=(7, 9))]
    asked = Replay("some.txt", (STANDS, ACROSS), (-5.0, 0.0, 0.0), (5.0, 0.0), (1.0, 30.0))
    assert {-s.people[0].track[0][0] for s in built(asked, seeds=(0, 20))} == {1.0, 30.0}


def test_what_the_held_out_suite_refuses() -> None:
    with pytest.raises(ClearwayError, match="'3:3' is no range of seeds"):
        built(seeds=(3, 3))
    with pytest.raises(ClearwayError, match="the suite 'replayed-held-out' has no recorded people; 'replayed' has"):
        built(made(), "replayed-held-out")
    with pytest.raises(ClearwayError, match="out of reach"):
        built(suite="replayed-held-out", speeds=(3.0,))
