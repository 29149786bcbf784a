"""Legs by what the robot reported: goals that are sent again, given up, reached elsewhere; and a bag of Nav2 scored whole."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_bags import START, Robot, write_mcap
from test_assemble import drive

from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.recordings.lab.actions import legs_told
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.lab.lab import Lab
from clearway.recordings.motion.motion import Motion, Quality
from clearway.recordings.protocol.toml_text import toml
from clearway.recordings.recording import Goals
from clearway.trials import Leg

A, B = np.zeros(3), np.array([4.0, 0.0, 0.0])
LEGS = (Leg("forth", A, B, 0.2, 0.2), Leg("back", B, A, 0.2, 0.2))


def motion() -> Motion:
    """To B from 2 s to 10 s, back to A from 14 s to 22 s, at 0.5 m/s; until 26 s."""
    t = np.arange(0.0, 26.0, 0.1)
    x = np.interp(t, [2, 10, 14, 22], [0, 4, 4, 0])
    pose = np.column_stack([x, np.zeros((len(t), 2))])
    velocity = np.gradient(pose, t, axis=0)[:, [0, 2]]
    return Motion(t, pose, velocity, None, Quality(10.0, 1.0))


def goals(*told: tuple[float, float, str], poses: list[list[float]] | None = None) -> Goals:
    sent, ended, outcome = zip(*told, strict=True)
    where = np.full((len(told), 3), np.nan) if poses is None else np.array(poses)
    return Goals("map", np.array(sent), where, np.array(ended), outcome)


def test_each_goal_that_was_reached_ends_a_leg() -> None:
    found = legs_told(LEGS, goals((1.4, 10.9, "succeeded"), (13.2, 22.8, "succeeded")), motion())
    assert found is not None
    assert [(f.leg, f.start, f.end, f.reached) for f in found] == [(0, 1.4, 10.9, True), (1, 13.2, 22.8, True)]
    assert found[0].why == "goal sent at 1.40 s; called reached at 10.90 s by the robot"


def test_a_goal_that_was_sent_again_is_one_leg_from_the_first_on() -> None:
    told = goals((1.4, 3.0, "aborted"), (3.5, 4.0, "canceled"), (4.1, 10.9, "succeeded"), (13.2, math.nan, ""))
    found = legs_told(LEGS, told, motion())
    assert found is not None
    assert [(f.start, f.end, f.reached) for f in found] == [(1.4, 10.9, True), (13.2, pytest.approx(25.9), False)]
    assert "and 2 more times" in found[0].why
    assert "still pursued" in found[1].why


def test_where_goals_are_known_another_one_begins_the_next_leg() -> None:
    told = goals((1.4, 9.0, "aborted"), (13.2, 22.8, "succeeded"), poses=[[4, 0, 0], [0, 0, 0]])
    found = legs_told(LEGS, told, motion())
    assert found is not None
    assert [(f.leg, f.reached) for f in found] == [(0, False), (1, True)]


def test_what_cannot_be_is_told() -> None:
    with pytest.raises(ClearwayError, match=r"more than the plan's 2 legs: another at 24\.00 s"):
        legs_told(LEGS, goals((1, 10.9, "succeeded"), (13, 22.8, "succeeded"), (24, math.nan, "")), motion())
    with pytest.raises(ClearwayError, match=r"called a goal reached at 6\.00 s, 2\.00 m from that of leg forth"):
        legs_told(LEGS, goals((1.4, 6.0, "succeeded")), motion())


def test_without_an_action_the_motion_decides() -> None:
    assert legs_told(LEGS, None, motion()) is None
    assert legs_told(LEGS, Goals("map", np.array([1.0]), np.zeros((1, 3))), motion()) is None
    assert legs_told(LEGS, replace(goals((1.0, 2.0, "succeeded")), t=np.zeros(0)), motion()) is None


def bag(folder: Path, reports: list[tuple[float, float]]) -> Path:
    """The drive that `test_assemble` knows by hand, as a bag of odometry, and Nav2's states of three goals."""
    r, rows, lines = Robot(2), drive(), []
    for t, x, y, yaw in rows[:, :4]:
        ns = START + round(t * 1e9)
        lines.append(("/odom", "nav_msgs/msg/Odometry", ns, r.odometry(ns, x, y, yaw)))
    kind = "action_msgs/msg/GoalStatusArray"
    for number, (sent, ended) in enumerate(reports, 1):
        uuid = r.make("unique_identifier_msgs/msg/UUID", np.full(16, number, dtype=np.uint8))
        for at, state in ((sent, 2), (ended, 4)):
            ns = START + round(at * 1e9)
            stamp = r.make("builtin_interfaces/msg/Time", *divmod(START + round(sent * 1e9), 1_000_000_000))
            status = r.make("action_msgs/msg/GoalStatus", r.make("action_msgs/msg/GoalInfo", uuid, stamp), state)
            lines.append(
                ("/navigate_to_pose/_action/status", kind, ns, r.make("action_msgs/msg/GoalStatusArray", [status]))
            )
    return write_mcap(folder / "run.mcap", sorted(lines, key=lambda line: line[2]))


def test_a_bag_of_nav2_is_scored_by_the_robots_own_times(tmp_path: Path) -> None:
    reports = [(1.2, 6.9), (7.3, 11.9), (12.1, 17.8)]
    bag(tmp_path, reports)
    plan: dict[str, Any] = {
        "test": {"suite": "own", "robot": "tiago", "reference_length": 2.0},
        "sources": {"log": {"frame": {"same": True}, "goals": "/navigate_to_pose"}},
        "robot": {"track": "/odom"},
        "legs": [
            {"name": "forth", "start": [0.0, 0.0, 0.0], "goal": [2.0, 0.0, 0.0]},
            {"name": "turn", "goal": [2.0, 0.0, math.pi], "scored": False},
            {"name": "back", "goal": [0.0, 0.0, math.pi]},
        ],
        "trial": [{"file": "run.mcap", "speed": 0.5}],
    }
    path = tmp_path / "plan.toml"
    path.write_text(toml(plan), encoding="utf-8")
    assert not [str(e) for e in problems_of(path) if "goals" in str(e)]
    trial = assemble(Lab(path), 0)
    spans = [(s.start, s.end) for s in trial.spans]
    assert spans == [pytest.approx(span, abs=1e-6) for span in reports]
    assert trial.outcome == "reached"
    assert score_row(trial)["CT"] == pytest.approx(sum(b - a for a, b in reports[::2]), abs=1e-6)
    assert "called reached at 6.90 s by the robot" in trial.provenance["legs"][0]
