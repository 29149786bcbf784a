"""The skeleton of a test plan says of every trial what the simulated one is, and is a plan as it stands."""

from __future__ import annotations

import math
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.lab.test_plan import TestPlan
from clearway.recordings.protocol.lab_trials import behind, key, scenarios, setup
from clearway.recordings.protocol.line import Line
from clearway.recordings.protocol.protocol import parsed, skeleton, write_new
from clearway.recordings.protocol.run_sheet import sheet_of
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite


@pytest.fixture(scope="module")
def whole() -> str:
    return skeleton()


@pytest.fixture(scope="module")
def plan(whole: str) -> TestPlan:
    return parsed(whole)


class TestHospital:
    def test_is_a_plan_as_it_stands_with_all_336_trials_to_do(self, whole: str, tmp_path: Path):
        path = tmp_path / "plan.toml"
        path.write_text(whole, encoding="utf-8")
        plan = load_test_plan(path)
        assert len(plan.trials) == 336
        assert not any(t.attempted or t.file for t in plan.trials)
        assert all(t.contact is None for t in plan.trials)
        counts = {b: sum(t.batch == b for t in plan.trials) for b in ("NO", "SO", "MO", "CE")}
        assert counts == {"NO": 9, "SO": 252, "MO": 27, "CE": 48}

    def test_every_scenario_is_there_once_by_its_labels(self, plan: TestPlan):
        made = load_suite("hospital").build(load_robot("tiago"))
        assert {key(t, t.speed) for t in plan.trials} == {key(s.labels, s.speed) for s in made}
        assert len({key(t, t.speed) for t in plan.trials}) == 336

    def test_static_obstacles_stand_where_the_scenario_puts_them(self, plan: TestPlan):
        made = {key(s.labels, s.speed): s for s in load_suite("hospital").build(load_robot("tiago"))}
        for trial in plan.trials:
            scenario = made[key(trial, trial.speed)]
            for placed, obstacle in zip(trial.obstacles, scenario.obstacles, strict=True):
                shape = plan.bodies[placed.body].shape
                assert shape == obstacle.shape
                if obstacle.pose is None:
                    assert placed.pose is None
                    moving_obstacle = plan.bodies[placed.body]
                    assert moving_obstacle.markers == "hosbot:"
                    assert (
                        moving_obstacle.static is not None
                    )  # else nobody could tell where on its markers the shape is
                    assert (moving_obstacle.static.file, moving_obstacle.static.pose) == ("static_hosbot.csv", "A")
                else:
                    assert placed.pose == pytest.approx(obstacle.pose, abs=1e-7)

    def test_a_perpendicular_gate_by_hand(self, plan: TestPlan):
        # paper A: d_3 = 2 d_base = 1.08 m between the edges of two squares of 0.60 m: centres 0.84 m from the line
        gate = [t for t in plan.trials if (t.configuration, t.size, t.gap) == ("perpendicular", 0.6, 2.0)]
        assert len(gate) == 9
        for t in gate:
            assert sorted(o.pose[1] for o in t.obstacles if o.pose) == pytest.approx([-0.84, 0.84])

    def test_time_limits_follow_the_speed(self, plan: TestPlan):
        # three times the nominal 5 m and 20 s; the turn three times pi at 2.094 rad/s and 20 s
        for speed, limit in ((0.2, 95.0), (0.6, 45.0), (1.0, 35.0)):
            for t in [t for t in plan.trials if t.speed == speed]:
                legs = plan.legs_of(t)
                assert [leg.name for leg in legs] == ["forth", "turn", "back"]
                assert [leg.time_limit for leg in legs] == pytest.approx([limit, 24.5, limit])
                assert [leg.scored for leg in legs] == [True, False, True]

    def test_poses_tolerances_and_reference(self, plan: TestPlan):
        a, b, turned = (np.array(plan.poses[n]) for n in ("A", "B", "A_turned"))
        assert math.dist(a[:2], b[:2]) == pytest.approx(5.0)
        assert math.remainder(turned[2] - a[2], math.tau) == pytest.approx(math.pi, abs=1e-7)
        assert plan.test.reference_length == 5.0
        assert (plan.test.xy_tolerance, plan.test.yaw_tolerance) == (0.2, 0.2)
        assert plan.legs[0].start == "A"
        assert plan.test.robot == "tiago"
        assert plan.test.floor_plan is None  # a lab is not the hall of the simulation

    def test_obstacles_are_carried_as_rarely_as_the_order_of_batches_allows(self, plan: TestPlan):
        made = scenarios("hospital", "tiago")
        assert [key(t, t.speed) for t in plan.trials] == [key(s.labels, s.speed) for s in made]
        changes = 1 + sum(setup(p) != setup(q) for p, q in pairwise(made))
        assert changes == len({setup(s) for s in made}) == 36
        assert list(dict.fromkeys(s.labels.batch for s in made)) == ["NO", "SO", "MO", "CE"]

    def test_a_comment_tells_how_the_moving_obstacle_goes(self, whole: str):
        part = skeleton(selection=Selection(configurations=("crossing",), speeds=(0.6,), obstacle_speeds=(0.2,)))
        crossing = part[part.index("MO crossing") :]
        assert "(2.5 m from A towards B, 2.5 m to the left) to (2.5 m from A towards B, 2.5 m to the right)" in crossing
        # 2.5 m at 0.2 m/s take 12.5 s; the robot needs 0.6 s + (2.5 - 0.18) / 0.6 = 4.47 s: about 8 s before it
        starts = [
            float(line.split("forth: ")[1].split(" s before")[0]) for line in part.splitlines() if "forth: " in line
        ]
        assert len(starts) == 3
        assert all(abs(s - 8.03) < 0.56 for s in starts)
        assert whole.isascii()

    def test_the_ward_and_the_other_robot(self):
        plan = parsed(skeleton(robot="hosbot", selection=Selection(floor_plan="ward", batches=("CE",), repetitions=1)))
        assert plan.test.floor_plan == "ward"
        assert "tiago" in plan.bodies
        assert plan.test.yaw_tolerance == load_robot("hosbot").tolerances.yaw
        assert len(plan.trials) == 16

    def test_the_scenarios_behind_a_plan_are_found_again(self, plan: TestPlan):
        found = behind(plan, Path())
        assert {s.name for s in found} == {s.name for s in load_suite("hospital").build(load_robot("tiago"))}
        assert behind(plan.model_copy(update={"test": plan.test.model_copy(update={"suite": "own"})}), Path()) == []


