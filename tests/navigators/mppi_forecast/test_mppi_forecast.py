"""MPPI among forecasts: its samples and their costs against a plain reading, the weights, and where it is known to fail."""

from __future__ import annotations

import math
from types import SimpleNamespace

import mppi_forecast_oracle as oracle
import numpy as np
import pytest

from clearway.contract import Goal, Latency, Observation, Task
from clearway.crowds.ways import Room, ways_to, with_discs
from clearway.errors import ClearwayError
from clearway.geometry.footprint import footprint
from clearway.geometry.motion import ramp, slide
from clearway.geometry.shapes import Circle, Polygon, rectangle
from clearway.navigators.common.mppi.weights import softmax, weighted_mean
from clearway.navigators.mppi_forecast import MppiForecast
from clearway.navigators.mppi_forecast.costs import Body, Floor, People, Weights, judge, way_left
from clearway.navigators.mppi_forecast.decision import Sampler, Settings
from clearway.navigators.mppi_forecast.navigator import _rim
from clearway.navigators.mppi_forecast.rollout import Drawn, make_room, roll_out
from clearway.robots import DriveLimits, load_robot
from perceived import obstacles

pytestmark = pytest.mark.slow  # compiles for long

STEPS, BATCH, DT, HOLD = 20, 24, 0.2, 3
ANYWHERE = np.array((-math.inf, -math.inf, math.inf, math.inf))
DIFFERENTIAL = DriveLimits(-0.5, 1.0, 1.5, 2.0, 1.5, 3.0, 4.0)
OMNI = DriveLimits(-0.8, 1.0, math.inf, math.inf, 1.5, math.inf, math.inf, 0.8, math.inf, math.inf, 1.0)
NOBODY = People(np.empty((STEPS + 1, 0, 2)), np.empty((STEPS + 1, 0)), np.empty(0), np.empty(0), np.empty(0, np.int64))


def open_room(discs=(), side=10.0, h=0.1):
    n = round(side / h)
    room = Room(np.full((n, n), 5.0), np.full(2, -side / 2), h)
    return with_discs(room, np.array(discs, float).reshape(-1, 3), 1.0)


def body_of(shape, limits):
    foot = footprint(shape)
    return Body(foot, _rim(foot), limits.deceleration, limits.lateral_deceleration, limits.v_max)


def weights_of(**changed):
    usual = Weights(DT, 50.0, 0.8, 0.03, 0.4, 1.0, 0.02, 0.3, 0.2, np.array((0.5, 0.4, 0.8)))
    return usual._replace(**changed)


def floor_of(room, goal, area=ANYWHERE, radius=0.3):
    ways = ways_to(np.array(goal, float), room, radius)
    return ways, Floor(room.clearance, ways.distance, room.origin, room.resolution, ways.goal, area)


def drawn_of(rng, deviation=(0.5, 0.4, 0.8)):
    points = (STEPS - 1) // HOLD + 2
    return Drawn(*(rng.normal(0.0, s, (points, BATCH)).astype(np.float32) for s in deviation))


