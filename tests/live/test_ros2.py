"""A stand-in for Nav2 in a process of its own, over DDS on the loopback interface, drives a real trial."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")

from clearway.campaigns import CampaignPlan, run_campaign
from clearway.scenarios.suites import Selection
from clearway.trials.store import Results

pytestmark = pytest.mark.slow

STAND_IN = Path(__file__).with_name("nav2_stand_in.py")
DOMAIN = 20 + os.getpid() % 80


@contextmanager
def stand_in(kind: str) -> Iterator[None]:
    process = subprocess.Popen([sys.executable, str(STAND_IN), str(DOMAIN), kind])
    try:
        yield
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()


def driven(out: Path, options: str = "", domain: int = DOMAIN) -> Results:
    plan = CampaignPlan(
        suites=("hospital",), robots=("tiago",), navigators=(f"ros2:[domain={domain},patience=3{options}]",),
        selection=Selection(scenarios=("NO-v0.6-r1",)), localisation="truth", decision_limit=10.0,
    )  # fmt: skip
    return run_campaign(plan, out, 1)


def test_a_trial_is_driven_to_its_goal_with_the_same_bits_twice(tmp_path: Path) -> None:
    with stand_in("stamped"):
        one, two = (driven(tmp_path / name, ",stamped=true") for name in ("one", "two"))
    assert one.trials.to_pylist()[0]["outcome"] == "reached"
    assert one.trial(0).pose.tobytes() == two.trial(0).pose.tobytes()


@pytest.mark.parametrize(
    ("kind", "options"),
    [("lost", ",deadline=0.05"), ("late", ",stamped=true,deadline=0.05"), ("good", ",lockstep=false")],
)
def test_lost_and_late_commands_and_real_time_reach_the_goal_too(tmp_path: Path, kind: str, options: str) -> None:
    with stand_in(kind):
        row = driven(tmp_path / "out", options).trials.to_pylist()[0]
    assert row["outcome"] == "reached", row["reason"]


@pytest.mark.parametrize(
    ("kind", "options", "outcome", "says"),
    [
        ("rejects", "", "navigator_failed", "rejects the goal"),
        ("aborts", "", "aborted", "aborted the goal"),
        ("silent", "", "navigator_failed", "said nothing on /cmd_vel"),
        ("nan", "", "navigator_failed", "linear.x = nan"),
        ("two", "", "navigator_failed", "two publishers"),
        ("wrong frame", ",stamped=true", "navigator_failed", "in the frame 'odom'"),
        ("jumps back", ",stamped=true", "navigator_failed", "jumps back"),
    ],
)
def test_what_goes_wrong_is_the_trials_reason(tmp_path: Path, kind: str, options: str, outcome: str, says: str) -> None:
    with stand_in(kind):
        row = driven(tmp_path / "out", options).trials.to_pylist()[0]
    assert row["outcome"] == outcome
    assert says in row["reason"]


def test_nobody_there_is_said(tmp_path: Path) -> None:
    row = driven(tmp_path / "out", domain=DOMAIN + 100).trials.to_pylist()[0]
    assert row["outcome"] == "navigator_failed"
    assert "has no server of the action navigate_to_pose within 3 s" in row["reason"]
