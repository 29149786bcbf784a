"""A real master and a real node of rospy, which stands in for move_base, drive a real trial."""

from __future__ import annotations

import os
import socket
import subprocess
import time
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import clearway
from clearway.campaigns import CampaignPlan, run_campaign
from clearway.live.ros1.node import Node
from clearway.scenarios.suites import Selection
from clearway.trials.store import Results

PYTHON = "/usr/bin/python3"
NEEDS = "import actionlib, move_base_msgs.msg, nav_msgs.msg, rosmaster, rospy, sensor_msgs.msg, std_srvs.srv, tf2_ros"
MISSING = (
    not os.path.exists(PYTHON) or subprocess.run([PYTHON, "-c", NEEDS], capture_output=True, check=False).returncode
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason="Debian's ROS 1 isn't installed (see .ci/run)"),
]
STAND_IN = Path(__file__).with_name("move_base_stand_in.py")


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture(scope="module")
def master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The environment of a node of its."""
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS"))}
    environment = kept | {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "ROS_HOME": str(tmp_path_factory.mktemp("ros"))}
    command = ["rosmaster", "--core", "-p", str(port)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 20.0
    while True:
        with suppress(OSError):
            xmlrpc.client.ServerProxy(uri).setParam("/test", "/use_sim_time", True)
            break
        assert time.monotonic() < until
        time.sleep(0.05)
    yield environment
    process.kill()
    process.wait()


@contextmanager
def stand_in(master: dict[str, str], kind: str, *arguments: str) -> Iterator[None]:
    process = subprocess.Popen([PYTHON, str(STAND_IN), kind, *arguments], env=master, stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        yield
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()


def driven(out: Path, master: dict[str, str], options: str = "") -> Results:
    plan = CampaignPlan(
        suites=("hospital",), robots=("tiago",), navigators=(f"ros1:{master['ROS_MASTER_URI']}[patience=4{options}]",),
        selection=Selection(scenarios=("NO-v0.6-r1", "NO-v0.6-r2")[: 1 + ("twice" in out.name)]), localisation="truth",
        decision_limit=20.0,
    )  # fmt: skip
    return run_campaign(plan, out, 1)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("good", ""),
        ("lost", ",deadline=0.05"),
        ("late", ",deadline=0.05"),
        ("good", ",lockstep=false"),
        ("connects late", ""),
    ],
)
def test_a_trial_is_driven_to_its_goal(tmp_path: Path, master: dict[str, str], kind: str, options: str) -> None:
    with stand_in(master, kind):
        row = driven(tmp_path / "out", master, options).trials.to_pylist()[0]
    assert row["outcome"] == "reached", row["reason"]


def test_one_trial_after_another_and_a_stack_that_is_begun_anew(tmp_path: Path, master: dict[str, str]) -> None:
    for name in ("twice", "twice more"):
        with stand_in(master, "good"):
            rows = driven(tmp_path / name, master).trials.to_pylist()
        assert [row["outcome"] for row in rows] == ["reached", "reached"], [row["reason"] for row in rows]


def test_the_clock_goes_on_where_another_process_left_it(tmp_path: Path, master: dict[str, str]) -> None:
    """It ran ahead of the wall clock; actionlib takes no goal that is older than the last one that was cancelled."""
    with stand_in(master, "rests"):
        rows = driven(tmp_path / "twice", master).trials.to_pylist()
        # whose goal is cancelled
        assert [row["outcome"] for row in rows] == ["reached", "navigator_failed"], [row["reason"] for row in rows]
        rows = driven(tmp_path / "once more", master).trials.to_pylist()
    assert [row["outcome"] for row in rows] == ["reached"], rows[0]["reason"]


@pytest.mark.parametrize(
    ("kind", "outcome", "says"),
    [
        ("rejects", "navigator_failed", "rejects the goal"),
        ("aborts", "aborted", "aborted the goal"),
        ("silent", "navigator_failed", "said nothing on /cmd_vel"),
        ("nan", "navigator_failed", "linear.x = nan"),
        ("wrong type", "navigator_failed", "does not say geometry_msgs/Twist"),
        ("no publisher", "navigator_failed", "has no publisher of /cmd_vel within 4 s"),
        ("deaf", "navigator_failed", "has no connection of its subscriber /move_base to /map within 4 s"),
    ],
)
def test_what_goes_wrong_is_the_trials_reason(
    tmp_path: Path, master: dict[str, str], kind: str, outcome: str, says: str
) -> None:
    with stand_in(master, kind):
        row = driven(tmp_path / "out", master).trials.to_pylist()[0]
    assert row["outcome"] == outcome
    assert says in row["reason"]


def test_goals_that_it_hears_of_after_the_cancel_are_left_too(tmp_path: Path, master: dict[str, str]) -> None:
    under_way = {0, 1, 6, 7}  # actionlib_msgs/GoalStatus: pending, active, preempting, recalling
    with stand_in(master, "thinks"):
        # Listens from the start: after the trial its clock stands, and actionlib says only what changes.
        node, known = Node(master["ROS_MASTER_URI"], "127.0.0.1", ""), {}
        hears = node.subscription("move_base/status", "actionlib_msgs/msg/GoalStatusArray")
        row = driven(tmp_path / "out", master).trials.to_pylist()[0]
        assert "does not answer the goal" in row["reason"]
        until = time.monotonic() + 20.0
        while (len(known) < 3 or under_way & {*known.values()}) and time.monotonic() < until:
            node.wait(0.1)
            known |= {goal.goal_id.id: goal.status for _, array in hears.take() for goal in array.status_list}
        node.close()
    assert len(known) == 3, known
    assert not under_way & {*known.values()}


def test_two_that_command_are_told_by_name(tmp_path: Path, master: dict[str, str]) -> None:
    with stand_in(master, "good"), stand_in(master, "second"):
        row = driven(tmp_path / "out", master).trials.to_pylist()[0]
    assert row["outcome"] == "navigator_failed"
    assert "has two publishers of /cmd_vel that command at the same time, /move_base and /teleop;" in row["reason"]


def test_nobody_there_is_said(tmp_path: Path, master: dict[str, str]) -> None:
    row = driven(tmp_path / "out", master).trials.to_pylist()[0]
    assert row["outcome"] == "navigator_failed"
    assert "has no server of the action move_base within 4 s" in row["reason"]


def test_the_verb_drives_a_suite_with_the_robots_topics_in_a_namespace(tmp_path: Path, master: dict[str, str]) -> None:
    with stand_in(master, "good", "__ns:=robot1"):
        found = clearway.live_ros1(
            "hospital", robot="tiago", scenarios=["NO-v0.6-r1"], master=master["ROS_MASTER_URI"], namespace="robot1", patience=4.0,
            out=tmp_path / "out",
        )  # fmt: skip
    assert found.results.trials["outcome"].to_pylist() == ["reached"]
    assert found.real_time_factor > 0.0
