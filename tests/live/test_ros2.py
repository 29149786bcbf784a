"""A stand-in for Nav2 in a process of its own, over DDS and over Zenoh on the loopback interface, drives a real trial."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")

from clearway.campaigns import CampaignPlan, run_campaign
from clearway.errors import ClearwayError
from clearway.scenarios.suites import Selection
from clearway.trials.store import Results

pytestmark = pytest.mark.slow

STAND_IN = Path(__file__).with_name("nav2_stand_in.py")
DOMAIN = 20 + os.getpid() % 80


@pytest.fixture(params=["cyclonedds", "zenoh"])
def place(request: pytest.FixtureRequest) -> Iterator[str]:
    """Where the stack is: a DDS domain, or a Zenoh router, which is begun for it."""
    if request.param == "cyclonedds":
        yield str(DOMAIN)
        return
    zenoh = pytest.importorskip("zenoh")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        at = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    config = {"mode": "router", "listen": {"endpoints": [at]}, "scouting": {"multicast": {"enabled": False}}}
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))):
        yield at


@contextmanager
def stand_in(place: str, kind: str) -> Iterator[None]:
    process = subprocess.Popen([sys.executable, str(STAND_IN), place, kind], stdout=subprocess.PIPE)
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == b"ready\n"
        yield
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def driven(out: Path, place: str, options: str = "") -> Results:
    where = f"domain={place}" if place.isdigit() else f"rmw=zenoh,router={place}"
    plan = CampaignPlan(
        suites=("hospital",), robots=("tiago",), navigators=(f"ros2:[{where},patience=3{options}]",),
        selection=Selection(scenarios=("NO-v0.6-r1",)), localisation="truth", decision_limit=10.0,
    )  # fmt: skip
    return run_campaign(plan, out, 1)


def test_a_trial_is_driven_to_its_goal_with_the_same_bits_twice(tmp_path: Path, place: str) -> None:
    with stand_in(place, "stamped"):
        one, two = (driven(tmp_path / name, place, ",stamped=true,deadline=5") for name in ("one", "two"))
    row = one.trials.to_pylist()[0]
    assert row["outcome"] == "reached", row["reason"]
    assert one.trial(0).pose.tobytes() == two.trial(0).pose.tobytes()


@pytest.mark.parametrize(
    ("kind", "options"),
    [("lost", ",deadline=0.05"), ("late", ",stamped=true,deadline=0.05"), ("good", ",lockstep=false")],
)
def test_lost_and_late_commands_and_real_time_reach_the_goal_too(
    tmp_path: Path, place: str, kind: str, options: str
) -> None:
    with stand_in(place, kind):
        row = driven(tmp_path / "out", place, options).trials.to_pylist()[0]
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
def test_what_goes_wrong_is_the_trials_reason(
    tmp_path: Path, place: str, kind: str, options: str, outcome: str, says: str
) -> None:
    with stand_in(place, kind):
        row = driven(tmp_path / "out", place, options).trials.to_pylist()[0]
    assert row["outcome"] == outcome
    assert says in row["reason"]


def test_nobody_there_is_said(tmp_path: Path, place: str) -> None:
    row = driven(tmp_path / "out", str(DOMAIN + 100) if place.isdigit() else place).trials.to_pylist()[0]
    assert row["outcome"] == "navigator_failed"
    assert "has no server of the action navigate_to_pose within 3 s" in row["reason"]


def test_no_router_is_said_before_anything_runs(tmp_path: Path) -> None:
    pytest.importorskip("zenoh")
    with pytest.raises(ClearwayError, match=r"finds no Zenoh router at tcp/127.0.0.1:9 .*rmw_zenohd. starts one"):
        driven(tmp_path / "out", "tcp/127.0.0.1:9")
