"""The examples can be had from wherever Clearway is installed."""

from __future__ import annotations

from pathlib import Path

from command_line import Shell

from clearway.examples_place import example_files

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_they_are_listed(clearway: Shell) -> None:
    said = clearway("examples")
    assert "02_own_navigator.py" in said.out
    assert "06_score_recordings/plan.toml" in said.out


def test_copies_are_the_same_files_and_overwrite_nothing(clearway: Shell, tmp_path: Path) -> None:
    said = clearway("examples", "--copy", tmp_path / "mine")
    assert said.code == 0
    for name in example_files():
        assert (tmp_path / "mine" / name).read_bytes() == (EXAMPLES / name).read_bytes()
    (tmp_path / "mine" / "my_robot.toml").write_text("changed")
    assert "is there already" in clearway.complaint("examples", "--copy", tmp_path / "mine")
    assert (tmp_path / "mine" / "my_robot.toml").read_text() == "changed"