def scene(seed, limits):
    """Samples and people on random input."""
    rng = np.random.default_rng(seed)
    plan = rng.normal(0.3, 0.4, (3, STEPS)).astype(np.float32)
    go = rng.normal(0.0, 1.0, (3, STEPS)).astype(np.float32)
    start, speed = rng.uniform(-1.0, 1.0, 3), np.array((0.4, 0.0, -0.3))
    drawn, samples = drawn_of(rng), make_room(STEPS, BATCH)
    roll_out(samples, drawn, HOLD, plan, go, start, speed, limits, DT)
    obstacle = np.array((0, 0, 0, 1, 2, 2))
    place = rng.uniform(-2.0, 2.0, (6, 2)) + np.arange(STEPS + 1)[:, None, None] * rng.normal(0.0, 0.2, (6, 2))
    spread = np.linspace(0.05, 0.4, STEPS + 1)[:, None] * rng.uniform(0.3, 1.0, 6)
    people = People(place, spread, np.array((0.5, 0.3, 0.2, 1.0, 0.6, 0.4)), rng.uniform(0.1, 0.4, 6), obstacle)
    return SimpleNamespace(
        plan=plan, go=go, start=start, speed=speed, drawn=drawn, samples=samples, people=people, limits=limits
    )


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI])
def test_samples_keep_to_the_base(limits):
    s = scene(1, limits)
    controls = oracle.controls_of(s.drawn, HOLD, s.plan, s.go, limits, STEPS, BATCH)
    for b in range(BATCH):
        velocity, poses = oracle.drive(controls[:, :, b].T, s.start, s.speed, limits, DT)
        for k, found in enumerate((s.samples.vx, s.samples.vy, s.samples.wz)):
            assert found[:, b] == pytest.approx(velocity[:, k], abs=2e-6)
        for k, found in enumerate((s.samples.x, s.samples.y, s.samples.yaw)):
            assert found[:, b] == pytest.approx(poses[:, k], abs=2e-5)
    assert np.array_equal(s.samples.cvx, s.samples.vx[1:])  # what is averaged is what the base can follow
    assert np.array_equal(s.samples.cwz, s.samples.wz[1:])


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI])
@pytest.mark.parametrize("shape", [Circle(0.3), rectangle(0.8, 0.5)])
def test_costs_are_those_of_the_plain_reading(shape, limits):
    met = stood = arrived = 0
    for seed in range(4):
        s = scene(seed, limits)
        room = open_room([(1.0, 0.5, 0.3), (-1.5, -1.0, 0.5)])
        _, floor = floor_of(room, (0.6, 0.4), np.array((-1.5, -1.4, 4.0, 4.0)))
        body, weights, costs = body_of(shape, limits), weights_of(), np.zeros(BATCH, np.float32)
        judge(s.samples, s.start, s.people, floor, body, weights, costs)
        for b in range(BATCH):
            velocity = np.column_stack((s.samples.vx[:, b], s.samples.vy[:, b], s.samples.wz[:, b])).astype(float)
            poses = np.column_stack((s.samples.x[:, b], s.samples.y[:, b], s.samples.yaw[:, b])).astype(float)
            plain = oracle.cost(velocity, poses, s.start, s.people, floor, body, weights, shape)
            assert costs[b] == pytest.approx(plain, rel=2e-4, abs=2e-3)
            met += oracle.chance_of_contact(poses[3], poses[4], s.people, 4, shape) > 0.01
            stood += oracle.between(floor.clearance, floor, poses[-1, :2]) < 0.5
            arrived += np.hypot(*(poses[:, :2] - floor.goal).T).min() < weights.reach
    assert min(met, stood, arrived) >= 3  # none of it is out of play


def test_the_plan_becomes_the_weighted_mean():
    settings = Settings(STEPS, 64, HOLD, 0.1, 0.5, 2.0, DIFFERENTIAL, body_of(Circle(0.3), DIFFERENTIAL), weights_of())
    ways, _ = floor_of(open_room(), (3.0, 0.0))
    sampler, start = Sampler(settings, np.uint64(5)), np.array((0.0, 0.0, 0.4))
    for _ in range(3):
        command = sampler.decide(start, np.zeros(3), NOBODY, ways, ANYWHERE, 0.2)
    costs = sampler.costs.astype(float)
    share = np.exp(-(costs - costs.min()) / 0.5)
    share /= share.sum()
    assert 1.5 < 1.0 / (share**2).sum() < 60.0
    for axis, controls in enumerate((sampler.samples.cvx, sampler.samples.cvy, sampler.samples.cwz)):
        assert sampler.plan[axis] == pytest.approx(controls @ share, abs=1e-5)
    assert command == pytest.approx(sampler.plan[:, 0])


