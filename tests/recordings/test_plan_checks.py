"""What can be wrong with a test plan is found before anything is scored, each with its field and what would be right."""

from __future__ import annotations

from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.lab import checks
from clearway.recordings.lab.checks import problems_of, summary
from clearway.recordings.lab.plan import is_test_plan, seen_from
from clearway.recordings.protocol.protocol import skeleton
from clearway.recordings.recording import Points, Recording
from clearway.scenarios.suites import Selection

ROBOT = tuple(f"tiago:{m}" for m in ("front", "left", "right", "top"))
FLOOR = ("floor:A", "floor:B", "floor:C")


def capture(path: Path, names: tuple[str, ...], *, seconds: float = 10.0) -> None:
    """A capture of markers at rest, as Nexus would export it."""
    t = np.arange(round(seconds * 10) + 1) / 10
    at = np.stack([np.cos(np.arange(len(names))), np.sin(np.arange(len(names))), 0.3 + 0.1 * np.arange(len(names))], 1)
    write = formats.formats()["vicon"].write
    assert write is not None
    write(path, Recording(path, "vicon", Points(names, t, np.tile(at, (len(t), 1, 1)))))


Lab = Callable[..., Path]
JUNK = (
    "nan", "inf", "-1", "1e400", "0", '""', '"."', '".."', '"\\u0000"', f'"{"x" * 5000}"', '"a\\nb.toml"', "true", "[]", "{}",
    "[[]]", "[0.0, inf]", "[1, 0]", '{ kind = "robot", robot = "x.toml" }', '"first.csv"', '"plan.toml"', '"A"', "1979-05-27",
    '["a", "a", "a"]', '"hospital"', '"->"', '"a->b"', '"x:"', '":"',
)  # fmt: skip


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    """Two trials without obstacles, the first recorded, all as it should be; `edit` changes the plan's text."""
    capture(tmp_path / "survey.csv", FLOOR)
    for name in ("static_A.csv", "straight.csv", "first.csv"):
        capture(tmp_path / name, ROBOT)
    text = skeleton(selection=Selection(batches=("NO",), speeds=(0.6,), repetitions=2))
    text = text.replace('file = ""', 'file = "first.csv"', 1)

    def written(*edits: tuple[str, str], source: str = text) -> Path:
        for old, new in edits:
            assert old in source, old
            source = source.replace(old, new, 1)
        path = tmp_path / "plan.toml"
        path.write_text(source, encoding="utf-8")
        return path

    return written


def only(path: Path) -> str:
    found = problems_of(path)
    assert len(found) == 1, [str(p) for p in found]
    assert found[0].file is not None
    return str(found[0])


def test_nothing_wrong(lab: Lab):
    path = lab()
    assert problems_of(path) == []
    assert summary(path) == ["2 trials, 1 of them recorded", "1 not yet done"]


def test_an_untouched_skeleton_is_as_it_should_be(tmp_path: Path):
    path = tmp_path / "plan.toml"
    path.write_text(skeleton(selection=Selection(batches=("CE",))), encoding="utf-8")
    assert problems_of(path) == []
    assert summary(path) == ["48 trials, 0 of them recorded", "48 not yet done"]


def test_attempted_without_a_file_is_counted(lab: Lab):
    path = lab(('file = ""\nattempted = false', 'file = ""\nattempted = true'))
    assert "1 attempted without a file: they count as attempted" in summary(path)
    assert problems_of(path) == []


def test_a_missing_file_and_the_closest_there_is(lab: Lab):
    said = only(lab(('file = "first.csv"', 'file = "frist.csv"')))
    assert "trial.0.file" in said
    assert "'first.csv'" in said


def test_missing_files_that_tie_the_frames(lab: Lab):
    said = only(lab(('straight = { file = "straight.csv" }', 'straight = { file = "bent.csv" }')))
    assert "robot.straight" in said
    assert "'bent.csv'" in said


@pytest.mark.parametrize(
    ("second", "wrong"),
    [
        ('file = "first.csv"', "all of 'first.csv' overlaps 0 to 5 s of it, which is trial 0 (number 1)"),
        ('file = "first.csv"\nspan = [4.5, 9.0]', "4.5 to 9 s of 'first.csv' overlaps 0 to 5 s"),
        ('file = "first.csv"\nspan = [5.0, 9.0]', None),
        ('file = "first.csv"\nspan = [9.0, 6.0]', "ends before it begins"),
        ('file = "first.csv"\nspan = [6.0, 11.5]', "is not within 'first.csv', which has 0 to 10 s"),
    ],
)
def test_spans(lab: Lab, second: str, wrong: str | None):
    path = lab(('file = "first.csv"', 'file = "first.csv"\nspan = [0.0, 5.0]'), ('file = ""', second))
    if wrong is None:
        assert problems_of(path) == []
    else:
        said = only(path)
        assert wrong in said
        assert "trial.1.span" in said


def test_a_leg_outside_its_trial(lab: Lab):
    leg = 'legs = [{ name = "forth", goal = "B", span = [4.0, 7.0] }]'
    said = only(lab(('file = "first.csv"', f'file = "first.csv"\nspan = [0.0, 5.0]\n{leg}')))
    assert "trial.0.legs.0.span" in said
    assert "[0.0, 5.0]" in said


