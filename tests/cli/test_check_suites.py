"""`clearway check` of a suite: one that is written in Python, by its address, and one in a file, with the robots that it names."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from command_line import Shell

SUITE = """
from clearway.scenarios.scenario import LabelSpec, LegSpec, PersonSpec, Scenario
from clearway.scenarios.suite import Suite, scenario_seed


def make(robot, selection, seed):
    return [
        Scenario(
            name=f"across-r{i}", floor_plan="arena", start=(3.0, 7.0, 0.0), speed=0.5, seed=scenario_seed(seed, f"across-r{i}"),
            legs=(LegSpec(name="across", goal=(11.0, 7.0, 0.0), time_limit=40.0),), labels=LabelSpec(batch="yard", configuration="across", repetition=i),
            people=(PersonSpec(name="p", start=(3.0, 3.0), behaviour="social-force"),),
        )
        for i in (1, 2)
    ]


YARD = Suite("yard", "Crossing our yard", "nothing but a yard", ("yard",), ("across",), make, robots=("tiago", "hosbot"))
"""


def _check(clearway: Shell, tmp_path: Path, old: str = "", new: str = "") -> tuple[int, str]:
    file = tmp_path / "our_suites.py"
    assert old in SUITE
    file.write_text(SUITE.replace(old, new) if old else SUITE)
    said = clearway("check", f"{file}:YARD")
    return said.code, said.out + said.err


def test_each_scenario_with_each_of_its_robots(clearway: Shell, tmp_path: Path) -> None:
    code, said = _check(clearway, tmp_path)
    assert code == 0, said
    assert "tiago: 2 scenarios, 1 without repetitions" in said
    assert "hosbot: 2 scenarios, 1 without repetitions" in said
    assert "nothing wrong" in said


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("11.0, 7.0", "900.0, 7.0", "across-r2: legs.0.goal"),
        ("social-force", "nowhere.py:Wanders", "people.0.behaviour"),
        ("return [", "return 1 / 0, [", "its scenarios cannot be made: ZeroDivisionError: division by zero (our_suites.py:7)"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_it_is_a_problem(clearway: Shell, tmp_path: Path, old: str, new: str, problem: str) -> None:
    code, said = _check(clearway, tmp_path, old, new)
    assert (code, problem in said) == (1, True), said


def test_a_suites_file_is_checked_with_the_robots_that_it_names(clearway: Shell, tmp_path: Path) -> None:
    examples = Path(__file__).parents[2] / "examples"
    shutil.copy(examples / "my_corridor.toml", tmp_path)
    robot = (examples / "my_robot.toml").read_text()
    (tmp_path / "broad.toml").write_text(robot.replace("[[0.35, 0.25], [-0.35, 0.25]", "[[0.35, 1.5], [-0.35, 1.5]"))
    suite = tmp_path / "suite.toml"
    suite.write_text('name = "own"\nfiles = ["my_corridor.toml"]\nrobots = ["tiago", "broad.toml", "gone.toml"]\n')
    said = clearway("check", suite)
    assert f"{suite}: robots.2: {tmp_path / 'gone.toml'}: no such file" in said.err
    assert "cart at the goal 'forth' (13.5, 0.3) would stand in" in said.err
    assert clearway("check", suite, "--robot", "tiago").code == 0


def test_a_robots_file_with_the_name_of_a_shipped_robot_is_told(clearway: Shell, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text((Path(__file__).parents[2] / "examples" / "my_robot.toml").read_text().replace('"cart"', '"tiago"'))
    said = clearway("check", path)
    assert (said.code, "'tiago' is the name of the robot 'tiago' too" in said.err) == (1, True)
