"""Motive's CSV by hand: which columns are measured, axes, angles, versions of the header."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError
from clearway.recordings.formats import motive
from clearway.recordings.recording import Recording, Want

FIRST = (
    "Format Version,1.25,Take Name,run 3,Take Notes,floor wet, cold,Capture Frame Rate,120.000000,"
    "Export Frame Rate,120.000000,Capture Start Time,2024-07-17 01.12.15.319 PM,Total Frames in Take,3,"
    "Total Exported Frames,3,Rotation Type,Quaternion,Length Units,Centimeters,Coordinate Space,Global\n\n"
)
HEADS = """,Type,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker Constraint,Marker Constraint,Marker Constraint,Marker,Marker,Marker,Marker
,Name,,cart,cart,cart,cart,cart,cart,cart,cart,cart:1,cart:1,cart:1,cart:1,cart:1,cart:1,Unlabeled 77
,ID,,"A1","A1","A1","A1","A1","A1","A1","A1","A2","A2","A2","B1","B1","B1","B2"
,Parent,,,,,,,,,,,,,,,,
,,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position,Position,Position,Position,Position,Position,Position
Frame,Time (Seconds),TimeCode,X,Y,Z,w,X,Y,Z,,X,Y,Z,X,Y,Z,X
"""
ROWS = """0,0.000000,15:26:46:12.02,0,0.6,0,0.8,10,20,30,0.001,1,2,3,11,21,31,5
1,0.008333,15:26:46:12.03,0,0.6,0,0.8,10,20,30,0.001,1,2,3,,,,5
2,0.016667,15:26:46:12.04,,,,,,,,,1,2,3,11,21,31,5
"""


def of(text: str, folder: Path, want: Want | None = None) -> Recording:
    path = folder / "take.csv"
    path.write_text(text)
    return motive.FORMATS[0].read(path, want or Want())


def test_y_up_centimetres_and_what_was_not_seen(tmp_path: Path) -> None:
    found = of(FIRST + HEADS + ROWS, tmp_path)
    assert found.points is not None
    assert found.points.names == ("cart:1",)  # the constraint of the same name is not measured, and is not read
    assert found.points.xyz[0, 0] == pytest.approx([0.11, -0.31, 0.21])  # (x, y, z) -> (x, -z, y)
    assert np.isnan(found.points.xyz[1]).all()
    assert found.points.t == pytest.approx([0, 1 / 120, 2 / 120], abs=1e-12)  # not the rounded 0.008333
    track = found.tracks["cart"]
    assert track.position[0] == pytest.approx([0.1, -0.3, 0.2])
    assert np.isnan(track.position[2]).all()
    assert track.orientation is not None
    assert track.orientation[0] == pytest.approx([0, 0, 0.6, 0.8])  # about the vertical, in either frame
    assert np.isnan(track.orientation[2]).all()
    assert any("1 markers' expected positions were passed over" in note for note in found.notes)
    assert found.epoch == 1_721_221_935.319


def test_a_body_that_turns_about_its_vertical_keeps_its_markers(tmp_path: Path) -> None:
    """The body frame is turned with the world: pose and markers stay one rigid thing."""
    rng = np.random.default_rng(3)
    local = rng.normal(size=3)
    turned = Rotation.from_euler("YXZ", [130, 12, -7], degrees=True)
    p = rng.normal(size=3)
    x, q = turned.apply(local) + p, turned.as_quat()
    row = ",".join(f"{v:.9f}" for v in (*q, *p, 0, 1, 2, 3, *x, 5))
    found = of(FIRST.replace("Centimeters", "Meters") + HEADS + f"0,0.0,,{row}\n", tmp_path)
    track = found.tracks["cart"]
    assert found.points is not None
    assert track.orientation is not None
    back = Rotation.from_quat(track.orientation[0]).inv().apply(found.points.xyz[0, 0] - track.position[0])
    assert back == pytest.approx([local[0], -local[2], local[1]], abs=1e-7)


@pytest.mark.parametrize("order", ["XYZ", "YXZ", "ZYX", "XZY"])
def test_euler_angles_turn_about_the_bodys_own_axes_in_the_order_named(order: str, tmp_path: Path) -> None:
    """ "Relative", says help.naturalpoint.com, "Changes in Motive's Reported Euler Angles"."""
    heads = """,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body
