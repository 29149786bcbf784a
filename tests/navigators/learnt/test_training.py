"""Where `ppo` learns for TIAGo, and that nothing of a training that is killed goes on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clearway.navigators.learnt.ppo import Ppo
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
PROGRAM = BENCHMARKS / "train_ppo.py"


def test_a_way_is_always_there_in_the_halls_and_each_is_another() -> None:
    robot, halls = load_robot("tiago"), load_suite(f"{BENCHMARKS / 'ppo' / 'halls.py'}:HALLS")
    drawn = halls.build(robot, Selection(seeds=(0, 40)))
    assert [problem for scenario in drawn for problem in check_scenario(scenario, robot)] == []
    assert len({scenario.start for scenario in drawn}) == 40
    assert {len([o for o in scenario.obstacles if o.runs]) for scenario in drawn} == {0, 1, 2}
    (again,) = halls.build(robot, Selection(seeds=(7, 8)))
    assert again == drawn[7]


@pytest.mark.slow
def test_the_training_for_scans_runs(tmp_path: Path) -> None:
    command = [sys.executable, str(PROGRAM), "lidar", "--smoke", "--episodes", "1", "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=600)
    Ppo(policy=str(tmp_path / "lidar-0.npz")).read_parameters(load_robot("tiago"))
    told = json.loads((tmp_path / "lidar-0.json").read_text())
    assert told["steps"] > 0
    assert 0.0 <= told["success"] <= 1.0


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="who is whose child is read from /proc")
def test_who_kills_a_training_ends_its_workers(tmp_path: Path) -> None:
    command = [sys.executable, str(PROGRAM), "discs", "--seeds", "2", "--steps", "1000000000", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as training:
        until = time.monotonic() + 60.0
        while len(workers := _workers(training.pid)) < 2 and time.monotonic() < until:
            time.sleep(0.1)
        time.sleep(5.0)
        training.send_signal(signal.SIGKILL)
    assert len(workers) == 2
    until = time.monotonic() + 30.0
    while any(map(_lives, workers)) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(map(_lives, workers))


def _workers(pid: int) -> list[int]:
    """Its children that train."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