SUITE = """
name = "doors"
repetitions = 2
[[scenario]]
name = "pushed aside"
floor_plan = "hall"
start = [-2.0, 1.0, 1.5707963267948966]
speed = 0.5
[[scenario.legs]]
name = "out"
goal = [-2.0, 3.0, 0.0]
time_limit = 30.0
[[scenario.obstacles]]
name = "trolley, \\"big\\""
shape = { kind = "rectangle", length = 0.5, width = 0.255 }
pose = [-1.0, 2.0, 0.5]
[[scenario.obstacles]]
name = "odd one"
shape = { kind = "polygon", vertices = [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2]] }
pose = [-3.0, 2.0, 0.0]
[[scenario.obstacles]]
name = "second trolley"
shape = { kind = "rectangle", length = 0.5, width = 0.255 }
pose = [-3.2, 2.6, 0.0]
"""


PEOPLE = """
name = "round"
floor_plan = "hall"
start = [-4.0, 0.0, 0.0]
speed = 0.6
legs = [{ name = "forth", goal = [0.0, 0.0, 0.0], time_limit = 60.0 }]

[[obstacles]]
name = "bed"
shape = { kind = "rectangle", length = 2.1, width = 0.96 }
behaviour = { kind = "operator" }
runs = [{ leg = "forth", path = [[2.0, 1.5], [-4.0, 1.5]], speed = 0.7 }]

[[people]]
name = "nurse"
start = [-3.0, 2.0]
route = [{ at = [-3.0, -2.0], wait = 5.0 }, { at = [0.0, 0.0] }]
loop = true
speed = 1.2

[[people]]
name = "patient"
start = [-1.0, 0.0]
behaviour = "still"
"""


