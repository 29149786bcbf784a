"""Navigators are found by name and by address; what can't be found says why in one line."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from clearway.campaigns import provenance
from clearway.campaigns.plan import CampaignPlan, Selection
from clearway.campaigns.plan_checks import check_plan
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


def test_a_file_imports_what_lies_beside_it(tmp_path: Path) -> None:
    """As `python own_beside.py` would; once it has changed it is read again, and so is the record of what drove."""
    file, helper, package = tmp_path / "own_beside.py", tmp_path / "own_helper.py", tmp_path / "own_parts"
    package.mkdir()
    (package / "__init__.py").write_text("from .pace import PACE\n")
    (package / "pace.py").write_text("PACE = 0.1\n")
    helper.write_text("PACE = 0.2\n")
    file.write_text(
        f"from own_helper import PACE\n{OWN}\ndef late():\n    from own_parts import PACE\n    return PACE\n"
    )
    path = sys.path.copy()
    assert registry.navigator_class(f"{file}:PACE.__class__") is float
    sys.path[:] = path  # as a worker's is put back after each trial
    assert registry.navigator_class(f"{file}:late")() == 0.1
    before = provenance.code_of(f"{file}:Still")
    for changed, value in ((helper, 0.25), (package / "pace.py", 0.15)):
        changed.write_text(f"PACE = {value}\n")
        after = provenance.code_of(f"{file}:Still")
        assert after != before
        before = after
    made = registry.navigator_class(f"{file}:late")
    assert (made.__globals__["PACE"], made()) == (0.25, 0.15)


def test_files_of_one_name_are_told_apart(tmp_path: Path) -> None:
    codes = set()
    for folder in (tmp_path / "old", tmp_path / "new"):
        folder.mkdir()
        (folder / "own_version.py").write_text(f"{OWN}\nversion = {folder.name!r}\n")
    for _ in range(2):
        codes |= {provenance.code_of(f"{tmp_path / folder / 'own_version.py'}:Still") for folder in ("old", "new")}
    assert len(codes) == 2


@pytest.mark.parametrize("name", ["statistics", "sys", "numpy"])
def test_what_lies_beside_a_file_has_a_name_of_its_own(tmp_path: Path, name: str) -> None:
    (tmp_path / "own_named.py").write_text(f"import {name}\n{OWN}")
    (tmp_path / f"{name}.py").write_text("")
    with pytest.raises(
        ClearwayError, match=f"own_named.py: imports '{name}' from beside it, but that is the name of .* too"
    ):
        registry.navigator_class(f"{tmp_path / 'own_named.py'}:Still")


def test_files_of_two_folders_do_not_share_a_module_by_chance(tmp_path: Path) -> None:
    """Which of two a worker had imported first hung on which trials it got."""
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "own_planner.py").write_text(f"import own_shared\n{OWN}")
        (tmp_path / folder / "own_shared.py").write_text("")
    names = tuple(f"{tmp_path / folder / 'own_planner.py'}:Still" for folder in ("one", "two"))
    plan = CampaignPlan(("hospital",), ("tiago",), names, Selection(batches=("NO",), repetitions=1))
    with pytest.raises(
        ClearwayError, match=r"two.own_planner.py: imports 'own_shared' .*one.own_planner.py imports another"
    ):
        check_plan(plan, plan.specs())
    assert not {"own_shared"} & set(sys.modules)


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
    assert registry.split_options("exec:python3 p.py [1,2]") == ("exec:python3 p.py [1,2]", {})
    made = registry.make_navigator("move-base[base_local_planner=TrajectoryPlannerROS]")
    assert type(made).__name__ == "MoveBase"
    for wrong in ("move-base[]", "move-base[speed]", "move-base[=1]"):
        with pytest.raises(ClearwayError, match="is not an option"):
            registry.make_navigator(wrong)
    with pytest.raises(ClearwayError, match="unknown option 'nothing'; known: base_local_planner"):
        registry.make_navigator("move-base[nothing=1]")


class Reads:
    files: object = None


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (staticmethod(lambda gain: 1 / 0), r"'own' cannot say which files it reads: ZeroDivisionError.*\(test_registry.py:"),
        (lambda self, gain: (), "cannot say which files it reads: TypeError"),
        (staticmethod(lambda: ()), "cannot say which files it reads: TypeError.*'gain'"),
        (staticmethod(lambda gain: "gains.yaml"), "reads 'gains.yaml'; `files` answers with a tuple of paths"),
        (staticmethod(lambda gain: (1,)), r"reads \(1,\); `files` answers"),
    ],
)  # fmt: skip
def test_which_files_it_reads_is_said_as_paths(files: object, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Reads, "files", files)
    with pytest.raises(ClearwayError, match=said):
        registry.files_of("own", Reads, {"gain": 2})
    monkeypatch.setattr(Reads, "files", staticmethod(lambda gain: [f"{gain}.yaml"]))
    assert registry.files_of("own", Reads, {"gain": 2}) == (Path("2.yaml"),)
    assert registry.files_of("own", object, {"gain": 2}) == ()
