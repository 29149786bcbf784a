"""Files that a scenario's file names, seen from its own folder, wherever the command is given."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.scenarios.files import scenarios_in

SCENE = """
name = "beside"
floor_plan = "arena"
start = [3.0, 7.0, 0.0]
speed = 0.5
[[legs]]
name = "on"
goal = [11.0, 7.0, 0.0]
time_limit = 60.0
[[robots]]
name = "other"
role = "other"
start = [3.0, 3.0, 0.0]
navigator = "NAVIGATOR"
legs = [{ name = "on", goal = [11.0, 3.0, 0.0], time_limit = 60.0 }]
"""


@pytest.mark.parametrize(
    ("named", "seen"),
    [
        ("nav2[params=mine.yaml]", "nav2[params={}/mine.yaml]"),
        ("move-base[params=folder+mine.yaml]", "move-base[params={0}/folder+{0}/mine.yaml]"),
        ("npz:mine.yaml", "npz:{}/mine.yaml"),
        ("own.py:Drives[params=mine.yaml]", "{0}/own.py:Drives[params={0}/mine.yaml]"),
        ("nav2[params=turtlebot4]", "nav2[params=turtlebot4]"),  # a preset
        ("nav2[params=gone.yaml]", "nav2[params=gone.yaml]"),
        ("hp-st", "hp-st"),
    ],
)
def test_what_another_robots_navigator_reads_lies_beside_the_file(tmp_path: Path, named: str, seen: str) -> None:
    (tmp_path / "mine.yaml").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "scene.toml").write_text(SCENE.replace("NAVIGATOR", named))
    (scenario,) = scenarios_in(tmp_path / "scene.toml")
    assert scenario.robots[0].navigator == seen.format(tmp_path)
