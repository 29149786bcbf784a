"""Motion out of a recording without a plan: what is found in it, and what the CSV says of it."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from driven_trials import forth_and_back

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.exports.mcap import write_trial
from clearway.recordings.lab.unplanned import (
    bodies_of,
    cleaning_at,
    file_of,
    motions,
    summary,
    write_motion,
)
from clearway.recordings.motion.motion import Gap, Motion, MotionSpec, Quality
from clearway.recordings.motion.tracks import motion_of_track
from clearway.recordings.recording import Points, Recording, Track

BODY = np.array([[0.2, 0.1, 0.3], [-0.2, 0.15, 0.4], [0.1, -0.25, 0.5], [-0.1, -0.1, 0.9]])


def driven(t: np.ndarray) -> np.ndarray:
    """(n, 3) at 0.5 m/s along y, from x = 1 m."""
    return np.column_stack([np.ones(len(t)), 0.5 * t, np.zeros(len(t))])


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    t = np.arange(1001) / 100
    xyz = driven(t)[:, None] + BODY
    lone = np.tile([3.0, 0.0, 0.0], (len(t), 1, 1))
    names = (*(f"tiago:{i}" for i in range(4)), "lamp")
    path = tmp_path / "drive.csv"
    write = formats.formats()["vicon"].write
    assert write is not None
    write(path, Recording(path, "vicon", Points(names, t, np.concatenate([xyz, lone], axis=1))))
    return path


def poses(tmp_path: Path) -> Path:
    t = np.arange(501) / 50
    quaternion = np.tile([0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4)], (len(t), 1))
    path = tmp_path / "drive.tum"
    write = formats.formats()["tum"].write
    assert write is not None
    write(path, Recording(path, "tum", tracks={"base": Track("pose", "", "", t, driven(t), quaternion)}))
    return path


def test_everything_that_moves_is_found(tmp_path: Path):
    t = np.arange(3) / 10
    names = ("a:b:1", "a:b:2", "a:b:3", "pair:1", "pair:2", "lone", "never:1", "never:2", "never:3")
    xyz = np.zeros((3, len(names), 3))
    xyz[:, 6:] = np.nan
    tracks = {"cart": Track("body", "", "", t, np.zeros((3, 3))), "/tf": Track("tf", "", "", t[:1], np.zeros((1, 3)))}
    assert bodies_of(Recording(tmp_path, "c3d", Points(names, t, xyz), tracks)) == ["a:b:", "cart"]


def test_a_bag_gives_its_robots_base_and_any_pair_of_frames(tmp_path: Path):
    path = tmp_path / "drive.mcap"
    write_trial(path, forth_and_back(square=False), scans=False)
    found = {f.name: f for f in motions(path)}
    assert {"/odom", "/ground_truth/pose", "/amcl_pose", "map->base_link"} <= set(found)
    assert not any(f.problem for f in found.values())
    (truth,) = motions(path, ["/ground_truth/pose"])
    assert truth.motion is not None
    assert truth.motion.pose[0, :2] == pytest.approx([-2.5, 1.0], abs=1e-6)
    assert [f.name for f in motions(path, ["map->odom"])] == ["map->odom"]
    with pytest.raises(ClearwayError, match="base_link"):
        list(motions(path, ["map->base_lonk"]))
    with pytest.raises(ClearwayError, match="pair"):
        list(motions(path, ["/tf"]))


def test_a_bag_may_be_the_folder_that_one_is_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_trial(tmp_path / "bag", forth_and_back(square=False), scans=False)
    monkeypatch.chdir(tmp_path / "bag")
    assert "/odom" in {e.name for e in formats.look(".").entries}
    assert "/odom" in formats.read(Path()).tracks
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ClearwayError, match="no ROS 2 bag"):
        formats.look(".")


def test_markers_by_prefix_without_a_plan(capture: Path):
    found = list(motions(capture))
    assert [f.name for f in found] == ["tiago:"]
    motion = found[0].motion
    assert motion is not None
    middle = BODY[:, :2].mean(axis=0)
    assert motion.pose[500, :2] == pytest.approx([1.0 + middle[0], 2.5 + middle[1]], abs=2e-3)
    assert motion.velocity[500] == pytest.approx([0.5, 0.0], abs=2e-3)  # over the floor, wherever its x points
    about = summary(motion)
    assert about["length"] == pytest.approx(5.0, rel=1e-3)
    assert about["residual"] == pytest.approx(0.0, abs=1e-5)  # the file has micrometres
    assert any("base_link" in note for note in about["notes"])


def test_chosen_markers_and_a_track(capture: Path, tmp_path: Path):
    (found,) = motions(capture, ["tiago:0, tiago:1,tiago:2"])
    assert found.motion is not None
    file = poses(tmp_path)
    (track,) = motions(file)
    assert track.motion is not None
    assert track.motion.pose[250] == pytest.approx([1.0, 2.5, math.pi / 2], abs=1e-4)
    assert track.motion.velocity[250] == pytest.approx([0.5, 0.0], abs=1e-3)


@pytest.mark.parametrize(
    ("name", "right"),
    [
        ("tiaggo:", "'tiago:'"),
        ("tiago:0,tiago:1,tiago:8", "'tiago:8'"),
        ("tiago", "'tiago:'"),
        ("tiago:0,tiago:1", "three"),
    ],
)
def test_what_is_not_there_is_said(capture: Path, name: str, right: str):
    with pytest.raises(ClearwayError, match=right) as said:
        list(motions(capture, [name]))
    assert "drive.csv" in str(said.value)


def test_a_capture_of_loose_markers_says_how_to_name_them(tmp_path: Path):
    path = tmp_path / "loose.csv"
    write = formats.formats()["vicon"].write
    assert write is not None
    t = np.arange(50) / 100
    write(path, Recording(path, "vicon", Points(("a", "b", "c", "d"), t, driven(t)[:, None] + BODY)))
    with pytest.raises(ClearwayError, match="--body"):
        list(motions(path))
    (found,) = motions(path, ["a,b,c,d"])
    assert found.motion is not None


def test_one_bad_body_does_not_hide_the_others(tmp_path: Path):
    t = np.arange(201) / 100
    line = np.array([[0.0, 0.0, 0.5], [0.1, 0.0, 0.5], [0.2, 0.0, 0.5]])
    xyz = np.concatenate([driven(t)[:, None] + BODY, driven(t)[:, None] + line], axis=1)
    names = (*(f"good:{i}" for i in range(4)), *(f"line:{i}" for i in range(3)))
    path = tmp_path / "two.csv"
    write = formats.formats()["vicon"].write
    assert write is not None
    write(path, Recording(path, "vicon", Points(names, t, xyz)))
    good, line_ = motions(path)
    assert (good.name, good.problem) == ("good:", "")
    assert line_.motion is None
    assert "line" in line_.problem
    with pytest.raises(ClearwayError):
        list(motions(path, ["line:"]))


def test_csv(tmp_path: Path):
    nan = math.nan
    motion = Motion(
        np.array([0.0, 0.5, 1.0]),
        np.array([[1.0, -2.0, 3.0], [nan, nan, nan], [1.0000001, 2.0, 3.5]]),
        np.array([[0.5, -0.0], [nan, nan], [0.25, 0.125]]),
        None,
        Quality(2.0, 2 / 3, (Gap(0.5, 0.5, ""), Gap(0.1, 0.2, "spline"), Gap(0.3, 0.6, "spline"))),
    )
    path = tmp_path / "a.csv"
    write_motion(motion, path)
    rows = list(csv.reader(path.read_text().splitlines()))
    assert rows[0] == ["t", "x", "y", "theta", "v", "omega"]
    assert rows[1] == ["0", "1", "-2", "3", "0.5", "0"]
    assert rows[2] == ["0.5", "", "", "", "", ""]
    assert float(rows[3][3]) == pytest.approx(3.5 - 2 * math.pi, abs=1e-6)
    assert summary(motion)["gaps"]["spline"] == {"count": 2, "longest": pytest.approx(0.3)}
    assert summary(motion)["known"] == pytest.approx(2 / 3)
    with pytest.raises(ClearwayError, match="there already"):
        write_motion(motion, path)


@pytest.mark.parametrize(
    ("name", "file"),
    [("tiago:", "run-tiago.csv"), ("/robot/odom", "run-robot-odom.csv"), ("map->base_link", "run-map-to-base_link.csv"),
     ("../../x", "run-x.csv"), (":", "run-body.csv")],
)  # fmt: skip
def test_file_names_stay_in_their_folder(name: str, file: str):
    assert file_of("a/run.bag", name) == file


def test_the_length_over_an_open_gap_counts_for_no_one():
    """Whether samples lack there (a bag, poses) or only positions (markers): 3 m were seen of 5."""
    t = np.arange(0, 10.001, 0.01)
    pose = np.stack((0.5 * t, 0 * t, 0 * t), axis=1)
    hidden = (t > 3) & (t < 7)
    blank = pose.copy()
    blank[hidden] = np.nan
    orientation = np.tile((0.0, 0.0, 0.0, 1.0), (len(t), 1))
    tracks = {
        "there": Track("body", "", "", t, blank, orientation),
        "lacking": Track("body", "", "", t[~hidden], pose[~hidden], orientation[~hidden]),
    }
    for track in tracks.values():
        about = summary(motion_of_track(track, MotionSpec(), None))
        assert about["length"] == pytest.approx(3.0, abs=1e-6)
        assert about["gaps"]["open"]["count"] == 1


def test_what_the_reader_noticed_is_said_too(tmp_path: Path):
    path = tmp_path / "a.tum"
    rows = [f"{i / 100:.2f} {i / 200} 0 0 0 0 0 1" for i in range(300)]
    path.write_text("\n".join([*rows[:100], rows[99], *rows[100:]]) + "\n")
    (found,) = motions(path)
    assert found.motion is not None
    assert any("1 samples had the stamp of the one before; dropped" in note for note in found.motion.notes)


@pytest.mark.parametrize(("text", "cutoff"), [("residual", "residual"), ("none", "none"), ("6", 6.0)])
def test_cut_off(text: str, cutoff: object):
    assert cleaning_at(text).cutoff == cutoff


@pytest.mark.parametrize("text", ["0", "-1", "nan", "six", "inf"])
def test_no_cut_off(text: str):
    with pytest.raises(ClearwayError, match="Hz"):
        cleaning_at(text)
