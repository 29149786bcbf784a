"""`clearway check` of a suite that is written in Python: as of every other one, by its address."""

from __future__ import annotations

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
