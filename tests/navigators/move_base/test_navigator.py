"""move_base's state machine with scripted planners, and the whole navigator in a small kinematic loop."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest

from clearway.contract import Command, Goal, Observation, Scan, Task
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.navigators.move_base import MoveBase
from clearway.navigators.move_base.local_planners.interface import LocalResult
from clearway.navigators.move_base.parameters import Parameters
from clearway.robots import Robot, load_robot
from rooms import floor

PERIOD = 0.1


def robot(**groups: dict[str, Any]) -> Robot:
    """HOSBOT with some groups of its parameters updated."""
    base = load_robot("hosbot")
    navigators = copy.deepcopy(base.navigators)
    for group, values in groups.items():
        navigators["move-base"].setdefault(group, {}).update(values)
    return base.model_copy(update={"navigators": navigators})


def observe(t: float, pose: FloatArray, goal: Goal, velocity: FloatArray | None = None) -> Observation:
    scan = Scan(np.full(8, math.inf), -math.pi, math.pi / 4, 0.05, 10.0, np.zeros(3))
    return Observation(t, pose, np.zeros(2) if velocity is None else velocity, pose, goal, scan)


class Planner:
    """Plans straight ahead, or not at all."""

    def __init__(self, works: bool = True) -> None:
        self.works, self.calls = works, 0

    def plan(self, costmap: object, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        self.calls += 1
        return np.array((start, goal)) if self.works else None


class Controller:
    """Drives at 0.3 m/s, or finds no command; arrives when it is told to."""

    prune_plan = True

    def __init__(self, works: bool = True) -> None:
        self.works, self.arrived, self.plans = works, False, 0

    def reset(self) -> None: ...

    def set_plan(self) -> None:
        self.plans += 1

    def goal_reached(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> bool:
        return self.arrived

    def compute(self, *_: object) -> LocalResult:
        return LocalResult(0.3, 0.1, self.works, np.zeros((0, 2)))


def scripted(planner: Planner, controller: Controller, **groups: dict[str, Any]) -> MoveBase:
    navigator = MoveBase()
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), robot(**groups), np.random.default_rng(0))
    navigator._planner, navigator._controller = planner, controller  # type: ignore[assignment]
    return navigator


def drive(navigator: MoveBase, goal: Goal, seconds: float, start: float = 0.0) -> tuple[list[str], Command]:
    """What it was doing, without repetition, and its last command; the robot stands, but turns as it is told."""
    said: list[str] = []
    yaw = 0.0
    command = Command(0.0, 0.0)
    for k in range(round(seconds / PERIOD)):
        command = navigator.step(observe(start + k * PERIOD, np.array((0.0, 0.0, yaw)), goal))
        yaw += command.omega * PERIOD
        status = navigator.diagnostics().status
        if not said or said[-1] != status:
            said.append(status)
        if command.gave_up or command.arrived:
            break
    return said, command


GOAL = Goal(np.array((5.0, 0.0, 0.0)), 0.1, 0.05)


def test_recoveries_come_in_ros_order_and_then_it_gives_up() -> None:
    navigator = scripted(
        Planner(False), Controller(), move_base={"clearing_rotation_allowed": True, "planner_patience": 1.0}
    )
    said, command = drive(navigator, GOAL, 60.0)
    recoveries = [s.removeprefix("recovery: ") for s in said if s.startswith("recovery")]
    assert recoveries == ["conservative_reset", "rotate_recovery", "aggressive_reset", "rotate_recovery"]
    assert command.gave_up == "Failed to find a valid plan. Even after executing recovery behaviors."
    assert command.v == command.omega == 0.0


def test_patience_of_the_planner_is_waited_for() -> None:
    planner = Planner(False)
    navigator = scripted(planner, Controller(), move_base={"planner_patience": 2.0, "recovery_behavior_enabled": False})
    said, command = drive(navigator, GOAL, 60.0)
    assert command.gave_up is not None
    assert planner.calls == 22  # one per period while planning, from 0.0 s to just over 2.0 s
    assert said == ["planning", "gave up"]


def test_retries_are_bounded() -> None:
    planner = Planner(False)
    navigator = scripted(
        planner, Controller(), move_base={"max_planning_retries": 3, "recovery_behavior_enabled": False}
    )
    drive(navigator, GOAL, 60.0)
    assert planner.calls == 4


def test_no_valid_command_leads_to_planning_then_to_recovery_then_to_giving_up() -> None:
    settings = {"planner_frequency": 0.0, "controller_patience": 1.0, "clearing_rotation_allowed": False}
    navigator = scripted(Planner(), Controller(False), move_base=settings)
    said, command = drive(navigator, GOAL, 60.0)
    recoveries = [s for s in said if s.startswith("recovery")]
    assert recoveries == ["recovery: conservative_reset", "recovery: aggressive_reset"]
    assert command.gave_up == "Failed to find a valid control. Even after executing recovery behaviors."


def test_a_robot_that_does_not_get_on_is_oscillating() -> None:
    settings = {"oscillation_timeout": 3.0, "clearing_rotation_allowed": False, "planner_frequency": 0.0}
    navigator = scripted(Planner(), Controller(), move_base=settings)
    said, command = drive(navigator, GOAL, 60.0)
    assert [s for s in said if s.startswith("recovery")] == [
        "recovery: conservative_reset",
        "recovery: aggressive_reset",
    ]
    assert command.gave_up == "Robot is oscillating. Even after executing recovery behaviors."


def test_a_plan_is_used_one_period_after_it_was_asked_for_and_again_at_the_planner_rate() -> None:
    planner, controller = Planner(), Controller()
    navigator = scripted(planner, controller, move_base={"planner_frequency": 1.0})
    first = navigator.step(observe(0.0, np.zeros(3), GOAL))
    assert (first.v, planner.calls, controller.plans) == (0.0, 1, 0)
    second = navigator.step(observe(0.1, np.zeros(3), GOAL))
    assert (second.v, planner.calls, controller.plans) == (0.3, 1, 1)
    drive(navigator, GOAL, 10.0, start=0.2)
    assert planner.calls == 11


def test_arrival_and_the_next_goal() -> None:
    planner, controller = Planner(), Controller()
    navigator = scripted(planner, controller)
    drive(navigator, GOAL, 1.0)
    controller.arrived = True
    command = navigator.step(observe(1.0, np.zeros(3), GOAL))
    assert command == Command(0.0, 0.0, arrived=True)
    assert navigator.step(observe(1.1, np.zeros(3), GOAL)).arrived
    controller.arrived, calls = False, planner.calls
    back = Goal(np.array((-1.0, 0.0, math.pi)), 0.1, 0.05, leg=1)
    command = navigator.step(observe(1.2, np.zeros(3), back))
    assert (command.arrived, command.v, planner.calls) == (False, 0.0, calls + 1)
    assert navigator.step(observe(1.3, np.zeros(3), back)).v == 0.3


def test_set_speed_caps_the_command() -> None:
    navigator = MoveBase()
    navigator.reset(Task(PERIOD, 0.2, np.zeros(3), floor()), robot(), np.random.default_rng(0))
    navigator._planner, navigator._controller = Planner(), Controller()  # type: ignore[assignment]
    assert drive(navigator, GOAL, 1.0)[1].v == 0.2


def test_a_wrong_parameter_is_named_with_its_robot() -> None:
    with pytest.raises(
        ClearwayError, match=r"robot hosbot: navigators.move-base.move_base.planer_frequency.*planner_f"
    ):
        Parameters.read(robot(move_base={"planer_frequency": 1.0}))
    with pytest.raises(ClearwayError, match=r"move-base.local_costmap.inflation_layer.inflation_radius: -1.0 is wrong"):
        Parameters.read(robot(local_costmap={"inflation_layer": {"inflation_radius": -1.0}}))
    with pytest.raises(ClearwayError, match="use_dijkstra is a parameter of global_planner/GlobalPlanner"):
        Parameters.read(robot(global_planner={"use_dijkstra": False}))


def test_an_unknown_local_planner_is_refused() -> None:
    with pytest.raises(ClearwayError, match="unknown local planner 'DWAPlaner'; did you mean 'DWAPlannerROS'"):
        MoveBase("DWAPlaner")


def room_scan(pose: FloatArray, box: FloatArray, beams: int = 181) -> Scan:
    """What a lidar at the robot's centre sees of the room and of one axis-aligned box (x0, y0, x1, y1)."""
    angle = np.linspace(-math.pi, math.pi, beams)
    d = np.stack((np.cos(pose[2] + angle), np.sin(pose[2] + angle)), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.array(((-1.95, -1.95), (6.95, 1.95)))
        walls = np.where(d > 0, (room[1] - pose[:2]) / d, (room[0] - pose[:2]) / d).min(axis=1)
        low, high = (box[:2] - pose[:2]) / d, (box[2:] - pose[:2]) / d
        enter, leave = np.minimum(low, high).max(axis=1), np.maximum(low, high).min(axis=1)
    hit = np.where((enter > 0) & (enter <= leave), enter, np.inf)
    return Scan(np.minimum(walls, hit), -math.pi, angle[1] - angle[0], 0.05, 20.0, np.zeros(3))


def loop(local_planner: str, box: FloatArray, seconds: float = 60.0) -> tuple[np.ndarray, Command]:
    """Drive TIAGo 5 m ahead, with the odom frame turned and shifted against the map; its path, its last command."""
    navigator = MoveBase(local_planner)
    navigator.reset(Task(PERIOD, 0.6, np.zeros(3), floor()), load_robot("tiago"), np.random.default_rng(0))
    pose, odom, velocity = np.zeros(3), np.array((3.0, -1.0, 2.0)), np.zeros(2)
    path, command = [], Command(0.0, 0.0)
    for k in range(round(seconds / PERIOD)):
        scan = room_scan(pose, box)
        command = navigator.step(Observation(k * PERIOD, pose.copy(), velocity, odom.copy(), GOAL, scan))
        path.append((*pose, command.v, command.omega))
        if command.arrived or command.gave_up:
            break
        velocity = np.array((command.v, command.omega))
        for p in (pose, odom):
            p[2] += command.omega * PERIOD / 2
            p[:2] += command.v * PERIOD * np.array((math.cos(p[2]), math.sin(p[2])))
            p[2] += command.omega * PERIOD / 2
    return np.array(path), command


@pytest.mark.parametrize("local_planner", ["DWAPlannerROS", "TrajectoryPlannerROS"])
def test_it_drives_around_a_box_that_is_not_on_the_map(local_planner: str) -> None:
    box = np.array((2.35, -0.15, 2.65, 0.15))
    path, command = loop(local_planner, box)
    assert command.arrived, command
    assert math.hypot(path[-1, 0] - 5.0, path[-1, 1]) < 0.22
    assert abs(path[-1, 2]) < 0.22
    centre = np.abs(path[:, :2] - (2.5, 0.0))
    clearance = np.hypot(*np.maximum(centre - 0.15, 0.0).T).min()
    assert 0.26 < clearance < 1.0


def test_the_same_trial_gives_the_same_bits() -> None:
    box = np.array((2.35, -0.15, 2.65, 0.15))
    one, _ = loop("DWAPlannerROS", box, 8.0)
    two, _ = loop("DWAPlannerROS", box, 8.0)
    assert np.array_equal(one, two)
