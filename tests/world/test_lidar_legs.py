"""What a lidar that looks low sees of people: two legs that walk within the disc that can be touched."""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from worlds import Pilot, body, make_robot, make_scenario, run

from clearway.contract import Command, Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, FloatArray, rectangle
from clearway.perception import make_tracker
from clearway.robots import Robot, load_robot
from clearway.robots.ideal import ERRORS, RobotError, errors_named, ideal
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Body, Outcome
from clearway.world.legs import APART, RADIUS, STRIDES, Legs, on_legs, walk
from clearway.world.tracks import stack

LEGS = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 6.0}]
LIDAR = {"beams": 721, "angle_min": -1.5, "angle_max": 1.5, "range_min": 0.05, "range_max": 10.0, "sigma": 0.0}
LOW = {"height": 0.2}


def person(name: str = "anna", radius: float = 0.25) -> Body:
    return Body(name, "person", Circle(radius), None)


def straight(x: float, y: float, theta: float, v: float, duration: float = 9.0) -> FloatArray:
    end = x + v * duration * math.cos(theta), y + v * duration * math.sin(theta)
    return np.array([[0.0, x, y, theta], [duration, *end, theta]])


def placed(knots: FloatArray, times: FloatArray, seed: int = 5, radius: float = 0.25) -> tuple[Legs, FloatArray]:
    """(times, 2, 3) x, y, radius of both legs, in the person's frame."""
    scene, legs = on_legs([person(radius=radius)], seed, True)
    tracks = stack([[knots]])
    found = []
    for t in times:
        walk(scene.circles, legs, tracks, np.zeros(1), 0, float(t))
        found.append(scene.circles.copy())
    return legs, np.array(found)


@settings(max_examples=60, deadline=None)
@given(
    radius=st.floats(0.1, 1.0), v=st.floats(-3.0, 3.0), course=st.floats(-3.1, 3.1), turned=st.floats(-3.1, 3.1),
    seed=st.integers(0, 9),
)  # fmt: skip
def test_legs_never_lie_outside_the_disc_that_can_be_touched(
    radius: float, v: float, course: float, turned: float, seed: int
) -> None:
    knots = straight(0.0, 0.0, course, v)
    knots[:, 3] += turned  # it looks elsewhere than where it goes
    _, circles = placed(knots, np.linspace(0.0, 9.0, 50), seed, radius)
    assert (np.hypot(circles[..., 0], circles[..., 1]) + circles[..., 2]).max() <= radius + 1e-12


def test_one_leg_stands_while_the_other_swings() -> None:
    """At 0.5 m/s, where steps fit into the disc: each leg is either still on the floor or goes at twice the walk's speed."""
    v, h = 0.5, 1e-4
    times = np.arange(1.0, 4.0, 0.0317)
    _, now = placed(straight(0.0, 0.0, 0.0, v), times)
    _, then = placed(straight(0.0, 0.0, 0.0, v), times + h)
    speed = v + (then - now)[..., 0] / h
    still, swings = np.abs(speed) < 1e-6, np.abs(speed - 2.0 * v) < 1e-6
    turning = ~(still | swings).all(axis=1)  # a leg was set down or lifted within h
    assert turning.mean() < 0.05
    assert (still.sum(axis=1) == 1)[~turning].all()
    per_second = np.count_nonzero(np.diff(np.sign(now[:, 0, 0] - now[:, 1, 0]))) / (times[-1] - times[0])
    assert per_second == pytest.approx(2.0 * STRIDES, rel=0.15)  # a step is half a stride


def test_who_stands_has_two_still_legs() -> None:
    _, circles = placed(straight(2.0, 0.0, 1.0, 0.0), np.linspace(0.0, 5.0, 30))
    assert (circles[:, 0] == [0.0, 0.5 * APART, RADIUS]).all()
    assert (circles[:, 1] == [0.0, -0.5 * APART, RADIUS]).all()


def test_the_phase_is_the_persons_own_and_the_seeds() -> None:
    def phases(names: list[str], seed: int) -> dict[str, float]:
        people = [person(name) for name in names]
        legs = on_legs(people, seed, True)[1]
        return {names[m]: float(p) for m, p in zip(legs.owner, legs.phase, strict=True)}

    assert phases(["anna", "ben"], 1) == phases(["ben", "anna"], 1)
    assert len(set(phases(["anna", "ben"], 1).values()) | set(phases(["anna"], 2).values())) == 3


