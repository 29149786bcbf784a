"""A differential drive that follows ORCA's velocities, and the social force model's: how exactly, and past whom."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.contract import Goal, Latency, Observation, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.motion import arc
from clearway.navigators.common.holonomic import follow, turning_time
from clearway.navigators.orca import Orca
from clearway.navigators.orca.decision import SIDES, Rules, followed
from clearway.navigators.social_force import SocialForceNavigator
from clearway.robots import load_robot, possible
from perceived import exact

RADIUS, PERIOD = 0.25, 0.1
ROBOT = load_robot("rescue").model_copy(update={"period": PERIOD})


def tracking_error(speed: float, turn: float, time: float, omega_max: float) -> float:
    """How far, m, a base gets off a velocity of `speed` [m/s] at the angle `turn` [rad] to its heading.

    Up to 90 degrees it is what the best speed along the arc leaves; beyond, the base turns on the spot meanwhile.
    """
    way = speed * turning_time(turn, time, omega_max)
    return way * abs(math.sin(0.5 * turn)) if abs(turn) <= 0.5 * math.pi else way


@given(st.floats(0.01, 1.0), st.floats(-math.pi, math.pi), st.floats(0.2, 1.0), st.floats(0.5, 3.0))
def test_the_tracking_error_is_that_of_the_arc(speed, turn, time, omega_max):
    v, omega = follow(speed * math.cos(turn), speed * math.sin(turn), 0.0, time, math.inf, omega_max)
    t = turning_time(turn, time, omega_max)
    x, y, theta = arc(0.0, 0.0, 0.0, v, omega, t)
    off = math.hypot(x - speed * t * math.cos(turn), y - speed * t * math.sin(turn))
    assert math.cos(theta - turn) == pytest.approx(1.0)
    assert off == pytest.approx(tracking_error(speed, turn, time, omega_max), abs=1e-5)
    if abs(turn) <= 0.5 * math.pi:  # no other speed gets nearer
        for other in np.linspace(0.0, 2.0 * speed, 21):
            x, y, _ = arc(0.0, 0.0, 0.0, other, omega, t)
            assert math.hypot(x - speed * t * math.cos(turn), y - speed * t * math.sin(turn)) >= off - 1e-6


@given(
    st.floats(-math.pi, math.pi), st.floats(0.01, 0.2), st.floats(0.2, 1.0), st.floats(0.5, 3.0), st.integers(0, 10**6)
)
def test_velocities_of_the_polygon_are_followed_as_exactly_as_they_are_to_be(theta, error, time, omega_max, seed):
    lines = np.empty((SIDES, 4))
    followed(theta, error, Rules(5.0, 10, 3.0, 1.0, error, time, 0.8, omega_max, PERIOD, False), lines)
    tried = np.random.default_rng(seed).uniform(-0.8, 0.8, (300, 2)) * (1.0, 0.5)
    tried = tried @ np.array(((math.cos(theta), math.sin(theta)), (-math.sin(theta), math.cos(theta))))
    off = lines[:, 2] * (lines[:, 1] - tried[:, 1:]) - lines[:, 3] * (lines[:, 0] - tried[:, :1])
    inside = tried[(off <= 0.0).all(1)]
    for vx, vy in inside:
        turn = (math.atan2(vy, vx) - theta + math.pi) % (2 * math.pi) - math.pi
        assert tracking_error(math.hypot(vx, vy), turn, time, omega_max) <= error * (1.0 + 1e-9)
    ahead = np.array((0.8 * math.cos(theta), 0.8 * math.sin(theta)))
    assert (lines[:, 2] * (lines[:, 1] - ahead[1]) - lines[:, 3] * (lines[:, 0] - ahead[0]) <= 1e-9).all()


def others(poses, velocities, but):
    """What robot `but` perceives of the others."""
    mask = np.arange(len(poses)) != but
    heading = np.column_stack((np.cos(poses[mask, 2]), np.sin(poses[mask, 2])))
    return exact(poses[mask, :2], velocities[mask, :1] * heading, RADIUS, identity=np.flatnonzero(mask))


def drive(navigators, poses, goals, duration, sees=others):
    """The robots drive, each by its navigator and its base's limits of speed; the smallest gap on the way, and where they end."""
    n, gap = len(poses), math.inf
    velocities, arrived = np.zeros((n, 2)), np.zeros(n, bool)
    goals = [Goal(np.array((*g, 0.0)), 0.2, math.pi) for g in goals]
    for navigator, pose in zip(navigators, poses, strict=True):
        navigator.reset(Task(PERIOD, 0.8, pose.copy()), ROBOT, np.random.default_rng(0))
    for k in range(int(duration / PERIOD)):
        commands = [
            navigator.step(Observation(k * PERIOD, poses[i].copy(), velocities[i].copy(), poses[i].copy(), goals[i], None, sees(poses, velocities, i)))
            for i, navigator in enumerate(navigators)
        ]  # fmt: skip
        arrived |= [bool(c.arrived) for c in commands]
        velocities = np.array([(c.v, c.omega) if not c.arrived else (0.0, 0.0) for c in commands])
        for _ in range(5):
            poses = np.array([arc(*p, *v, PERIOD / 5) for p, v in zip(poses, velocities, strict=True)])
            i, j = np.triu_indices(n, 1)
            if n > 1:
                gap = min(gap, float(np.hypot(*(poses[i, :2] - poses[j, :2]).T).min()) - 2 * RADIUS)
    return gap, poses, arrived


