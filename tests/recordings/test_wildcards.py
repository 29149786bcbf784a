"""People and movers by a pattern of their names: all that a trial's file holds are in it, whatever they are called."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from made_bags import START, Robot, write_mcap

import clearway
from clearway.contract import BodyKind
from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.lab.wildcards import with_bearers
from clearway.recordings.motion.middle import middle_of
from clearway.recordings.recording import Points, Recording, Track
from clearway.trials import Trial

TABLE = 'id = "who"\ntime = { column = "t" }\n[bodies.each]\nx = "x"\ny = "y"\n'
PLAN = """
people = "person*"
movers = "cart?"
sources.capture = { table = "table.toml", frame.same = true }
robot = { track = "robot", shape = { kind = "disc", radius = 0.3 } }
bodies.movers.shape = { kind = "disc", radius = 0.2 }
[[trial]]
file = "one.csv"
[[trial]]
file = "two.csv"
"""


def csv(path: Path, others: dict[str, tuple[float, float]]) -> None:
    """The robot drives 2 m along x; each of the others crosses its way, at x [m] and y [m] in the middle."""
    rows = ["t,who,x,y"]
    for t in np.arange(0.0, 8.0, 0.05):
        way = 1 - math.cos(math.pi * min(max((t - 2.0) / 4.0, 0.0), 1.0))
        rows.append(f"{t:.3f},robot,{way:.6f},0")
        rows += [f"{t:.3f},{name},{x},{y + 0.2 * (t - 4.0):.6f}" for name, (x, y) in others.items()]
    path.write_text("\n".join(rows), encoding="utf-8")


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    (tmp_path / "table.toml").write_text(TABLE, encoding="utf-8")
    csv(
        tmp_path / "one.csv", {"person2": (1.0, 1.5), "person10": (1.0, 3.0), "cart1": (1.0, 2.0), "cart12": (9.0, 9.0)}
    )
    csv(tmp_path / "two.csv", {"personal": (0.0, 2.0)})
    return tmp_path


def around(trial: Trial) -> dict[str, BodyKind]:
    return {b.name: b.kind for b in trial.attempt.bodies}


def test_everyone_in_a_file_is_in_its_trial(lab: Path):
    assert problems_of(lab / "plan.toml") == []
    at_work = Lab(lab / "plan.toml")
    one, two = assemble(at_work, 0), assemble(at_work, 1)
    person, mover = BodyKind.PERSON, BodyKind.MOVING_OBSTACLE
    assert around(one) == {"person10": person, "person2": person, "cart1": mover}
    assert around(two) == {"personal": person}
    assert [b.shape for b in one.attempt.bodies[:2]] == [Circle(0.25)] * 2
    assert [b.visits for b in one.attempt.bodies] == [True, True, False]
    np.testing.assert_allclose(one.moving_obstacles[80, :, :2], [[1.0, 3.0], [1.0, 1.5], [1.0, 2.0]], atol=1e-3)


def test_scored_like_bodies_by_their_names(lab: Path):
    clearway.score(lab / "plan.toml", out=lab / "a", workers=1)
    names = {"person2": "person", "person10": "person", "cart1": "obstacle"}
    bodies = "".join(
        f'[bodies.{n}]\ntrack = "{n}"\nkind = "{k}"\n'
        + ('shape = { kind = "disc", radius = 0.2 }\n' if n == "cart1" else "")
        for n, k in names.items()
    )
    spelt = PLAN.replace('people = "person*"\nmovers = "cart?"\n', "").partition("[[trial]]")[0]
    spelt = spelt.replace('bodies.movers.shape = { kind = "disc", radius = 0.2 }\n', bodies)
    listed = ", ".join(f'{{ body = "{n}" }}' for n in ("person10", "person2", "cart1"))
    (lab / "plan.toml").write_text(f'{spelt}[[trial]]\nfile = "one.csv"\nobstacles = [{listed}]\n', encoding="utf-8")
    clearway.score(lab / "plan.toml", out=lab / "b", workers=1)
    a, b = (clearway.open_results(lab / n).trials.to_pylist()[0] for n in ("a", "b"))
    assert a == b
    assert a["MDO"] > 0


def test_whom_another_source_saw_and_who_was_never_seen(tmp_path: Path):
    """The robot is measured by the capture, people by the robot's own log."""
    (tmp_path / "table.toml").write_text(TABLE, encoding="utf-8")
    csv(tmp_path / "one.csv", {})
    csv(tmp_path / "log.csv", {"person1": (1.0, 1.5), "person2": (math.nan, math.nan)})
    log = PLAN.replace(
        "robot = {", 'sources.log = { table = "table.toml", frame.same = true, clock = "same" }\nrobot = {'
    )
    log = log.replace('movers = "cart?"\n', 'bodies.people.source = "log"\n').replace("bodies.movers", "bodies.others")
    (tmp_path / "plan.toml").write_text(
        log.partition("[[trial]]")[0] + '[[trial]]\nfile = "one.csv"\nfiles = { log = "log.csv" }\n', encoding="utf-8"
    )
    trial = assemble(Lab(tmp_path / "plan.toml"), 0)
    assert around(trial) == {"person1": BodyKind.PERSON}
    np.testing.assert_allclose(trial.moving_obstacles[80, 0, :2], [1.0, 1.5], atol=1e-3)


