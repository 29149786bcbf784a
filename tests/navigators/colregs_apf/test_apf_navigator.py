"""The navigator in a closed loop: it keeps the rules, survives odd sensing, and says what is wrong with its gains."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from arcs import step_arc
from clearway.campaigns.conformance import check_navigator
from clearway.contract import Budget, Goal, Observation, Obstacles, Task
from clearway.errors import ClearwayError
from clearway.navigators.colregs_apf import ColregsApf
from clearway.robots import Robot, load_robot
from perceived import exact

RESCUE = load_robot("rescue")
R_OBS = 0.35
CONTACT = 0.25 + R_OBS
BY_HAND = {
    "eta_d": 0.3, "eta_e": 1.0, "eta_s": 0.2, "rho_0": 4.0, "rho_s": 1.0, "d_safe": 0.3, "velocity_term": 0.0,
}  # fmt: skip
"""Gains under which the rules show: a wide berth, begun early."""


def task(robot: Robot = RESCUE, start: tuple[float, float, float] = (0.0, 0.0, 0.0), **other: Any) -> Task:
    return Task(robot.period, 1.0, np.array(start), **other)


def discs(rows: Any, moving: bool = True) -> Obstacles:
    """From rows x, y, vx, vy."""
    a = np.array(rows, dtype=float).reshape(-1, 4)
    return exact(a[:, :2], a[:, 2:], R_OBS, moving=moving)


def observe(t: float, pose: Any, obstacles: Obstacles | None, goal: Goal, velocity: Any = (0.0, 0.0)) -> Observation:
    return Observation(
        t, np.array(pose, float), np.array(velocity, float), np.array(pose, float), goal, None, obstacles
    )


class Meeting:
    """One robot from the origin to a goal, among discs that keep their velocities; what happened, step by step."""

    def __init__(self, rows: Any, goal: Any = (8.0, 0.0, 0.0), moving: bool = True, steps: int = 400, **gains: Any):
        navigator = ColregsApf(**(BY_HAND | gains))
        navigator.reset(task(), RESCUE, np.random.default_rng(0))
        pose, velocity, rows = np.zeros(3), np.zeros(2), np.array(rows, dtype=float).reshape(-1, 4)
        target, c = Goal(np.array(goal, float), 0.2, math.pi), RESCUE.period
        self.poses, self.others, self.commands, self.status = [pose], [rows], [], []
        for k in range(steps):
            command = navigator.step(observe(k * c, pose, discs(rows, moving), target, velocity))
            velocity = np.array((command.v, command.omega))
            pose = step_arc(pose, command.v, command.omega, c)
            rows = rows + np.column_stack((rows[:, 2:], np.zeros((len(rows), 2)))) * c
            self.poses.append(pose)
            self.others.append(rows)
            self.commands.append(velocity)
            self.status.append(command.status)
            if np.hypot(*(pose - target.pose)[:2]) <= 0.2:
                break
        self.reached = bool(np.hypot(*(pose - target.pose)[:2]) <= 0.2)
        apart = np.array([np.hypot(*(o[:, :2] - p[:2]).T) for p, o in zip(self.poses, self.others, strict=True)])
        self.apart, self.nearest = apart.min(), int(apart.min(axis=1).argmin())

    def bearing_when_nearest(self) -> float:
        """Of the first obstacle from the robot's course towards the goal (x), positive to port, rad."""
        dx, dy = (self.others[self.nearest][0, :2] - self.poses[self.nearest][:2]).tolist()
        return math.atan2(dy, dx)


@pytest.mark.parametrize("aside", [-0.3, -0.1, 0.0, 0.1, 0.3])
def test_head_on_they_pass_port_to_port(aside: float) -> None:
    met = Meeting([(6.0, aside, -0.5, 0.0)])
    assert met.reached
    assert met.apart > CONTACT + 0.1
    assert 0.2 < met.bearing_when_nearest() < math.pi - 0.2  # it is on the port side when they pass
    assert "head-on" in met.status
    assert met.status[-1] == "clear"


def test_head_on_the_change_of_course_is_early_and_large() -> None:
    met = Meeting([(6.0, 0.0, -0.5, 0.0)])
    headings = np.array([p[2] for p in met.poses])
    begun = met.status.index("head-on")
    assert np.hypot(*(met.others[begun][0, :2] - met.poses[begun][:2])) > 3.0
    assert headings[begun : begun + 15].min() < -math.radians(
        10.0
    )  # to starboard, and not back before they have passed
    assert headings[begun + 5 : met.nearest - 2].max() < 0.02


