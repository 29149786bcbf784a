"""The suite `hospital` is paper A's protocol: counts, sizes, gaps, meetings in time. The held-out one shares none of its numbers."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import affinity

from clearway.errors import ClearwayError
from clearway.geometry.rasterise import outline
from clearway.geometry.shapes import circumscribed_radius
from clearway.robots import Robot, load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.hospital import undisturbed
from clearway.scenarios.scenario import ObstacleSpec, Scenario
from clearway.scenarios.suites import Selection, load_suite, with_movers

ROBOTS = ("tiago", "hosbot")


PLACES = [("hospital", "hall"), ("hospital", "ward"), ("hospital-held-out", "ward")]


def protocol(robot: str, seed: int = 1, suite: str = "hospital", **selection: object) -> list[Scenario]:
    return load_suite(suite).build(load_robot(robot), Selection(**selection), seed)  # type: ignore[arg-type]


def square(obstacle: ObstacleSpec) -> shapely.Polygon:
    assert obstacle.pose is not None
    return shapely.Polygon(outline(obstacle.shape.shape(), np.array(obstacle.pose)))


@pytest.mark.parametrize("robot", ROBOTS)
def test_336_trials_by_batch_and_configuration(robot: str) -> None:
    tests = protocol(robot)
    assert len(tests) == 336
    assert Counter(t.labels.batch for t in tests) == {"NO": 9, "SO": 252, "MO": 27, "CE": 48}
    assert Counter(t.labels.configuration for t in tests) == {
        "free": 9, "single": 36, "parallel": 108, "perpendicular": 108,
        "passing": 12, "crossing": 12, "overtaking": 3, "complex": 48,
    }  # fmt: skip
    assert {Counter((t.labels.batch, t.speed) for t in tests)["SO", v] for v in (0.2, 0.6, 1.0)} == {84}
    assert len({t.name for t in tests}) == 336
    assert len({t.seed for t in tests}) == 336


def test_names_tell_the_test() -> None:
    names = [t.name for t in protocol("tiago")]
    expected = {
        "NO-v0.2-r1", "SO-single-v0.6-s0.03-r3", "SO-parallel-v0.2-s0.15-d1.5-r2", "SO-perpendicular-v1-s0.6-d2-r1",
        "MO-passing-v0.2-o0.6-r1", "MO-crossing-v0.6-o0.2-r3", "MO-overtaking-v0.2-o1-r2", "CE-v0.6-o0.6-s0.3-r1",
    }  # fmt: skip
    assert expected <= set(names)


def test_a_trial_goes_forth_turns_and_comes_back() -> None:
    for test in protocol("tiago", batches=("NO",)):
        assert test.start == (-2.5, 0.0, 0.0)
        assert [leg.name for leg in test.legs] == ["forth", "turn", "back"]
        goals = [(2.5, 0.0, 0.0), (2.5, 0.0, math.pi), (-2.5, 0.0, math.pi)]
        for leg, goal in zip(test.legs, goals, strict=True):
            assert leg.goal[:2] == goal[:2]
            assert math.cos(leg.goal[2] - goal[2]) == pytest.approx(1)
        assert [leg.scored for leg in test.legs] == [True, False, True]
        assert test.legs[0].time_limit == pytest.approx(3 * 5 / test.speed + 20)
        assert test.reference_length == 5.0


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_gap_between_double_obstacles_is_a_multiple_of_d_base(robot: str) -> None:
    d_base = {"tiago": 0.54, "hosbot": 0.60}[robot]
    doubles = [t for t in protocol(robot) if t.labels.configuration in ("parallel", "perpendicular")]
    for test in doubles:
        one, two = (square(o) for o in test.obstacles)
        assert test.labels.gap in (1.0, 1.5, 2.0)
        assert one.distance(two) == pytest.approx(test.labels.gap * d_base, abs=1e-9)
        assert one.area == pytest.approx(test.labels.size**2)  # type: ignore[operator]
        line = shapely.LineString([(-2.5, 0), (2.5, 0)])
        assert one.union(two).centroid.distance(shapely.Point(0, 0)) < 1e-9
        along = test.labels.configuration == "parallel"
        assert (one.intersects(line), two.intersects(line)) == (along, along)


def test_a_single_obstacle_stands_in_the_middle() -> None:
    for test in protocol("tiago", configurations=("single", "complex")):
        assert test.obstacles[0].pose == (0.0, 0.0, 0.0)
        assert square(test.obstacles[0]).area == pytest.approx(test.labels.size**2)  # type: ignore[operator]


def moving_obstacle_at(test: Scenario, leg: str, t: float) -> tuple[float, float]:
    """Where the moving obstacle is `t` seconds after `leg` began: an own, plain computation on its straight path."""
    moving_obstacle = next(o for o in test.obstacles if o.runs)
    run = next(r for r in moving_obstacle.runs if r.leg == leg)
    (x0, y0), (x1, y1) = run.path
    share = (t - run.delay) * run.speed / math.dist(*run.path)
    return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


def robot_at(robot: Robot, speed: float, t: float) -> float:
    """How far the robot is after `t` seconds: Euler's method in small steps."""
    v = s = 0.0
    for _ in range(round(t / 1e-3)):
        v = min(v + robot.drive.acceleration * 1e-3, speed)
        s += v * 1e-3
    return s


