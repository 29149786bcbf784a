"""What the panels of a report show of the floor."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

import clearway
from clearway.contract import BodyKind
from clearway.geometry.shapes import rectangle
from clearway.reports import theme
from clearway.reports.floor_drawing import around, floor
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Body, Trial


def trial_of(suite: str, robot_name: str, batch: str) -> Trial:
    robot = load_robot(robot_name)
    scenario = load_suite(suite).build(robot, Selection(batches=(batch,), repetitions=1))[0]
    return clearway.simulate(scenario, robot, "orca")


def test_on_an_open_floor_people_are_shown_where_they_begin() -> None:
    trial = trial_of("crowd", "crowdnav-disc", "circle-invisible")
    low_x, low_y, high_x, high_y = around([trial], driven=False)
    begin = trial.moving_obstacles[0, :, :2]
    assert np.abs(begin[:, 0]).max() > 2.0  # far to the side of the robot's way, which is straight ahead
    assert (begin > (low_x, low_y)).all()
    assert (begin < (high_x, high_y)).all()


def test_between_walls_their_lanes_are_cut_short() -> None:
    trial = trial_of("crowd", "crowdnav-disc", "circle-invisible")
    wall = Body("wall", BodyKind.WALL, rectangle(10.0, 0.2), pose=np.array((0.0, 6.0, 0.0)))
    between = replace(trial, attempt=replace(trial.attempt, bodies=(*trial.attempt.bodies, wall)))
    low_x, _, high_x, _ = around([between], driven=False)
    begin = trial.moving_obstacles[0, :, 0]
    assert ((begin < low_x) | (begin > high_x)).any()


def test_the_ends_of_all_legs_are_named_each_place_once() -> None:
    trial = trial_of("crowd", "crowdnav-disc", "circle-invisible")
    (way,) = trial.attempt.legs
    corners = [np.array(at) for at in ((0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (5.0, 4.0, 0.0), (0.0, 0.0, 0.0))]
    legs = tuple(replace(way, start=a, goal=b) for a, b in itertools.pairwise(corners))
    ax = theme.new_figure(4.0, 4.0).add_subplot()
    floor(ax, replace(trial, attempt=replace(trial.attempt, legs=legs)), (-1.0, -1.0, 6.0, 5.0))
    named = {text.get_text(): text.get_position() for text in ax.texts}
    assert {"A", "B", "C"} <= set(named)
    assert "D" not in named
    for name, corner in zip("ABC", corners, strict=False):
        assert math.dist(named[name], corner[:2]) < 1.0
    lines = {tuple(map(tuple, line.get_xydata().tolist())) for line in ax.lines if line.is_dashed()}
    assert lines == {((0.0, 0.0), (5.0, 0.0)), ((5.0, 0.0), (5.0, 4.0)), ((5.0, 4.0), (0.0, 0.0))}


def test_where_trials_failed_on_their_way_is_marked_and_counted(tmp_path: Path) -> None:
    out = tmp_path / "out"
    results = clearway.run(
        "crowd", robots=["crowdnav-disc"], navigators=["orca"], batches=["circle-invisible"], seeds=(4, 6), repetitions=2,
        workers=0, out=out,
    )  # fmt: skip
    rows = results.trials.to_pylist()
    assert [r["outcome"] for r in rows] == ["collision", "collision", "reached", "reached"]
    touched, reached = results.figure("trajectories").axes
    drawn = [line for line in touched.lines if line.get_marker() == "x" and line.get_color() == theme.BAD]
    assert [tuple(at) for line in drawn for at in line.get_xydata()] == [
        tuple(results.trial(r["trial"]).pose[-1, :2]) for r in rows[:2]
    ]
    assert "touched something: 2 of 2" in touched.get_xlabel()
    assert "touched" not in reached.get_xlabel()
    assert not [line for line in reached.lines if line.get_marker() == "x"]