def test_crossing_from_starboard_it_gives_way_astern() -> None:
    met = Meeting([(3.0, -3.0, 0.0, 0.5)])
    assert met.reached
    assert met.apart > CONTACT + 0.1
    assert "crossing give-way" in met.status
    # when the other has crossed the line to the goal, the robot had not yet
    crossed = next(k for k, o in enumerate(met.others) if o[0, 1] > 0.0)
    assert met.poses[crossed][0] < met.others[crossed][0, 0]
    assert min(p[1] for p in met.poses[:crossed]) < -0.05  # it turned to starboard


def test_crossing_from_port_it_stands_on_until_it_is_close() -> None:
    met = Meeting([(3.0, 3.0, 0.0, -0.5)])
    within = 1.3 * 0.9 + math.hypot(0.5, 0.5) * 5 * RESCUE.period  # 1.3 d_m, as seen five periods before
    held = next(k for k, o in enumerate(met.others) if np.hypot(*(o[0, :2] - met.poses[k][:2])) < within)
    assert held > 10
    assert "stand-on" in met.status[:held]
    assert max(abs(p[1]) for p in met.poses[:held]) < 0.02  # straight on
    assert met.apart > CONTACT
    assert min(p[1] for p in met.poses) < -0.1  # and then to starboard (rule 17 c)


@pytest.mark.parametrize("aside", [-0.15, 0.15])
def test_overtaking_on_the_side_that_it_is_on(aside: float) -> None:
    met = Meeting([(1.8, -aside, 0.1, 0.0)], goal=(9.0, 0.0, 0.0))
    assert met.reached
    assert met.apart > CONTACT
    assert "overtaking" in met.status
    passing = met.bearing_when_nearest()
    assert math.copysign(1.0, passing) == -math.copysign(1.0, aside)


def test_mirrored_meetings_are_not_mirrored_answers() -> None:
    give, stand = Meeting([(3.0, -3.0, 0.0, 0.5)]), Meeting([(3.0, 3.0, 0.0, -0.5)])
    assert "crossing give-way" in give.status
    assert "crossing give-way" not in stand.status


def test_around_what_stands() -> None:
    met = Meeting([(4.0, 0.15, 0.0, 0.0)], moving=False)
    assert met.reached
    assert met.apart > CONTACT + 0.05
    assert set(met.status) == {"clear"}


def test_deterministic() -> None:
    rows = [(5.0, 0.2, -0.5, 0.0), (4.0, -3.0, 0.0, 0.4)]
    a, b = Meeting(rows), Meeting(rows)
    assert np.array(a.commands).tobytes() == np.array(b.commands).tobytes()


def test_turns_to_the_goals_heading_in_place() -> None:
    robot = load_robot("tiago")
    navigator = ColregsApf()
    navigator.reset(task(robot), robot, np.random.default_rng(0))
    pose, velocity, goal = np.zeros(3), np.zeros(2), Goal(np.array((1.0, 0.0, 2.5)), 0.2, 0.1)
    for k in range(150):
        command = navigator.step(observe(0.1 * k, pose, None, goal, velocity))
        assert abs(command.v - velocity[0]) <= max(robot.drive.acceleration, robot.drive.deceleration) * 0.1 + 1e-9
        assert abs(command.omega - velocity[1]) <= robot.drive.angular_acceleration * 0.1 + 1e-9
        velocity = np.array((command.v, command.omega))
        pose = step_arc(pose, command.v, command.omega, 0.1)
    assert np.hypot(*(pose - goal.pose)[:2]) <= 0.2
    assert abs(math.remainder(pose[2] - 2.5, math.tau)) <= 0.1
    assert np.abs(velocity).max() < 1e-3


def one_step(obstacles: Obstacles | None, pose: Any = (0.0, 0.0, 0.0), goal: Any = (5.0, 0.0, 0.0), **of_task: Any):  # type: ignore[no-untyped-def]
    navigator = ColregsApf(**BY_HAND)
    navigator.reset(task(**of_task), RESCUE, np.random.default_rng(0))
    command = navigator.step(observe(0.0, pose, obstacles, Goal(np.array(goal, float), 0.2, math.pi), (0.3, 0.1)))
    shown = navigator.diagnostics()
    assert shown.field is not None
    assert all(np.isfinite(a).all() for a in (*shown.polylines.values(), *shown.circles.values()))
    return command, shown


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("where", [(0.0, 0.0), (1e-13, 0.0), (0.1, 0.1), (5.0, 0.0)])
def test_an_obstacle_on_top_of_the_robot_or_the_goal(where: tuple[float, float], moving: bool) -> None:
    command, _ = one_step(discs([(*where, 0.1, 0.2)], moving))
    assert math.isfinite(command.v)
    assert math.isfinite(command.omega)


