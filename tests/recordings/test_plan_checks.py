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
from clearway.recordings.lab.test_plan import is_test_plan, seen_from
from clearway.recordings.protocol.protocol import skeleton
from clearway.recordings.recording import Points, Recording
from clearway.scenarios.suites import Selection

ROBOT = tuple(f"tiago:{m}" for m in ("front", "left", "right", "top"))
FLOOR = ("floor:A", "floor:B", "floor:C")
PLACES = np.array([[-2.5, 0.0, 0.0], [2.5, 0.0, 0.0], [0.0, 2.0, 0.0]])
LAYOUT = np.array([[1.0, 0.0, 0.3], [0.54, 0.84, 0.4], [-0.42, 0.91, 0.5], [-0.99, 0.14, 0.6]])


def capture(path: Path, names: tuple[str, ...], at: np.ndarray = LAYOUT, *, way: float = 0.0) -> None:
    """10 s of markers that start `at` (m, 3) and move `way` [m] along x, as Nexus would export them."""
    t = np.arange(101) / 10
    along = way * (1 - np.cos(np.pi * np.clip((t - 2) / 6, 0, 1))) / 2
    write = formats.formats()["vicon"].write
    assert write is not None
    xyz = at + along[:, None, None] * np.array([1.0, 0.0, 0.0])
    write(path, Recording(path, "vicon", Points(names, t, xyz)))


Lab = Callable[..., Path]
JUNK = (
    "nan", "inf", "-1", "1e400", "0", '""', '"."', '".."', '"\\u0000"', f'"{"x" * 5000}"', '"a\\nb.toml"', "true", "[]", "{}",
    "[[]]", "[0.0, inf]", "[1, 0]", '{ kind = "robot", robot = "x.toml" }', '"first.csv"', '"plan.toml"', '"A"', "1979-05-27",
    '["a", "a", "a"]', '"hospital"', '"->"', '"a->b"', '"x:"', '":"',
)  # fmt: skip


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    """Two trials without obstacles, the first recorded, all as it should be; `edit` changes the plan's text."""
    capture(tmp_path / "survey.csv", FLOOR, PLACES)
    capture(tmp_path / "static_A.csv", ROBOT)
    capture(tmp_path / "straight.csv", ROBOT, way=2.0)
    capture(tmp_path / "first.csv", ROBOT, way=5.0)
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
    assert "trial no. 1: file" in said
    assert "'first.csv'" in said


def test_missing_files_that_tie_the_frames(lab: Lab):
    said = only(lab(('straight = { file = "straight.csv" }', 'straight = { file = "bent.csv" }')))
    assert "robot.straight" in said
    assert "'bent.csv'" in said


@pytest.mark.parametrize(
    ("second", "wrong"),
    [
        ('file = "first.csv"', "all of 'first.csv' overlaps 0 to 5 s of it, which is trial no. 1"),
        ('file = "./first.csv"\nspan = [4.5, 9.0]', "4.5 to 9 s of './first.csv' overlaps 0 to 5 s"),
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
        assert "trial no. 2: span" in said


def test_a_trial_corrects_legs_by_the_names_that_the_plan_has(lab: Lab):
    leg = 'legs = [{ name = "fort", goal = "B", span = [1.0, 4.0] }]'
    said = only(lab(('file = "first.csv"', f'file = "first.csv"\n{leg}')))
    assert "trial no. 1: legs.0.name" in said
    assert "unknown leg 'fort'; did you mean 'forth'?" in said


def test_a_leg_outside_its_trial(lab: Lab):
    leg = 'legs = [{ name = "forth", goal = "B", span = [4.0, 7.0] }]'
    said = only(lab(('file = "first.csv"', f'file = "first.csv"\nspan = [0.0, 5.0]\n{leg}')))
    assert "trial no. 1: legs.0.span" in said
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
        ('batch = "NO"', 'batch = "N0"', "trial no. 1: batch", "'NO'"),
        ('# format = "vicon"', 'format = "vico"', "sources.capture.format", "'vicon'"),
        ("[sources.capture]", '[sources.capture]\nestimate = "/amcl"', "sources.capture.estimate", "known: none"),
        (
            "repetition = 1",
            'repetition = 1\nobstacles = [{ body = "x" }]\n',
            "trial no. 1: obstacles.0.body",
            "unknown body 'x'",
        ),
        ("\nattempted = false", "\natempted = false", "trial no. 1: atempted", "'attempted'"),
    ],
)
def test_names(lab: Lab, old: str, new: str, field: str, right: str):
    said = [str(p) for p in problems_of(lab((old, new))) if field in str(p)]
    assert len(said) == 1
    assert right in said[0]


