"""Nexus' CSV by hand: blocks, units, frames, and the angles that no header explains."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.recordings.formats.vicon import FORMATS
from clearway.recordings.recording import Recording, Want

(VICON,) = FORMATS

TRAJECTORIES = """Trajectories
200
,,robot:m1,,,robot:m2,,
Frame,Sub Frame,X,Y,Z,X,Y,Z
,,mm,mm,mm,mm,mm,mm
101,0,1000,-2000.5,300,0,0,10
102,0,1001,-2000.5,300,,,
103,0,1002,-2000.5,300
"""

DEVICES = """Devices
1000
,,Force,,
Frame,Sub Frame,Fx,Fy,Fz
,,N,N,N
101,0,1,2,3
101,1,1,2,3
"""

SEGMENTS = """Segments
100
,,cart:cart,,,,,,
Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ
,,deg,deg,deg,mm,mm,mm
1,0,0,0,90,1500,0,250
2,0,0.5,-0.5,135,1500,100,250
3,0,40,30,90,1500,200,250
4,0,,,,,,
"""


def of(text: str, folder: Path, want: Want | None = None) -> Recording:
    path = folder / "nexus.csv"
    path.write_text(text)
    return VICON.read(path, want or Want())


def test_frame_1_is_zero_seconds_and_millimetres_become_metres(tmp_path: Path) -> None:
    points = of(TRAJECTORIES, tmp_path).points
    assert points is not None
    assert points.names == ("robot:m1", "robot:m2")
    assert points.t == pytest.approx([0.5, 0.505, 0.51])
    assert points.xyz[0] == pytest.approx(np.array([[1.0, -2.0005, 0.3], [0, 0, 0.01]]))
    assert np.isnan(points.xyz[1:, 1]).all()  # an empty cell, and a line that ends before its last marker
    assert np.isfinite(points.xyz[:, 0]).all()


@pytest.mark.parametrize("blank", ["\n", "\r\n", ",,,,,,,\n", " \n\n"])
@pytest.mark.parametrize("order", ["before", "behind"])
def test_other_blocks_are_passed_over(blank: str, order: str, tmp_path: Path) -> None:
    parts = [DEVICES, TRAJECTORIES] if order == "before" else [TRAJECTORIES, DEVICES]
    found = of("\n\n" + blank.join(parts), tmp_path)
    assert found.points is not None
    assert len(found.points.t) == 3
    assert any("passed over: Devices" in note for note in found.notes)


def test_a_block_that_nobody_knows_is_passed_over_but_numbers_behind_an_empty_line_are_not(tmp_path: Path) -> None:
    found = of(TRAJECTORIES + "\nGaze (left)\n100\n,,a\nFrame,Sub Frame,X\n,,mm\n1,0,5\n", tmp_path)
    assert any("passed over: Gaze (left)" in note for note in found.notes)
    with pytest.raises(ClearwayError, match=r"line 8: '102,0,1001,-2000\.5,300' is no block's title"):
        of(TRAJECTORIES.replace("102,0", "\n102,0"), tmp_path)


def test_a_heading_is_given_only_where_every_reading_of_the_angles_agrees(tmp_path: Path) -> None:
    found = of(TRAJECTORIES + "\n" + SEGMENTS, tmp_path)
    assert found.points is not None
    track = found.tracks["cart:cart"]
    assert track.position[1] == pytest.approx([1.5, 0.1, 0.25])
    assert track.orientation is not None
    assert track.orientation[0] == pytest.approx([0, 0, math.sqrt(0.5), math.sqrt(0.5)])
    x, y, z, w = track.orientation[1]
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(math.radians(135), abs=0.01)
    assert np.isnan(track.orientation[2:]).all()  # tilted: a rotation vector and Euler's angles are different headings
    assert np.isfinite(track.position[:3]).all()
    assert np.isnan(track.position[3]).all()


def test_a_quaternion_is_taken_as_it_is(tmp_path: Path) -> None:
    text = """Objects