@pytest.mark.parametrize("name", ROBOTS)
def test_the_moving_obstacle_meets_the_undisturbed_robot(name: str) -> None:
    robot = load_robot(name)
    delays = set()
    for test in protocol(name, configurations=("crossing", "complex", "passing")):
        for leg, sign in (("forth", 1), ("back", -1)):
            x = -1.0 * sign if test.labels.batch == "CE" else 0.0
            distance = 2.5 + sign * x
            t = undisturbed(robot, test.speed, distance)
            if (test.labels.repetition, leg) == (1, "forth"):
                assert robot_at(robot, test.speed, t) == pytest.approx(distance, abs=0.002)
            away = math.dist(moving_obstacle_at(test, leg, t), (x, 0.0)) / test.labels.obstacle_speed  # type: ignore[operator]
            assert away <= 0.5 + 1e-6
            delays.add(round(away, 4))
    assert len(delays) > 30  # spread, not fixed
    assert max(delays) > 0.4


def test_moving_obstacles_are_the_other_robot_and_go_where_the_paper_says() -> None:
    for name, other in (("tiago", "hosbot"), ("hosbot", "tiago"), ("hosbot:vendor", "tiago"), ("jackal", "tiago")):
        for test in protocol(name, batches=("MO", "CE")):
            moving_obstacle = next(o for o in test.obstacles if o.runs)
            assert moving_obstacle.shape.robot == other  # type: ignore[union-attr]
            assert [r.leg for r in moving_obstacle.runs] == ["forth", "back"]
            assert {r.speed for r in moving_obstacle.runs} == {test.labels.obstacle_speed}
            forth, back = (np.array(r.path) for r in moving_obstacle.runs)
            assert np.allclose(forth, -back)  # turned by pi about the midpoint
            way = (forth[1] - forth[0]) / np.linalg.norm(forth[1] - forth[0])
            expected = {"passing": (-1, 0), "crossing": (0, -1), "complex": (0, -1), "overtaking": (1, 0)}
            assert tuple(way) == pytest.approx(expected[test.labels.configuration])


@pytest.mark.parametrize("name", ROBOTS)
def test_the_overtaker_starts_2_m_behind_in_its_own_lane(name: str) -> None:
    robot, other = load_robot(name), load_robot("hosbot" if name == "tiago" else "tiago")
    for test in protocol(name, configurations=("overtaking",)):
        assert (test.speed, test.labels.obstacle_speed) == (0.2, 1.0)
        x, y = test.obstacles[0].runs[0].path[0]
        assert x == pytest.approx(-4.5)
        assert y == pytest.approx(circumscribed_radius(robot.shape) + circumscribed_radius(other.shape) + 0.2)
        lane = affinity.translate(shapely.Polygon(outline(other.shape, np.zeros(3))), 0, y)
        assert lane.distance(shapely.Polygon(outline(robot.shape, np.zeros(3)))) >= 0.2 - 1e-3
        assert 0 <= test.obstacles[0].runs[0].delay <= 1.0