def test_nothing_to_see_and_a_thousand() -> None:
    for obstacles in (None, discs([])):
        command, shown = one_step(obstacles)
        assert command.v > 0.0
        assert command.status == "clear"
        assert len(shown.circles["emergency"]) == 0
    rng = np.random.default_rng(1)
    for moving in (True, False):
        many = np.column_stack((rng.uniform(-7, 7, (1000, 2)), rng.uniform(-1, 1, (1000, 2))))
        command, _ = one_step(discs(many, moving))
        assert math.isfinite(command.v + command.omega)


def test_what_is_not_finite_is_dropped_or_named() -> None:
    odd = discs([(2.0, 0.0, np.nan, np.nan), (np.nan, 1.0, 0.0, 0.0)])
    plain = discs([(2.0, 0.0, 0.0, 0.0)])
    a, b = one_step(odd)[0], one_step(plain)[0]
    assert (a.v, a.omega) == (b.v, b.omega)
    for field, pose, goal in (
        ("observation's pose", (np.nan, 0, 0), (5, 0, 0)),
        ("observation's goal.pose", (0, 0, 0), (np.inf, 0, 0)),
    ):
        with pytest.raises(ValueError, match=field.replace(".", r"\.")):
            one_step(None, pose, goal)


def test_the_area_repels() -> None:
    free, walled = (
        one_step(None, pose=(0.5, 0.3, 0.0), area=area)[1].polylines["plan"] for area in (None, (0, 0, 9, 9))
    )
    assert (walled[-1] - free[-1])[1] > 0.2


def test_an_iteration_budget_changes_nothing() -> None:
    a = one_step(discs([(2.0, 0.1, -0.5, 0.0)]))[0]
    b = one_step(discs([(2.0, 0.1, -0.5, 0.0)]), budget=Budget(iterations=1))[0]
    assert a == b
    assert not a.cut


def test_the_field_is_higher_at_an_obstacle_and_lower_to_the_goal() -> None:
    _, shown = one_step(discs([(2.0, 0.0, 0.0, 0.0)], moving=False))
    field = shown.field
    assert field is not None
    assert field.data.shape == (60, 60)
    assert field.data.min() >= 0

    def at(x: float, y: float) -> int:
        return int(
            field.data[int((y - field.origin[1]) / field.resolution), int((x - field.origin[0]) / field.resolution)]
        )

    assert at(2.0, 0.0) == 100 > at(-3.0, 0.0) > at(4.0, 0.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gains": "tuned"}, "gains: 'tuned'"),
        ({"eta": 1.0}, "colregs-apf: eta: unknown key; did you mean 'eta_s'"),
        ({"eta_d": -1.0}, "colregs-apf: eta_d: -1.0"),
        ({"rho_0": math.nan}, "rho_0"),
        ({"horizon": 0}, "horizon"),
        ({"w1": 1.5}, "w1"),
    ],
)
def test_wrong_options_are_told_at_once(options: Any, words: str) -> None:
    with pytest.raises(ClearwayError, match=words):
        ColregsApf(**options)


def test_a_wrong_value_in_the_robots_file_is_named() -> None:
    robot = RESCUE.model_copy(update={"navigators": {"colregs-apf": {"eta_s": "much"}}})
    with pytest.raises(ClearwayError, match=r"robot rescue: navigators.colregs-apf.eta_s: 'much'"):
        ColregsApf().reset(task(robot), robot, np.random.default_rng(0))


@pytest.mark.parametrize("gains", ["fixed", "retuned"])
def test_it_conforms_on_the_rescue_robot(gains: Any) -> None:
    unmet = [f for f in check_navigator(lambda: ColregsApf(gains), RESCUE) if not f.passed]
    assert [f for f in unmet if "control period" not in f.name] == []


def test_arrived_only_well_within_the_tolerances_or_for_good() -> None:
    navigator, goal = ColregsApf(), Goal(np.array((1.0, 0.0, 0.0)), 0.2, 0.4)
    navigator.reset(task(), RESCUE, np.random.default_rng(0))
    poses = [(0.83, 0.0, 0.0), (0.92, 0.0, 0.35), (0.92, 0.0, 0.19), (0.83, 0.0, 0.3), (0.79, 0.0, 0.0)]
    said = [navigator.step(observe(0.15 * k, pose, None, goal)) for k, pose in enumerate(poses)]
    assert [c.arrived for c in said] == [False, False, True, True, False]
    assert (said[2].v, said[2].omega) == (0.0, 0.0)
    still = [navigator.step(observe(k, (0.83, 0.0, 0.0), None, goal)).arrived for k in range(20)]
    assert still == sorted(still)  # as near as it comes: in the end that will do
    assert still[-1]
