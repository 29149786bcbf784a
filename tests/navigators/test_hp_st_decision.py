"""What a decision is worth while the assumptions hold: at a contact the robot stands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from space_time_scenes import OTHER, OWN, PERIOD, SQUARE, Drive, Path, begun, drive, foreseen, line, obstacles

from clearway.contract import Budget, Latency, Task
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.assembly import assemble
from clearway.navigators.hp_st.environment.field import make_field
from clearway.navigators.hp_st.environment.sight import sees, sight_of
from clearway.navigators.hp_st.parameters import Parameters
from clearway.navigators.hp_st.ways import pose_scene, weigh
from clearway.robots import load_robot

BOUND = 1.25
"""Assumed of the obstacles' acceleration, m/s^2; of their speed 4.4 m/s."""
SEEN = 4.0
ENOUGH = Budget(iterations=10**9)


class Pursuers:
    """Discs that come at the robot as fast as the assumed bounds let them; perceived within 4 m."""

    def __init__(self, seed: int, count: int) -> None:
        rng = np.random.default_rng(seed)
        angle, far = rng.uniform(0.0, math.tau, count), rng.uniform(2.2, 6.0, count)
        self.at = np.column_stack([3.0 + far * np.cos(angle), far * np.sin(angle)])
        self.at[np.hypot(*self.at.T) < 2.2] += 4.0
        self.velocity = rng.uniform(-0.5, 0.5, (count, 2))
        self.rng, self.t = rng, 0.0

    def move(self, t: float, pose: FloatArray) -> bool:
        """Whether one touches a robot at `pose`, having moved on to `t`."""
        dt = t - self.t
        self.t = t
        to = pose[:2] - self.at
        push = 0.99 * BOUND * to / np.hypot(*to.T)[:, None]
        after = self.velocity + push * dt
        speed = np.hypot(*after.T)
        slow = speed > 3.0  # the bound is 4.4
        after[slow] = self.velocity[slow]
        self.at = self.at + 0.5 * (self.velocity + after) * dt
        self.velocity = after
        return bool((np.hypot(*(self.at - pose[:2]).T) < OWN + OTHER).any())

    def look(self, t: float, pose: FloatArray) -> Any:
        near = np.flatnonzero(np.hypot(*(self.at - pose[:2]).T) - OTHER <= SEEN)
        angle, far = self.rng.uniform(0.0, math.tau, len(near)), 0.01 * np.sqrt(self.rng.random(len(near)))
        error = np.column_stack([far * np.cos(angle), far * np.sin(angle)])
        return obstacles(self.at[near] + error, names=near)


SEEDS = range(10)


def pursued(guarantee: str, seed: int) -> Drive:
    obstacles = Pursuers(seed, 8)
    return drive(
        begun(guarantee=guarantee), (6.0, 0.0), obstacles.look, 80, push=0.01, seed=seed, touches=obstacles.move
    )


def test_at_a_contact_it_stands() -> None:
    """Whoever is pursued by all that keeps to the bounds can't get away for ever, but doesn't move then."""
    contacts, driven = 0, 0.0
    for seed in SEEDS:
        went = pursued("passive", seed)
        assert went.violated == []
        driven += sum(abs(c.v) for c in went.commands) * PERIOD
        if went.contact is not None:
            contacts += 1
            assert (went.contact.v, went.contact.omega) == (0.0, 0.0)
    assert contacts >= 4
    assert driven > 20.0  # m: it doesn't just stand


def test_without_a_guarantee_it_moves_at_contacts() -> None:
    """In the same scenes: so the test above says something."""
    contacts = [went.contact for seed in SEEDS if (went := pursued("none", seed)).contact is not None]
    assert sum(c.v != 0.0 for c in contacts) >= 2


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_more_disturbance_than_assumed_is_said(factor: float) -> None:
    went = drive(begun(), (6.0, 1.0), periods=60, push=0.01 * factor, seed=3)
    assert went.arrived
    assert bool(went.violated) == (factor > 1.0)


def test_an_obstacle_that_is_too_fast_is_said() -> None:
    went = drive(begun(), (6.0, 0.0), lambda t, pose: obstacles([(-6.0 + 6.0 * t, 3.5)]), 15)
    assert any("obstacle 0" in text and "4.4 m/s" in text for text in went.violated)


def test_nothing_is_certified_where_something_may_come_at_once_and_it_stays() -> None:
    """Touching all round: no motion is safe, so it stands, although the goal is near."""
    ring = [(0.72 * math.cos(a), 0.72 * math.sin(a)) for a in np.linspace(0.0, math.tau, 9)[:-1]]
    went = drive(begun(), (3.0, 0.0), lambda t, pose: obstacles(ring), 10)
    assert {(c.v, c.omega) for c in went.commands} == {(0.0, 0.0)}
    assert {c.status for c in went.commands} <= {"stored", "stopped", "planned", "kept"}


def test_where_nothing_is_certified_evasive_goes_where_nobody_is_expected_and_passive_stays() -> None:
    """Who stands at either side could be at it before it has braked; the way ahead is free."""

    def beside(t: float, pose: FloatArray) -> Any:
        return obstacles([(0.0, OWN + OTHER + 0.05), (0.0, -OWN - OTHER - 0.05)])

    stood, went = (drive(begun(guarantee=name), (3.0, 0.0), beside, 30) for name in ("passive", "evasive"))
    assert {(c.v, c.omega) for c in stood.commands} == {(0.0, 0.0)}
    assert [c.status for c in went.commands[:2]] == ["stored", "evading"]  # not for a single period
    assert went.commands[-1].status not in ("evading", "stored")
    assert went.arrived