def test_bodies_of_a_topic(tmp_path: Path):
    r, kind = Robot(2), "motion_capture_tracking_interfaces/msg/"
    lines = []
    for i in range(80):
        at, x = START + i * 50_000_000, 1 - math.cos(math.pi * min(max((i * 0.05 - 0.5) / 3.0, 0.0), 1.0))
        poses = [("robot", r.pose(x, 0.0, 0.0)), ("person_a", r.pose(1.0, 2.0 - i * 0.01, 0.0))]
        array = r.make(f"{kind}NamedPoseArray", r.header(at, "map"), [r.make(f"{kind}NamedPose", *p) for p in poses])
        lines.append(("/poses", f"{kind}NamedPoseArray", at, array))
    write_mcap(tmp_path / "one.mcap", lines)
    text = 'people = "/poses/person*"\nsources.capture.frame.same = true\nrobot.track = "/poses/robot"\n[[trial]]\nfile = "one.mcap"\n'
    (tmp_path / "plan.toml").write_text(text, encoding="utf-8")
    assert around(assemble(Lab(tmp_path / "plan.toml"), 0)) == {"/poses/person_a": BodyKind.PERSON}


def vicon(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Markers (n, 3) [m] at 50 Hz as Nexus writes them, NaN where unseen."""
    lines = ["Trajectories", "50", ",," + ",,,".join(columns) + ",,", "Frame,Sub Frame" + ",X,Y,Z" * len(columns)]
    lines.append(",," + ",".join(["mm"] * 3 * len(columns)))
    for i, row in enumerate(1000 * np.concatenate(list(columns.values()), axis=1), 1):
        lines.append(f"{i},0," + ",".join("" if math.isnan(v) else f"{v:.3f}" for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_who_wears_markers_is_in_their_middle(tmp_path: Path):
    t = np.arange(400) / 50
    drive = np.column_stack([1 - np.cos(np.pi * np.clip((t - 2.0) / 4.0, 0.0, 1.0)), 0 * t, 0 * t])
    walk = np.column_stack([0 * t + 1.0, 2.0 - 0.2 * t, 0 * t + 1.7])
    a = 0.3 * t  # it turns
    bob = np.column_stack([np.cos(a), np.sin(a), 0 * t]) * 0.1
    columns = {
        f"robot:{n}": drive + at for n, at in zip("abc", ([0.2, 0.1, 0.1], [-0.2, 0, 0.2], [0, -0.2, 0.3]), strict=True)
    }
    columns |= {"person1:left": walk + bob, "person1:right": walk - bob, "person2": walk + np.array([0.0, 3.0, 0.0])}
    columns["person3"] = np.full((400, 3), np.nan)  # was not there
    columns["person1:left"][150:190] = np.nan  # 0.8 s: where it is follows from the other
    columns["person1:right"][250:] = np.nan  # for good: after a second nobody knows any more
    vicon(tmp_path / "one.csv", columns)
    (tmp_path / "plan.toml").write_text(
        'people = "person*"\nsources.capture.frame.same = true\nrobot.markers = "robot:"\n[robot.coordinates]\n'
        '"robot:a" = [0.2, 0.1, 0.1]\n"robot:b" = [-0.2, 0, 0.2]\n"robot:c" = [0, -0.2, 0.3]\n[[trial]]\nfile = "one.csv"\n',
        encoding="utf-8",
    )
    assert problems_of(tmp_path / "plan.toml") == []
    trial = assemble(Lab(tmp_path / "plan.toml"), 0)
    assert around(trial) == {"person1": BodyKind.PERSON, "person2": BodyKind.PERSON}
    one, two = trial.moving_obstacles[:, 0, :2], trial.moving_obstacles[:, 1, :2]
    np.testing.assert_allclose(one[:245], walk[:245, :2], atol=2e-3)
    np.testing.assert_allclose(one[245:298], walk[245:298, :2], atol=0.03)  # as far as it turned meanwhile
    assert np.isnan(one[301:]).all()
    np.testing.assert_allclose(two, walk[:, :2] + np.array([0.0, 3.0]), atol=2e-3)
    assert trial.sigma is not None
    assert np.isfinite(trial.sigma[:298, 1, 0]).all()  # as a capture's noise shows it


def test_markers_that_take_turns_leave_the_one_that_is_seen_most():
    t = np.arange(10) / 50
    xyz = np.full((10, 3, 3), np.nan)
    for marker, (a, b) in enumerate([(0, 3), (3, 7), (7, 10)]):
        xyz[a:b, marker] = marker
    at = middle_of(Points(("p:a", "p:b", "p:c"), t, xyz), ("p:a", "p:b", "p:c")).position
    assert np.flatnonzero(np.isfinite(at[:, 0])).tolist() == [3, 4, 5, 6]
    assert (at[3:7] == 1.0).all()


def test_markers_of_a_body_of_the_file_are_nobody_else(tmp_path: Path):
    t = np.arange(100) / 50
    at = np.column_stack([t, 0 * t, 0 * t])
    points = Points(
        ("cart7:a", "cart7 - 1", "cart70:a", "robot:a", "unlabeled 3"), t, np.repeat(at[:, None], 5, axis=1)
    )
    recording = Recording(tmp_path / "one.c3d", "c3d", points=points, tracks={"cart7": Track("body", "", "", t, at)})
    text = 'movers = "*"\nrobot.markers = "robot:"\nbodies.movers.shape = { kind = "disc", radius = 0.2 }\n[[trial]]\nfile = "one.c3d"\n'
    (tmp_path / "plan.toml").write_text(text, encoding="utf-8")
    assert set(with_bearers(load_test_plan(tmp_path / "plan.toml"), "capture", recording).tracks) == {"cart7", "cart70"}


def test_a_pattern_that_nothing_fits_is_told_by_check_and_stops_nothing(lab: Path):
    text = PLAN.replace("person*", "human*")
    (lab / "plan.toml").write_text(text, encoding="utf-8")
    assert [(e.field, "'human*'" in str(e)) for e in problems_of(lab / "plan.toml")] == [("people", True)]
    assert len(clearway.score(lab / "plan.toml", out=lab / "out", workers=1)) == 2


def test_people_that_are_measured_in_two_ways(lab: Path):
    (lab / "plan.toml").write_text(
        PLAN.replace("[[trial]]", 'bodies.people.track = "anna"\n[[trial]]', 1), encoding="utf-8"
    )
    with pytest.raises(ClearwayError, match=r"bodies\.people.*and so does people = 'person\*'"):
        Lab(lab / "plan.toml")