def seen(
    knots: FloatArray, lidar: dict[str, Any], left_out: tuple[str, ...] = (), command: Command | None = None, **more: Any
) -> list[Sensing]:  # fmt: skip
    pilot = Pilot(lambda _: command or Command(0.0, 0.0))
    scenario = make_scenario(legs=LEGS, ideal=left_out)
    run(pilot, [person()], scenario, make_robot(lidar=LIDAR | lidar, **more), [knots])
    return pilot.seen


def ranges(s: Sensing) -> FloatArray:
    assert s.scan is not None
    return s.scan.ranges


def gaps(s: Sensing) -> int:
    """Runs of beams that hit something."""
    hit = np.isfinite(ranges(s)).astype(int)
    return int(np.count_nonzero(np.diff(hit) == 1))


def test_a_low_lidar_sees_legs_a_high_one_and_one_of_no_known_height_the_disc() -> None:
    knots = straight(2.0, 0.0, 0.0, 0.0)
    low, high, unknown, without = (
        seen(knots, *a) for a in ((LOW,), ({"height": 1.0},), ({},), (LOW, ("legs",)))
    )  # fmt: skip
    assert {gaps(s) for s in low} == {2}
    assert ranges(low[0]).min() == pytest.approx(math.hypot(2.0, 0.5 * APART) - RADIUS, abs=1e-4)
    for others in (high, without):
        assert all(np.array_equal(ranges(a), ranges(b)) for a, b in zip(others, unknown, strict=True))
    assert ranges(unknown[0]).min() == pytest.approx(1.75, abs=1e-6)


@pytest.mark.parametrize("sweep", [0.0, 0.06])
def test_the_scan_shows_where_the_legs_are(sweep: float) -> None:
    knots = straight(2.0, -1.0, math.pi / 2, 0.5)
    late = {"sensing": 0.03}
    for s in seen(knots, LOW | {"sweep": sweep}, latency=late)[5:30]:
        _, (circles,) = placed(knots, np.array([s.t]))
        x, y = 2.0, -1.0 + 0.5 * s.t
        at = [(x - b, y + a) for a, b, _ in circles]  # turned by a quarter
        nearest = min(math.hypot(*p) for p in at) - RADIUS
        assert ranges(s).min() == pytest.approx(nearest, abs=1e-3 + 1.0 * sweep / 2)


def test_a_person_who_stands_for_good_has_legs_as_well() -> None:
    """Such as a recording may have."""
    still = Body("anna", "person", Circle(0.25), np.array([2.0, 0.0, 0.3]))
    pilot = Pilot(lambda _: Command(0.0, 0.0))
    run(pilot, [still], make_scenario(legs=LEGS), make_robot(lidar=LIDAR | LOW))
    assert {gaps(s) for s in pilot.seen} == {2}


def test_contact_is_with_the_whole_disc() -> None:
    pilot = Pilot(lambda _: Command(1.0, 0.0))
    trials = [
        run(
            pilot, [person()], make_scenario(legs=LEGS), make_robot(lidar=LIDAR | lidar), [straight(2.0, 0.0, 0.0, 0.0)]
        )
        for lidar in ({}, LOW)
    ]
    assert {t.outcome for t in trials} == {Outcome.COLLISION}
    assert np.array_equal(trials[0].pose, trials[1].pose)
    assert trials[1].pose[-1, 0] == pytest.approx(1.5, abs=1e-3)


def test_the_same_legs_come_out_again_and_others_of_another_seed() -> None:
    knots = straight(2.0, -1.0, math.pi / 2, 0.6)

    def scans(seed: int) -> FloatArray:
        pilot = Pilot(lambda _: Command(0.0, 0.0))
        run(pilot, [person()], make_scenario(legs=LEGS, seed=seed), make_robot(lidar=LIDAR | LOW), [knots])
        return np.array([ranges(s) for s in pilot.seen])

    assert np.array_equal(scans(3), scans(3))
    assert not np.array_equal(scans(3), scans(4))


@pytest.mark.parametrize("lidar", [{"height": -0.1}, {"height": math.nan}, {"height": "knee"}])
def test_a_height_that_can_not_be_is_refused(lidar: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="height"):
        make_robot(lidar=LIDAR | lidar)