def settled(sampler, start, ways, people, seconds, limits):
    """Drive on its own commands among people who stay where they are; poses."""
    pose, velocity, poses = np.array(start, float), np.zeros(3), []
    for _ in range(round(seconds / sampler._settings.period)):
        v, v_y, omega = sampler.decide(pose, velocity, people, ways, ANYWHERE, 0.2)
        velocity = np.array((v, v_y, omega))
        pose = np.array(slide(*pose, v, v_y, omega, sampler._settings.period))
        poses.append(pose)
    return np.array(poses)


def u_trap():
    """A U that is open to the left, 3 m deep and wide."""
    side = np.linspace(-1.5, 1.5, 16)
    back = [(1.5, y, 0.15) for y in side]
    return back + [(x, y, 0.15) for x in side for y in (-1.5, 1.5)]


def test_out_of_a_trap_it_needs_to_be_told_the_way():
    room, goal, limits = open_room(u_trap()), (3.5, 0.0), DIFFERENTIAL._replace(v_min=0.0)
    settings = Settings(STEPS, 400, HOLD, DT, 0.05, 2.0, limits, body_of(Circle(0.3), limits), weights_of())
    told, _ = floor_of(room, goal)
    straight = told._replace(distance=floor_of(open_room(), goal)[0].distance)  # as the crow flies
    out = settled(Sampler(settings, np.uint64(1)), (0.0, 0.0, 0.0), told, NOBODY, 16.0, limits)
    stuck = settled(Sampler(settings, np.uint64(1)), (0.0, 0.0, 0.0), straight, NOBODY, 16.0, limits)
    assert np.hypot(*(out[:, :2] - goal).T).min() < 0.3
    assert np.hypot(*(stuck[:, :2] - goal).T).min() > 1.5
    assert (np.abs(stuck[:, 1]) < 1.5).all()
    assert stuck[:, 0].max() < 1.3  # stuck, without contact


