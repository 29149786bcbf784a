"""Planners of Arena by their step protocol, against a stand-in that speaks it."""

from __future__ import annotations

import dataclasses
import math
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from wire_scenes import observations

from clearway.campaigns.provenance import code_of
from clearway.contract import Command, Scan, Task
from clearway.errors import ClearwayError
from clearway.live.line import WireError
from clearway.navigators.registry import make_navigator
from clearway.robots import load_robot

pytest.importorskip("zmq", reason="pyzmq is not installed")

PLANNER = Path(__file__).with_name("arena_planner")
ADDRESS = f"arena:{PLANNER}[python={sys.executable}]"


def begin(navigator: Any) -> None:
    navigator.reset(Task(0.1, 0.6, np.zeros(3)), load_robot("tiago"), np.random.default_rng(0))


def drive(navigator: Any) -> list[Command]:
    return [navigator.step(observation) for observation in observations(12)]


def test_it_acts_on_features_that_its_manifest_names() -> None:
    made: Any = make_navigator(ADDRESS)
    assert made.needs == {"map", "scan", "obstacles"}
    for _ in range(2):
        begin(made)
        commands = drive(made)
        heading = math.atan2(1.0, 5.0)  # nothing stands between: the goal is its own subgoal
        assert (commands[0].v, commands[0].omega) == (0.5, pytest.approx(heading - 0.5))
        assert len({c.omega for c in commands}) > 5
    process = made._session._process
    made.close()
    assert process.poll() == 0


def test_what_is_too_fast_is_scaled_so_that_the_curve_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARENA_KIND", "fast")
    made: Any = make_navigator(ADDRESS)
    begin(made)
    assert [(c.v, c.omega) for c in drive(made)] == [(0.6, pytest.approx(0.3))] * 12
    made.close()


def test_an_action_in_the_worlds_frame_is_turned_to_the_base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eastward at 0.5 m/s, as rl_rvo would say it, with the robot's nose at 0.5 rad (`observations`)."""
    monkeypatch.setenv("ARENA_KIND", "east")
    shutil.copytree(PLANNER, tmp_path / "planner")
    file = tmp_path / "planner" / "planner.yaml"
    file.write_text(file.read_text().replace("differential_drive", "omnidirectional"))
    for robot, expected in (
        ("tiago-omni", (0.5 * math.cos(0.5), 0.0, -0.5 * math.sin(0.5))),
        ("tiago", (0.5 * 2.0943951 / 5.0, -2.0943951, 0.0)),  # -0.5 rad within 0.1 s, by one factor with its speed
    ):
        made: Any = make_navigator(f"arena:{tmp_path / 'planner'}[python={sys.executable}]")
        made.reset(Task(0.1, 0.6, np.zeros(3)), load_robot(robot), np.random.default_rng(0))
        command = next(iter(drive(made)))
        made.close()
        assert (command.v, command.omega, command.v_y) == pytest.approx(expected), robot


def test_a_scan_is_laid_around_the_robot_as_arena_lays_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight beams: to the left front, where half the range lies; behind, between the last and the first; nobody looks there."""
    monkeypatch.setenv("ARENA_KIND", "beams")
    made: Any = make_navigator(ADDRESS)
    begin(made)
    first = next(observations(1))
    for ranges, start, step, expected in (
        (np.linspace(1.0, 9.0, 9)[:8], -math.pi, math.pi / 4, (6.0, 1.0)),
        (np.full(8, 0.01), -math.pi, math.pi / 4, (25.0, 25.0)),  # nearer than the lidar sees is no return
        (np.array([3.0, 3.0, 3.0]), 0.6, 0.2, (3.0, 25.0)),
    ):
        scan = Scan(ranges, start, step, 0.05, 25.0, np.zeros(3))
        command = made.step(dataclasses.replace(first, scan=scan))
        assert (100 * command.v, 100 * command.omega) == pytest.approx(expected, rel=1e-6)
    made.close()


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("dies", "ended with exit code 1; .* 'out of thrust'"),
        ("fails", r"says that it failed: 'no weights' \('step_failed'\)"),
        ("nan", r"acts \[nan, nan\], which is no action of kind differential_drive; the last line .* 'no way out'"),
    ],
)
def test_what_it_does_wrong_is_said(kind: str, says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARENA_KIND", kind)
    made: Any = make_navigator(ADDRESS)
    begin(made)
    with pytest.raises(WireError, match=f"^navigator 'arena:.*arena_planner' {says}"):
        drive(made)
    begin(made)  # anew
    made.close()


def test_one_that_dies_before_it_connects_is_told_at_once(tmp_path: Path) -> None:
    shutil.copytree(PLANNER, tmp_path / "planner")
    (tmp_path / "planner" / "planner.py").write_text("import sys\nsys.exit('no module torch')\n")
    with pytest.raises(ClearwayError, match=r"ended with exit code 1; the last line .* 'no module torch'"):
        make_navigator(f"arena:{tmp_path / 'planner'}[python={sys.executable}]")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "{type: RobotPoseTFGenerator}",
            "{type: [RobotPoseTFGenerator]}",
            "robot_pose_from_tf.type: .* is not to be had",
        ),
        ("differential_drive", "flying", "action_type: 'flying' is none; differential_drive and"),
        (
            "nav_msgs/Path",
            "sensor_msgs/Image",
            "observations.datasources.plan.type: 'sensor_msgs/Image' is not to be had",
        ),
        ("lookahead: 2.0", "lookahead: far", "params.lookahead: 'far' is none"),
        ("{type: RobotPoseTFGenerator}", "3", "robot_pose_from_tf: 3 is no table"),
    ],
)
def test_a_manifest_that_asks_for_what_there_is_not(tmp_path: Path, old: str, new: str, says: str) -> None:
    shutil.copytree(PLANNER, tmp_path / "planner")
    file = tmp_path / "planner" / "planner.yaml"
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(ClearwayError, match=says):
        make_navigator(f"arena:{file.parent}")


def test_its_folder_decides_the_bits(tmp_path: Path) -> None:
    shutil.copytree(PLANNER, tmp_path / "planner")
    address = f"arena:{tmp_path / 'planner'}"
    before = code_of(address)
    (tmp_path / "planner" / ".venv").mkdir()
    (tmp_path / "planner" / ".venv" / "x").write_text("")
    assert code_of(address) == before
    (tmp_path / "planner" / "weights.npz").write_text("w")
    assert code_of(address) != before
    with pytest.raises(ClearwayError, match=r"planner\.py: no such file; arena:FOLDER names a folder"):
        make_navigator(f"arena:{tmp_path}")
