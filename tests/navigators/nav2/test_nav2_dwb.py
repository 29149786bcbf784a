"""Nav2's DWB controller against a plain reading on random input, and how it behaves on whole paths."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import dwb_oracle as plain
import numpy as np
import pytest
from test_nav2_pursuit import OUTLINE, drive, random_scene, view

from clearway.errors import ClearwayError
from clearway.navigators.nav2.controllers.dwb.controller import DWB
from clearway.navigators.nav2.controllers.dwb.parameters import DWBParameters
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.seams import NoValidControl, Tolerances, Velocity

pytestmark = pytest.mark.slow  # compiles for long

DT = 0.05
FAR = Tolerances(0.25, 0.25, False)
USUAL = ("RotateToGoal", "Oscillation", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist")
ROBOT: dict[str, Any] = {
    "max_vel_x": 0.5,
    "max_vel_theta": 1.0,
    "max_speed_xy": 0.5,
    "acc_lim_x": 2.5,
    "acc_lim_theta": 3.2,
    "decel_lim_x": -2.5,
    "decel_lim_theta": -3.2,
    "linear_granularity": 0.05,
    "BaseObstacle": {"scale": 0.02},
    "PathAlign": {"scale": 32.0, "forward_point_distance": 0.1},
    "GoalAlign": {"scale": 24.0, "forward_point_distance": 0.1},
    "PathDist": {"scale": 32.0},
    "GoalDist": {"scale": 24.0},
    "RotateToGoal": {"scale": 32.0},
}


def controller(critics: tuple[str, ...] = USUAL, **table: Any) -> tuple[DWB, dict[str, Any], dict[str, dict[str, Any]]]:
    """A controller, its parameters, and those of its critics."""
    branch = settle(DWBParameters, ROBOT | {"critics": critics} | table, "FollowPath", None)
    groups = {name: child.group for name, child in branch.children.items()}
    values = {name: group.model_dump() for name, group in groups.items()}
    group = branch.group
    assert isinstance(group, DWBParameters)
    return DWB(group, groups, DT), group.model_dump(), values


def random_table(rng: np.random.Generator) -> dict[str, Any]:
    """Parameters of the controller and of its critics, all of them, in any order."""
    sideways = float(rng.choice((0.0, 0.2)))
    table: dict[str, Any] = {
        "min_vel_x": float(rng.choice((0.0, -0.2))),
        "max_vel_y": sideways,
        "min_vel_y": -sideways,
        "acc_lim_y": 1.0,
        "decel_lim_y": -1.0,
        "min_speed_xy": float(rng.choice((0.0, 0.1, -1.0))),
        "min_speed_theta": float(rng.choice((0.0, 0.3))),
        "vx_samples": int(rng.integers(0, 5)),
        "vy_samples": 3,
        "vtheta_samples": int(rng.integers(3, 6)),
        "sim_time": float(rng.uniform(0.8, 1.7)),
        "angular_granularity": 0.2,
        "trajectory_generator_name": f"dwb_plugins::{rng.choice(('StandardTrajectoryGenerator', 'LimitedAccelGenerator'))}",
        "sim_period": float(rng.choice((0.05, 0.3))),
        "discretize_by_time": bool(rng.random() < 0.2),
        "time_granularity": 0.2,
        "include_last_point": bool(rng.random() < 0.7),
        "limit_vel_cmd_in_traj": bool(rng.random() < 0.3),
        "xy_goal_tolerance": float(rng.choice((0.25, 2.0))),
        "trans_stopped_velocity": float(rng.choice((0.25, 0.05))),
        "RotateToGoal": {"scale": 5.0, "lookahead_time": float(rng.choice((-1.0, 0.5, 9.0)))},
        "Oscillation": {"x_only_threshold": float(rng.choice((0.05, -1.0))), "oscillation_reset_time": 0.2},
        "Twirling": {"scale": float(rng.choice((0.0, 0.3)))},
        "PreferForward": {"scale": float(rng.choice((0.0, 0.3)))},
    }
    for name in ("BaseObstacle", "ObstacleFootprint"):
        table[name] = {"scale": float(rng.choice((0.0, 0.02))), "sum_scores": bool(rng.random() < 0.3)}
    for name in ("PathDist", "GoalDist", "PathAlign", "GoalAlign"):
        how = str(rng.choice(("last", "Last", "sum", "product"), p=(0.4, 0.3, 0.2, 0.1)))
        table[name] = {"scale": float(rng.uniform(0.0, 30.0)), "aggregation_type": how}
        if "Align" in name:
            table[name]["forward_point_distance"] = float(rng.uniform(0.05, 0.4))
    return table


def test_against_a_plain_reading() -> None:
    rng = np.random.default_rng(31)
    ends: Counter[str] = Counter()
    for _ in range(24):
        names = tuple(str(n) for n in rng.permutation(list(plain.CRITICS))[: rng.integers(3, 11)])
        dwb, p, critics = controller(names, **random_table(rng))
        oracle = plain.PlainDWB(p, critics, DT)
        cost, path, pose = random_scene(rng)
        cost[rng.random(cost.shape) < 0.9] = 0
        grid = plain.PlainMap(cost, complex(-1.5, -1.5), 0.05, True)
        velocity = Velocity(0.0, 0.0, 0.0)
        for k in range(4):
            told = tuple(pose), tuple(velocity), tuple(path[-1]), [tuple(q) for q in path]
            oracle.prepare(grid, OUTLINE, *told)
            least, best = oracle.best(*told[:2])
            command = Velocity(0.0, 0.0, 0.0)
            if best is None:
                with pytest.raises(NoValidControl):
                    dwb.compute(DT * k, pose, velocity, path, path[-1], FAR, view(cost))
                ends["none"] += 1
            else:
                command = dwb.compute(DT * k, pose, velocity, path, path[-1], FAR, view(cost))
                if command != pytest.approx(best.velocity, abs=1e-9):  # two that cost the same to the last digits
                    same = (
                        plain.Trajectory(p, tuple(pose), tuple(velocity), s) for s in oracle.samples(tuple(velocity))
                    )
                    costs = [oracle.cost(t) for t in same if t.velocity == pytest.approx(tuple(command), abs=1e-9)]
                    assert min(costs) == pytest.approx(least, abs=1e-9)
                    ends["tie"] += 1
                ends["found"] += 1
                np.testing.assert_allclose(dwb.trajectory[0], pose[:2])
            for critic in oracle.critics:
                critic.debrief(DT * k, tuple(command))
            velocity = Velocity(*(np.array(command) + rng.normal(0.0, 0.1, 3) * (1.0, p["max_vel_y"] > 0, 1.0)))
            pose = pose + np.array((*rng.normal(0.0, 0.03, 2), rng.normal(0.0, 0.1)))
    assert ends["found"] > 50
    assert ends["none"] > 3
    assert ends["tie"] < 10


@pytest.mark.parametrize("generator", ["StandardTrajectoryGenerator", "LimitedAccelGenerator"])
def test_it_follows_a_bend_and_turns_to_the_goal(generator: str) -> None:
    angle = np.linspace(0.0, math.pi / 2, 40)
    bend = np.column_stack((1.0 * np.sin(angle), 1.0 * (1 - np.cos(angle)), angle))
    bend[-1, 2] = -2.5
    dwb, *_ = controller(trajectory_generator_name=f"dwb_plugins::{generator}", trans_stopped_velocity=0.1)
    poses = drive(dwb, bend, np.zeros(3), 12.0)
    gaps = [np.hypot(*(bend[:, :2] - p[:2]).T).min() for p in poses]
    assert max(gaps) < 0.15
    assert math.dist(poses[-1, :2], bend[-1, :2]) < 0.3
    assert abs(math.remainder(poses[-1, 2] + 2.5, math.tau)) < 0.1


def test_a_wall_is_gone_around_or_refused() -> None:
    cost = np.zeros((60, 60), np.uint8)
    cost[26:36, 36:38] = 254
    path = np.column_stack((np.linspace(0.0, 1.2, 25), np.zeros(25), np.zeros(25)))
    told = np.zeros(3), Velocity(0.3, 0.0, 0.0), path, path[-1], FAR
    dwb, *_ = controller((*USUAL, "ObstacleFootprint"))
    around = dwb.compute(0.0, *told, view(cost))
    assert abs(around.omega) > 0.1 or around.v_x < 0.2
    end = dwb.trajectory[-1]
    assert not 0.2 < end[0] < 0.5 or abs(end[1]) > 0.2
    cost[20:41, 20:41] = 254
    with pytest.raises(NoValidControl, match="legal"):
        dwb.compute(0.1, *told, view(cost))


def test_the_speed_limit_shrinks_all_limits() -> None:
    path = np.column_stack((np.linspace(0.01, 1.21, 31), np.full(31, 0.02), np.zeros(31)))
    told = np.array((0.01, 0.02, 0.0)), Velocity(0.3, 0.0, 0.0), path, path[-1], FAR, view()
    dwb, *_ = controller()
    assert dwb.compute(0.0, *told).v_x == pytest.approx(0.5)
    dwb.set_speed_limit(40.0, True)
    assert dwb.compute(0.0, *told).v_x == pytest.approx(0.2)
    dwb.set_speed_limit(0.3, False)
    assert dwb.compute(0.0, *told).v_x == pytest.approx(0.3)
    dwb.set_speed_limit(0.0, False)
    assert dwb.compute(0.0, *told).v_x == pytest.approx(0.5)


def test_names_and_values_of_critics() -> None:
    other, *_ = controller(
        ("PathDistCritic", "Nose"), Nose={"class": "dwb_critics::PathAlign", "forward_point_distance": 0.2}
    )
    assert other._critics.kind.tolist() == [6, 7]
    for critics, table, text in (
        (("PathDist", "PathDist"), {}, "twice"),
        (("PathDst",), {}, "PathDist"),
        ((), {}, "critics"),
        (("PathDist",), {"PathDist": {"aggregation_type": "mean"}}, "last, sum, product"),
        (("PathDist",), {"PathDist": {"scale": -1.0}}, "scale"),
        (("PathDist",), {"vx_samples": 900, "vtheta_samples": 900}, "100000"),
    ):
        with pytest.raises(ClearwayError, match=text):
            controller(critics, **table)