@pytest.mark.parametrize(("n", "seed"), [(2, 5), (3, 0), (6, 3)])
def test_robots_that_change_places_across_a_circle_touch_nobody(n, seed):
    """Two get there; more may stand before each other in the middle, as ORCA's do."""
    angle = 2 * np.pi * (np.arange(n) + np.random.default_rng(seed).uniform(-0.15, 0.15, n)) / n
    at = 3.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    poses = np.column_stack((at, angle + np.pi))
    gap, _, arrived = drive([Orca() for _ in range(n)], poses, -at, 15.0)
    assert gap > 0.0
    assert arrived.all() or n > 2


@pytest.mark.parametrize("make", [Orca, SocialForceNavigator])
def test_a_mirrored_meeting_goes_mirrored_ways(make):
    start, goal = np.array(((-3.0, 0.1, 0.0), (3.0, -0.1, math.pi))), [(3.0, 0.1), (-3.0, -0.1)]
    mirror = np.array((1.0, -1.0, -1.0))
    _, here, _ = drive([make(), make()], start, goal, 5.0)
    _, there, _ = drive([make(), make()], start * mirror, [(x, -y) for x, y in goal], 5.0)
    turned = (there * mirror - here)[:, 2]
    assert np.abs((there * mirror - here)[:, :2]).max() < 1e-6
    assert np.abs((turned + math.pi) % (2 * math.pi) - math.pi).max() < 1e-6
    assert abs(here[0, 1] - 0.1) > 0.02  # each gave way


@pytest.mark.parametrize("make", [Orca, SocialForceNavigator])
def test_around_what_stands_in_the_way(make):
    """A disc that stands before the goal, and none of it on any map."""

    def sees(poses, velocities, i):
        return exact((0.0, 0.05), radius=0.4, moving=False)

    _, poses, arrived = drive([make()], np.array(((-3.0, 0.0, 0.0),)), [(3.0, 0.0)], 20.0, sees)
    assert arrived.all()
    assert np.hypot(*(poses[0, :2] - (3.0, 0.0))) < 0.2


@pytest.mark.parametrize("make", [Orca, SocialForceNavigator])
def test_without_a_way_it_stands_and_says_so(make):
    cells = np.zeros((60, 60), np.int8)
    cells[:, 30] = 100
    task = Task(PERIOD, 0.8, np.zeros(3), map=OccupancyGrid(cells, 0.1, (-3.0, -3.0)))
    navigator, pose = make(), np.array((-1.0, 0.0, 0.0))
    navigator.reset(task, ROBOT, np.random.default_rng(0))
    goal = Goal(np.array((2.0, 0.0, 0.0)), 0.2, math.pi)
    command = navigator.step(
        Observation(0.0, pose, np.zeros(2), pose, goal, None, others(pose[None], np.zeros((1, 2)), 0))
    )
    assert command.status == "no path"
    assert abs(command.v) < 1e-9


@pytest.mark.parametrize(("make", "option"), [(Orca, "horizon"), (SocialForceNavigator, "relaxation")])
def test_a_wrong_option_is_told_at_once(make, option):
    with pytest.raises(ClearwayError, match=option):
        make(**{option: -1.0})


@pytest.mark.parametrize("make", [Orca, SocialForceNavigator])
def test_an_omnidirectional_base_goes_to_its_side_at_once(make):
    """The goal lies to its left, in the open: it moves there while it turns, and within what the base can hold."""
    pepper = load_robot("pepper")
    navigator, pose = make(), np.zeros(3)
    navigator.reset(Task(PERIOD, 0.5, pose), pepper, np.random.default_rng(0))
    goal = Goal(np.array((0.0, 3.0, 0.0)), 0.2, math.pi)
    nothing = exact()
    command = navigator.step(Observation(0.0, pose, np.zeros(3), pose, goal, None, nothing))
    assert command.v_y == pytest.approx(0.5, abs=0.01)
    assert abs(command.v) < 0.05
    assert command.omega > 0.5
    limits = pepper.limits(0.5)
    told = command.v, command.omega, command.v_y
    assert possible(limits, *told) == pytest.approx(told)
    with pytest.raises(ValueError, match="velocity"):
        navigator.step(Observation(PERIOD, pose, np.zeros(2), pose, goal, None, nothing))


@pytest.mark.parametrize("made", [Orca, SocialForceNavigator])
@pytest.mark.parametrize("name", ["tiago", "tiago-omni"])
def test_who_senses_and_acts_late_decides_for_when_its_command_is_followed(made, name):
    """It commands what one that isn't late does, who sees what will be by then."""
    robot, late = load_robot(name), 0.4
    omni = name == "tiago-omni"
    velocity = np.array((0.4, 0.0, 0.2)) if omni else np.zeros(2)
    pose = np.array((1.0, 2.0, 0.0))
    rolled = pose + late * np.array((0.4, 0.2, 0.0)) if omni else pose

    def command(latency, pose, x):
        navigator = made()
        navigator.reset(Task(robot.period, 0.8, pose.copy(), latency=latency), robot, np.random.default_rng(0))
        seen = exact((x, 2.3), (-0.6, 0.0), 0.3)
        goal = Goal(np.array((9.0, 2.0, 0.0)), 0.2, math.pi)
        c = navigator.step(Observation(0.0, pose.copy(), velocity.copy(), pose.copy(), goal, None, seen))
        return c.v, c.omega, c.v_y

    as_late = command(Latency(0.3, 0.1), pose, 3.0)
    assert as_late == pytest.approx(command(Latency(), rolled, 3.0 - late * 0.6))
    assert as_late != pytest.approx(command(Latency(), pose, 3.0))
