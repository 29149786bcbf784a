"""What is nearly right is answered with what would be right."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Shell

EXAMPLES = Path(__file__).parents[2] / "examples"

OWN = """
from clearway.contract import Command
class Hangs:
    needs = frozenset()
    def reset(self, task, robot, rng): pass
    def step(self, observation):
        while True: pass
class Tuples(Hangs):
    def step(self, observation): return (0.1, 0.0)
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    file = tmp_path / "own.py"
    file.write_text(OWN)
    return file


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["check", "tiagoo"], "did you mean the robot 'tiago'?"),
        (["check", "hospitall"], "did you mean the suite 'hospital'?"),
        (["score", EXAMPLES / "my_robot.toml"], "is the file of a robot, and a test plan is wanted"),
        (["run", EXAMPLES / "my_robot.toml"], "is the file of a robot, and a suite is wanted; name it with --robot"),
        (
            ["run", "floor 2.yaml", "-r", "tiago"],
            "floor 2.yaml: is no file of a suite, which is TOML; a map is named in a scenario, or with",
        ),
        (["run", "hospital", "-r", EXAMPLES / "my_suite.toml"], "is the file of a suite, and a robot is wanted"),
        (["run", EXAMPLES / "06_score_recordings" / "plan.toml"], "`clearway score` scores it"),
        (["run", "hospital", "--workers", "0", "-n", "my_pkg.Mine"], "is named as my_pkg:Mine"),
    ],
)
def test_what_was_meant_is_named(clearway: Shell, words: list[object], says: str) -> None:
    assert says in clearway.complaint(*words)


def test_a_file_of_navigators_is_answered_with_what_is_in_it(clearway: Shell, own: Path) -> None:
    assert f"{own}:Hangs or {own}:Tuples" in clearway.complaint("check", own)


@pytest.mark.parametrize(
    ("navigator", "says"),
    [("hp-tmpc[sover=genetic]", "did you mean 'solver'?"), ("hp-st[witout=reverse]", "did you mean 'without'?")],
)
def test_an_option_that_is_misspelt(clearway: Shell, navigator: str, says: str) -> None:
    assert says in clearway.complaint("check", navigator)


def test_a_share_above_one_is_no_percentage(clearway: Shell) -> None:
    assert "did you mean" not in clearway.complaint("samples", "--reliability", "1.2")
    assert "did you mean 0.95?" in clearway.complaint("samples", "--reliability", "95")


@pytest.mark.parametrize("name", ["tiago", "hosbot:vendor", "arena"])
def test_what_comes_with_clearway_is_checked_by_its_name(clearway: Shell, name: str) -> None:
    said = clearway("check", name)
    assert said.code == 0
    assert said.out.endswith(f"{name}: nothing wrong\n")


def test_a_decision_without_end_is_broken_off(clearway: Shell, own: Path) -> None:
    said = clearway("check", f"{own}:Hangs", "--decision-limit", "0.3")
    assert said.code == 1
    assert "took longer than 0.3 s for a decision" in said.err
    assert "not tested  decides: nothing in sight: an earlier decision hung" in said.out
    assert "ok          decides" not in said.out
    assert "ok          commands" not in said.out


def test_what_no_command_was_given_for_is_not_called_right(clearway: Shell, own: Path) -> None:
    said = clearway("check", f"{own}:Tuples")
    assert "not tested  commands are finite: it gave no command" in said.out
    assert "returned a tuple" in said.err


def test_a_footprint_in_centimetres(clearway: Shell, tmp_path: Path) -> None:
    text = (EXAMPLES / "my_robot.toml").read_text()
    file = tmp_path / "big.toml"
    file.write_text(text.replace("[0.35, 0.25], [-0.35, 0.25]", "[35.0, 25.0], [-35.0, 25.0]"))
    said = clearway("check", file)
    assert said.code == 1
    assert "the footprint reaches 43.0 m from base_link" in said.err


@pytest.mark.parametrize(
    ("a", "b", "says"),
    [
        ("[1.1, 2.0, 0.0]", "[8.0, 2.0, 0.0]", "a: tiago at A (1.1, 2) would stand in 'west'"),
        ("[2.0, 2.0, 0.0]", "[12.0, 2.0, 0.0]", "b: (12, 2) is outside the floor plan"),
        ("[2.0, 2.0, 0.0]", "[8.0, 2.0, 0.0]", "b: tiago is 0.54 m wide, but the widest way from A to B"),
    ],
)
def test_the_ends_of_a_plans_line(clearway: Shell, tmp_path: Path, a: str, b: str, says: str) -> None:
    walls = {"west": (0.8, 0, 1, 4), "east": (9, 0, 9.2, 4), "south": (0.8, -0.2, 9.2, 0), "north": (0.8, 4, 9.2, 4.2)}
    walls["between"] = (5.0, 0.3, 5.2, 4.0)
    rows = "".join(f'[[walls]]\nname = "{n}"\nbox = {[float(v) for v in box]}\n' for n, box in walls.items())
    file = tmp_path / "plan.toml"
    file.write_text(f'name = "strip"\na = {a}\nb = {b}\n{rows}')
    said = clearway("check", file)
    assert said.code == 1
    assert says in said.err


@pytest.mark.parametrize(
    ("words", "word", "found"),
    [
        ("clearway run hospital-h", 2, ["hospital-held-out", "hospital-held-out-blind"]),
        ("clearway run hospital --robot mi", 4, ["mir100"]),
        ("clearway run hospital --navigator hp-s", 4, ["hp-st", "hp-st-foresight"]),
    ],
)
def test_a_shell_completes_names(
    clearway: Shell, monkeypatch: pytest.MonkeyPatch, words: str, word: int, found: list[str]
) -> None:
    monkeypatch.setenv("_CLEARWAY_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(word))
    assert [n for n in clearway().out.split() if n.startswith(found[0])] == found