def test_the_mean_of_two_good_ways_round_leads_into_who_comes():
    rng = np.random.default_rng(3)
    drawn = drawn_of(rng, (0.1, 0.4, 0.8))
    for noise, sign in ((drawn.v, 1.0), (drawn.omega, -1.0)):
        noise[:, BATCH // 2 :] = sign * noise[:, : BATCH // 2]  # each sample has its mirror image
    plan = np.zeros((3, STEPS), np.float32)
    plan[0] = 0.8
    limits = DIFFERENTIAL._replace(acceleration=math.inf, angular_acceleration=math.inf, deceleration=math.inf, angular_deceleration=math.inf)  # fmt: skip
    samples, start, body = make_room(STEPS, BATCH), np.zeros(3), body_of(Circle(0.3), limits)
    first = 3  # without those that are no noise, and their mirror images
    roll_out(samples, drawn, HOLD, plan, plan, start, np.array((0.8, 0.0, 0.0)), limits, DT)
    along = np.arange(STEPS + 1) * DT
    at = np.column_stack((3.5 - 0.5 * along, np.zeros(STEPS + 1)))[:, None]
    people = People(at, np.full((STEPS + 1, 1), 0.05), np.ones(1), np.full(1, 0.3), np.zeros(1, np.int64))
    _, floor = floor_of(open_room(), (4.5, 0.0))
    costs = np.zeros(BATCH, np.float32)
    judge(samples, start, people, floor, body, weights_of(), costs)
    pairs = np.r_[first : BATCH // 2, BATCH // 2 + first : BATCH]
    assert costs[pairs][: len(pairs) // 2] == pytest.approx(costs[pairs][len(pairs) // 2 :], abs=0.02)
    best = costs[pairs].min()
    mean = np.zeros((3, STEPS), np.float32)
    share = softmax(costs[pairs], np.float32(0.05))
    for axis, controls in ((0, samples.cvx), (2, samples.cwz)):
        weighted_mean(mean[axis], np.ascontiguousarray(controls[:, pairs]), share)
    assert np.abs(mean[2]).max() < 0.1  # straight on
    roll_out(samples, drawn, HOLD, mean, mean, start, np.array((0.8, 0.0, 0.0)), limits, DT)
    judge(samples, start, people, floor, body, weights_of(), costs)
    assert costs[0] > best + 3.0


def drive_past(robot, seed=0, latency=0.0, seconds=20.0, **options):
    """Poses on the way past two that cross, and the least distance to them, m."""
    navigator, period = MppiForecast(**{"samples": 300, **options}), 0.2
    model = load_robot(robot)
    limits = model.limits(1.0)
    late = round(latency / period)
    task = Task(period, 1.0, np.zeros(3), latency=Latency(command=late * period))
    navigator.reset(task, model, np.random.default_rng(seed))
    goal = Goal(np.array((6.0, 0.0, 0.0)), 0.25, math.inf)
    pose, velocity, poses, least = np.zeros(3), np.zeros(3), [], math.inf
    commands = [(0.0, 0.0, 0.0)] * late
    begin, way = np.array(((3.0, -3.0), (4.5, 3.0))), np.array(((0.0, 0.9), (0.0, -0.8)))
    for k in range(round(seconds / period)):
        place = begin + k * period * way
        seen = obstacles(place, way, 0.3, velocity_error=0.05)
        told = velocity if limits.kind == "omnidirectional" else velocity[:2]
        observation = Observation(k * period, pose, told[[0, 2, 1]] if len(told) == 3 else velocity[[0, 2]], pose, goal, obstacles=seen)  # fmt: skip
        command = navigator.step(observation)
        assert limits.v_min - 1e-9 <= command.v <= limits.v_max + 1e-9
        commands.append((0.0, 0.0, 0.0) if command.arrived else (command.v, command.v_y, command.omega))
        now = commands.pop(0)
        if limits.kind == "differential":
            velocity[0], v = ramp(velocity[0], now[0], limits.acceleration, limits.deceleration, period)
            velocity[2], w = ramp(velocity[2], now[2], limits.angular_acceleration, limits.angular_deceleration, period)
            pose = np.array(slide(*pose, v, 0.0, w, period))
        else:
            velocity = np.array(now)
            pose = np.array(slide(*pose, *velocity, period))
        poses.append(pose)
        least = min(least, float(np.hypot(*(begin + (k + 1) * period * way - pose[:2]).T).min()))
        if command.arrived and not velocity.any():
            break
    return np.array(poses), least


@pytest.mark.parametrize(("robot", "latency"), [("rescue", 0.0), ("rescue", 0.4), ("crowdnav-disc", 0.0)])
def test_it_arrives_past_those_who_cross(robot, latency):
    radius = footprint(load_robot(robot).planner_shape).circumscribed
    poses, least = drive_past(robot, latency=latency)
    assert np.hypot(*(poses[-1, :2] - (6.0, 0.0))) < 0.25
    assert least > 0.3 + radius
    assert len(poses) < 70  # 14 s


def test_same_seed_same_way_another_seed_another():
    (a, _), (b, _), (c, _) = (drive_past("rescue", seed, seconds=3.0) for seed in (0, 0, 1))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


@pytest.mark.parametrize(
    ("option", "value"),
    [("samples", 4), ("horizon", -1.0), ("discount", 0.0), ("temperature", math.nan), ("speed", 1.0)],
)
def test_a_wrong_option_is_told(option, value):
    with pytest.raises(ClearwayError, match=option):
        MppiForecast(**{option: value})


def test_an_outline_is_followed_closely():
    shape = Polygon(((0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3)))
    rim = _rim(footprint(shape))
    gaps = np.hypot(*(np.roll(rim, -1, axis=0) - rim).T)
    assert gaps.max() <= 0.15 + 1e-9
    assert gaps.sum() == pytest.approx(2.8)


def test_a_map_may_be_a_cell_wide():
    room = Room(np.array([[1.0, 0.5, 2.0]]), np.zeros(2), 1.0)
    _, floor = floor_of(room, (0.5, 0.5), radius=0.1)
    assert way_left(floor, 0.5, 7.0) == pytest.approx(0.0)
    assert way_left(floor, 1.0, 0.5) == pytest.approx(0.5 * floor.distance[0, 1])