@pytest.mark.parametrize(("suite", "plan"), PLACES)
@pytest.mark.parametrize("name", ROBOTS)
def test_every_test_is_sound_wherever_it_runs(name: str, suite: str, plan: str) -> None:
    robot = load_robot(name)
    for test in protocol(name, suite=suite, floor_plan=plan, repetitions=1):
        assert [str(e) for e in check_scenario(test, robot)] == [], test.name


@pytest.mark.parametrize(("suite", "plan"), PLACES)
@pytest.mark.parametrize("name", ROBOTS)
def test_everything_stays_in_the_clear_area(name: str, suite: str, plan: str) -> None:
    clear = load_floor_plan(plan).clear
    assert clear is not None
    area = shapely.box(*clear)
    for test in protocol(name, suite=suite, floor_plan=plan):
        for obstacle in test.obstacles:
            if obstacle.pose is not None:
                assert area.covers(square(obstacle)), test.name
            reach = circumscribed_radius(obstacle.shape.shape())
            for run in obstacle.runs:
                assert area.covers(shapely.LineString(run.path).buffer(reach)), test.name


def test_the_held_out_suite_shares_no_number_and_no_place_with_the_other() -> None:
    known, held_out = (protocol("tiago", suite=name) for name in ("hospital", "hospital-held-out"))
    assert Counter(t.labels.batch for t in held_out) == {"NO": 6, "SO": 168, "MO": 27, "CE": 48}
    assert {t.labels.configuration for t in held_out} == {t.labels.configuration for t in known}
    for number in ("size", "gap", "obstacle_speed"):
        here, there = ({getattr(t.labels, number) for t in tests} - {None} for tests in (held_out, known))
        assert here
        assert not here & there
    for number in ("speed", "floor_plan", "name", "seed"):
        assert not {getattr(t, number) for t in held_out} & {getattr(t, number) for t in known}
    assert {t.labels.obstacle_speed for t in held_out} == {None, 0.4, 0.8}
    assert {t.labels.suite for t in held_out} == {"hospital-held-out"}


def test_the_seed_comes_from_the_campaign_and_the_name_alone() -> None:
    all_of_it = {t.name: t for t in protocol("tiago", seed=5)}
    part = protocol("tiago", seed=5, batches=("MO",), speeds=(0.6,))
    assert part == [t for t in all_of_it.values() if t.labels.batch == "MO" and t.speed == 0.6]
    assert {t.name: t.seed for t in protocol("hosbot", seed=5)} == {n: t.seed for n, t in all_of_it.items()}
    other = {t.name: t for t in protocol("tiago", seed=6)}
    assert all(other[n].seed != t.seed for n, t in all_of_it.items())
    name = "MO-crossing-v0.2-o0.2-r1"
    assert other[name].obstacles[0].runs[0].delay != all_of_it[name].obstacles[0].runs[0].delay


def test_repetitions_differ_by_seed_and_timing() -> None:
    one, two, three = (t for t in protocol("tiago") if t.name.startswith("MO-crossing-v0.2-o0.2-"))
    assert len({one.seed, two.seed, three.seed}) == 3
    assert len({t.obstacles[0].runs[0].delay for t in (one, two, three)}) == 3


