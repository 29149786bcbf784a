"""Navigators are found by name and by address; what can't be found says why in one line."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from clearway.errors import ClearwayError
from clearway.navigators import registry

OWN = """
class Still:
    needs = frozenset()
    def __init__(self, pace=0.0):
        self.pace = pace
    def reset(self, task, robot, rng): pass
    def step(self, observation): pass

class NotOne:
    pass

value = 3
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    file = tmp_path / "own_still.py"  # a name of its own: a module stays imported for the tests that follow
    file.write_text(OWN)
    return file


def test_the_shipped_navigator_is_registered() -> None:
    assert "move-base" in registry.navigator_names()


def test_an_unknown_name_suggests_the_closest() -> None:
    with pytest.raises(ClearwayError, match="did you mean 'move-base'"):
        registry.navigator_class("move_base")


def test_a_file_and_a_module_are_addresses(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = registry.make_navigator(f"{own}:Still", pace=0.3)
    assert made.pace == 0.3
    assert type(registry.make_navigator(f"{own}:Still")) is type(made)  # the file is loaded once
    monkeypatch.chdir(own.parent)
    assert registry.make_navigator("own_still:Still").pace == 0.0  # a module that lies where the user stands


def test_two_packages_may_not_claim_one_name() -> None:
    points = [EntryPoint("mine", f"{package}:Nav", registry.NAVIGATORS.group) for package in ("a", "b")]
    with pytest.raises(ClearwayError, match=r"'mine': a:Nav and b:Nav"):
        registry.NAVIGATORS.collect(points)
    assert registry.NAVIGATORS.collect([points[0], points[0]])["mine"] == "a:Nav"


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("{dir}/none.py:Nav", "none.py: no such file"),
        ("no_such_pkg.mod:Nav", "there is no module 'no_such_pkg'"),
        ("{dir}/own_still.py:Stil", "did you mean 'Still'"),
        ("{dir}/own_still.py:value", "is a int, not a class"),
        ("{dir}/own_still.py:", "not an address"),
        ("{dir}/own_still.py:NotOne", "has no method reset"),
        ("{dir}/broken.py:Nav", r"SyntaxError: .*\(broken.py:1\)"),
        ("{dir}/raises.py:Nav", r"ZeroDivisionError: division by zero \(raises.py:2\)"),
        ("{dir}/imports.py:Nav", "No module named 'does_not_exist'"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(own: Path, address: str, says: str) -> None:
    (own.parent / "broken.py").write_text("def (:\n")
    (own.parent / "raises.py").write_text("\n1 / 0\n")
    (own.parent / "imports.py").write_text("import does_not_exist\n")
    with pytest.raises(ClearwayError, match=says) as caught:
        registry.make_navigator(address.format(dir=own.parent))
    assert "\n" not in str(caught.value)


def test_a_wrong_option_is_one_line(own: Path) -> None:
    with pytest.raises(ClearwayError, match="unknown option 'speed'; known: pace"):
        registry.make_navigator(f"{own}:Still", speed=1.0)


def test_options_stand_behind_a_name() -> None:
    name, options = registry.split_options("hp-tmpc[solver=genetic, prediction_horizon=10,w1=0.5]")
    assert name == "hp-tmpc"
    assert options == {"solver": "genetic", "prediction_horizon": 10, "w1": 0.5}
    assert registry.split_options("own.py:Mine") == ("own.py:Mine", {})
    made = registry.make_navigator("move-base[base_local_planner=TrajectoryPlannerROS]")
    assert type(made).__name__ == "MoveBase"
    for wrong in ("move-base[]", "move-base[speed]", "move-base[=1]"):
        with pytest.raises(ClearwayError, match="is not an option"):
            registry.make_navigator(wrong)
    with pytest.raises(ClearwayError, match="unknown option 'nothing'; known: base_local_planner"):
        registry.make_navigator("move-base[nothing=1]")
