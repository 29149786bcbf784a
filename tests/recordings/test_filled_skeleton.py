"""A skeleton needs nothing but files and names: filled in with what a lab records, it is scored as it stands."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_trials import forth_and_back

from clearway.indicators import score_row
from clearway.recordings import formats
from clearway.recordings.exports import synthetic
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.lab.lab import Lab
from clearway.recordings.protocol.protocol import skeleton
from clearway.recordings.recording import Points, Recording
from clearway.scenarios.suites import Selection
from clearway.trials import Outcome, Trial


def written(path: Path, recording: Recording) -> None:
    """As Nexus exports it, with the marker names that the skeleton proposes."""
    points = recording.points
    assert points is not None
    names = tuple(n.replace("robot:", "tiago:").replace("person_500:", "hosbot:") for n in points.names)
    write = formats.formats()["vicon"].write
    assert write is not None
    write(path, replace(recording, points=replace(points, names=names)))


def survey(trial: Trial) -> Recording:
    """Markers on A, on B and 2 m to the left of the middle, in the capture's frame, half a millimetre of noise."""
    x, y, theta = synthetic.LAB.frame
    c, s = math.cos(theta), math.sin(theta)
    (a, b) = (trial.attempt.legs[0].start[:2], trial.attempt.legs[0].goal[:2])
    known = np.array([a, b, (a + b) / 2 + [0.0, 2.0]])
    xyz = np.zeros((100, 3, 3))
    xyz[:, :, :2] = (known - [x, y]) @ np.array([[c, -s], [s, c]])
    xyz += np.random.default_rng(4).normal(0.0, 0.0005, xyz.shape)
    return Recording(Path("survey"), "vicon", Points(("floor:A", "floor:B", "floor:C"), np.arange(100) / 100, xyz))


MOVED = (("[-2.5, 0.0", "[-2.5, 1.0"), ("[2.5, 0.0", "[2.5, 1.0"), ("[0.0, 2.0]", "[0.0, 3.0]"))
"""The made-up robot drives 1 m beside the line of the hall: here A and B lie there."""


def with_a_moving_obstacle(folder: Path, *, tied: bool) -> Path:
    """The plan of a trial with a moving obstacle, filled in; `tied`: the moving obstacle was recorded at rest on A, as the sheet asks."""
    trial = forth_and_back(square=False, batch="MO")
    a = trial.attempt.legs[0].start
    on_a = [replace(b, kind="obstacle", pose=a) if b.kind == "moving obstacle" else b for b in trial.attempt.bodies]
    rested = replace(
        trial, attempt=replace(trial.attempt, bodies=tuple(on_a)), moving_obstacles=np.empty((len(trial.t), 0, 3))
    )
    written(folder / "survey.csv", survey(trial))
    written(folder / "static_A.csv", synthetic.held(trial, a))
    written(folder / "straight.csv", synthetic.straight(trial, a))
    written(folder / "static_hosbot.csv", synthetic.captured(rested))
    written(folder / "first.csv", synthetic.captured(trial))
    text = skeleton(selection=Selection(batches=("MO",), speeds=(0.6,), obstacle_speeds=(0.6,), repetitions=1))
    head, trial_1, *_ = text.split("\n[[trial]]")
    text = f"{head}\n[[trial]]{trial_1}".replace('file = ""', 'file = "first.csv"')
    hosbot = 'shape = { kind = "robot", robot = "hosbot" }'
    assert hosbot in text
    text = text.replace(hosbot, 'shape = { kind = "disc", radius = 0.25 }')
    if not tied:
        text = text.replace('static = { file = "static_hosbot.csv"', '# static = { file = "static_hosbot.csv"')
    for old, new in MOVED:
        assert old in text
        text = text.replace(old, new)
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return folder / "plan.toml"


def test_a_moving_obstacle_that_rested_on_a_has_its_shape_where_it_is(tmp_path: Path):
    plan = with_a_moving_obstacle(tmp_path, tied=True)
    assert problems_of(plan) == []
    unseen = score_row(assemble(Lab(plan), 0))
    assert "moving obstacle 'hosbot' was not seen" in unseen["to_confirm"]
    text = plan.read_text(encoding="utf-8")
    assert "# visits = true" in text
    plan.write_text(text.replace("# visits = true", "visits = true"), encoding="utf-8")
    found = score_row(assemble(Lab(plan), 0))
    truth = score_row(forth_and_back(square=False, batch="MO"))
    assert truth["MDO"] < 1.0
    assert "not seen" not in found["to_confirm"]
    assert found["MDO"] == pytest.approx(truth["MDO"], abs=0.01)


def test_a_moving_obstacle_that_nothing_ties_is_found_by_check_and_has_no_clearance(tmp_path: Path):
    plan = with_a_moving_obstacle(tmp_path, tied=False)
    (problem,) = problems_of(plan)
    assert problem.field == "bodies.hosbot"
    assert score_row(assemble(Lab(plan), 0))["MDO"] is None


def test_files_and_names_are_all_that_is_left_to_fill_in(tmp_path: Path):
    trial = forth_and_back(moving_obstacle=False, square=False, batch="NO")
    a = trial.attempt.legs[0].start
    written(tmp_path / "survey.csv", survey(trial))
    written(tmp_path / "static_A.csv", synthetic.held(trial, a))
    written(tmp_path / "straight.csv", synthetic.straight(trial, a))
    written(tmp_path / "first.csv", synthetic.captured(trial))
    text = skeleton(selection=Selection(batches=("NO",), speeds=(0.6,), repetitions=1))
    text = text.replace('file = ""', 'file = "first.csv"').replace("# contact = false", "contact = false")
    for old, new in MOVED:
        assert old in text
        text = text.replace(old, new)
    plan = tmp_path / "plan.toml"
    plan.write_text(text, encoding="utf-8")
    assert problems_of(plan) == []
    found = assemble(Lab(plan), 0)
    assert found.outcome is Outcome.REACHED
    assert [s.leg for s in found.spans] == [0, 1, 2]
    ours, truth = score_row(found), score_row(trial)
    assert ours["success"]
    assert truth["DE"] == pytest.approx(0.025)  # 30 mm at B, 20 mm at A
    assert ours["DE"] == pytest.approx(truth["DE"], abs=0.005)
    assert ours["OE"] == pytest.approx(truth["OE"], abs=0.01)
    assert ours["PL"] == pytest.approx(truth["PL"], rel=0.01)
    assert (ours["batch"], ours["configuration"], ours["speed"]) == ("NO", "free", 0.6)