def test_within_proceed_horizon_alone_a_risk_keeps_evasive_from_driving_on() -> None:
    """Nothing is certified between two who go along with it; 2 m ahead others bar the way."""
    gate = [(2.0, 0.7 * i) for i in range(-3, 4)]
    room = OWN + OTHER + 0.05

    def among(t: float, pose: FloatArray) -> Any:
        return obstacles([(pose[0], room), (pose[0], -room), *gate])

    whole, soon = (
        drive(
            begun(contact_cost=0.5, halt_cost=0.0, proceed=0.02, proceed_horizon=horizon), (6.0, 0.0), among, 40
        )
        for horizon in (60.0, 0.5)
    )  # fmt: skip
    assert {c.v for c in whole.commands} == {0.0}
    ends = float(soon.poses[-1][0])
    assert 0.5 < ends < 2.0 - OWN - OTHER
    assert soon.commands[-1].v == 0.0
    assert soon.contact is None


@pytest.mark.parametrize(("name", "again"), [("tiago", False), ("rescue", True), ("rescue:lidar", True)])
def test_evading_it_drives_only_where_it_looks_and_searches_again_only_for_what_the_first_search_leaves_out(
    name: str, again: bool
) -> None:
    robot = load_robot(name)
    task = Task(robot.period, 0.6, np.zeros(3), latency=Latency(robot.latency.sensing, robot.latency.command))
    evasion = assemble(Parameters.read(robot), task, robot, "evasive", ()).evasion
    free = assemble(Parameters.read(robot), task, robot, "none", ()).base.limits
    behind = sees(sight_of(robot, Parameters.read(robot).scan_range), math.pi, 0.0)
    assert free.v_min < 0.0
    assert evasion.base.limits == (free if behind else free._replace(v_min=0.0))
    assert evasion.again == again


def test_it_evades_what_comes_at_it_at_rest() -> None:
    """It stands at its goal's side, waiting; a disc comes that would touch it."""
    gaps = []

    def coming(t: float, pose: FloatArray) -> Any:
        at = (-3.0 + 1.0 * t, 0.02)
        gaps.append(math.dist(at, pose[:2]))
        return obstacles([at])

    went = drive(begun(guarantee="none"), (8.0, 0.0), coming, 60, start=(0.0, 0.0, math.pi / 2))
    assert min(gaps) > OWN + OTHER
    assert went.contact is None


def test_the_risk_of_contact_is_a_probability_of_being_touched_by_what_moves() -> None:
    """What nearness to furniture costs, and that it grows against a contact's cost the later it comes, is none of it."""
    navigator = begun(load_robot("tiago"), 0.6)
    settings, base = navigator._settings, navigator._base
    n, reach = settings.periods, base.foot.circumscribed
    wall = [(x, side * (reach + 0.1), 0.0) for x in np.linspace(-1.0, 1.0, 41) for side in (-1.0, 1.0)]

    def standing(moving: list[Path]) -> float:
        forecast = foreseen(wall, moving, settings.period, n)
        grown = forecast.still + np.array((0.0, 0.0, reach))
        field = make_field(np.array((5.0, 0.0, 0.0)), grown, SQUARE)
        scene = pose_scene(
            settings, base, navigator._memory, forecast, field, SQUARE, navigator._wishes, navigator._safety, np.zeros(3)
        )  # fmt: skip
        return float(weigh(scene, np.zeros((n, 2)), np.empty((n + 1, 5)))[2])

    assert standing([]) == 0.0
    assert standing([line(-2.0, 0.0, 1.0, 0.0)] * 3) == 1.0


def test_a_search_that_would_be_no_wider_is_not_made() -> None:
    """No way past the disc costs nothing, so each decision with a threshold of 0 s asks for the wide search."""
    spent = []
    for wide in (24, 25):
        navigator = begun(narrow=24, wide=wide, low_cost_threshold=0.0, budget=ENOUGH)
        drive(navigator, (6.0, 0.0), lambda t, pose: obstacles([(1.5, 0.0)]), periods=1)
        spent.append(navigator.diagnostics().iterations)
    assert 1.5 * spent[0] < spent[1] < 2.5 * spent[0]


def searched(budget: Budget | None) -> tuple[list[tuple[float, float]], int]:
    """What is commanded among pursuers, and how many nodes that takes."""
    navigator, pursuers, nodes = begun(budget=budget), Pursuers(3, 8), []

    def look(t: float, pose: FloatArray) -> Any:
        nodes.append(navigator.diagnostics().iterations)
        return pursuers.look(t, pose)

    went = drive(navigator, (6.0, 0.0), look, 40, touches=pursuers.move)
    return [(c.v, c.omega) for c in went.commands], sum(nodes)


def test_a_narrow_search_that_finds_nothing_cheap_is_broken_off_and_the_decisions_are_the_same() -> None:
    """Whoever counts nodes searches to the end, as what is left decides how wide the next search is."""
    (whole, most), (commands, spent) = searched(ENOUGH), searched(None)
    assert commands == whole
    assert len(set(commands)) > 5
    assert spent < 0.95 * most
