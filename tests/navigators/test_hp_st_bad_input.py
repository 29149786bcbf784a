"""Whatever it is told, HP-ST answers with a finite command within the limits, or with one clear error."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from space_time_scenes import OTHER, OWN, PERIOD, RESCUE, begun, drive, goal, observation, obstacles

from clearway.contract import Command, Goal, Observation
from clearway.navigators.hp_st import HpSt
from clearway.robots import Robot

AHEAD = goal(6.0, 0.0)
ORIGIN = (0.0, 0.0, 0.0)


def sound(command: Command, robot: Robot = RESCUE, speed: float = 1.0) -> Command:
    d = robot.drive
    assert max(d.v_min, -speed) - 1e-9 <= command.v <= min(d.v_max, speed) + 1e-9
    assert abs(command.omega) <= d.omega_max + 1e-9
    return command


def answer(navigator: HpSt, k: float, seen: Any, pose: Any = ORIGIN, aim: Goal = AHEAD, **more: Any) -> Command:
    """To an observation in period `k`."""
    return sound(navigator.step(observation(k * PERIOD, pose, aim, seen, **more)))


def answers(seen: Any, count: int = 3, **more: Any) -> list[Command]:
    """To the same observation in each of the first periods, of a robot that drives as it is told."""
    navigator = begun()
    went = drive(navigator, (6.0, 0.0), lambda t, pose: seen, count, **more)
    return [sound(c) for c in went.commands]


def with_rates(**drive_changes: Any) -> Robot:
    return RESCUE.model_copy(update={"drive": RESCUE.drive.model_copy(update=drive_changes)})


# obstacles


def test_an_obstacle_that_appears_inside_the_robot() -> None:
    navigator = begun()
    answer(navigator, 0, obstacles())
    for moving in (True, False):
        navigator = begun()
        answer(navigator, 0, obstacles())
        for k in range(1, 6):
            answer(navigator, k, obstacles([(0.05, 0.02)], moving=moving))
        answer(navigator, 6, obstacles([(0.0, 0.0)], moving=moving))


def test_an_obstacle_that_teleports_is_told() -> None:
    navigator = begun()
    told = [answer(navigator, k, obstacles([(2.0 if k < 5 else 3.5, 2.0)]), (0.0, 0.0, 0.0)).violated for k in range(8)]
    assert not any("obstacle" in text for texts in told[:5] for text in texts)
    assert any("obstacle 0" in text for text in told[5])


def test_two_that_swap_identities() -> None:
    navigator = begun()
    left, right = (2.5, 1.5), (2.5, -1.5)
    told: list[str] = []
    for k in range(10):
        names = [7, 8] if k < 5 else [8, 7]
        told += [t for t in answer(navigator, k, obstacles([left, right], names=names)).violated if "obstacle" in t]
    assert any("7" in text for text in told)
    assert any("8" in text for text in told)


def test_one_identity_twice() -> None:
    navigator = begun()
    for k in range(4):
        answer(navigator, k, obstacles([(2.0, 1.0), (2.0, -1.0), (3.0, 0.0)], names=[1, 1, 1]))


def test_one_that_vanishes_is_reckoned_with_for_a_while() -> None:
    """It was in the way a moment ago: nobody drives there at once."""
    navigator, spot = begun(), [(0.9, 0.0)]
    for k in range(5):
        answer(navigator, k, obstacles(spot))
    blind = answer(navigator, 5, obstacles())
    unseen = answer(begun(), 0, obstacles())
    assert unseen.v == 1.0
    assert (blind.v, blind.omega) != (1.0, 0.0)


@pytest.mark.parametrize("nothing", [None, obstacles()])
def test_no_obstacles(nothing: Any) -> None:
    assert {(c.v, c.omega, c.violated) for c in answers(nothing)} == {(1.0, 0.0, ())}


def test_five_hundred_obstacles() -> None:
    rng = np.random.default_rng(1)
    at = rng.uniform(-4.0, 4.0, (2000, 2))
    at = at[np.hypot(*at.T) > 1.0][:500]
    navigator = begun()
    for k in range(3):
        answer(navigator, k, obstacles(at, velocity=0.1, moving=np.arange(500) % 2 == 0))


@pytest.mark.parametrize("radius", [0.0, 30.0])
def test_obstacles_of_odd_sizes(radius: float) -> None:
    answers(obstacles([(2.0, 0.1)], radius=radius))
    answers(obstacles([(2.0, 0.1)], radius=radius, moving=False))


@pytest.mark.parametrize("field", ["position", "radius", "error"])
@pytest.mark.parametrize("wrong", [math.nan, math.inf])
@pytest.mark.parametrize("moving", [True, False])
def test_an_obstacle_that_is_no_number_is_left_out(field: str, wrong: float, moving: bool) -> None:
    good = obstacles([(1.5, 1.2), (1.0, 0.0)], moving=moving)
    values = getattr(good, field).copy()
    values[1] = wrong
    alone = obstacles([(1.5, 1.2)], moving=moving)
    assert answers(dataclasses.replace(good, **{field: values})) == answers(alone)


def test_velocities_that_are_no_numbers() -> None:
    seen = obstacles([(1.5, 0.3), (2.0, -0.4)], velocity=math.nan)
    assert answers(seen) == answers(obstacles([(1.5, 0.3), (2.0, -0.4)]))


# time


@pytest.mark.parametrize(
    ("at", "says"),
    [
        (5.0, "period: 0.3 s since the last command, assumed 0.15 s"),
        (3.0, "period: 0 s since the last command, assumed 0.15 s"),
        (1.0, "period: -0.3 s since the last command, assumed 0.15 s"),
        (2000.0, "period: 299.6 s since the last command, assumed 0.15 s"),
    ],
    ids=["missed", "doubled", "back", "asleep"],
)
def test_periods_that_are_none(at: float, says: str) -> None:
    navigator, seen = begun(), obstacles([(3.0, 0.4)])
    for k in range(4):
        assert answer(navigator, k, seen, (0.15 * k, 0.0, 0.0), velocity=(1.0, 0.0)).violated == ()
    assert says in answer(navigator, at, seen, (0.5, 0.0, 0.0), velocity=(1.0, 0.0)).violated
    for k in range(1, 4):
        answer(navigator, at + k, seen, (0.5, 0.0, 0.0))


# the goal


def test_a_goal_that_moves_every_period() -> None:
    navigator, pose = begun(), np.zeros(3)
    for k in range(20):
        aim = goal(3.0 * math.cos(2.0 * k), 3.0 * math.sin(2.0 * k))
        command = answer(navigator, k, obstacles([(1.5, 1.5)]), pose, aim)
        pose = pose + np.array([0.02, 0.0, 0.1]) * (command.v != 0.0)


def test_a_goal_that_flees_is_followed() -> None:
    navigator, pose = begun(), np.zeros(3)
    for k in range(30):
        command = answer(navigator, k, obstacles(), pose, goal(2.0 + 0.12 * k, 0.0), velocity=(1.0, 0.0))
        pose = pose + np.array([PERIOD * command.v, 0.0, 0.0])
    assert pose[0] > 4.0


@pytest.mark.parametrize("moving", [True, False])
def test_a_goal_inside_an_obstacle_is_come_near_to_and_no_further(moving: bool) -> None:
    spot = (3.0, 0.0)
    went = drive(
        begun(), spot, lambda t, pose: obstacles([spot], moving=moving), 60, touches=lambda t, p: math.dist(p[:2], spot) < OWN + OTHER
    )  # fmt: skip
    assert went.contact is None
    assert not went.arrived
    assert went.poses[-1][0] > 1.0


def test_a_goal_where_it_stands() -> None:
    command = answer(begun(), 0, obstacles(), (1.0, 2.0, 0.3), goal(1.0, 2.0))
    assert command.arrived


@pytest.mark.parametrize("far", [1e3, 1e6])
def test_a_goal_far_away(far: float) -> None:
    assert answer(begun(), 0, obstacles([(far / 2, 0.0)], moving=False), aim=goal(far, 0.0)).v == 1.0


# the robot itself


@pytest.mark.parametrize("i", range(3))
@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_pose_that_is_no_number(i: int, wrong: float) -> None:
    pose = np.array([1.0, 2.0, 0.5])
    pose[i] = wrong
    with pytest.raises(ValueError, match=r"the observation's pose is \[.*(nan|inf).*\]; 3 finite numbers"):
        begun().step(observation(0.0, pose, AHEAD, obstacles()))
    with pytest.raises(ValueError, match=r"the observation's goal\.pose is"):
        begun().step(observation(0.0, ORIGIN, Goal(pose, 0.2, math.inf), obstacles()))


def test_after_a_pose_that_is_no_number_it_goes_on() -> None:
    navigator = begun()
    answer(navigator, 0, obstacles())
    with pytest.raises(ValueError):
        navigator.step(observation(PERIOD, (math.nan, 0.0, 0.0), AHEAD, obstacles()))
    assert answer(navigator, 2, obstacles(), (0.3, 0.0, 0.0)).v == 1.0


def test_a_velocity_that_is_no_number() -> None:
    navigator = begun()
    for k in range(3):
        assert answer(navigator, k, obstacles(), (0.15 * k, 0.0, 0.0), velocity=(math.nan, math.nan)).v == 1.0


@pytest.mark.parametrize("guarantee", HpSt.GUARANTEES)
def test_a_robot_that_is_carried_away(guarantee: str) -> None:
    """In every third period, while an obstacle keeps it from its way: the stored plan was meant for elsewhere."""
    navigator, rng = begun(guarantee=guarantee), np.random.default_rng(0)
    pose, told = np.zeros(3), 0
    for k in range(40):
        near = pose[:2] + 0.9 * np.array([math.cos(pose[2]), math.sin(pose[2])])
        command = answer(
            navigator, k, obstacles([near, *rng.uniform(-2.0, 4.0, (3, 2))], names=[k, 101, 102, 103]), pose
        )
        told += any(text.startswith("disturbance:") for text in command.violated)
        if k % 3 == 2:
            pose = np.array([*rng.uniform(-1.0, 3.0, 2), rng.uniform(-3.0, 3.0)])
        else:
            pose = pose + np.array([PERIOD * command.v, 0.0, PERIOD * command.omega])
    assert told >= 8


def test_corrections_of_the_stored_plan_keep_to_the_limits() -> None:
    """Carried 2 m to the left, to where something has just come so near that nothing new is certified."""
    navigator = begun()
    assert answer(navigator, 0, obstacles()).v == 1.0
    command = answer(navigator, 1, obstacles([(0.95, 2.0)]), (0.15, 2.0, 0.8))
    assert command.status == "stored"
    assert abs(command.omega) == RESCUE.drive.omega_max


# limits


@pytest.mark.parametrize("speed", [0.0, 1e-9, 1e-3])
def test_a_set_speed_of_nothing(speed: float) -> None:
    navigator = begun(speed=speed)
    for k in range(3):
        command = navigator.step(observation(k * PERIOD, ORIGIN, AHEAD, obstacles([(2.0, 0.3)])))
        sound(command, speed=speed)


def test_a_robot_that_hardly_turns() -> None:
    robot = with_rates(omega_max=1e-6)
    navigator = begun(robot)
    for k in range(3):
        command = navigator.step(observation(k * PERIOD, ORIGIN, goal(0.0, 3.0), obstacles([(2.0, 0.3)])))
        sound(command, robot)


@pytest.mark.parametrize(
    "options", [{"robot": with_rates(v_min=0.0)}, {"reverse": False}, {"without": "reverse"}], ids=["robot", "option", "without"]
)  # fmt: skip
def test_a_robot_that_may_not_reverse(options: dict[str, Any]) -> None:
    """The goal lies behind it, and something comes from ahead."""
    navigator, pose = begun(**options), np.zeros(3)
    turned = 0.0
    for k in range(30):
        seen = obstacles([(3.0 - 0.5 * k * PERIOD, 0.0)])
        command = navigator.step(observation(k * PERIOD, pose, goal(-4.0, 0.0), seen))
        assert command.v >= 0.0
        sound(command)
        pose = pose + PERIOD * np.array(
            [command.v * math.cos(pose[2]), command.v * math.sin(pose[2]), command.omega]
        )  # fmt: skip
        turned += abs(command.omega) * PERIOD
    assert turned > 1.0


def test_an_area_smaller_than_the_robot() -> None:
    navigator = begun(within=(-0.05, -0.05, 0.05, 0.05))
    pose = np.zeros(3)
    for k in range(10):
        command = answer(navigator, k, obstacles(), pose)
        pose = pose + PERIOD * np.array([command.v * math.cos(pose[2]), command.v * math.sin(pose[2]), command.omega])
        assert np.abs(pose[:2]).max() <= 0.05 + 1e-6


def test_an_area_without_extent() -> None:
    answer(begun(within=(1.0, 1.0, 1.0, 1.0)), 0, obstacles(), (1.0, 1.0, 0.0))


@pytest.mark.parametrize("guarantee", HpSt.GUARANTEES)
def test_a_start_outside_the_area(guarantee: str) -> None:
    """It comes in; with `passive` it stands, as the disturbance might drive it farther out first."""
    went = drive(begun(guarantee=guarantee, within=(1.0, -3.0, 7.0, 3.0)), (6.0, 0.0), periods=60)
    assert went.arrived == (guarantee != "passive")
    assert went.poses[-1][0] > 5.0 or all((c.v, c.omega) == (0.0, 0.0) for c in went.commands)


def test_a_robot_without_eyes() -> None:
    robot = RESCUE.model_copy(update={"camera": None, "lidar": None})
    navigator = begun(robot, within=(-1.0, -3.0, 7.0, 3.0))
    sound(navigator.step(observation(0.0, ORIGIN, AHEAD, None)))


# anything

ODD = st.sampled_from([0.0, -0.0, 1e-12, 1e6, -1e6, math.nan, math.inf, -math.inf])
NUMBER = st.one_of(st.floats(-5.0, 5.0), ODD)
JUNK = st.lists(
    st.tuples(NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, st.integers(-3, 5), st.booleans()), max_size=8
)
SANE = st.floats(-20.0, 20.0)


@settings(max_examples=30)
@given(
    st.lists(st.tuples(JUNK, st.floats(-1.0, 3.0), SANE, SANE, SANE, NUMBER, SANE, SANE), min_size=1, max_size=5),
    st.sampled_from(HpSt.GUARANTEES),
)
def test_any_observation(periods: list[Any], guarantee: str) -> None:
    navigator, t = begun(guarantee=guarantee, within=(-8.0, -8.0, 8.0, 8.0)), 0.0
    for junk, dt, x, y, theta, v, gx, gy in periods:
        t += dt
        rows = np.array([r[:6] for r in junk], dtype=np.float64).reshape(-1, 6)
        seen = dataclasses.replace(
            obstacles(
                rows[:, :2], names=[r[6] for r in junk], moving=np.array([r[7] for r in junk], dtype=np.bool_)
            ),
            radius=np.abs(rows[:, 2]), error=np.abs(rows[:, 3]), velocity=rows[:, 4:6].copy(),
        )  # fmt: skip
        pose, before = np.array([x, y, theta]), rows.copy()
        given_ = Observation(t, pose, np.array([v, v]), pose.copy(), goal(gx, gy), obstacles=seen)
        sound(navigator.step(given_))
        assert np.array_equal(seen.position, before[:, :2], equal_nan=True)
        assert pose.tolist() == [x, y, theta]
