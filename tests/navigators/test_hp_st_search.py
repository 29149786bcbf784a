"""What the search finds is what the base can drive, keeps clear of what stands, and is the fastest where that is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from space_time_scenes import OTHER, OWN, RESCUE, Finder, area, finder, line

from clearway.geometry.angles import turn_between
from clearway.geometry.footprint import gap
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.search.layer import STEPS
from clearway.navigators.hp_st.search.tree import Tree, leaf
from clearway.robots import load_robot


def steps(tree: Tree) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Parent's state (5,), told v and omega (2,), and child's state (5,) of every node but the root."""
    return [
        (tree.nodes[k - 1, tree.parent[k, b], :5], tree.control[k, b], tree.nodes[k, b, :5])
        for k in range(1, len(tree.count))
        for b in range(tree.count[k])
    ]


def scattered(seed: int, count: int = 10) -> list[tuple[float, float, float]]:
    """Discs that leave the start at the origin free."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-3.0, 3.0, (4 * count, 2))
    free = at[np.hypot(*at.T) > 0.36 + OTHER + OWN][:count]
    return [(x, y, OTHER) for x, y in free.tolist()]


def test_an_empty_square_is_crossed_straight_at_top_speed() -> None:
    found = finder()
    tree = found.look((2.5, 0.0))
    states, told = found.best()
    assert np.abs(states[:, 1]).max() < 1e-9
    assert told.tolist() == [[1.0, 0.0]] * 8
    assert tree.goal[2] == pytest.approx(2.4)  # to come within 0.1 m
    far = finder(speed=0.6)
    far.look((9.0, 0.0))
    states, _ = far.best()
    assert states[-1, :3] == pytest.approx([1.8, 0.0, 0.0])  # ten layers of 0.3 s


def test_a_goal_to_the_side_is_come_to_on_an_arc() -> None:
    found = finder(reverse=False)
    found.look((0.0, 2.0))
    states, _ = found.best()
    assert states[-1, :2] == pytest.approx([0.0, 2.0], abs=0.35)
    assert len(states) - 1 <= 10


@pytest.mark.parametrize("seed", range(6))
def test_nothing_that_stands_is_touched(seed: int) -> None:
    found, discs = finder(), scattered(seed)
    tree = found.look((4.0, 0.5), still=discs)
    centres = np.array(discs)[:, :2]
    nearest = math.inf
    for before, _, after in steps(tree):
        nearest = min(nearest, np.hypot(*(centres - after[:2]).T).min())
        v, omega = after[3:]
        half = np.array(arc(*before[:3], v, omega, 0.5 * found.costs.step))
        assert np.hypot(*(centres - half[:2]).T).min() > OTHER + OWN
    assert OTHER + OWN + found.costs.margin - 1e-9 <= nearest < OTHER + OWN + 0.3
    assert len(steps(tree)) > 200


def test_the_area_is_not_left() -> None:
    found, inside = finder(), area(-0.4, -0.3, 9.0, 0.2)
    tree = found.look((2.0, 1.0), inside=inside)
    nodes = np.array([after for _, _, after in steps(tree)])
    assert nodes[:, 0].min() >= -0.4
    assert nodes[:, 1].min() >= -0.3
    assert 0.15 < nodes[:, 1].max() <= 0.2


def test_more_controls_than_there_is_room_for_are_refused() -> None:
    found = finder()
    for count in (STEPS - 3, STEPS - 2):
        found.settings = found.settings._replace(controls=np.resize(found.settings.controls, (count, 2)))
        if count == STEPS - 3:
            assert found.look((2.0, 0.0)).count[1] > 1
        else:
            with pytest.raises(ValueError, match="more controls are to be tried than"):
                found.look((2.0, 0.0))


@pytest.mark.parametrize("name", ["rescue:unlimited", "rescue", "hosbot", "tiago"])
def test_every_step_is_one_that_the_base_drives(name: str) -> None:
    robot = load_robot(name)
    d, found = robot.drive, finder(robot)
    tree = found.look((3.0, 1.0), (0.0, 0.0, 0.4, 0.5 * min(1.0, d.v_max), -0.5), still=[(1.5, 0.3, 0.2)])
    dt, seen = found.costs.step, 0
    for before, told, after in steps(tree):
        assert d.v_min - 1e-9 <= told[0] <= min(d.v_max, 1.0) + 1e-9
        assert abs(told[1]) <= d.omega_max + 1e-9
        if name == "rescue:unlimited":  # no limits: at once, and ramps of infinite steepness are no numbers
            (v_end, v), (w_end, w) = (told[0], told[0]), (told[1], told[1])
        else:
            v_end, v = ramp(before[3], told[0], d.acceleration, d.deceleration, dt)
            w_end, w = ramp(before[4], told[1], d.angular_acceleration, d.angular_deceleration, dt)
            seen += abs(v_end - told[0]) > 0.01
        x, y, theta = arc(*before[:3], v, w, dt)
        assert after[:2] == pytest.approx([x, y], abs=1e-6)
        assert abs(turn_between(theta, after[2])) < 1e-6
        assert after[3:] == pytest.approx([v_end, w_end])
    assert seen > 0 or name == "rescue:unlimited"


def test_a_square_body_keeps_its_corners_clear_and_comes_nearer_than_a_disc_around_it() -> None:
    robot, nearer = load_robot("hosbot"), 0
    found = finder(robot, speed=0.6, margin=0.02, soft=0.06, near=0.2)
    foot, rng = found.base.foot, np.random.default_rng(0)
    for angle, heading in rng.uniform(-3.0, 3.0, (10, 2)).tolist():
        ux, uy = math.cos(angle), math.sin(angle)
        disc = (0.66 * ux, 0.66 * uy, 0.2)
        tree = found.look((2.0 * ux, 2.0 * uy), (0.0, 0.0, heading, 0.0, 0.0), still=[disc], beam=160)
        at = np.array([after[:3] for _, _, after in steps(tree)])
        gaps = [gap(foot.vertices, foot.radius, *pose, *disc[:2]) - disc[2] for pose in at]
        assert min(gaps) >= found.costs.margin - 1e-9
        nearer += np.hypot(*(at[:, :2] - disc[:2]).T).min() < foot.circumscribed + disc[2]
    assert nearer >= 3


@pytest.mark.parametrize(("y", "behind"), [(-1.2, True), (-2.6, False)])
def test_a_crossing_obstacle_is_passed_behind_or_before(y: float, behind: bool) -> None:
    """It comes at 1 m/s from the right and cuts the way 1.5 m ahead after 1.2 s (too soon to go first) or 2.6 s."""
    found, moving_obstacle = finder(), line(1.5, y, 0.0, 1.0)
    found.look((4.0, 0.0), moving_obstacles=[moving_obstacle])
    states, _ = found.best()
    gaps = []
    for k in range(len(states) - 1):
        v, omega = states[k + 1, 3:]
        for i in range(7):
            t = i / 6 * found.costs.step
            x, y_robot, _ = arc(*states[k, :3], v, omega, t)
            mx, my = moving_obstacle(k * found.costs.step + t)
            gaps.append(math.hypot(x - mx, y_robot - my) - OWN - OTHER)
    assert 0.0 < min(gaps) < 0.6
    k = int(np.argmin(np.abs(states[:, 0] - 1.5)))
    assert (moving_obstacle(k * found.costs.step)[1] > states[k, 1]) == behind


def test_what_closes_is_not_entered() -> None:
    """Two discs that close a gap of 1.4 m, which a planner blind to time believes in now, before the robot is there."""
    found = finder(without="reverse")
    pair = [line(2.4, 0.95, 0.0, -0.25), line(2.4, -0.95, 0.0, 0.25)]
    found.look((4.0, 0.0), moving_obstacles=pair)
    states, _ = found.best()
    for k, state in enumerate(states):
        assert min(math.dist(state[:2], m(k * found.costs.step)) for m in pair) > OWN + OTHER


def test_without_time_the_belt_of_a_whole_window_counts() -> None:
    """It has crossed long before the robot comes; only who unites its places over time goes round them."""
    moving_obstacle = line(2.2, 0.3, 0.0, 1.5)
    detours = []
    for without in ((), "time-aware"):
        found = finder(without=without)
        found.look((4.0, 0.0), moving_obstacles=[moving_obstacle])
        detours.append(np.abs(found.best()[0][:, 1]).max())
    assert detours[0] < 0.05
    assert detours[1] > 0.2


@pytest.mark.parametrize("off", [{"reverse": False}, {"without": "reverse"}, {"robot": "may not"}])
def test_who_may_not_reverse_never_does(off: dict) -> None:
    if "robot" in off:
        drive = RESCUE.drive.model_copy(update={"v_min": 0.0})
        off = {"robot": RESCUE.model_copy(update={"drive": drive})}
    behind = (-2.0, 0.0)
    forwards, both = finder(**off), finder()
    assert min(after[3] for _, _, after in steps(forwards.look(behind))) >= 0.0
    both.look(behind)
    states, _ = both.best()
    assert states[1:, 3].max() < 0.0
    assert states[-1, 0] == pytest.approx(-2.0, abs=0.35)


def test_the_same_search_twice() -> None:
    def bits(found: Finder) -> bytes:
        tree = found.look((3.0, 2.0), still=scattered(3), moving_obstacles=[line(2.0, -1.0, 0.2, 0.7)])
        return b"".join(tree.nodes[k, :n].tobytes() + tree.control[k, :n].tobytes() for k, n in enumerate(tree.count))

    assert bits(finder()) == bits(finder())


def test_enclosed_it_stays() -> None:
    ring = [(0.75 * math.cos(a), 0.75 * math.sin(a), 0.35) for a in np.linspace(0.0, math.tau, 9)[:-1].tolist()]
    found = finder()
    tree = found.look((4.0, 0.0), still=ring)
    assert leaf(tree)[1] >= 0
    assert np.hypot(*tree.nodes[-1, : tree.count[-1], :2].T).max() < 0.15
