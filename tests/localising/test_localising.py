"""A robot with only scans and odometry, localised afterwards: in a room made in plain numpy, held against where it truly was."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "perception"))
sys.path.insert(0, str(Path(__file__).parents[1] / "recordings"))
from made_bags import START, Robot, write_mcap
from simulated_room import MOUNT, drive, forth_and_back, make_robot, room_map

from clearway.cli import main
from clearway.contract import Sensing
from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.indicators import score_row
from clearway.localising import localise, localise_recording
from clearway.recordings import formats
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.lab import Lab
from clearway.recordings.protocol.toml_text import toml
from clearway.recordings.recording import Sweeps, Track, Want

BOX = make_robot(
    odometry={"translation_per_metre": 0.02, "rotation_per_metre": 0.02, "rotation_per_radian": 0.03, "scale": 0.05}
)
BEGIN = np.array((2.0, 2.5, 0.0))
WRONG = np.array((0.3, -0.2, 0.1))
MAP = room_map()
SENSED = drive(BEGIN, forth_and_back()[:130], BOX, 1)
TRUTH = np.array([s.truth for s in SENSED])


def recorded(sensed: list[Sensing]) -> tuple[Track, Sweeps]:
    t, odom = np.array([s.t for s in sensed]), np.array([s.odom_pose for s in sensed])
    half, zero = odom[:, 2] / 2, np.zeros(len(t))
    q = np.column_stack((zero, zero, np.sin(half), np.cos(half)))
    track = Track("odometry", "odom", "base_link", t, np.column_stack((odom[:, :2], zero)), q)
    ranges = np.array([s.scan.ranges for s in sensed if s.scan is not None])
    scan = sensed[0].scan
    assert scan is not None
    return track, Sweeps(
        "laser", t, ranges, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max, MOUNT
    )


ODOMETRY, SWEEPS = recorded(SENSED)


def off(pose: np.ndarray, truth: np.ndarray = TRUTH) -> np.ndarray:
    found = pose - truth
    found[:, 2] = np.remainder(found[:, 2] + np.pi, 2 * np.pi) - np.pi
    return found


def test_it_finds_the_way_and_says_how_well() -> None:
    found = localise(ODOMETRY, SWEEPS, MAP, BEGIN + WRONG, BOX)
    wrong = off(found.pose)
    far = np.hypot(wrong[:, 0], wrong[:, 1])
    drifted = off(np.array([s.odom_pose for s in SENSED]) + BEGIN)
    assert far.max() < 0.1  # from its first sample on, though the start is 0.36 m off
    assert np.hypot(*drifted[-1, :2]) > 0.1
    held = np.abs(wrong) <= 2 * found.sigma[:, [0, 0, 1]]
    assert held.mean() > 0.95
    assert np.median(found.sigma[:, 0]) < 0.08  # and it doesn't say 2 m to be safe
    length, true = (np.hypot(*np.diff(p[:, :2], axis=0).T).sum() for p in (found.pose, TRUTH))
    assert length == pytest.approx(true, rel=0.03)
    assert "of their beams end within 0.15 m of a wall" in found.notes[0]


def test_same_seed_same_bits() -> None:
    track, sweeps = recorded(SENSED[:30])
    one, two, other = (localise(track, sweeps, MAP, BEGIN, BOX, seed=s).pose for s in (3, 3, 4))
    np.testing.assert_array_equal(one, two)
    assert np.abs(one - other).max() > 0


def test_where_nothing_fits_it_is_lost_and_the_rest_is_not() -> None:
    ranges = SWEEPS.ranges.copy()
    ranges[50:90] = 0.6  # people stand all around it for four seconds
    found = localise(ODOMETRY, replace(SWEEPS, ranges=ranges), MAP, BEGIN, BOX)
    lost = np.isnan(found.pose[:, 0])
    assert lost[55:85].all()
    assert not lost[:45].any()
    assert not lost[95:].any()
    assert np.isnan(found.sigma[lost]).all()
    assert np.hypot(*off(found.pose)[~lost, :2].T).max() < 0.25
    assert any("lost from 5.0 s to" in note for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"map": OccupancyGrid(np.full((140, 220), FREE, dtype=np.int8), 0.05, (-0.5, -0.5))}, "only 0 % of the beams"),
        ({"start": np.array((6.0, 5.0, 2.0)), "within": (0.05, 0.05)}, "% of the beams end within"),
        ({"odometry": replace(ODOMETRY, orientation=None)}, "has no orientations"),
        ({"sweeps": replace(SWEEPS, mount=None)}, "nothing says where the lidar sits"),
        ({"sweeps": replace(SWEEPS, t=SWEEPS.t + 100.0)}, "no two scans while the odometry was recorded"),
    ],
)
def test_what_cannot_be_is_told(change: dict[str, Any], problem: str) -> None:
    told: dict[str, Any] = {"odometry": ODOMETRY, "sweeps": SWEEPS, "map": MAP, "start": BEGIN, "robot": BOX} | change
    with pytest.raises(ClearwayError, match=problem):
        localise(**told)


def bag(folder: Path, *, upside_down: bool) -> Path:
    """The drive as a bag; a lidar that hangs upside down has its beams in the other order."""
    r, lines = Robot(2), []
    edge = r.transform(START, "base_link", "laser", MOUNT[0], 0.0, 0.0)
    if upside_down:
        edge.transform.rotation = r.make("geometry_msgs/msg/Quaternion", 1.0, 0.0, 0.0, 0.0)  # half a turn about x
    tf = "tf2_msgs/msg/TFMessage"
    lines.append(("/tf_static", tf, START, r.make(tf, [edge])))
    sign = -1.0 if upside_down else 1.0
    for s in SENSED:
        ns = START + round(s.t * 1e9)
        lines.append(("/odom", "nav_msgs/msg/Odometry", ns, r.odometry(ns, *s.odom_pose.tolist())))
        assert s.scan is not None
        ranges = s.scan.ranges.astype(np.float32)
        scan = r.make("sensor_msgs/msg/LaserScan", r.header(ns, "laser"), sign * s.scan.angle_min, -sign * s.scan.angle_min,
                      sign * s.scan.angle_increment, 0.0, 0.1, s.scan.range_min, s.scan.range_max, ranges,
                      np.zeros(0, dtype=np.float32))  # fmt: skip
        lines.append(("/scan", "sensor_msgs/msg/LaserScan", ns, scan))
    return write_mcap(folder / "run.mcap", lines)


def ros_map(folder: Path) -> Path:
    """The room as a ROS map."""
    pixels = np.where(MAP.data == OCCUPIED, 0, 254).astype(np.uint8)[::-1]
    (folder / "room.pgm").write_bytes(b"P5\n%d %d\n255\n" % pixels.shape[::-1] + pixels.tobytes())
    x, y = MAP.origin
    (folder / "room.yaml").write_text(
        f"image: room.pgm\nresolution: {MAP.resolution}\norigin: [{x}, {y}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return folder / "room.yaml"


@pytest.mark.parametrize("upside_down", [False, True])
def test_where_the_lidar_sits_is_read_of_the_bag(upside_down: bool, tmp_path: Path) -> None:
    sweeps = formats.read(bag(tmp_path, upside_down=upside_down), Want(frozenset({"/scan"}))).scans["/scan"]
    assert sweeps.mount == pytest.approx(MOUNT)
    assert (sweeps.angle_min, sweeps.angle_increment) == pytest.approx(
        (SWEEPS.angle_min, SWEEPS.angle_increment), abs=1e-6
    )


def test_from_a_bag_and_a_map_to_a_scored_trial(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, floor = bag(tmp_path, upside_down=True), ros_map(tmp_path)
    out = tmp_path / "run.csv"
    asked = ["localise", str(path), "--map", str(floor), "--start", "2.1,2.4,0.05", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["clearway", *asked, "--within", "0.2,0.1"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code in (0, None)
    assert "standard uncertainty:" in capsys.readouterr().out
    track = formats.read(out).tracks["robot"]
    assert track.frame == "map"
    assert track.sigma is not None
    assert np.hypot(*(track.position[:, :2] - TRUTH[:, :2]).T).max() < 0.12
    goal = [*TRUTH[-1, :2].tolist(), float(TRUTH[-1, 2])]
    plan: dict[str, Any] = {
        "test": {"suite": "own", "robot": "tiago"},
        "sources": {"localised": {"frame": {"same": True}}},
        "robot": {"track": "robot"},
        "legs": [{"name": "forth", "start": BEGIN.tolist(), "goal": goal, "span": [0.0, 12.8]}],
        "trial": [{"file": "run.csv", "speed": 0.6}],
    }
    (tmp_path / "plan.toml").write_text(toml(plan), encoding="utf-8")
    row = score_row(assemble(Lab(tmp_path / "plan.toml"), 0))
    assert row["DE"] < row["DE_U"]  # it truly stood on the goal
    assert row["DE_U"] == pytest.approx(2 * np.hypot(*track.sigma[-1, [0, 0]]), rel=0.5)
    assert row["CT"] == pytest.approx(12.8)


def test_nothing_is_overwritten_and_topics_are_named(tmp_path: Path) -> None:
    path, floor = bag(tmp_path, upside_down=False), str(ros_map(tmp_path))
    (tmp_path / "there.csv").write_text("mine")
    with pytest.raises(ClearwayError, match="exists already"):
        localise_recording(path, floor, "tiago", (2.0, 2.5, 0.0), tmp_path / "there.csv")
    with pytest.raises(ClearwayError, match="did you mean '/scan'"):
        localise_recording(path, floor, "tiago", (2.0, 2.5, 0.0), tmp_path / "new.csv", scan="/scn")
    with pytest.raises(ClearwayError, match="has no topic of scan"):
        localise_recording(write_mcap(tmp_path / "b.mcap", []), floor, "tiago", (2.0, 2.5, 0.0), tmp_path / "new.csv")