class TestOwnSuites:
    def test_any_suite_becomes_a_plan(self, tmp_path: Path):
        file = tmp_path / "doors.toml"
        file.write_text(SUITE)
        plan = parsed(skeleton(str(file)))
        assert plan.test.suite == "doors"
        assert [t.repetition for t in plan.trials] == [1, 2]
        assert {"rectangle-50cm-255mm-1", "rectangle-50cm-255mm-2", "odd-one-1"} == set(plan.bodies)
        assert plan.trials[0].obstacles[0].pose == (-1.0, 2.0, 0.5)
        assert plan.poses["B"] == (-2.0, 3.0, 0.0)
        assert plan.test.floor_plan == "hall"

    def test_people_and_who_looks_are_told_to_the_lab(self, tmp_path: Path):
        """They are part of the test; without them the lab would drive another one."""
        file = tmp_path / "round.toml"
        file.write_text(PEOPLE)
        text = skeleton(str(file))
        parsed(text)
        sheet = sheet_of(parsed(text), scenarios(str(file), "tiago"))
        nurse = "nurse at 1.2 m/s from 1 m from A towards B, 2 m to the left to 1 m from A towards B, 2 m to the right (stays 5 s); to on B; and round again"
        for said in (
            nurse,
            "patient: stands 3 m from A towards B, on the line",
            "stop 0.5 m short of it",
            "after standing for 3 s",
        ):
            assert said in text
            assert said in sheet
        assert "whatever the robot does" not in sheet
        assert "forth: starts, s" in sheet
        assert '<td class="num">0.7</td><td class="start">+0.0</td>' in sheet
        blind = file.with_name("blind.toml")
        blind.write_text(PEOPLE.replace('behaviour = { kind = "operator" }', ""))
        assert "whatever the robot does" in sheet_of(parsed(skeleton(str(blind))), scenarios(str(blind), "tiago"))

    def test_files_are_named_as_seen_from_the_plan(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.chdir(tmp_path)
        from importlib import resources

        text = resources.files("clearway.robots").joinpath("tiago.toml").read_text(encoding="utf-8")
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        folder = tmp_path / "lab" / "plans"
        folder.mkdir(parents=True)
        plan = parsed(skeleton(robot="mine.toml", selection=Selection(batches=("NO",)), folder=folder))
        assert plan.test.robot is not None
        assert (folder / plan.test.robot).resolve() == (tmp_path / "mine.toml").resolve()

    def test_a_suite_of_many_worlds_is_no_lab(self):
        with pytest.raises(ClearwayError, match="floor plans"):
            skeleton("barn", "jackal", Selection(worlds=(0, 6)))

    def test_what_is_unknown_is_said(self):
        with pytest.raises(ClearwayError, match="hospital"):
            skeleton("hospitl")
        with pytest.raises(ClearwayError, match="tiago"):
            skeleton(robot="tiga")
        with pytest.raises(ClearwayError, match="known"):
            skeleton(selection=Selection(speeds=(0.7,)))


@given(
    a=st.tuples(st.floats(-9, 9), st.floats(-9, 9)),
    heading=st.floats(-3.14, 3.14),
    along=st.floats(-9, 9),
    across=st.floats(-9, 9),
)
def test_a_place_is_seen_from_the_line_wherever_it_lies(
    a: tuple[float, float], heading: float, along: float, across: float
):
    c, s = math.cos(heading), math.sin(heading)
    line = Line((*a, heading), (a[0] + 5 * c, a[1] + 5 * s, heading))
    point = (a[0] + along * c - across * s, a[1] + along * s + across * c)
    assert line.seen(point) == pytest.approx((along, across), abs=2e-6)
    assert line.turned(heading + 0.5) == pytest.approx(math.degrees(0.5), abs=1e-3)


def test_the_plan_says_in_which_order_it_stands():
    chosen = Selection(batches=("SO",), configurations=("single",), speeds=(0.6,), repetitions=2)
    by_lot, grouped = (skeleton(selection=chosen, drawn=drawn) for drawn in (True, False))
    assert "Order: every test once before any is repeated, each time in an order drawn by lot" in by_lot
    assert "a trial that is driven out of turn waits" in by_lot
    assert "You may\n# drive in another order. The number behind" in grouped


def test_words():
    line = Line((0.0, 0.0, 0.0), (5.0, 0.0, 0.0))
    assert line.words((2.215, 0.0)) == "2.215 m from A towards B, on the line"
    assert line.words((-2.0, 0.8944)) == "2 m behind A, 0.894 m to the left"
    assert line.words((2.5, -0.42, 0.0)) == "2.5 m from A towards B, 0.42 m to the right"
    assert line.words((5.0, 0.0, 1.0)) == "on B"


def test_nothing_is_overwritten(tmp_path: Path):
    path = tmp_path / "plan.toml"
    write_new(path, "a = 1\n")
    with pytest.raises(ClearwayError, match="there already"):
        write_new(path, "b = 1\n")
    assert tomllib.loads(path.read_text()) == {"a": 1}
    with pytest.raises(ClearwayError, match="cannot be written"):
        write_new(tmp_path / "no" / "plan.toml", "")