def test_selecting() -> None:
    assert len(protocol("tiago", batches=("SO",), speeds=(0.2,))) == 84
    assert len(protocol("tiago", configurations=("single",), sizes=(0.15, 0.3), repetitions=1)) == 6
    assert {t.labels.gap for t in protocol("tiago", batches=("SO",), gaps=(1.5,))} == {None, 1.5}
    assert {t.labels.configuration for t in protocol("tiago", gaps=(1.5,))} >= {"free", "single", "passing"}
    assert len(protocol("tiago", batches=("NO",), repetitions=29)) == 87
    assert {t.floor_plan for t in protocol("tiago", floor_plan="ward")} == {"ward"}
    (one,) = protocol("tiago", scenarios=("NO-v0.6-r1",), sizes=(0.3,), gaps=(1.5,))  # which bar those that have others
    assert one.name == "NO-v0.6-r1"


@pytest.mark.parametrize(
    ("selection", "message"),
    [
        ({"batches": ("S0",)}, r"unknown batch 'S0'; did you mean 'SO'\? known: CE, MO, NO, SO"),
        ({"configurations": ("croossing",)}, r"unknown configuration 'croossing'; did you mean 'crossing'\?"),
        ({"speeds": (0.5,)}, r"no scenario of the suite 'hospital' has the speed 0\.5; known: 0\.2, 0\.6, 1"),
        ({"sizes": (0.2,)}, r"has the size 0\.2; known: 0\.03, 0\.15, 0\.3, 0\.6"),
        ({"gaps": (3.0,)}, r"has the gap 3; known: 1, 1\.5, 2"),
        ({"obstacle_speeds": (0.3,)}, r"has the obstacle_speed 0\.3; known: 0\.2, 0\.6, 1"),
        ({"repetitions": 0}, r"0 repetitions make no trial"),
        ({"configurations": ("overtaking",), "speeds": (0.6,)}, r"no scenario .* has all that is selected together"),
        ({"floor_plan": "hal"}, r"unknown floor plan 'hal'; did you mean 'hall'\?"),
        ({"floor_plan": "barn-0"}, r"the floor plan 'barn-0' has no line from a to b"),
    ],
)
def test_a_selection_that_nothing_meets(selection: dict[str, object], message: str) -> None:
    with pytest.raises(ClearwayError, match=message):
        protocol("tiago", **selection)


def test_unknown_suite() -> None:
    with pytest.raises(ClearwayError, match=r"unknown suite 'hospitl'; did you mean 'hospital'\?"):
        load_suite("hospitl")


def test_latency_is_scaled_for_every_test() -> None:
    robot = load_robot("tiago")
    some = Selection(batches=("NO",), repetitions=1)
    assert {s.latency for s in load_suite("hospital").build(robot, some)} == {1.0}
    for factor in (0.0, 2.5):
        assert {s.latency for s in load_suite("hospital").build(robot, replace(some, latency=factor))} == {factor}
    for wrong in (-0.1, 101.0, float("nan")):
        with pytest.raises(ClearwayError, match="no factor on a latency"):
            load_suite("hospital").build(robot, replace(some, latency=wrong))


def test_blind_movers_have_the_same_path_and_timing_and_nobody_who_looks() -> None:
    robot = load_robot("tiago")
    some = Selection(batches=("MO", "CE"), repetitions=1)
    for name in ("hospital", "hospital-held-out"):
        looks = load_suite(name).build(robot, some)
        blind = load_suite(*with_movers((name,), "blind")).build(robot, some)
        assert len(looks) == len(blind) > 0
        for a, b in zip(looks, blind, strict=True):
            assert [o.behaviour is not None for o in (*a.obstacles, *b.obstacles)].count(True) == 1
            driven = next(o for o in a.obstacles if o.behaviour)
            assert driven.model_copy(update={"behaviour": None}) in b.obstacles
            assert (a.name, a.seed) == (b.name, b.seed)
            assert a.labels.suite != b.labels.suite


def test_only_the_hospitals_movers_can_be_blind() -> None:
    assert with_movers(("barn", "hospital"), "blind") == ("barn", "hospital-blind")
    with pytest.raises(ClearwayError, match="no suite among barn"):
        with_movers(("barn",), "blind")
    with pytest.raises(ClearwayError, match="unknown kind of movers 'dumb'"):
        with_movers(("hospital",), "dumb")
