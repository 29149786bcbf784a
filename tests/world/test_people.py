"""People who walk, by ORCA or by social forces: along routes, in groups, at the speeds of people."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from watched_people import RULES, WALL, ends, nearest, walker, watch
from worlds import constant, make_scenario

from clearway.contract import BodyKind
from clearway.scenarios.people import PersonSpec
from clearway.world.behaviours.wishes import speed_of


@pytest.mark.parametrize("rule", RULES)
def test_who_walks_alone_walks_straight_at_the_preferred_speed_and_stays_there(rule: str) -> None:
    people = [walker("ann", (-4.0, 0.0), (4.0, 0.0), behaviour=rule)]
    trial = watch(people)
    way = trial.moving_obstacles[:, 0]
    assert np.hypot(*np.diff(way[20:55, :2], axis=0).T) == pytest.approx(0.12, abs=2e-3)
    assert np.abs(way[:, 1]).max() < 0.15
    assert ends(trial, people)[0] < 0.05
    assert trial.attempt.bodies[0].kind is BodyKind.PERSON


@pytest.mark.parametrize("rule", RULES)
def test_who_decides_seldom_walks_straight_in_between_and_arrives_all_the_same(rule: str) -> None:
    people = [
        walker("ann", (-4.0, 0.1), (4.0, 0.0), behaviour=rule, decides_every=0.4),
        walker("bob", (4.0, 0.0), (-4.0, 0.1), behaviour=rule),
    ]
    trial = watch(people)
    steps = np.diff(trial.moving_obstacles[:, :, :2], axis=0)  # of 0.1 s
    turns = np.hypot(*np.diff(steps, axis=0).T)  # (people, samples)
    decided = np.arange(turns.shape[1]) % 4 == 3
    assert turns[0, ~decided].max() < 1e-9
    assert turns[0, decided].max() > 1e-4
    assert turns[1, ~decided].max() > 1e-4
    assert ends(trial, people).max() < 0.3


@pytest.mark.parametrize("rule", RULES)
def test_eight_who_want_through_each_other_arrive_and_nobody_walks_through_anybody(rule: str) -> None:
    at = [(5.0 * math.cos(math.tau * k / 8), 5.0 * math.sin(math.tau * k / 8)) for k in range(8)]
    people = [walker(f"p{k}", p, (-p[0], -p[1]), behaviour=rule) for k, p in enumerate(at)]
    trial = watch(people, 30.0)
    assert ends(trial, people).max() < 0.3
    assert nearest(trial) > (0.49 if rule == "orca" else 0.35)  # forces are soft: shoulders touch


@pytest.mark.parametrize("rule", RULES)
def test_a_crowd_uses_the_door_and_nobody_comes_through_the_wall(rule: str) -> None:
    people = [
        walker(f"p{k}", (-3.0 - 0.8 * (k % 3), -1.0 + 0.9 * (k // 3)), (3.0, -2.0 + 0.8 * k), behaviour=rule)
        for k in range(6)
    ]
    trial = watch(people, 25.0, walls=WALL)
    m = trial.moving_obstacles
    assert (m[-1, :, 0] > 1.5).all()
    within = np.abs(m[..., 0]) < 0.1
    assert np.abs(m[..., 1][within]).max() < 0.6 - 0.1
    assert within.any()


def test_who_sees_nobody_walks_the_same_whatever_the_robot_does() -> None:
    person = walker("ann", (-4.0, 1.0), (4.0, 1.0), sees_robots=False)
    still, drives = watch([person]), watch([person], start=(-4.0, -3.0, 0.0), pilot=constant(0.8, 0.3))
    n = min(len(still.t), len(drives.t))
    assert np.array_equal(still.moving_obstacles[:n], drives.moving_obstacles[:n])


def test_the_order_in_a_file_changes_nothing_but_the_order() -> None:
    people = [walker(f"p{k}", (-4.0, 0.6 * k), (4.0, 1.2 - 0.6 * k), behaviour="social-force") for k in range(3)]
    one, other = watch(people, 8.0), watch(people[::-1], 8.0)
    assert other.moving_obstacles[:, ::-1] == pytest.approx(one.moving_obstacles, abs=1e-9)


def test_a_route_with_waits_that_begins_anew() -> None:
    person = walker("ann", (0.0, 0.0), (3.0, 0.0), (0.0, 0.0), wait=2.0, loop=True)
    x, t = watch([person], 25.0).moving_obstacles[:, 0, 0], np.arange(251) * 0.1
    far, near = t[x > 2.9], t[(x < 0.1) & (t > 5.0)]
    assert np.diff(far).max() > 5.0  # it came twice
    stood = far[far < 10.0]
    assert stood[-1] - stood[0] == pytest.approx(2.0, abs=0.7)
    assert near.size


def test_a_group_stays_together() -> None:
    def spread(group: str) -> float:
        people = [
            walker(f"p{k}", (-6.0, y), (6.0, 2.0 * y), group=group, speed=1.0 + 0.1 * k)
            for k, y in enumerate((-0.5, 0.5))
        ]
        m = watch(people, 9.0).moving_obstacles
        return float(np.hypot(*(m[60:, 0, :2] - m[60:, 1, :2]).T).mean())

    assert spread("friends") < 0.8 * spread("")


def visitors(rule: str = "social-force") -> list[dict[str, Any]]:
    """Two who go about together, between places 0.8 m apart and 2.5 m apart; one is slow."""
    share: dict[str, Any] = {"wait": 1.0, "loop": True, "group": "visitors", "behaviour": rule}
    return [
        walker("ann", (0.0, 0.4), (5.0, 0.4), (-1.0, 1.2), **share),
        walker("bob", (0.0, -0.4), (5.0, -0.4), (-1.0, -1.3), **share | {"speed": 0.5}),
    ]


@pytest.mark.parametrize("rule", RULES[1:])
def test_who_belongs_to_a_group_walks_on_when_all_of_it_have_come_and_stayed(rule: str) -> None:
    people = visitors(rule)
    m = watch(people, 40.0).moving_obstacles[:, :, :2]
    t, near = np.arange(len(m)) * 0.1, np.empty((2, len(m)))
    for k, person in enumerate(people):
        near[k] = np.hypot(*(m[:, k] - person["route"][0]["at"]).T)
    came = [t[near[k] <= 0.3][0] for k in range(2)]
    left = [t[(t > came[k]) & (near[k] > 0.35)][0] for k in range(2)]
    assert came[1] - came[0] > 1.5
    assert min(left) >= came[1] + 0.9
    for k, person in enumerate(people):  # and then to the next, however far apart
        apart = np.hypot(*(m[t > left[k], k] - person["route"][1]["at"]).T)
        assert apart.min() <= 0.3


def test_in_which_order_a_group_is_listed_changes_nothing_but_the_order() -> None:
    one, other = watch(visitors(), 30.0), watch(visitors()[::-1], 30.0)
    assert other.moving_obstacles[:, ::-1] == pytest.approx(one.moving_obstacles, abs=1e-9)


def test_one_of_a_group_who_goes_no_further_keeps_nobody() -> None:
    ann, bob = visitors()
    bob["route"], bob["loop"] = bob["route"][:1], False
    x = watch([ann, bob], 40.0).moving_obstacles[:, 0, 0]
    assert (np.abs(np.diff((x > 2.0).astype(int))).sum()) >= 2  # there, and away again


def test_preferred_speeds_are_drawn_from_what_is_published() -> None:
    drawn = [speed_of(PersonSpec(name=f"p{k}", start=(0.0, 0.0)), 3) for k in range(2000)]
    assert np.mean(drawn) == pytest.approx(1.34, abs=0.02)
    assert np.std(drawn) == pytest.approx(0.26 * 0.88, abs=0.02)  # cut at two standard deviations
    assert 0.82 <= min(drawn) < max(drawn) <= 1.86
    assert (
        speed_of(PersonSpec(name="p0", start=(9.0, 9.0)), 3)
        == drawn[0]
        != speed_of(PersonSpec(name="p0", start=(0.0, 0.0)), 4)
    )


@pytest.mark.parametrize(
    ("change", "word"),
    [({"speed": 0.0}, "greater"), ({"radius": 3.0}, "less"), ({"behaviour": "walks"}, "orca"), ({"reaction": -1.0}, "greater"), ({"decides_every": 0.07}, "multiple"),
     ({"route": [{"at": (0.0, 0.0), "wait": -1.0}]}, "greater"), ({"nonsense": 1}, "nonsense"), ({"name": ""}, "least 1")],
)  # fmt: skip
def test_what_nobody_can_mean_is_refused(change: dict[str, Any], word: str) -> None:
    with pytest.raises(ValidationError, match=word):
        make_scenario(people=[walker("ann", (0.0, 0.0)) | change])