,Name,cart,cart,cart,cart,cart,cart
,ID,1,1,1,1,1,1
,,Rotation,Rotation,Rotation,Position,Position,Position
Frame,Time (Seconds),X,Y,Z,X,Y,Z
"""
    angle = {"X": 10.0, "Y": 70.0, "Z": -20.0}
    first = FIRST.replace("Quaternion", order)
    found = of(first + heads + f"0,0.0,{angle['X']},{angle['Y']},{angle['Z']},1,2,3\n", tmp_path)
    own = Rotation.identity()
    for axis in order:
        own = own * Rotation.from_euler(axis.lower(), angle[axis], degrees=True)
    turn = Rotation.from_euler("x", 90, degrees=True)
    there = found.tracks["cart"].orientation
    assert there is not None
    assert (turn * own * turn.inv()).inv().__mul__(Rotation.from_quat(there[0])).magnitude() < 1e-9


def test_the_older_header_without_labels(tmp_path: Path) -> None:
    text = FIRST.replace("1.25", "1.21") + (
        ",,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker,"
        "Rigid Body Marker,Rigid Body Marker,Rigid Body Marker,Marker,Marker,Marker\n"
        ",,b,b,b,b,b,b,b,b,b_1,b_1,b_1,b_1,b:Marker1,b:Marker1,b:Marker1\n"
        ',,"1","1","1","1","1","1","1","1","1","1","1","1","2","2","2"\n'
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Error Per Marker,Position,Position,Position,"
        "Marker Quality,Position,Position,Position\n"
        "Frame,Time,X,Y,Z,W,X,Y,Z,,X,Y,Z,,X,Y,Z\n"
        "0,0.000000,0,0,0,-1,1,2,3,0.5,7,7,7,0.9,4,5,6\n"
    )
    found = of(text, tmp_path)
    assert found.points is not None
    assert found.points.names == ("b:Marker1",)
    assert found.points.xyz[0, 0] == pytest.approx([0.04, -0.06, 0.05])
    assert found.tracks["b"].position[0] == pytest.approx([0.01, -0.03, 0.02])


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("Length Units,Centimeters,", "", "Length Units: the unit of length is missing"),
        ("Centimeters", "Cubits", "'Cubits' is no unit of length"),
        ("Space,Global", "Space,Local", "Coordinate Space: 'Local': export it in global coordinates"),
        ("Type,Quaternion", "Type,Axis Angle", "Rotation Type: 'Axis Angle' should be Quaternion or an order of axes"),
        ("Frame,Time", "Bild,Zeit", "the row of columns (Frame, Time (Seconds), X, Y, Z, ...) is missing"),
        ("Format Version", "Version", "doesn't begin with 'Format Version'"),
        ("11,21,31,5\n1,", "11,21,31,5,6\n1,", "line 9 has 19 columns; the header has 18"),
        ("1,0.008333", "1,0.908333", "time goes backwards"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, problem: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError) as error:
        of((FIRST + HEADS + ROWS).replace(old, new), tmp_path)
    assert problem in str(error.value)


def test_without_a_time_column_the_rate_makes_the_time(tmp_path: Path) -> None:
    heads = ",Type,Marker,Marker,Marker\n,Name,a,a,a\n,ID,1,1,1\n,,Position,Position,Position\nFrame,,X,Y,Z\n"
    found = of(FIRST + heads + "0,,1,2,3\n12,,1,2,3\n", tmp_path)
    assert found.points is not None
    assert found.points.t == pytest.approx([0, 0.1])
