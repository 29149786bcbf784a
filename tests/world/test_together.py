"""Several robots in one world: they meet exactly, in whatever order they are listed and at whatever instants they decide."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import DRIVE, SILENT, Pilot, constant, make_robot, make_scenario, moving_obstacle, steer

from clearway.contract import Command
from clearway.errors import ClearwayError
from clearway.geometry.distance import clearance, min_clearance
from clearway.geometry.motion import arc
from clearway.robots import Robot
from clearway.scenarios.scenario import Scenario
from clearway.trials import Outcome, Trial
from clearway.world import simulate, simulate_all
from clearway.world.drive import Driver

PLAN = "arena"
FREE = {
    "v_max": 2.0,
    "v_min": -2.0,
    "omega_max": 3.0,
    **dict.fromkeys(("acceleration", "deceleration", "angular_acceleration", "angular_deceleration"), math.inf),
}
"""A base that is at its command at once."""
BLOCK = {"kind": "polygon", "vertices": [(-0.3, -0.2), (0.4, -0.2), (0.4, 0.2), (-0.3, 0.2)]}


def scene(*robots: dict[str, Any], **changes: Any) -> Scenario:
    """The first robot of these is the scenario's own; who has no legs is to go nowhere in particular."""
    full = [
        {"name": f"robot {k + 1}", "legs": [{"name": "away", "goal": (0.0, 2.9, 0.0), "time_limit": 4.0}]} | robot
        for k, robot in enumerate(robots)
    ]
    first, *rest = full
    own = {"member": first["name"], "start": first["start"], "legs": first["legs"], "robots": rest}
    return make_scenario(**{"floor_plan": PLAN, "speed": 2.0, **own, **changes})


def together(scenario: Scenario, *drivers: tuple[Robot, Pilot]) -> list[Trial]:
    return simulate_all(
        scenario, [Driver(robot, pilot, navigator="test", localisation="truth") for robot, pilot in drivers], raise_errors=True
    )  # fmt: skip


def reached(trials: Sequence[Trial]) -> list[Outcome]:
    return [trial.outcome for trial in trials]


def test_two_that_drive_at_each_other_meet_in_the_middle():
    robot = make_robot(drive=FREE)
    a, b = together(
        scene({"start": (-2.0, 0.0, 0.0)}, {"start": (2.0, 0.0, math.pi)}),
        (robot, constant(1.0)),
        (robot, constant(0.5)),
    )
    assert reached([a, b]) == [Outcome.COLLISION] * 2
    assert a.t[-1] == pytest.approx(3.5 / 1.5, abs=1e-4)
    assert b.t[-1] == pytest.approx(a.t[-1], abs=1e-4)
    assert a.pose[-1, 0] == pytest.approx(-2.0 + 3.5 / 1.5, abs=1e-3)
    assert a.reason == "contact with robot 'robot 2'"
    assert b.reason == "contact with robot 'robot 1'"
    np.testing.assert_allclose(a.moving_obstacles[:, 0], b.pose, atol=1e-6)
    assert (a.attempt.member, a.attempt.run) == ("robot 1", b.attempt.run)
    assert b.attempt.member == "robot 2"


@pytest.mark.parametrize("period", [0.001, 0.1, 3.0, 10.0])
def test_they_meet_as_exactly_however_seldom_one_of_them_decides(period: float):
    scenario = scene({"start": (-2.0, 0.0, 0.0)}, {"start": (2.0, 0.0, math.pi)})
    often, seldom = make_robot(drive=FREE), make_robot(drive=FREE, period=period)
    trials = together(scenario, (often, constant(1.0)), (seldom, constant(0.1)))
    assert reached(trials) == [Outcome.COLLISION] * 2
    assert [trial.t[-1] for trial in trials] == pytest.approx([3.5 / 1.1] * 2, abs=1e-4)


def test_who_stands_is_run_into_as_exactly():
    robot = make_robot(drive=FREE)
    a, b = together(
        scene({"start": (-2.0, 0.0, 0.0)}, {"start": (1.0, 0.0, 1.0)}), (robot, constant(1.0)), (robot, constant(0.0))
    )
    assert a.t[-1] == pytest.approx(2.5, abs=1e-4)
    assert reached([a, b]) == [Outcome.COLLISION] * 2
    np.testing.assert_allclose(b.pose[-1], [1.0, 0.0, 1.0], atol=1e-12)