@pytest.mark.parametrize(
    ("old", "new", "field", "right"),
    [
        ('markers = "tiago:"', 'markers = "tiga:"', "robot.markers", "'tiago:'"),
        (
            'markers = "tiago:"',
            'markers = ["tiago:front", "tiago:left", "tiago:rihgt"]',
            "robot.markers",
            "'tiago:right'",
        ),
        ('markers = "tiago:"', 'track = "tiago"', "robot.track", "known: none"),
        ('"floor:B"', '"floor:Bb"', "sources.capture.frame.surveyed.1.marker", "'floor:B'"),
        ('robot = "tiago"', 'robot = "tiga"', "test.robot", "'tiago'"),
        ('batch = "NO"', 'batch = "N0"', "trial.0.batch", "'NO'"),
        ('# format = "vicon"', 'format = "vico"', "sources.capture.format", "'vicon'"),
        ("[sources.capture]", '[sources.capture]\nestimate = "/amcl"', "sources.capture.estimate", "known: none"),
        ("repetition = 1", 'repetition = 1\nobstacles = [{ body = "x" }]\n', "", "'x' is none of [bodies]"),
        ("attempted = false", "atempted = false", "trial.0.atempted", "'attempted'"),
    ],
)
def test_names(lab: Lab, old: str, new: str, field: str, right: str):
    said = [str(p) for p in problems_of(lab((old, new))) if field in str(p)]
    assert len(said) == 1
    assert right in said[0]


def test_an_obstacle_that_is_neither_placed_nor_measured(lab: Lab):
    body = '[bodies.box]\nshape = { kind = "square", edge = 0.3 }\n\n[[trial]]  # 1 of'
    said = only(lab(("[[trial]]  # 1 of", body), ("repetition = 1", 'repetition = 1\nobstacles = [{ body = "box" }]')))
    assert "trial.0.obstacles.0" in said
    assert "neither placed" in said


def test_a_body_measured_by_a_source_that_the_trial_lacks(lab: Lab):
    body = '[sources.bag]\n\n[bodies.cart]\nsource = "bag"\ntrack = "cart"\n\n[[trial]]  # 1 of'
    said = only(lab(("[[trial]]  # 1 of", body), ("repetition = 1", 'repetition = 1\nobstacles = [{ body = "cart" }]')))
    assert "trial.0.files" in said
    assert "'bag'" in said


def test_a_damaged_recording_is_told_once_though_many_trials_lie_in_it(lab: Lab, tmp_path: Path):
    (tmp_path / "first.csv").write_bytes(b"Trajectories\n100\n")
    first = 'file = "first.csv"\nspan = [0.0, 1.0]'
    said = only(lab(('file = "first.csv"', first), ('file = ""', 'file = "first.csv"\nspan = [2.0, 3.0]')))
    assert "first.csv" in said


def test_each_file_is_looked_at_once(lab: Lab, monkeypatch: pytest.MonkeyPatch):
    seen: list[Path] = []
    look = formats.look

    def counted(path: Path, *, format: str | None = None) -> object:
        seen.append(Path(path))
        return look(path, format=format)

    monkeypatch.setattr(checks.formats, "look", counted)
    path = lab(
        ('file = "first.csv"', 'file = "first.csv"\nspan = [0.0, 5.0]'),
        ('file = ""', 'file = "first.csv"\nspan = [5.0, 9.0]'),
    )
    assert problems_of(path) == []
    assert len(seen) == len(set(seen)) == 4
    assert problems_of(path, inside=False) == []
    assert len(seen) == 4


def test_no_toml_and_no_file(tmp_path: Path):
    (tmp_path / "plan.toml").write_text("[[trial]\n")
    assert "TOML" in only(tmp_path / "plan.toml")
    assert "no such file" in only(tmp_path / "none.toml")
    assert summary(tmp_path / "none.toml") == []


@pytest.mark.parametrize(("table", "is_one"), [({"trial": []}, True), ({"test": {}}, True), ({"legs": []}, False)])
def test_a_plan_is_told_from_other_files(table: dict[str, object], is_one: bool):
    assert is_test_plan(table) is is_one


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_a_plan_says_is_answered_with_problems(lab: Lab, data: st.DataObject):
    """Lines dropped, doubled and swapped, values replaced by junk: a list comes back, and nothing else out."""
    lines = lab().read_text(encoding="utf-8").splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        i = data.draw(st.integers(0, len(lines) - 1))
        match data.draw(st.sampled_from(["drop", "double", "swap", "value", "junk"])):
            case "drop":
                del lines[i]
            case "double":
                lines.insert(i, lines[i])
            case "swap":
                j = data.draw(st.integers(0, len(lines) - 1))
                lines[i], lines[j] = lines[j], lines[i]
            case "value":
                lines[i] = f"{lines[i].partition('=')[0]}= {data.draw(st.sampled_from(JUNK))}"
            case _:
                lines[i] = data.draw(st.text(max_size=30))
    path = lab(source="\n".join(lines))
    for problem in problems_of(path):
        assert isinstance(problem, ClearwayError)
    assert isinstance(summary(path), list)


def test_robots_and_floors_are_files_beside_the_plan(lab: Lab, tmp_path: Path):
    (tmp_path / "mine.toml").write_bytes(resources.files("clearway.robots").joinpath("hosbot.toml").read_bytes())
    body = '[bodies.cart]\nshape = { kind = "robot", robot = "mine.toml" }\n\n[[trial]]  # 1 of'
    path = lab(('robot = "tiago"', 'robot = "mine.toml:vendor"'), ("[[trial]]  # 1 of", body))
    assert problems_of(path) == []
    assert seen_from(tmp_path, "mine.toml:vendor") == f"{tmp_path / 'mine.toml'}:vendor"
    assert seen_from(tmp_path, "tiago") == "tiago"
    said = only(lab(('robot = "tiago"', 'robot = "other.toml"')))
    assert "other.toml" in said
