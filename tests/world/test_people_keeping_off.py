"""How people keep off each other, robots, things and walls, whatever the rule by which they walk."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from watched_people import RULES, WALL, ends, lane, nearest, walker, watch
from worlds import Pilot, body, constant

from clearway.contract import Command
from clearway.crowds.bodies import Bodies
from clearway.crowds.walls import walls_of
from clearway.crowds.ways import room_of
from clearway.geometry.grid import FREE, OccupancyGrid
from clearway.geometry.shapes import FloatArray, rectangle
from clearway.trials import Outcome
from clearway.world.behaviours.keeping_off import BESIDE, IN_TIME, SLIM, TOUCH, Around, Walker, keep_off
from clearway.world.behaviours.walkers import FASTER


@pytest.mark.parametrize("rule", RULES)
def test_a_robot_that_stands_is_walked_around_by_who_sees_it_and_run_into_by_who_does_not(rule: str) -> None:
    person = walker("ann", (-4.0, 0.05), (4.0, 0.0), behaviour=rule)
    seen = watch([person], start=(0.0, 0.0, 0.0))
    assert seen.outcome is Outcome.TIMEOUT
    assert ends(seen, [person])[0] < 0.1
    blind = watch([person | {"sees_robots": False}], start=(0.0, 0.0, 0.0))
    assert blind.outcome is Outcome.COLLISION
    assert blind.reason == "contact with person 'ann'"


@pytest.mark.parametrize("rule", RULES)
def test_who_follows_a_robot_does_not_run_into_it_when_it_brakes(rule: str) -> None:
    lane = [body(rectangle(20.0, 0.2), 0.0, y, name=f"wall {y}") for y in (0.6, -0.6)]
    person = walker("ann", (-1.5, 0.0), (8.0, 0.0), behaviour=rule)
    for at in (1.6, 2.0, 2.4, 2.8):
        pilot = Pilot(lambda sensing, at=at: Command(0.5 if sensing.t < at else 0.0, 0.0))  # type: ignore[misc]
        trial = watch([person], 6.0, (0.0, 0.0, 0.0), pilot, lane)
        assert trial.outcome is Outcome.TIMEOUT, trial.reason
        assert np.hypot(*(trial.moving_obstacles[:, 0, :2] - trial.pose[:, :2]).T).min() < 0.9  # it does follow


@pytest.mark.parametrize("rule", RULES)
def test_nobody_nears_a_robot_that_stands_so_fast_that_they_would_meet_within_half_a_second(rule: str) -> None:
    trial = watch([walker("ann", (-3.0, 0.0), (4.0, 0.0), behaviour=rule)], 6.0, (0.0, 0.0, 0.0), walls=lane(0.9))
    gap = np.hypot(*(trial.moving_obstacles[:, 0, :2] - trial.pose[:, :2]).T) - 0.5
    nearing = -np.diff(gap) / np.diff(trial.t)
    assert (nearing <= gap[:-1] / IN_TIME + 1e-6).all()
    assert nearing.max() > 0.6  # who is farther away walks on
    assert TOUCH - 1e-6 < gap.min() < 0.7


@pytest.mark.parametrize("rule", RULES)
def test_who_sees_a_robot_come_makes_room_and_who_turns_the_back_is_run_over(rule: str) -> None:
    comes, goes = (walker("ann", (3.0, 0.0), (x, 0.0), speed=0.5, behaviour=rule) for x in (-9.0, 15.0))
    for speed, person, expected in ((0.5, comes, Outcome.TIMEOUT), (1.0, goes, Outcome.COLLISION)):
        trial = watch([person], 10.0, (0.0, 0.0, 0.0), constant(speed), lane(0.9))
        assert trial.outcome is expected, trial.reason
        if expected is Outcome.TIMEOUT:
            assert (
                trial.moving_obstacles[-1, 0, 0] > trial.pose[-1, 0] > 3.0
            )  # where the person was, who has walked back


@pytest.mark.parametrize("rule", RULES)
def test_who_decides_seldom_does_not_run_into_a_robot_that_stands(rule: str) -> None:
    for y in (0.0, 0.1, 0.2, 0.3):
        person = walker("ann", (-4.0, y), (4.0, 0.0), behaviour=rule, decides_every=1.0)
        assert watch([person], start=(0.0, 0.0, 0.0)).outcome is Outcome.TIMEOUT


FLOOR = room_of(OccupancyGrid(np.full((200, 200), FREE, np.int8), 0.1, (-10.0, -10.0)))


def stepped(
    walker: Walker, velocity: tuple[float, float], bodies: Bodies, bound: FloatArray, free: Sequence[bool], dt: float
) -> FloatArray:
    """The velocity (2,) at which `walker` walks who wants to walk at `velocity`."""
    found, n = np.array(velocity), len(bodies.radius)
    age = np.array([0.0] * len(free) + [0.3] * (n - len(free)))
    around = Around(bodies, bound, np.array(free), age, FLOOR, walls_of([]), np.empty((2 * n, 3)))
    keep_off(walker, found, False, around, dt)
    return found


def test_who_makes_room_walks_no_faster_than_it_says() -> None:
    at, moving = np.array([[0.0, 0.0], [0.7, 0.0]]), np.array([[0.0, 0.0], [-2.0, 0.0]])  # a robot drives at her
    bodies = Bodies(at, moving, np.array([0.25, 0.55]), np.array([1, 2]), np.ones(2))
    velocity = stepped(Walker(0, 0.0, 0.0, 0.0, 3, 1.56), (0.3, 1.5), bodies, np.zeros((1, 3)), [True], 0.05)
    assert velocity[0] < 0.0
    assert np.hypot(*velocity) <= 1.56 + 1e-9
    blind = stepped(Walker(0, 0.0, 0.0, 0.0, 1, 1.56), (0.3, 1.5), bodies, np.zeros((1, 3)), [True], 0.05)
    assert blind.tolist() == [0.3, 1.5]


@settings(max_examples=200)
@given(
    far=st.floats(0.4, 4.0), bearing=st.floats(-math.pi, math.pi), v=st.floats(0.8, 1.7), w=st.floats(0.8, 6.5),
    wishes=st.lists(st.floats(-math.pi, math.pi), min_size=20, max_size=20),
)  # fmt: skip
def test_nobody_gets_into_the_way_of_who_has_decided_whatever_they_want(
    far: float, bearing: float, v: float, w: float, wishes: list[float]
) -> None:
    """One decides once a second, the other 20 times, and may want to go anywhere, as onto the way that the first still goes."""
    one, other = np.zeros(2), far * np.array([math.cos(bearing), math.sin(bearing)])
    both = Bodies(np.array([one, other]), np.zeros((2, 2)), np.full(2, 0.25), np.ones(2, np.int64), np.ones(2))
    now = np.column_stack([both.position, np.zeros(2)])
    velocity = stepped(Walker(0, 0.0, 0.0, 0.0, 1, v), (v, 0.0), both, now, [True, True], 1.0)
    end = velocity.copy()
    for k, wish in enumerate(wishes):
        both.position[:] = one, other
        bound = np.array([[*end, 0.0], [*other, 0.0]])
        wanted = (w * math.cos(wish), w * math.sin(wish))
        step = stepped(Walker(1, *other.tolist(), 0.0, 1, w), wanted, both, bound, [k == 0, True], 0.05)
        for share in (0.025, 0.05):
            assert np.hypot(*(one + share * velocity - other - share * step)) > min(0.5 * SLIM, far) - 1e-9
        one, other = one + 0.05 * velocity, other + 0.05 * step


def test_a_recorded_person_who_stands_stays_there() -> None:
    track = [(0.0, 2.0, 0.1), (20.0, 2.0, 0.1)]
    person = {"name": "ann", "start": (2.0, 0.1), "behaviour": "recorded", "track": track}
    assert watch([person], 8.0, (0.0, 0.0, 0.0), constant(0.4)).outcome is Outcome.COLLISION


@pytest.mark.parametrize("gap", [0.545, 0.57, 0.59])
def test_who_would_go_between_a_thing_and_a_robot_touches_neither(gap: float) -> None:
    y = 0.5 + gap
    run = {"leg": "forth", "path": [(-0.05, y), (0.15, y)], "speed": 0.01}
    post = {"name": "post", "shape": {"kind": "disc", "radius": 0.25}, "runs": [run]}
    sides = [body(rectangle(20.0, 0.2), 0.0, at, name=f"wall {at}") for at in (-0.45, y + 0.45)]
    person = walker("ann", (-3.0, 0.5 * y + 0.01), (3.0, 0.5 * y), behaviour="headed-social-force")
    trial = watch([person], 15.0, (0.0, 0.0, 0.0), walls=sides, things=[post])
    assert trial.outcome is Outcome.TIMEOUT, trial.reason
    there = trial.moving_obstacles[:, 1, :2]
    assert np.hypot(*(there - trial.pose[:, :2]).T).min() - 0.5 > TOUCH - 1e-6
    assert np.nanmin(np.hypot(*(there - trial.moving_obstacles[:, 0, :2]).T)) > 0.5


@settings(max_examples=40)
@given(away=st.floats(0.001, 0.03), turned=st.floats(0.0, 3.1), along=st.floats(-1.0, 1.0))
def test_a_child_beside_a_wall_is_not_pushed_through_it(away: float, turned: float, along: float) -> None:
    """Its cell of the floor is one that the wall touches."""
    across, way = np.array([-math.sin(turned), math.cos(turned)]), np.array([math.cos(turned), math.sin(turned)])
    child = along * way + (0.125 + away) * across
    push = child + 0.35 * across
    people = [
        {
            "name": "child",
            "start": tuple(child.tolist()),
            "radius": 0.1,
            "route": [{"at": tuple((-3.0 * across).tolist())}],
        },
        walker("pusher", tuple(push.tolist()), tuple((-3.0 * across).tolist())),
    ]
    wall = [body(rectangle(9.0, 0.05), 0.0, 0.0, turned, name="wall")]
    side = watch(people, 1.5, walls=wall).moving_obstacles[:, 0, :2] @ across
    assert side.min() > 0.0


def test_a_recorded_person_who_makes_room_goes_on_looking_at_the_robot() -> None:
    track = [(0.0, 4.0, 0.0), (20.0, -8.0, 0.0)]
    person = {"name": "ann", "start": (4.0, 0.0), "behaviour": "recorded", "track": track}
    trial = watch([person], 6.0, (0.0, 0.0, 0.0), constant(0.5))
    assert trial.outcome is Outcome.TIMEOUT, trial.reason
    assert np.cos(trial.moving_obstacles[:, 0, 2]).max() < 0.0


@pytest.mark.parametrize("rule", RULES)
def test_who_is_held_up_again_and_again_steps_back(rule: str) -> None:
    trial = watch([walker("ann", (-3.0, 0.0), (4.0, 0.0), behaviour=rule)], 40.0, (0.0, 0.0, 0.0), walls=lane(0.9))
    x = trial.moving_obstacles[:, 0, 0]
    came = int(np.argmax(x > -1.0))
    went = came + int(np.argmin(x[came:-80]))
    assert x[came] > -1.0 > -2.0 > x[went]  # a metre, at least
    assert x[went:].max() > -1.0  # and comes again


@pytest.mark.parametrize(("yields", "outcome"), [(0.6, Outcome.TIMEOUT), (None, Outcome.COLLISION)])
def test_who_stands_steps_aside_or_does_not(yields: float | None, outcome: Outcome) -> None:
    stands = {"name": "ann", "start": (2.0, 0.1), "behaviour": "still", "yields_at": yields}
    trial = watch([stands], 6.0, start=(0.0, 0.0, 0.0), pilot=constant(0.3))
    assert trial.outcome is outcome
    away = 0.25 + 0.25 + BESIDE - 0.1  # from where it stands to where the robot leaves it room
    assert np.ptp(trial.moving_obstacles[:, 0, :2], axis=0).max() == pytest.approx(away if yields else 0.0, abs=1e-6)


def test_who_stands_steps_aside_as_often_as_it_is_in_the_way() -> None:
    """The robot drives past, and backs in an arc over where the person has stepped."""
    pilot = Pilot(lambda sensing: Command(0.5, 0.0) if sensing.t < 6.0 else Command(-0.5, -0.35))
    stands = {"name": "ann", "start": (1.5, 0.1), "behaviour": "still", "yields_at": 0.6}
    trial = watch([stands], 10.0, start=(0.0, 0.0, 0.0), pilot=pilot)
    assert trial.outcome is Outcome.TIMEOUT, trial.reason
    back = trial.t > 6.0
    aside = trial.moving_obstacles[~back, 0, :2][-1]
    assert np.hypot(*(trial.pose[back, :2] - aside).T).min() < 0.3
    assert np.hypot(*(trial.moving_obstacles[-1, 0, :2] - aside)) > 0.3


@settings(max_examples=15)
@given(seed=st.integers(0, 999), rule=st.sampled_from(RULES), v=st.floats(-0.8, 0.8), omega=st.floats(-1.0, 1.0))
def test_no_contact_with_the_robot_is_missed(seed: int, rule: str, v: float, omega: float) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-3.0, 3.0, (6, 2, 2)).round(3).tolist()
    people = [walker(f"p{k}", tuple(a), tuple(b), behaviour=rule, sees_robots=False) for k, (a, b) in enumerate(places)
              if math.hypot(*a) > 0.6]  # fmt: skip
    trial = watch(people, 8.0, start=(0.0, 0.0, 0.0), pilot=constant(v, omega), seed=seed)
    fine = np.arange(0.0, trial.t[-1], 1e-3)
    x, y = (np.interp(fine, trial.t, trial.pose[:, k]) for k in (0, 1))
    for k in range(len(people)):
        px, py = (np.interp(fine, trial.t, trial.moving_obstacles[:, k, c]) for c in (0, 1))
        apart = np.hypot(px - x, py - y) - 0.5
        assert (apart[:-1] > -8e-3).all()  # a line between samples of 0.1 s is off by so much


@settings(max_examples=15)
@given(seed=st.integers(0, 999), rules=st.lists(st.sampled_from(RULES), min_size=8, max_size=8))
def test_nobody_passes_through_anybody_in_a_throng_at_a_door(seed: int, rules: list[str]) -> None:
    places = np.random.default_rng(seed).uniform(-2.5, 2.5, (8, 2, 2)).round(3)
    places[:, 0] = [(side * (0.5 + 0.6 * k), 0.3 * side) for k in range(4) for side in (-1.0, 1.0)]
    people = [walker(f"p{k}", tuple(a), tuple(b), behaviour=rules[k]) for k, (a, b) in enumerate(places.tolist())]
    assert nearest(watch(people, 8.0, walls=WALL, seed=seed)) > 0.5 * SLIM - 1e-9


@settings(max_examples=25)
@given(
    seed=st.integers(0, 999),
    rules=st.lists(st.sampled_from(RULES), min_size=8, max_size=8),
    every=st.lists(st.sampled_from((0.05, 0.1, 0.35, 0.5, 1.0)), min_size=8, max_size=8),
)
def test_nobody_passes_through_anybody_or_a_wall_however_seldom_they_decide(
    seed: int, rules: list[str], every: list[float]
) -> None:
    thin = [body(rectangle(0.05, 6.0), 0.0, side * 3.6, name=f"wall {side}") for side in (-1.0, 1.0)]
    places = np.random.default_rng(seed).uniform(-2.5, 2.5, (8, 2, 2)).round(3)
    places[:, 0] = [(side * (0.5 + 0.6 * k), 0.3 * side) for k in range(4) for side in (-1.0, 1.0)]
    people = [
        walker(f"p{k}", tuple(a), tuple(b), behaviour=rules[k], decides_every=every[k])
        for k, (a, b) in enumerate(places.tolist())
    ]
    trial = watch(people, 8.0, walls=thin, seed=seed)
    assert nearest(trial) > 0.5 * SLIM - 1e-9
    x, y = trial.moving_obstacles[..., 0], trial.moving_obstacles[..., 1]
    for k in range(8):
        for n in np.flatnonzero(x[1:, k] * x[:-1, k] < 0.0):
            share = x[n, k] / (x[n, k] - x[n + 1, k])
            assert abs(y[n, k] + share * (y[n + 1, k] - y[n, k])) < 0.6


def bed(name: str, y: float, way: float = 1.0) -> dict[str, Any]:
    """A bed that is pushed along x."""
    shape = {"kind": "rectangle", "length": 2.1, "width": 0.96}
    run = {"leg": "forth", "path": [(-4.0 * way, y), (4.0 * way, y)], "speed": 0.6}
    return {"name": name, "shape": shape, "behaviour": {}, "runs": [run]}


@pytest.mark.parametrize(
    ("first", "second"),
    [(("orca", 0.5), ("social-force", 0.5)), (("social-force", 0.5), ("social-force", 0.05)),
     (("headed-social-force", 0.05), ("social-force", 0.05)), (("orca", 1.0), ("headed-social-force", 0.35))],
)  # fmt: skip
def test_which_crowd_is_listed_first_changes_no_bit(first: tuple[str, float], second: tuple[str, float]) -> None:
    """Two meet in a lane, and each leaves the other half of the room, or what it has decided for."""
    people = [
        walker("ann", (-1.2, 0.05), (3.0, 0.0), behaviour=first[0], decides_every=first[1]),
        walker("bob", (1.2, 0.0), (-3.0, 0.0), behaviour=second[0], decides_every=second[1]),
    ]
    one, other = (watch(order, 8.0, walls=lane(0.9)).moving_obstacles for order in (people, people[::-1]))
    assert np.array_equal(one, other[:, ::-1])
    assert nearest(watch(people, 8.0, walls=lane(0.9))) > 0.5 * SLIM - 1e-9


@pytest.mark.parametrize("rule", RULES)
def test_in_which_order_beds_are_listed_changes_no_bit(rule: str) -> None:
    """Who stands between two of them that come makes room for both."""
    people = [walker(f"p{k}", (0.2 * k, -0.5 + 0.5 * k), (-6.0, 0.2), behaviour=rule) for k in range(3)]
    things = [bed("one", 0.8), bed("two", -0.8), bed("three", 0.1, -1.0)]
    one, other = (watch(people, 12.0, things=t).moving_obstacles for t in (things, things[::-1]))
    assert np.array_equal(one[:, 3:], other[:, 3:])
    assert np.array_equal(one[:, :3], other[:, 2::-1], equal_nan=True)


def test_who_steps_aside_does_so_as_far_as_there_is_room() -> None:
    stands = {"behaviour": "still", "yields_at": 1.5}
    people = [stands | {"name": "ann", "start": (2.0, 0.1)}, stands | {"name": "bob", "start": (3.0, 0.1)}]
    wall = [body(rectangle(20.0, 0.1), 0.0, 0.5, name="wall")]
    trial = watch(people, 8.0, start=(0.0, -0.5, 0.0), pilot=constant(0.4), walls=wall)
    assert trial.outcome is Outcome.TIMEOUT, trial.reason
    moved = np.ptp(trial.moving_obstacles[:, :, 1], axis=0)
    assert (moved > 0.05).all()
    assert trial.moving_obstacles[:, :, 1].max() < 0.45 - SLIM * 0.25 + 0.1  # up to a cell
    beside = [
        stands | {"name": "ann", "start": (2.0, 0.1)},
        {"name": "bob", "start": (2.0, 0.65), "behaviour": "still"},
    ]
    assert nearest(watch(beside, 8.0, start=(0.0, -0.5, 0.0), pilot=constant(0.4))) > 0.5 * SLIM - 1e-9


def test_who_is_pushed_off_a_recorded_way_keeps_off_walls_and_others_and_hurries_no_more_than_it_says() -> None:
    wall = [body(rectangle(20.0, 0.05), 0.0, 0.4, name="wall")]
    track = [(0.0, 4.0, 0.1), (10.0, -4.0, 0.1), (30.0, -4.5, 0.1)]
    people = [
        {"name": "ann", "start": (4.0, 0.1), "behaviour": "recorded", "track": track},
        {"name": "bob", "start": (1.5, -0.5), "behaviour": "still"},
    ]
    trial = watch(people, 15.0, (-1.0, -0.3, 0.0), constant(0.1), wall)
    ann = trial.moving_obstacles[:, 0, :2]
    assert np.ptp(ann[:, 1]) > 0.05  # she is pushed
    assert ann[:, 1].max() < 0.375 - SLIM * 0.25 + 0.1  # up to a cell
    assert nearest(trial) > 0.5 * SLIM - 1e-9
    assert (np.hypot(*np.diff(ann, axis=0).T) / np.diff(trial.t)).max() <= FASTER * 0.8 + 1e-9


@pytest.mark.parametrize("period", [1.27, 1.29, 10.0])
def test_people_see_a_robot_that_decides_seldom_all_the_way(period: float) -> None:
    """It drives towards her at 0.2 m/s, and she goes round it."""
    person = walker("ann", (4.0, 0.05), (-4.0, 0.0))
    trial = watch([person], 20.0, (0.0, 0.0, 0.0), constant(0.2), period=period)
    assert trial.outcome is Outcome.TIMEOUT
    assert ends(trial, [person])[0] < 0.3


@settings(max_examples=15)
@given(seed=st.integers(0, 999), rule=st.sampled_from(RULES[1:]))
def test_nobody_is_pressed_into_a_robot_that_stands(seed: int, rule: str) -> None:
    """Two streams meet in a corridor where it leaves half a metre to either side."""
    aside = np.random.default_rng(seed).uniform(-0.6, 0.6, 12).round(3).tolist()
    people = [
        walker(f"p{k}", (side * (1.5 + 0.4 * k), aside[k]), (-6.0 * side, aside[k]), behaviour=rule)
        for k in range(12)
        for side in [1.0 if k % 2 else -1.0]
    ]
    lane = [body(rectangle(20.0, 0.2), 0.0, y, name=f"wall {y}") for y in (1.0, -1.0)]
    assert watch(people, 12.0, (0.0, 0.0, 0.0), walls=lane, seed=seed).outcome is Outcome.TIMEOUT


@settings(max_examples=15)
@given(
    seed=st.integers(0, 999),
    rules=st.lists(st.sampled_from(RULES), min_size=8, max_size=8),
    sees=st.lists(st.booleans(), min_size=8, max_size=8),
    v=st.sampled_from((0.0, 0.9)),
)
def test_nobody_is_given_energy(seed: int, rules: list[str], sees: list[bool], v: float) -> None:
    """In a throng at a door nobody is ever faster than contact is looked for, and a robot drives as it is told, whoever pushes."""
    places = np.random.default_rng(seed).uniform(-2.5, 2.5, (8, 2, 2)).round(3)
    places[..., 0] += np.copysign(0.4, places[..., 0])  # not in the wall
    people = [
        walker(f"p{k}", tuple(a), tuple(b), behaviour=rules[k], sees_robots=sees[k])
        for k, (a, b) in enumerate(places.tolist())
    ]
    trial = watch(people, 8.0, start=(-3.5, 0.0, 0.0), pilot=constant(v), walls=WALL, seed=seed)
    dt = np.diff(trial.t)
    walked = np.hypot(*np.moveaxis(np.diff(trial.moving_obstacles[:, :, :2], axis=0), -1, 0))
    assert (walked <= FASTER * 1.2 * dt[:, None] + 1e-9).all()
    assert trial.t[-1] > 0.5
    driven = trial.velocity[:, 0]
    assert 0.0 <= driven.min() <= driven.max() <= v
    assert (np.diff(driven) <= 0.5 * dt + 1e-9).all()
    assert np.diff(trial.pose[:, 0]) == pytest.approx(0.5 * (driven[1:] + driven[:-1]) * dt, abs=1e-3)