def tracks_of(robot: Robot, knots: list[FloatArray], legs: bool, tracking: str) -> list[tuple[int, float]]:
    """At each scan from 1.5 s on: how many moving bodies are told of near the first of the people, and by how much the
    nearest one's velocity is wrong [m/s]; a robot stands and looks on."""
    left_out = () if legs else ("legs",)
    pilot = Pilot(lambda _: Command(0.0, 0.0))
    around = [body(rectangle(0.2, 30.0), 6.0, 0.0), *(person(f"person {i}") for i in range(len(knots)))]
    run(pilot, around, make_scenario(legs=LEGS, ideal=left_out), robot, knots)
    tracker = make_tracker(tracking, robot)
    tracker.reset(Task(robot.period, 1.0, np.zeros(3)), robot, np.random.default_rng(0))
    found, (first, last) = [], knots[0]
    v = (last[1:3] - first[1:3]) / last[0]
    for s in pilot.seen:
        told = tracker.update(s, np.zeros(3))
        x = first[1:3] + v * s.t
        if s.t >= 1.5 and math.hypot(*x) < 3.3 and abs(math.atan2(x[1], x[0])) < 1.3:
            near = told.moving & (np.hypot(*(told.position - x).T) < 0.6)
            error = np.hypot(*(told.velocity[near] - v).T).min() if near.any() else math.inf
            found.append((int(near.sum()), float(error)))
    return found


@pytest.mark.parametrize("name", ["tiago", "hosbot", "turtlebot3-waffle"])
@pytest.mark.parametrize("way", [(4.4, 0.2, math.pi), (2.5, -3.0, math.pi / 2)])
def test_one_person_is_one_track(name: str, way: tuple[float, float, float]) -> None:
    knots = straight(*way, 1.0, 5.0)
    with_, without = (tracks_of(load_robot(name), [knots], legs, "kalman") for legs in (True, False))
    assert len(with_) == len(without) > 10
    count = np.array([n for n, _ in with_])
    assert (count <= 1).mean() > 0.95  # never two but while a leg comes out from behind the other
    assert (count >= 1).mean() >= (np.array([n for n, _ in without]) >= 1).mean() - 0.1
    assert np.median([e for _, e in with_ if e < math.inf]) < 0.25


def test_two_people_side_by_side_are_two() -> None:
    """Shoulder to shoulder, coming: legs 0.17 m apart within a person, 0.33 m between them."""
    ways = [straight(4.4, y, math.pi, 0.8, 5.0) for y in (0.25, -0.25)]
    count = np.array([n for n, _ in tracks_of(load_robot("hosbot"), ways, True, "kalman")])
    assert (count >= 1).all()
    assert (count == 2).mean() > 0.5  # their inner legs may come nearer to each other than to their own ones


def test_what_is_left_out_is_left_out_of_the_world_alone() -> None:
    robot = load_robot("tiago")
    without = ideal(robot, ("all",))
    assert without.lidar is not None
    assert robot.lidar is not None
    lidar = without.lidar
    assert (lidar.sweep, lidar.height, lidar.divergence, lidar.dropout, lidar.bias, lidar.sigma) == (
        0,
        None,
        0,
        0,
        0,
        0,
    )
    assert without.odometry.velocity_errors(1.0, 1.0, 0.1) == (0.0, 0.0)
    assert ideal(robot, ()) == robot
    assert ideal(robot, ("bias",)).lidar == robot.lidar.model_copy(update={"bias": 0.0})
    assert ideal(load_robot("rescue"), ("all",)).camera == load_robot("rescue").camera


def test_errors_are_named_once_and_known() -> None:
    assert set(get_args(RobotError)) == {*ERRORS, "all"}
    assert errors_named(("bias", "sweep", "bias")) == ("sweep", "bias")
    assert errors_named(("all", "bias")) == tuple(ERRORS)
    robot = load_robot("tiago")
    (made, *_) = load_suite("hospital").build(robot, Selection(ideal=("bias", "legs"), repetitions=1))
    assert made.ideal == ("legs", "bias")
    with pytest.raises(ClearwayError, match=r"ideal: unknown error of a robot 'swep'; did you mean 'sweep'\?"):
        load_suite("hospital").build(robot, Selection(ideal=("swep",)))
    with pytest.raises(ValidationError, match="ideal"):
        make_scenario(ideal=("swep",))
