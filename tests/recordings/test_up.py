"""Which axis is up: said in the plan or beside the file; what moves out of the floor's plane is refused until it is said."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_bags import START, Robot, write_ros1
from scipy.spatial.transform import Rotation
from small_plans import PLAN, drive

from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.recordings import formats
from clearway.recordings.formats import axes
from clearway.recordings.formats.axes import TURNS, turn_of, turned
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.unplanned import motions
from clearway.recordings.motion.upright import other_axis
from clearway.recordings.protocol.toml_text import toml
from clearway.recordings.recording import Points, Recording, Track, Want
from clearway.trials import Trial

AXES = tuple(TURNS)


def track(rows: np.ndarray, *, headings: bool = True) -> Track:
    """The drive of `small_plans`, z up."""
    q = Rotation.from_euler("z", rows[:, 3:4]).as_quat()
    at = np.column_stack([rows[:, 1:3], np.full(len(rows), 0.2)])
    return Track("pose", "", "", rows[:, 0], at, q if headings else None)


def lying(up: str, rows: np.ndarray | None = None, *, headings: bool = True) -> Track:
    """The same as a file has it in which another axis is up."""
    return axes.track_turned(track(drive() if rows is None else rows, headings=headings), turn_of(up).T)


def tum(folder: Path, up: str, *, beside: str = "") -> Path:
    path = folder / "one.tum"
    write = formats.formats()["tum"].write
    assert write is not None
    write(path, Recording(path, "tum", tracks={"trajectory": lying(up)}))
    if beside:
        (folder / "one.tum.toml").write_text(beside, encoding="utf-8")
    return path


def scored(folder: Path, **source: Any) -> Trial:
    sources = {"capture": {"format": "tum", "frame": {"same": True}} | source}
    robot = {"track": "trajectory"}
    trial = [{"file": "one.tum", "speed": 0.5}]
    content = PLAN | {"sources": sources, "robot": robot, "bodies": {}, "trial": trial}
    (folder / "plan.toml").write_text(toml(content), encoding="utf-8")
    return assemble(Lab(folder / "plan.toml"), 0)


@pytest.mark.parametrize("up", AXES)
def test_every_axis_is_turned_to_z_by_a_rotation(up: str) -> None:
    assert np.linalg.det(turn_of(up)) == pytest.approx(1.0)
    axis = np.zeros(3)
    axis["xyz".index(up.lstrip("-"))] = -1.0 if up.startswith("-") else 1.0
    assert turn_of(up) @ axis == pytest.approx([0.0, 0.0, 1.0])
    back = turned(Recording(Path("x"), "tum", tracks={"a": lying(up)}), up).tracks["a"]
    assert back.position == pytest.approx(track(drive()).position)
    assert back.orientation is not None
    yaw = Rotation.from_quat(back.orientation).as_euler("zyx")[:, 0]
    assert np.cos(yaw - drive()[:, 3]) == pytest.approx(1.0)


@pytest.mark.parametrize("up", [a for a in AXES if a not in ("z", "-z")])
def test_a_trajectory_on_its_side_is_refused_until_it_is_said(tmp_path: Path, up: str) -> None:
    tum(tmp_path, up)
    axis = up.lstrip("-")
    with pytest.raises(ClearwayError, match=f"another axis than z seems to be up in 'trajectory'.*up = '{axis}'"):
        scored(tmp_path)
    (problem,) = problems_of(tmp_path / "plan.toml")
    assert "another axis than z seems to be up" in str(problem)
    row = score_row(scored(tmp_path, up=up))
    assert row["DE"] == pytest.approx(0.0, abs=1e-6)
    assert row["OE"] == pytest.approx(0.0, abs=1e-6)
    tum(tmp_path, up, beside=f'up = "{up}"\n')
    assert score_row(scored(tmp_path))["DE"] == pytest.approx(0.0, abs=1e-6)
    by_name = scored(tmp_path, up={"trajectory": up})
    assert score_row(by_name)["OE"] == pytest.approx(0.0, abs=1e-6)


def test_whoever_says_that_z_is_up_is_believed(tmp_path: Path) -> None:
    tum(tmp_path, "y")
    found = formats.read(tmp_path / "one.tum", Want(up="z"))
    assert (found.up, found.up_said) == ("z", True)
    (tmp_path / "one.tum.toml").write_text('upp = "y"\n', encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"one\.tum\.toml: upp: unknown key; did you mean 'up'"):
        formats.read(tmp_path / "one.tum")


@pytest.mark.parametrize("headings", [True, False])
def test_what_is_seen_of_how_it_moved(headings: bool) -> None:
    slanting = drive()
    c, s = math.cos(0.7), math.sin(0.7)
    slanting[:, 1:3] = slanting[:, 1:3] @ np.array([[c, s], [-s, c]])
    found = other_axis(lying("y", slanting, headings=headings))
    assert found is not None
    assert found[0] == "y"
    assert other_axis(track(drive(), headings=headings)) is None
    drone = track(drive(), headings=headings)
    drone.position[:, 2] += np.linspace(0.0, 2.0, len(drone.t))
    drone.position[:, 1] += np.sin(np.linspace(0.0, 9.0, len(drone.t)))
    assert other_axis(drone) is None, "it fits no axis"


def test_what_only_climbs_is_refused_whichever_other_axis_is_up():
    t = np.arange(200) / 20.0
    at = np.column_stack([0 * t, 0 * t, 0.1 * t])
    assert other_axis(Track("pose", "", "", t, at)) is not None


def test_a_ramp_is_no_other_axis_where_the_heading_turns_about_z() -> None:
    rows = drive()
    ramp = track(rows)
    ramp.position[:, 2] += 0.4 * rows[:, 1]
    assert other_axis(ramp) is None
    assert other_axis(Track("pose", "", "", ramp.t, ramp.position)) is not None


def test_a_bag_with_a_capture_whose_y_is_up_beside_odometry_whose_z_is(tmp_path: Path) -> None:
    """As a VRPN client hands on what Motive streams."""
    on_its_side, make, lines = lying("y"), Robot(1), []
    assert on_its_side.orientation is not None
    for t, p, q, row in zip(on_its_side.t, on_its_side.position, on_its_side.orientation, drive(), strict=True):
        at = START + round(t * 1e9)
        pose = make.make(
            "geometry_msgs/msg/Pose", make.vector(*p, "Point"), make.make("geometry_msgs/msg/Quaternion", *q)
        )
        kind = "geometry_msgs/msg/PoseStamped"
        lines.append(("/vrpn/robot/pose", kind, at, make.make(kind, make.header(at, "world"), pose)))
        lines.append(("/odom", "nav_msgs/msg/Odometry", at, make.odometry(at, *row[1:4])))
    write_ros1(tmp_path / "one.bag", lines)
    bag = {"format": "bag", "frame": {"same": True}}
    content = PLAN | {
        "robot": {"track": "/vrpn/robot/pose"},
        "bodies": {},
        "trial": [{"file": "one.bag", "speed": 0.5}],
    }

    def made(**source: Any) -> Trial:
        (tmp_path / "plan.toml").write_text(toml(content | {"sources": {"bag": bag | source}}), encoding="utf-8")
        return assemble(Lab(tmp_path / "plan.toml"), 0)

    with pytest.raises(ClearwayError, match="another axis than z seems to be up in '/vrpn/robot/pose'"):
        made()
    row = score_row(made(up={"/vrpn/robot/pose": "y"}))
    assert (row["DE"], row["OE"]) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert score_row(made(up={"/vrpn/robot/pose": "y"}, estimate="/odom"))["DE_self"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", ["vicon", "qualisys", "trc"])
def test_markers_of_a_capture_whose_y_is_up(tmp_path: Path, kind: str) -> None:
    """What its reader refuses by itself is read once it is said."""
    t = np.arange(0.0, 5.0, 0.01)
    way = np.column_stack([0.2 * t, 0.1 * np.sin(t), np.full_like(t, 0.3)])
    upright = way[:, None] + np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [-0.1, 0.0, 0.1]])
    xyz = upright @ turn_of("y")
    xyz = xyz[:, :, [2, 1, 0]] * [-1.0, 1.0, 1.0]  # it drives along the file's z
    names, path = ("a", "b", "c"), tmp_path / f"one{formats.formats()[kind].suffixes[0]}"
    write = formats.formats()[kind].write
    assert write is not None
    write(path, Recording(path, kind, Points(names, t, xyz)))
    with pytest.raises(
        ClearwayError, match=r"another axis seems to be up; if so, say up = 'y' in the test plan's source"
    ):
        formats.read(path, format=kind)
    found = formats.read(path, Want(up="y"), format=kind)
    assert found.points is not None
    assert np.ptp(found.points.xyz[..., 2], axis=0) == pytest.approx(0.0, abs=1e-3)
    assert not any("z up" in note or "z taken as up" in note for note in found.notes), found.notes
    path.with_name(f"{path.name}.toml").write_text('up = "y"\n', encoding="utf-8")
    beside = formats.read(path, format=kind)
    assert beside.points is not None
    assert beside.points.xyz == pytest.approx(found.points.xyz)


def test_looking_in_says_it_and_refuses_nothing(tmp_path: Path) -> None:
    (found,) = motions(tum(tmp_path, "y"))
    assert found.motion is not None
    assert any("another axis than z seems to be up, y" in note for note in found.motion.notes)