def test_who_has_crashed_stands_there_for_the_others():
    """The third one comes along later, and runs into what is left of the first two."""
    robot = make_robot(drive=FREE)
    starts = [{"start": (-1.0, 0.0, 0.0)}, {"start": (1.0, 0.0, math.pi)}, {"start": (-0.25, 2.5, -math.pi / 2)}]
    trials = together(scene(*starts), (robot, constant(1.0)), (robot, constant(1.0)), (robot, constant(0.8)))
    assert reached(trials) == [Outcome.COLLISION] * 3
    assert trials[0].t[-1] == pytest.approx(0.75, abs=1e-4)
    assert trials[2].t[-1] == pytest.approx(2.0 / 0.8, abs=1e-4)


def test_nobody_is_met_or_seen_beyond_its_own_contact():
    """Two decide seldom and meet early in their periods; the third decides five times meanwhile."""
    often, seldom = make_robot(drive=FREE), make_robot(drive=FREE, period=0.5)
    starts = [{"start": (-2.0, 2.0, 0.0)}, {"start": (1.5, 0.0, 0.0)}, {"start": (3.0, 0.0, math.pi)}]
    a, b, c = together(scene(*starts), (often, constant(0.0)), (seldom, constant(1.9)), (seldom, constant(1.9)))
    assert reached([b, c]) == [Outcome.COLLISION] * 2
    assert b.t[-1] == c.t[-1] < 0.5
    after = a.moving_obstacles[a.t > b.t[-1], :2]
    assert len(after) > 4
    np.testing.assert_allclose(after - np.array([b.pose[-1], c.pose[-1]]), 0.0, atol=1e-9)


def test_who_has_arrived_stands_there_for_the_others():
    goal = [{"name": "there", "goal": (0.0, 0.0, 0.0), "time_limit": 20.0}]
    robot = make_robot()
    scenario = scene({"start": (-2.0, 0.0, 0.0), "legs": goal}, {"start": (2.5, 0.0, math.pi)})
    waits = Pilot(lambda s: Command(0.0, 0.0) if s.t < 9.0 else Command(1.0, 0.0))
    a, b = together(scenario.model_copy(update={"robots": (scenario.robots[0].model_copy(
        update={"legs": tuple(leg.model_copy(update={"time_limit": 30.0}) for leg in scenario.robots[0].legs)}),)}),
        (robot, Pilot(steer)), (robot, waits))  # fmt: skip
    assert reached([a, b]) == [Outcome.REACHED, Outcome.COLLISION]
    assert a.t[-1] < 9.0
    assert b.moving_obstacles[-1, 0] == pytest.approx(a.pose[-1], abs=1e-9)


def test_who_runs_out_of_time_brakes_as_its_base_can():
    """Time ends at 4 s; what was at 1 m/s then stands 0.25 m further on, where the other drives through what it has left."""
    robot = make_robot(
        drive=FREE
        | {"acceleration": 10.0, "deceleration": 2.0, "angular_acceleration": 9.0, "angular_deceleration": 9.0}
    )
    scenario = scene(
        {"start": (-3.0, -1.0, 0.0)},
        {"start": (3.0, 1.0, 0.0), "legs": [{"name": "far", "goal": (0.0, 0.0, 0.0), "time_limit": 9.0}]},
    )
    a, b = together(scenario, (robot, constant(1.0)), (robot, constant(0.0)))
    assert a.outcome is Outcome.TIMEOUT
    assert b.outcome is Outcome.TIMEOUT
    seen = b.moving_obstacles[:, 0]
    assert seen[-1, 0] == pytest.approx(a.pose[-1, 0] + 0.25, abs=0.06)
    assert seen[-1, 0] > a.pose[-1, 0] + 0.2


