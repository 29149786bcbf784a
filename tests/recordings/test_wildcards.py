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
