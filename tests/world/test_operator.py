"""A robot that somebody drives with a joystick, looking at the tested one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from worlds import DRIVE, SILENT, Pilot, constant, make_robot, make_scenario, moving_obstacle, run

from clearway.contract import Command
from clearway.geometry.shapes import Circle, FloatArray
from clearway.scenarios.line_keeping import Line, hand, steepest
from clearway.scenarios.scenario import ObstacleSpec, RunSpec
from clearway.trials import Outcome, Trial

RADIUS = 0.3
FAR = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 20.0}]


def trial(
    pilot: Pilot, path: Any = ((5.0, 0.0), (-5.0, 0.0)), speed: float = 0.5, delay: float = 0.0, *, seconds: float = 20.0,
    start: Any = (0.0, 0.0, 0.0), name: str = "cart", seed: int = 5, legs: Any = None, drive: Any = DRIVE, **spec: Any,
) -> Trial:  # fmt: skip
    """Someone drives a disc of 0.3 m along `path`."""
    table = {
        "name": name, "shape": {"kind": "disc", "radius": RADIUS}, "behaviour": {"kind": "operator"} | spec,
        "runs": [{"leg": "forth", "path": path, "speed": speed, "delay": delay}],
    }  # fmt: skip
    scenario = make_scenario(
        legs=legs or [FAR[0] | {"time_limit": seconds}],
        obstacles=[table],
        start=start,
        seed=seed,
        speed=drive["v_max"] / 2,
    )
    return run(pilot, [moving_obstacle(Circle(RADIUS), name)], scenario, make_robot(odometry=SILENT, drive=drive))


def mover(trial: Trial) -> FloatArray:
    return trial.moving_obstacles[:, 0]


def clear(trial: Trial) -> FloatArray:
    """Between the two outlines at each sample, m."""
    apart = mover(trial)[:, :2] - trial.pose[:, :2]
    return np.hypot(*apart.T) - RADIUS - 0.25


def test_with_nobody_in_the_way_it_runs_as_on_rails_but_for_a_hands_breadth() -> None:
    found = mover(trial(constant(0.0), start=(0.0, 9.0, 0.0), delay=1.0, seconds=25.0))
    t = np.arange(len(found)) * 0.1
    there = np.isfinite(found[:, 0])
    assert (t[there][0], t[there][-1]) == (pytest.approx(1.0, abs=0.051), pytest.approx(21.0, abs=0.11))
    assert found[there, 0] == pytest.approx(5.0 - 0.5 * (t[there] - 1.0), abs=0.01)
    off = np.abs(found[there, 1])
    assert 0.02 < off.max() <= 0.1
    heading = np.abs(np.remainder(found[there, 2], 2 * math.pi) - math.pi)
    assert 0.01 < heading.max() < 0.15


def test_it_comes_under_way_where_it_would_be() -> None:
    assert mover(trial(constant(0.0), delay=-4.0, seconds=1.0))[0, 0] == pytest.approx(3.0, abs=0.01)


def test_it_does_not_come_in_upon_a_robot_but_waits_until_that_has_gone_on() -> None:
    """The robot drives over the place where it comes in, and is there when it is time."""
    found = trial(constant(0.5), path=((2.0, 0.0), (2.0, 9.0)), delay=4.5, seconds=12.0)
    assert found.outcome is not Outcome.COLLISION
    t, came = found.t, np.isfinite(mover(found)[:, 0])
    assert mover(found)[came][0] == pytest.approx((2.0, 0.0, math.pi / 2), abs=0.2)
    assert found.pose[t >= 4.5][0, 0] == pytest.approx(2.0, abs=0.05)
    far = RADIUS + 0.25 + 0.5 + 0.5  # outlines, what is left where it stands, and what has to be free beyond
    assert clear(found)[came][0] + RADIUS + 0.25 == pytest.approx(far, abs=0.25)
    assert np.diff(mover(found)[came, 1]).min() > 0.0  # and then at its set speed


def test_it_does_not_come_in_before_a_robot_that_could_not_stop() -> None:
    brakes = Pilot(lambda s: Command(0.0 if s.t > 1.6 else 1.0, 0.0))
    at_once = DRIVE | {"acceleration": 1e3}
    found = trial(brakes, path=((2.4, 0.0), (-9.0, 0.0)), delay=1.4, seconds=9.0, drive=at_once)
    assert found.pose[found.t >= 1.4][0, 0] == pytest.approx(1.4, abs=0.05)
    assert found.outcome is not Outcome.COLLISION


def test_it_comes_in_upon_nobody() -> None:
    """Another disc runs over the place, blindly, at 0.5 m/s, and is there when it is time."""
    cart = {
        "name": "cart", "shape": {"kind": "disc", "radius": RADIUS}, "behaviour": {"kind": "operator"},
        "runs": [{"leg": "forth", "path": ((2.0, 5.0), (2.0, 9.0)), "speed": 0.5, "delay": 4.0}],
    }  # fmt: skip
    runner = cart | {"name": "runner", "behaviour": None}
    runner["runs"] = [{"leg": "forth", "path": ((0.0, 5.0), (5.0, 5.0)), "speed": 0.5}]
    scenario = make_scenario(legs=[FAR[0] | {"time_limit": 9.0}], obstacles=[cart, runner])
    bodies = [moving_obstacle(Circle(RADIUS), name) for name in ("cart", "runner")]
    found = run(constant(0.0), bodies, scenario, make_robot(odometry=SILENT))
    came = np.isfinite(found.moving_obstacles[:, 0, 0])
    apart = found.moving_obstacles[came, 1, :2] - found.moving_obstacles[came, 0, :2]
    assert np.hypot(*apart[0]) - 2 * RADIUS == pytest.approx(0.1, abs=0.06)
    assert found.t[came][0] == pytest.approx(4.0 + 0.7 / 0.5, abs=0.15)


def test_it_stops_half_a_metre_short_of_who_stands_in_the_way() -> None:
    found = trial(constant(0.0), seconds=12.0)
    assert found.outcome is Outcome.TIMEOUT
    assert clear(found).min() == pytest.approx(0.5 + 0.1, abs=0.03)  # what is 0.1 m beside the way is in the way


def test_it_backs_off_slowly_once_it_has_stood_for_three_seconds_and_goes_on_when_the_way_is_free() -> None:
    leaves = Pilot(lambda s: Command(0.0, 0.0) if s.t < 16.0 else Command(1.0, 0.0))
    found = trial(leaves, seconds=30.0, start=(0.0, 0.0, math.pi / 2))
    x, t = mover(found)[:, 0], found.t
    stood = t[np.abs(np.diff(x, prepend=x[0])) < 1e-9]
    assert stood[1] == pytest.approx((5.0 - 1.15) / 0.5, abs=0.6)
    backing = (t > stood[1] + 3.3) & (t < stood[1] + 6.0)
    assert np.diff(x[backing]) == pytest.approx(0.01, abs=2e-3)
    assert clear(found)[t < 16.0][-1] == pytest.approx(1.1, abs=0.1)  # and no further than it needs
    assert np.nanmin(x) < -4.9
    assert found.outcome is not Outcome.COLLISION


def test_who_is_behind_it_is_not_in_its_way() -> None:
    found = trial(constant(0.0), path=((-0.6, 0.0), (-5.6, 0.0)))
    assert np.nanmin(mover(found)[:, 0]) < -5.5


def test_it_does_not_back_into_anybody() -> None:
    """Somebody drives up behind it until it is 1 m away; it stands before somebody and would back off."""
    follows = Pilot(lambda s: Command(0.4 if s.truth[0] < -1.0 else 0.0, 0.0))
    found = trial(follows, start=(-4.0, 0.0, 0.0), path=((0.0, 0.0), (9.0, 0.0)), speed=0.2, seconds=30.0)
    assert found.outcome is Outcome.TIMEOUT
    assert clear(found)[np.isfinite(mover(found)[:, 0])].min() > 0.4


def test_it_sees_late() -> None:
    """Somebody jumps into the way at 4 s; the later that is seen, the later it brakes."""
    jumps = Pilot(lambda s: Command(10.0 if 4.0 <= s.t < 4.05 else 0.0, 0.0))
    sudden = DRIVE | {"v_max": 50.0, "acceleration": 1e6, "deceleration": 1e6}
    brakes = []
    for reaction in (0.0, 0.3, 0.6):
        found = trial(
            jumps, start=(0.0, -1.0, math.pi / 2), speed=0.8, deceleration=0.2, foresight=0.0, reaction=reaction,
            seconds=6.0, drive=sudden,
        )  # fmt: skip
        way = np.hypot(*np.diff(mover(found)[:, :2], axis=0).T)
        brakes.append(float(found.t[int(np.argmax(way < 0.99 * way[20:35].min()))]))
    assert brakes == pytest.approx([4.1, 4.4, 4.7], abs=0.11)


def test_a_leg_without_a_run_has_none() -> None:
    legs = [
        {"name": "forth", "goal": (0.0, 0.0, 0.0), "time_limit": 9.0, "xy_tolerance": 0.5},
        {"name": "wait", "goal": (50.0, 0.0, 0.0), "time_limit": 1.0},
    ]
    first = Pilot(lambda s: Command(0.0, 0.0, arrived=s.goal.leg == 0 and s.t > 0.95))
    found = trial(first, legs=legs)
    there = np.isfinite(mover(found)[:, 0])
    assert there[found.t < 0.95].all()
    assert not there[found.t > 1.05].any()


def test_the_seed_and_the_name_decide_how_the_hand_strays() -> None:
    away = {"start": (0.0, 9.0, 0.0), "seconds": 4.0}
    one = mover(trial(constant(0.0), **away))
    assert np.array_equal(one, mover(trial(constant(0.0), **away)))
    assert not np.array_equal(one, mover(trial(constant(0.0), seed=6, **away)))
    assert not np.array_equal(one, mover(trial(constant(0.0), name="bed", **away)))


@settings(max_examples=40)
@given(
    v=st.floats(-1.0, 1.0), omega=st.floats(-1.0, 1.0), speed=st.floats(0.2, 1.5), x=st.floats(-1.5, 1.5),
    y=st.floats(-1.5, 1.5), theta=st.floats(-3.1, 3.1), seed=st.integers(0, 99),
)  # fmt: skip
def test_no_contact_with_one_who_hardly_looks_is_missed(
    v: float, omega: float, speed: float, x: float, y: float, theta: float, seed: int
) -> None:
    """The samples and the lines between them, looked at each millisecond; both are round, so that what overlaps shows."""
    found = trial(
        constant(v, omega), path=((2.5, 0.0), (-2.5, 0.0)), speed=speed, start=(x, y, theta), seconds=6.0, seed=seed,
        reaction=1.0, foresight=0.0, stop_short=0.0, beside=0.0, deceleration=0.5,
    )  # fmt: skip
    places = mover(found)
    fine = np.arange(0.0, found.t[-1], 1e-3)
    robot = np.column_stack([np.interp(fine, found.t, found.pose[:, k]) for k in (0, 1)])
    other = np.column_stack([np.interp(fine, found.t, places[:, k]) for k in (0, 1)])
    gone = np.isnan(other[:, 0])
    apart = np.hypot(*(other - robot)[~gone].T) - RADIUS - 0.25
    if found.outcome is Outcome.COLLISION:
        assert clear(found)[-1] == pytest.approx(0.0, abs=2e-5)
        apart = apart[:-1]
    assert (apart > -4e-3).all()  # a line between samples of 0.1 s is off by so much


@settings(max_examples=40)
@given(
    v=st.floats(-0.6, 0.6), omega=st.floats(-0.5, 0.5), x=st.floats(-1.5, 1.5), y=st.floats(-1.5, 1.5),
    theta=st.floats(-3.1, 3.1), speed=st.floats(0.2, 0.6),
)  # fmt: skip
def test_it_never_jumps(v: float, omega: float, x: float, y: float, theta: float, speed: float) -> None:
    places = mover(trial(constant(v, omega), start=(x, y, theta), speed=speed, seconds=12.0))
    way = np.hypot(*np.diff(places[:, :2], axis=0).T)
    assert np.nanmax(way[1:], initial=0.0) < 0.1 * speed * 1.05


@settings(max_examples=40)
@given(
    seed=st.integers(0, 999),
    corners=st.lists(st.floats(-3.1, 3.1).filter(lambda a: abs(a) > 0.01), min_size=1, max_size=4),
    stray=st.floats(0.0, 0.3),
    straight=st.sampled_from([(), (0.7,), (0.2, 0.8)]),
)
def test_round_corners_it_neither_jumps_nor_turns_at_once(
    seed: int, corners: list[float], stray: float, straight: tuple[float, ...]
) -> None:
    """It passes through each way point and turns over a metre there, no faster than contact is looked for."""
    ways = np.cumsum([0.0, *corners])
    path = np.concatenate([[[0.0, 0.0]], np.cumsum(2.0 * np.column_stack([np.cos(ways), np.sin(ways)]), axis=0)])
    bends = path[1:-1]
    between = np.reshape([path[0] + share * (path[1] - path[0]) for share in straight], (-1, 2))
    path = np.concatenate([path[:1], between, path[1:]])  # way points at which it goes straight on
    run_ = RunSpec(leg="forth", path=tuple(map(tuple, path.tolist())), speed=1.0)
    line = Line(run_, stray, hand(seed, "bed"))
    s = np.linspace(0.0, line.length, round(line.length / 1e-3) + 1)
    poses = line.poses(s)
    gone = np.diff(s)
    assert (np.hypot(*np.diff(poses[:, :2], axis=0).T) / gone).max() <= math.hypot(1.0, steepest(stray)) + 1e-9
    turned = np.diff(np.unwrap(poses[:, 2])) / gone
    assert np.abs(turned).max() <= np.abs(corners).max() + 6.0 * stray / (1.0 - 3.0 * stray) + 1e-6
    assert np.abs(poses[np.searchsorted(s, line.along[1:-1] - 1e-9), :2] - bends).max() < 2e-3


@pytest.mark.parametrize(
    ("change", "word"),
    [({"reaction": -0.1}, "greater"), ({"stop_short": -1.0}, "stop_short"), ({"patience": 0.0}, "greater"),
     ({"backing": math.inf}, "finite"), ({"kind": "orca"}, "operator"), ({"nonsense": 1}, "nonsense")],
)  # fmt: skip
def test_what_nobody_can_mean_is_refused(change: dict[str, Any], word: str) -> None:
    run_ = {"leg": "forth", "path": [(0.0, 0.0), (1.0, 0.0)], "speed": 1.0}
    table = {"name": "x", "shape": {"kind": "disc", "radius": 0.3}, "runs": [run_], "behaviour": change}
    with pytest.raises(ValidationError, match=word):
        ObstacleSpec.model_validate(table)


def test_one_that_stands_has_nobody_who_drives_it() -> None:
    table = {"name": "x", "shape": {"kind": "disc", "radius": 0.3}, "pose": (0.0, 0.0, 0.0), "behaviour": {}}
    with pytest.raises(ValidationError, match="no runs along which an operator could drive it"):
        ObstacleSpec.model_validate(table)