@settings(max_examples=40, deadline=None)
@given(
    starts=st.lists(
        st.tuples(st.floats(-2.0, 2.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)), min_size=3, max_size=3
    ),
    ways=st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-2.0, 2.0)), min_size=3, max_size=3),
    periods=st.permutations([0.1, 1 / 15, 0.07]),
)
def test_no_contact_is_missed_and_none_invented(starts, ways, periods):
    """Robots on arcs, each deciding at its own instants: the first contact of all is where a look at each millisecond has it."""
    robots = [
        make_robot(
            drive=FREE,
            period=p,
            footprint=BLOCK,
        )
        for p in periods
    ]
    shapes = [r.shape for r in robots]
    if (
        min(
            clearance(shapes[i], np.array(starts[i]), shapes[j], np.array(starts[j]))
            for i, j in itertools.combinations(range(3), 2)
        )
        < 0.01
    ):
        return
    trials = together(
        scene(*({"start": s} for s in starts)), *((r, constant(*w)) for r, w in zip(robots, ways, strict=True))
    )
    first = min(trial.t[-1] for trial in trials)
    times = np.append(np.arange(0.0, first - 1e-9, 1e-3), first)
    at = [np.array([arc(*s, *w, t) for t in times]) for s, w in zip(starts, ways, strict=True)]
    gaps = np.array(
        [
            min_clearance(shapes[i], at[i], [moving_obstacle(shapes[j])], at[j][:, None])
            for i, j in itertools.combinations(range(3), 2)
        ]
    )
    assert gaps[:, :-1].min() > 0.0
    if any("robot" in trial.reason for trial in trials if trial.t[-1] == first):
        assert gaps[:, -1].min() < 1e-3


def test_the_order_in_which_robots_are_listed_changes_nothing():
    first = {"start": (-2.0, 0.0, 0.0), "legs": [{"name": "there", "goal": (2.0, 0.0, 0.0), "time_limit": 9.0}]}
    rest = [
        {"name": name, "start": start, "legs": [{"name": "there", "goal": goal, "time_limit": 9.0}]}
        for name, start, goal in (
            ("north", (0.3, 1.5, -1.5), (0.3, -1.5, -1.5)), ("east", (2.2, 0.7, 3.1), (-2.0, 0.7, 3.1)), ("south", (-1.0, -1.5, 1.5), (-1.0, 1.5, 1.5)),
        )
    ]  # fmt: skip
    robot = make_robot(
        lidar={"beams": 31, "angle_min": -1.5, "angle_max": 1.5, "range_min": 0.05, "range_max": 10.0, "sigma": 0.02}
    )

    def shy() -> Pilot:
        def rule(sensing):
            near = sensing.scan.ranges.min() < 0.7
            command = steer(sensing)
            return Command(0.0, 0.4) if near else command

        return Pilot(rule)

    found = []
    for order in itertools.permutations(rest):
        trials = together(scene(first, *order), *((robot, shy()) for _ in range(4)))
        found.append({trial.attempt.member: trial for trial in trials})
    for other in found[1:]:
        for name, trial in found[0].items():
            np.testing.assert_array_equal(other[name].pose, trial.pose)
            assert other[name].reason == trial.reason


@given(seed=st.integers(0, 999), v=st.floats(0.1, 1.0), omega=st.floats(-0.5, 0.5))
@settings(max_examples=10)
def test_who_meets_nobody_has_the_bits_of_one_who_drives_alone(seed: int, v: float, omega: float):
    """The fleet's way of driving, among people too, is that of a single run; of a fleet of one as well."""
    robot = make_robot(
        odometry=dict.fromkeys(SILENT, 0.05), lidar=make_robot().lidar.model_copy(update={"sigma": 0.01})
    )
    people = [{"name": "ann", "start": (-1.0, 1.5), "route": [{"at": (1.5, 1.5)}]}]
    first, far = {"start": (-2.0, 0.0, 0.0)}, {"start": (2.5, -2.5, 0.0)}
    alone = scene(first, people=people, seed=seed)
    (single,) = together(alone, (robot, constant(v, omega)))
    again = simulate(alone, robot, constant(v, omega), navigator="test", localisation="truth")
    among = together(
        scene(first, far, people=[person | {"sees_robots": False} for person in people], seed=seed),
        *[(robot, constant(v, omega)), (robot, constant(0.0))],
    )[0]
    blind = together(
        scene(first, people=[person | {"sees_robots": False} for person in people], seed=seed),
        (robot, constant(v, omega)),
    )[0]
    for one, other in ((single, again), (blind, among)):
        n = min(len(one.t), len(other.t))
        for name in ("t", "pose", "velocity", "estimate"):
            assert np.array_equal(getattr(one, name)[:n], getattr(other, name)[:n]), name
        assert np.array_equal(one.moving_obstacles[:n, :1], other.moving_obstacles[:n, :1])


