"""KITTI poses and EuRoC's ground truth, as their sets define them and by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from text_captures import damaged, nothing_but_clearway_errors

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats import euroc, kitti
from clearway.recordings.recording import Recording, Track, Want


def camera(n: int = 20) -> str:
    """A car that drives 1 m a pose on a left curve of 0.05 rad a pose, on level ground: the camera's x right, y down, z ahead. So it
    turns by minus the heading about y."""
    lines = []
    right, ahead = 0.0, 0.0
    for i in range(n):
        heading = 0.05 * i
        c, s = math.cos(heading), math.sin(heading)
        rows = [[c, 0, -s, right], [0, 1, 0, -0.01 * i], [s, 0, c, ahead]]
        lines.append(" ".join(f"{x:.6e}" for row in rows for x in row))
        right, ahead = right - s, ahead + c
    return "\n".join(lines) + "\n"


def poses(folder: Path, times: str = "00_times.txt", n: int = 20, hints: str = "") -> Path:
    path = folder / "00.txt"
    path.write_text(camera(n))
    if times:
        (folder / times).parent.mkdir(parents=True, exist_ok=True)
        (folder / times).write_text("".join(f"{0.1 * i:.6e}\n" for i in range(n)))
    if hints:
        (folder / "00.txt.toml").write_text(hints)
    return path


def heading(track: Track) -> np.ndarray:
    assert track.orientation is not None
    _, _, z, w = track.orientation.T
    return 2 * np.arctan2(z, w)


@pytest.mark.parametrize("times", ["00_times.txt", "times.txt"])
def test_a_camera_becomes_a_robot_on_a_floor(times: str, tmp_path: Path) -> None:
    found = formats.read(poses(tmp_path, times))
    assert found.format == "kitti"
    track = found.tracks["trajectory"]
    assert track.t == pytest.approx(0.1 * np.arange(20))
    assert heading(track) == pytest.approx(0.05 * np.arange(20), abs=1e-5)
    steps = np.diff(track.position[:, :2], axis=0)
    assert np.arctan2(steps[:, 1], steps[:, 0]) == pytest.approx(
        0.05 * np.arange(19), abs=1e-5
    )  # it goes where it looks
    assert track.position[-1, 1] > 0  # a left curve, z up
    assert track.position[-1, 2] == pytest.approx(0.19, abs=1e-5)


def test_the_sets_own_folders(tmp_path: Path) -> None:
    (tmp_path / "poses").mkdir()
    path = poses(tmp_path / "poses", "../sequences/00/times.txt")
    assert formats.read(path).tracks["trajectory"].t[-1] == pytest.approx(1.9)


def test_a_rate_or_another_file_of_times(tmp_path: Path) -> None:
    assert formats.read(poses(tmp_path, "", hints="rate = 20\n")).tracks["trajectory"].t[-1] == pytest.approx(0.95)
    path = poses(tmp_path, "stamps", hints='times = "stamps"\nup = "z"\n')
    track = formats.read(path, Want(span=(0.5, 1.0))).tracks["trajectory"]
    assert track.t == pytest.approx(0.1 * np.arange(5, 11))
    assert track.position[0, 1] == pytest.approx(-0.05)  # as it stands


@pytest.mark.parametrize(
    ("times", "hints", "problem"),
    [
        ("", "", "neither 00_times.txt nor times.txt stands beside it"),
        ("", 'times = "nowhere.txt"\n', "neither nowhere.txt"),
        ("00_times.txt", "rate = 0\n", "rate"),
    ],
)
def test_without_times_it_is_said_what_to_do(times: str, hints: str, problem: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=problem):
        formats.read(poses(tmp_path, times, hints=hints))


def test_as_many_times_as_poses(tmp_path: Path) -> None:
    path = poses(tmp_path)
    path.write_text(camera(19))
    with pytest.raises(ClearwayError, match=r"has 20 times; 00\.txt has 19 poses"):
        formats.read(path)


EUROC = """#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]
1403715524907143168,0.5,1.9,0.97,0.6,0,0,0.8,7
1403715524912143104,0.6,1.8,0.98,0.8,0,0,0.6,7
1403715524917143040,0.7,1.7,0.99,1.0,0,0,0.0,7
"""


def of(text: str, folder: Path) -> Recording:
    path = folder / "data.csv"
    path.write_text(text)
    return formats.read(path)


def test_stamps_are_exact_and_the_quaternion_begins_with_w(tmp_path: Path) -> None:
    found = of(EUROC, tmp_path)
    assert found.format == "euroc"
    track = found.tracks["trajectory"]
    assert track.t.tolist() == pytest.approx(
        [0, 0.004999936, 0.009999872], abs=1e-12
    )  # floats of ns since 1970 would be 256 apart
    assert found.epoch == pytest.approx(1403715524.907143)
    assert track.position[1] == pytest.approx([0.6, 1.8, 0.98])
    assert track.orientation is not None
    assert track.orientation[0] == pytest.approx([0, 0, 0.8, 0.6])


@pytest.mark.parametrize(
    "header",
    [
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]",
        "# timestamp[ns],tx,ty,tz,qw,qx,qy,qz,other",
        "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],gap",
    ],
)
def test_columns_by_the_names_that_other_sets_give(header: str, tmp_path: Path) -> None:
    track = of(header + EUROC[EUROC.index("\n") :], tmp_path).tracks["trajectory"]
    assert track.orientation is not None
    assert track.orientation[1] == pytest.approx([0, 0, 0.6, 0.8])


def test_positions_alone_have_no_heading(tmp_path: Path) -> None:
    rows = "1403715524907143168,1,2,3\n1403715525907143168,1,2,4\n"
    found = of("#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m]\n" + rows, tmp_path)
    assert found.tracks["trajectory"].orientation is None
    assert found.tracks["trajectory"].t.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [("912143104,", "912143104.5,", "not all whole numbers of ns"), ("1403715524917", "1403715520917", "time goes backwards"),
     ("#timestamp [ns],", '#"timestamp [ns],', "columns should be named"),
     ("\n1403715524912143104,0.6", "\n,0.6", "a line has no stamp"), ("0.6,1.8", "0.6,x", "column")],
)  # fmt: skip
def test_what_is_wrong_is_said(old: str, new: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(EUROC.replace(old, new))
    with pytest.raises(ClearwayError, match=problem):
        euroc.read(path, Want())


def test_a_description_beside_it_counts_more(tmp_path: Path) -> None:
    toml = '[time]\ncolumn = "timestamp [ns]"\nunit = "ns"\n[bodies.imu]\nx = "p_RS_R_x [m]"\ny = "p_RS_R_y [m]"\n'
    (tmp_path / "data.csv.toml").write_text(toml)
    assert list(of(EUROC.replace(", ", ","), tmp_path).tracks) == ["imu"]


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_the_file_holds_nothing_but_our_own_error_comes_out(tmp_path: Path, data: st.DataObject) -> None:
    poses(tmp_path)
    for made, valid in ((kitti.FORMATS[0], camera().encode()), (euroc.FORMATS[0], EUROC.encode())):
        nothing_but_clearway_errors(made, tmp_path / "00.txt", data.draw(damaged(valid)))