TIES = 'static = { file = "static_A.csv", pose = "A" }\nstraight = { file = "straight.csv" }\n'


def by_coordinates(few: int = 4, scale: float = 2.0) -> tuple[str, str]:
    """Instead of stretches, the coordinates of the first few markers, `scale` times half of what they are."""
    listed = ", ".join(
        f'"{n}" = {[float(v) * scale / 2 for v in p]}' for n, p in zip(ROBOT[:few], LAYOUT[:few], strict=True)
    )
    return TIES, f"coordinates = {{ {listed} }}\n"


class TestTies:
    """What `score` would refuse only once it ties frames and bodies."""

    def test_coordinates_that_fit(self, lab: Lab):
        assert problems_of(lab(by_coordinates())) == []

    def test_a_prefix_with_coordinates_for_some_of_its_markers(self, lab: Lab):
        said = only(lab(by_coordinates(3)))
        assert "robot.coordinates: the file also has tiago:top, without coordinates; list the markers" in said

    def test_coordinates_in_millimetres(self, lab: Lab):
        said = only(lab(by_coordinates(scale=2000.0)))
        assert "first.csv: robot: the coordinates of the markers don't fit what was seen" in said

    def test_a_static_stretch_in_which_the_robot_drives(self, lab: Lab):
        said = only(
            lab(('{ file = "static_A.csv", pose = "A" }\nstraight', '{ file = "first.csv", pose = "A" }\nstraight'))
        )
        assert "robot: the body is not at rest in the static pose" in said

    def test_a_straight_drive_that_is_none(self, lab: Lab):
        said = only(lab(('straight = { file = "straight.csv" }', 'straight = { file = "static_A.csv" }')))
        assert "robot: the straight drive is 0.00 m long" in said

    def test_surveyed_places_that_are_others(self, lab: Lab):
        said = only(lab(('{ marker = "floor:C", at = [0.0, 2.0] }', '{ marker = "floor:C", at = [0.0, 3.0] }')))
        assert "sources.capture.frame" in said

    def test_the_old_name_of_static_poses_is_told_the_new_one(self, lab: Lab):
        text = lab().read_text(encoding="utf-8")
        start, end = text.index('file = "survey.csv"'), text.index("# Other ways")
        hold = 'holds = [{ file = "static_A.csv", pose = "A" }]\n'
        said = only(lab(source=text[:start] + hold + text[end:]))
        assert "sources.capture.frame.holds: unknown key; it is called 'static_poses' now" in said

    def test_a_static_pose_in_which_the_robot_drives(self, lab: Lab):
        text = lab(by_coordinates()).read_text(encoding="utf-8")
        start, end = text.index('file = "survey.csv"'), text.index("# Other ways")
        hold = 'static_poses = [{ file = "first.csv", pose = "A" }]\n'
        said = only(lab(source=text[:start] + hold + text[end:]))
        assert "sources.capture.frame: the robot moved by" in said

    def test_a_static_pose_without_a_map(self, lab: Lab):
        text = lab(("straight = ", "# straight = ")).read_text(encoding="utf-8")
        start, end = text.index('file = "survey.csv"'), text.index("# Other ways")
        assert "robot.static" in only(lab(source=text[:start] + text[end:]))

    def test_nothing_is_tied_before_anything_was_recorded(self, lab: Lab, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(formats, "read", lambda *_, **__: pytest.fail("read"))
        assert problems_of(lab(('file = "first.csv"', 'file = ""'))) == []


MOVING = '[bodies.cart]\nshape = { kind = "square", edge = 0.3 }\nmarkers = "cart:"\n\n[[trial]]  # 1 of'


def test_a_moving_obstacle_with_a_shape_that_nothing_ties(lab: Lab):
    said = only(lab(("[[trial]]  # 1 of", MOVING)))
    assert "bodies.cart: has a shape and markers, but nothing that ties them: MDO" in said
    tied = MOVING.replace('"cart:"', '"cart:"\nstatic = { file = "none.csv", pose = "A" }')
    assert problems_of(lab(("[[trial]]  # 1 of", tied))) == []  # no trial has it yet
    there = ("repetition = 1", 'repetition = 1\nobstacles = [{ body = "cart" }]')
    found = [str(p) for p in problems_of(lab(("[[trial]]  # 1 of", tied), there))]
    assert any("bodies.cart.static: no such file: 'none.csv'" in p for p in found)


def test_every_unknown_name_at_once_each_with_the_closest(lab: Lab):
    found = problems_of(
        lab(("repetition = 1", 'repetition = 1\nobstacles = [{ body = "x" }]'), ('goal = "B"', 'goal = "b"'))
    )
    assert [p.field for p in found] == ["trial no. 1: obstacles.0.body", "legs.0.goal"]
    assert "unknown pose 'b'" in str(found[1])
    assert "known: A, A_turned, B, B_turned" in str(found[1])


@pytest.mark.parametrize(
    ("suite", "closest"),
    [("hopsital", "'hospital'"), ("Hospital", "'hospital'"), ("hospital-2026", ""), ("own", ""), ("ward-4", "")],
)
def test_a_suite_that_is_nearly_ours(lab: Lab, suite: str, closest: str):
    path = lab(('suite = "hospital"', f'suite = "{suite}"'))
    if closest:
        assert f"test.suite: unknown suite '{suite}'; did you mean {closest}" in only(path)
    else:
        assert problems_of(path) == []


def test_a_speed_that_the_robot_cannot_drive_is_said_once(lab: Lab):
    path = lab(("\nspeed = 0.6", "\nspeed = 60"), ("\nspeed = 0.6", "\nspeed = 60"))
    assert "trial no. 1: speed: 60 m/s is more than the 1 m/s that tiago can drive" in only(path)


def test_a_decimal_comma(lab: Lab):
    assert only(lab(("\nspeed = 0.6", "\nspeed = 0,6"))).endswith("; a number has a decimal point: 0.6")


def test_an_obstacle_that_is_neither_placed_nor_measured(lab: Lab):
    body = '[bodies.box]\nshape = { kind = "square", edge = 0.3 }\n\n[[trial]]  # 1 of'
    said = only(lab(("[[trial]]  # 1 of", body), ("repetition = 1", 'repetition = 1\nobstacles = [{ body = "box" }]')))
    assert "trial no. 1: obstacles.0" in said
    assert "neither placed" in said


def test_a_body_measured_by_a_source_that_the_trial_lacks(lab: Lab):
    body = '[sources.bag]\n\n[bodies.cart]\nsource = "bag"\ntrack = "cart"\n\n[[trial]]  # 1 of'
    said = only(lab(("[[trial]]  # 1 of", body), ("repetition = 1", 'repetition = 1\nobstacles = [{ body = "cart" }]')))
    assert "trial no. 1: files" in said
    assert "'bag'" in said


def test_a_damaged_recording_is_told_once_though_many_trials_lie_in_it(lab: Lab, tmp_path: Path):
    (tmp_path / "first.csv").write_bytes(b"Trajectories\n100\n")
    first = 'file = "first.csv"\nspan = [0.0, 1.0]'
    said = only(lab(('file = "first.csv"', first), ('file = ""', 'file = "first.csv"\nspan = [2.0, 3.0]')))
    assert "first.csv" in said


def test_each_file_is_looked_at_once(lab: Lab, monkeypatch: pytest.MonkeyPatch):
    seen: list[Path] = []
    look = formats.look

    def counted(path: Path, **how: str | None) -> object:
        seen.append(Path(path))
        return look(path, **how)

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


@pytest.mark.parametrize(
    ("table", "is_one"),
    [
        ({"trial": []}, True),
        ({"test": {}}, True),
        ({"legs": []}, False),
        ({"sources": {"vicon": {"files": "*.csv"}}}, True),
        (
            {"sources": {"drive": {"v_max": "data sheet"}}, "drive": {}},
            False,
        ),  # a robot's, its dotted name without quotes
    ],
)
def test_a_plan_is_told_from_other_files(table: dict[str, object], is_one: bool):
    assert is_test_plan(table) is is_one


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
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
