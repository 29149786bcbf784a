"""What appears where it must have been seen before is told; what can be explained is not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from space_time_scenes import OTHER, PERIOD, begun, foreseen, goal, observation, obstacles

from clearway.contract import Obstacles
from clearway.forecasts.forecast import Forecast
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.sight import Sight, beside, depth, looked_at, sees, sight_of
from clearway.navigators.hp_st.guarantee.sight_monitor import SightMonitor
from clearway.robots import load_robot

ORIGIN = np.zeros(3)
CIRCLE = Sight(4.0)
TIAGO = Sight(4.0, 0.0, math.radians(100), 0.2, 0.0)


def test_what_each_robot_sees() -> None:
    """A camera all around it; a lidar as far as its file says, but for what its ranges err by."""
    assert sight_of(load_robot("rescue"), 4.0) == CIRCLE
    tiago, hosbot = (sight_of(load_robot(name), 4.0) for name in ("tiago", "hosbot"))
    assert (math.degrees(tiago.half), tiago.x, tiago.middle) == (pytest.approx(100), 0.202, 0.0)
    assert (math.degrees(hosbot.half), hosbot.x, hosbot.y) == (pytest.approx(135, abs=0.01), 0.21, 0.0)
    assert 3.8 < tiago.range < 3.9
    assert sight_of(load_robot("tiago"), 99.0).range < load_robot("tiago").lidar.range_max  # type: ignore[union-attr]
    around = load_robot("tiago")
    lidar = around.lidar.model_copy(
        update={"beams": 360, "angle_min": -math.pi, "angle_max": math.radians(179), "sigma": 0.0, "bias": 0.0}
    )  # type: ignore[union-attr]
    assert sight_of(around.model_copy(update={"lidar": lidar}), 4.0).half == math.pi
    assert sight_of(around.model_copy(update={"lidar": None}), 4.0).range == math.inf


def test_what_lies_beside_the_sector_of_sight() -> None:
    assert not beside(CIRCLE, ORIGIN, -1.0, 0.0)
    assert not beside(TIAGO, ORIGIN, 9.0, 0.0)  # too far to be seen, but there it looks
    assert not beside(TIAGO, ORIGIN, 0.2, 1.0)
    assert beside(TIAGO, ORIGIN, 0.0, 1.0)  # 101 degrees from the sensor
    assert beside(TIAGO, np.array([0.0, 0.0, math.pi]), 1.0, 0.0)


@given(st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=4), st.floats(-3.0, 3.0))
def test_what_was_in_sight_all_along(turned: list[float], direction: float) -> None:
    left = looked_at(TIAGO, turned)
    edges = [abs(abs(direction + angle) - TIAGO.half) for angle in (0.0, *turned)]
    if min(edges) > 1e-9 and all(abs(direction + angle) < math.pi for angle in turned):
        assert sees(left, direction, 0.0) == all(abs(direction + angle) < TIAGO.half for angle in (0.0, *turned))
    assert looked_at(CIRCLE, turned) == CIRCLE


def test_it_drives_only_where_it_has_looked_for_a_while() -> None:
    """Of two TIAGos one has turned to the left by 0.2 rad before each of the last looks: less of that side is left to it."""
    tiago = load_robot("tiago")
    stood, turned = begun(tiago), begun(tiago)
    for k in range(8):
        for robot, heading in ((stood, 0.0), (turned, 0.2 * k)):
            robot.step(observation(k * tiago.period, (0.0, 0.0, heading), goal(3.0, 0.0), None))
    assert stood._rules.sight == sight_of(tiago, 4.0)
    assert turned._rules.sight.middle + turned._rules.sight.half == pytest.approx(math.radians(100) - 0.6)
    assert turned._rules.sight.middle - turned._rules.sight.half == pytest.approx(-math.radians(100))


def test_depth_by_hand() -> None:
    assert depth(CIRCLE, ORIGIN, 1.1, 0.0) == pytest.approx(2.9)
    assert depth(CIRCLE, ORIGIN, -5.0, 0.0) == pytest.approx(-1.0)
    quarter = Sight(4.0, math.pi / 2, math.pi / 4)  # from 45 to 135 degrees
    assert depth(quarter, ORIGIN, 0.0, 2.0) == pytest.approx(math.sqrt(2.0))
    assert depth(quarter, np.array([0.0, 0.0, -math.pi / 2]), 2.0, 0.0) == pytest.approx(math.sqrt(2.0))
    assert depth(quarter, ORIGIN, 1.0, 0.0) == pytest.approx(-math.sqrt(0.5))
    assert depth(quarter, ORIGIN, -1.0, -3.0) == pytest.approx(-math.hypot(1.0, 3.0))  # the sensor is the nearest
    assert depth(quarter, ORIGIN, 5.0, 5.0) == pytest.approx(4.0 - math.hypot(5.0, 5.0))
    assert depth(TIAGO, np.array([1.0, 1.0, math.pi]), 0.3, 1.0) == pytest.approx(0.5)  # ahead: the sensor again
    assert depth(TIAGO, ORIGIN, 0.0, 0.0) == pytest.approx(-0.2 * math.sin(math.radians(80)))


@settings(max_examples=300, deadline=None)
@given(
    st.floats(0.1, 3.14), st.floats(-3, 3), st.tuples(st.floats(-6, 6), st.floats(-6, 6)), st.floats(0, 6.28), st.floats(0, 1)
)  # fmt: skip
def test_depth_is_a_distance(half: float, middle: float, at: tuple[float, float], angle: float, share: float) -> None:
    """Within the depth of a place all is seen; outside, something that is seen is no farther than that."""
    sight, pose = Sight(4.0, middle, half, 0.2, -0.1), np.array([0.3, -0.2, 1.0])
    deep = depth(sight, pose, *at)
    x, y = at[0] + share * abs(deep) * math.cos(angle), at[1] + share * abs(deep) * math.sin(angle)
    beside = depth(sight, pose, x, y)
    if deep > 0.0:
        assert beside >= -1e-9
        assert beside >= (1.0 - share) * deep - 1e-9
    assert abs(beside - deep) <= share * abs(deep) + 1e-9


def monitor(sight: Sight = CIRCLE, speed: float = 4.4, surfaces: bool = False, **more: Any) -> SightMonitor:
    return SightMonitor(sight, speed, more.get("start", np.zeros(3)), 2.5, surfaces)


NOTHING = foreseen((), (), PERIOD, 2)


def looks(watch: SightMonitor, *seen: Obstacles, forecast: Forecast = NOTHING, pose: FloatArray = ORIGIN) -> list[str]:
    return [text for k, now in enumerate(seen) for text in watch.seen(k * PERIOD, pose, now, forecast)]


def test_what_pops_up_ahead_is_told() -> None:
    """The example: nothing there, and a period later something 1.1 m ahead; all of the circle is perceived."""
    navigator, aim = begun(), goal(6.0, 0.0)
    assert navigator.step(observation(0.0, ORIGIN, aim, obstacles())).violated == ()
    v = navigator._memory.velocity.copy()
    at = (float(v[0]) * PERIOD, 0.0, 0.0)
    told = navigator.step(observation(PERIOD, at, aim, obstacles([(1.1, 0.0)]), v)).violated
    within = 4.0 - 1.1 + OTHER - 0.01 - 4.4 * PERIOD
    assert told == (
        f"obstacle 0: appeared within sight, {within:.2f} m deeper than it can have come since the last look",
    )


def test_a_measured_velocity_that_was_never_commanded_is_told() -> None:
    navigator, aim = begun(), goal(6.0, 0.0)
    navigator.step(observation(0.0, ORIGIN, aim, obstacles()))
    v = float(navigator._memory.velocity[0])
    told = navigator.step(observation(PERIOD, (v * PERIOD, 0.0, 0.0), aim, obstacles(), (5.0, 3.0))).violated
    assert [text.split(" is ")[0] for text in told] == ["command: v", "command: omega"]


@pytest.mark.parametrize(("ahead", "said"), [(4.34, 0), (4.36, 0), (3.69, 0), (3.67, 1), (1.1, 1)])
def test_what_can_have_come_across_the_rim_is_not_told(ahead: float, said: int) -> None:
    """It comes 0.66 m in a period, and is perceived up to 0.01 m off."""
    edge = 4.0 + OTHER - 0.01 - 4.4 * PERIOD
    assert edge == pytest.approx(3.68)
    assert len(looks(monitor(), obstacles(), obstacles([(ahead, 0.0)]))) == said


def test_after_a_longer_time_it_can_have_come_farther() -> None:
    watch = monitor()
    assert watch.seen(0.0, ORIGIN, obstacles(), NOTHING) == ()
    assert watch.seen(5 * PERIOD, ORIGIN, obstacles([(1.1, 0.0)]), NOTHING) == ()


def test_what_stands_cannot_have_come() -> None:
    assert looks(monitor(), obstacles(), obstacles([(4.34, 0.0)], moving=False, error=0.0)) == [
        "obstacle 0: stands 0.01 m within sight and was not perceived before"
    ]
    assert looks(monitor(), obstacles(), obstacles([(4.36, 0.0)], moving=False, error=0.0)) == []


def test_at_the_first_look_all_is_new_and_then_it_is_known() -> None:
    seen = obstacles([(1.0, 0.0), (2.0, 2.0)])
    assert looks(monitor(), seen, seen, obstacles(), obstacles(), seen) == []  # remembered while it is not perceived
    assert len(looks(monitor(), seen, *[obstacles()] * 20, seen)) == 2  # forgotten


def test_what_was_perceived_as_standing_may_not_move() -> None:
    told = looks(monitor(), *(obstacles([(1.0, 0.0)], moving=moving, names=[7]) for moving in (False, True, True)))
    assert told == ["obstacle 7: moves, but was perceived as standing"]


def test_time_that_goes_back_begins_anew() -> None:
    watch = monitor()
    assert watch.seen(1.0, ORIGIN, obstacles(), NOTHING) == ()
    assert watch.seen(0.5, ORIGIN, obstacles([(1.0, 0.0)]), NOTHING) == ()


def test_what_is_no_number_is_left_out() -> None:
    assert looks(monitor(), obstacles(), obstacles([(math.nan, 0.0)]), obstacles([(math.inf, 0.0)])) == []


def test_outside_of_the_sector_nothing_is_seen() -> None:
    """Behind TIAGo something may be at any time; beside it, what comes across the edge of the sector at 2 m/s."""
    for at, said in (((-1.0, 0.0), 0), ((-0.2, 1.0), 0), ((1.0, 1.2), 1), ((2.0, 0.0), 1)):
        assert len(looks(monitor(TIAGO, 2.0), obstacles(), obstacles([at], radius=0.2))) == said, at
    watch = monitor(TIAGO, 2.0)
    assert watch.seen(0.0, np.array([0.0, 0.0, math.pi]), obstacles(), NOTHING) == ()  # it looked the other way
    assert watch.seen(0.1, ORIGIN, obstacles([(2.0, 0.0)]), NOTHING) == ()


def test_the_errors_of_the_pose_are_given() -> None:
    far = obstacles([(3.6, 0.0)])
    assert looks(monitor(), obstacles(), far)
    assert not looks(monitor(start=np.array([0.0, 0.0, 0.02])), obstacles(), far)  # twice 0.07 m at that distance
    assert not looks(monitor(start=np.array([0.05, 0.05, 0.0])), obstacles(), far)


def test_a_track_out_of_view_explains_what_comes_back_under_another_name() -> None:
    away = foreseen((), [lambda t: (1.0, 0.0)], PERIOD, 2)
    back = obstacles([(1.2, 0.0)], names=[9])
    near = away._replace(age=np.array([0.3]), reach=np.full((1, 3), 0.25))
    assert looks(monitor(), obstacles(), back, forecast=near) == []
    assert looks(monitor(), obstacles(), back, forecast=near._replace(reach=np.full((1, 3), 0.1))) != []
    assert looks(monitor(), obstacles(), back, forecast=near._replace(age=np.zeros(1))) != []  # that one is perceived


def test_a_surface_seen_further_along_is_nothing_new() -> None:
    wall = [(1.0, 0.1 * k) for k in range(10)]

    def pieces(count: int, *more: tuple[float, float]) -> Obstacles:
        at = [*wall[:count], *more]
        return obstacles(at, radius=0.06, moving=False, error=0.0, names=[-1 - 7 * k for k in range(len(at))])

    assert looks(monitor(TIAGO, 2.0, True), pieces(5), pieces(6), pieces(7)) == []
    told = looks(monitor(TIAGO, 2.0, True), pieces(5), pieces(5, (2.0, 0.9), (2.0, 1.0), (3.9, 0.0)))
    assert len(told) == 1  # one for all pieces of a look, of the deepest
    assert told[0].startswith("surface: stands 2.00 m")
    assert len(looks(monitor(TIAGO, 2.0), pieces(5), pieces(6))) == 1  # a camera names each


def test_a_body_that_a_lidar_took_for_structure() -> None:
    still = obstacles([(1.5, 0.0)], radius=0.2, moving=False, error=0.0, names=[-5])
    told = looks(monitor(TIAGO, 2.0, True), still, obstacles([(1.55, 0.0)], radius=0.2, names=[3]))
    assert told == ["obstacle 3: moves, but was perceived as standing"]
    again = looks(monitor(TIAGO, 2.0, True), *(obstacles([(1.5, 0.0)], radius=0.2, names=[n]) for n in (3, 4)))
    assert again == []  # another name for the same body