@pytest.mark.parametrize("drive", [FREE, DRIVE])
def test_who_gives_up_at_full_speed_stops_and_touches_nobody_far_away(drive: dict[str, Any]):
    """Its last command and the one to stop arrive at the same instant, within a control period."""
    robot = make_robot(drive=drive, latency={"command": 0.047})
    legs = [{"name": "on", "goal": (0.0, -2.9, 0.0), "time_limit": 6.0}]
    gives_up = Pilot(lambda s: Command(0.5, 0.0, gave_up="enough" if s.t > 2.55 else None))
    a, b = together(
        scene({"start": (-2.5, 2.0, 0.0)}, {"start": (2.0, -2.0, math.pi), "legs": legs}),
        (robot, gives_up),
        (robot, constant(0.3)),
    )
    assert reached([a, b]) == [Outcome.ABORTED, Outcome.TIMEOUT]
    assert np.isfinite(b.moving_obstacles).all()
    assert b.moving_obstacles[-1, 0, 0] == pytest.approx(a.pose[-1, 0], abs=0.2)


def test_what_happens_between_samples_ends_with_the_trial():
    """The first gives up at once and comes to rest for seconds, while the second comes ever nearer to it."""
    slow = {"v_max": 2.0, "v_min": -2.0, "omega_max": 3.0, "acceleration": 9.0, "deceleration": 0.4,
            "angular_acceleration": 9.0, "angular_deceleration": 9.0}  # fmt: skip
    legs = [{"name": "away", "goal": (0.0, 2.9, 0.0), "time_limit": 1.5}]
    scenario = scene({"start": (-3.0, 0.0, 6.0), "legs": legs}, {"start": (3.0, 0.5, math.pi)})
    a, b = together(scenario, (make_robot(drive=slow), constant(0.8)), (make_robot(drive=FREE), constant(1.0)))
    assert reached([a, b]) == [Outcome.TIMEOUT] * 2
    assert a.t[-1] < b.t[-1] - 1.0
    assert a.between is not None
    assert a.between.t.max() < a.t[-1]
    assert a.pose[0, 2] == pytest.approx(6.0 - 2 * math.pi, abs=1e-12), "a heading is told within half a turn"


def test_two_who_swap_roles_drive_mirrored():
    def goes(start: tuple[float, float, float], goal: tuple[float, float, float]) -> dict[str, Any]:
        return {"start": start, "legs": [{"name": "there", "goal": goal, "time_limit": 20.0}]}

    west, east = goes((-2.0, 0.4, 0.0), (2.0, 0.4, 0.0)), goes((2.0, -0.4, math.pi), (-2.0, -0.4, math.pi))
    robot = make_robot()
    a, b = together(scene(west, east), (robot, Pilot(steer)), (robot, Pilot(steer)))
    c, d = together(scene(east, west), (robot, Pilot(steer)), (robot, Pilot(steer)))
    np.testing.assert_array_equal(a.pose, d.pose)
    np.testing.assert_array_equal(b.pose, c.pose)
    np.testing.assert_allclose(a.pose[:, :2], -b.pose[:, :2], atol=1e-9)


def test_a_robot_is_seen_by_the_lidar_of_another():
    robot = make_robot()
    seen: list[float] = []

    def look(sensing):
        seen.append(float(sensing.scan.ranges[45]))
        return Command(0.0, 0.0)

    together(
        scene({"start": (-2.0, 0.0, 0.0)}, {"start": (1.0, 0.0, math.pi)}),
        (robot, Pilot(look)),
        (make_robot(drive=FREE), constant(-0.5)),
    )
    assert seen[0] == pytest.approx(2.75, abs=1e-6)
    assert seen[20] == pytest.approx(2.75 + 0.5 * 2.0, abs=1e-3)


def test_drivers_are_counted():
    scenario = scene({"start": (-2.0, 0.0, 0.0)}, {"start": (1.0, 0.0, 0.0)})
    with pytest.raises(ClearwayError, match="has 2 robots; 1 are driven"):
        simulate(scenario, make_robot(), constant(0.0), navigator="test", localisation="truth")