100
,,Global Angle box:box,,,,,,
Frame,Sub Frame,RX,RY,RZ,RW,TX,TY,TZ
,,,,,,mm,mm,mm
1,0,0.6,0,0,0.8,1,2,3
"""
    track = of(text, tmp_path).tracks["box:box"]
    assert track.orientation is not None
    assert track.orientation[0] == pytest.approx([0.6, 0, 0, 0.8])


def test_semicolons_decimal_commas_and_windows_letters(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    text = "Trajectories;;;;;\n100;;;;;\n;;Wägelchen:1;;\nFrame;Sub Frame;X;Y;Z\n;;mm;mm;mm\n1;0;-391,888;-6180,01;1734,43\n"
    path.write_bytes(text.encode("cp1252"))
    assert VICON.sniff(path, path.read_bytes())
    points = VICON.read(path, Want()).points
    assert points is not None
    assert points.names == ("Wägelchen:1",)
    assert points.xyz[0, 0] == pytest.approx([-0.391888, -6.18001, 1.73443])


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("mm,mm,mm,mm,mm,mm", ",,,,,", "the unit of length is missing"),
        ("mm,mm,mm,mm,mm,mm", "px,px,px,px,px,px", "'px' is no unit of length; it has to be one of mm, cm, m, in, ft"),
        ("mm,mm,mm,mm,mm,mm", "mm,mm,mm,m,m,m", "several units: m, mm"),
        ("\n200\n", "\nfast\n", "'fast' is no sampling rate"),
        ("\n200\n", "\n0\n", "'0' is no sampling rate"),
        ("Frame,Sub Frame", "Bild,Sub Frame", "the columns should be Frame, Sub Frame, X, Y, Z"),
        ("Trajectories", "Trajectoires", "'Trajectoires' is no block's title"),
        ("102,0,1001", "102,0,1001,5", "line 7 has 9 columns; the header has 8"),
        ("103,0,1002,-2000.5,300", "103,0,1002,-2000.5", "line 8 has 4 columns; the header has 8"),
        ("1001", "1 001", "line 7, column 3: '1 001' is no number"),
        ("103,0,", "99,0,", "time goes backwards"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, problem: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError) as error:
        of(TRAJECTORIES.replace(old, new), tmp_path)
    assert problem in str(error.value)


def test_a_file_of_other_blocks_says_what_it_has(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="has no block 'Trajectories', 'Segments' or 'Objects'; it has Devices"):
        of(DEVICES, tmp_path)


WORKSTATION = """TRAJECTORIES
120,Hz
,robot:m1,,,robot:m2,,
Field #,X,Y,Z,X,Y,Z
1,1000,-2000.5,300,0,0,10
2,1001,-2000.5,300,,,
3,1002,-2000.5,300
"""


@pytest.mark.parametrize("units", ["", ",mm,mm,mm,mm,mm,mm\n", ",cm,cm,cm,cm,cm,cm\n"])
def test_the_older_text_of_workstation(units: str, tmp_path: Path) -> None:
    scale = 10.0 if "cm" in units else 1.0
    text = WORKSTATION.replace("X,Y,Z\n1,", f"X,Y,Z\n{units}1,") + "\nANALOG\n1080,Hz\nSample #,Fx1\n,N\n1,0.5\n"
    path = tmp_path / "old.csv"
    path.write_text(text)
    assert VICON.sniff(path, text.encode())
    found = VICON.read(path, Want())
    assert found.points is not None
    assert found.points.names == ("robot:m1", "robot:m2")
    assert found.points.t == pytest.approx(np.arange(3) / 120)
    assert found.points.xyz[0] == pytest.approx(scale * np.array([[1.0, -2.0005, 0.3], [0, 0, 0.01]]))
    assert np.isnan(found.points.xyz[1:, 1]).all()
    assert any("taken as millimetres" in note for note in found.notes) == (not units)


def test_newer_text_without_units_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="the unit of length is missing"):
        of(TRAJECTORIES.replace("mm", ""), tmp_path)
