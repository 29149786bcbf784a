"""Plain tables: what a description may say, and what is said without one or with a wrong one."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from text_captures import capture, damaged, nothing_but_clearway_errors

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats import table
from clearway.recordings.formats.table_spec import TableSpec
from clearway.recordings.recording import Recording, Want

READ = table.FORMATS[0].read


def read(folder: Path, text: str | bytes, toml: str, want: Want | None = None) -> Recording:
    file = folder / "a.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    (folder / "a.csv.toml").write_text(toml)
    return READ(file, want or Want())


ROBOT = '[time]\ncolumn = "t"\n[bodies.robot]\nx = "x"\ny = "y"\n'


def test_a_body_without_heading(tmp_path: Path):
    track = read(tmp_path, "t,x,y,note\n0,1,2,a\n0.5,1.5,2,b\n", ROBOT).tracks["robot"]
    assert track.kind == "table"
    assert track.t.tolist() == [0, 0.5]
    assert track.position.tolist() == [[1, 2, 0], [1.5, 2, 0]]
    assert track.orientation is None
    assert track.twist is None


def test_decimal_commas_semicolons_and_a_western_encoding(tmp_path: Path):
    text = "Zeit;größe;x;y\n0,0;a;1,25;-2\n0,5;b;1.500,0;2\n".replace("1.500,0", "1,5")
    track = read(tmp_path, text.encode("cp1252"), ROBOT.replace('"t"', '"Zeit"')).tracks["robot"]
    assert track.t.tolist() == [0, 0.5]
    assert track.position[:, :2].tolist() == [[1.25, -2], [1.5, 2]]
    track = read(tmp_path, text.replace("größe", "g").encode("utf-16"), ROBOT.replace('"t"', '"Zeit"')).tracks["robot"]
    assert track.position[1, 0] == 1.5


def test_units_angles_and_speeds(tmp_path: Path):
    toml = 'units = "mm"\nframe = "lab"\n[time]\ncolumn = "t"\nunit = "ms"\n' + (
        '[bodies.robot]\nx = "x"\ny = "y"\nz = "z"\nyaw = "h"\nangle = "deg"\nv = "v"\nomega = "w"\n'
    )
    track = read(tmp_path, "t,x,y,z,h,v,w\n0,1000,-500,20,90,250,180\n10,1000,-500,20,,250,\n", toml).tracks["robot"]
    assert track.frame == "lab"
    assert track.t.tolist() == [0, 0.01]
    np.testing.assert_allclose(track.position[0], [1, -0.5, 0.02])
    assert track.orientation is not None
    assert track.twist is not None
    np.testing.assert_allclose(track.orientation[0], [0, 0, math.sqrt(0.5), math.sqrt(0.5)])
    assert np.isnan(track.orientation[1]).all()
    np.testing.assert_allclose(track.twist[0], [0.25, math.pi])
    assert np.isnan(track.twist[1, 1])


@pytest.mark.parametrize("up", ["x", "y", "z", "-y", "-z"])
def test_the_axis_that_is_up(tmp_path: Path, up: str):
    # A point one metre along the axis that is up and a body turned by 90 degrees about it.
    point = {"x": "1,0,0", "y": "0,1,0", "z": "0,0,1", "-y": "0,-1,0", "-z": "0,0,-1"}[up]
    half = math.sqrt(0.5)
    sign = "-" if up[0] == "-" else ""
    q = ",".join(f"{sign}{half}" if axis == up[-1] else "0" for axis in "xyz") + f",{half}"
    toml = f'up = "{up}"\n[time]\ncolumn = "t"\n' + (
        '[bodies.robot]\nx = "x"\ny = "y"\nz = "z"\nquaternion = ["a", "b", "c", "d"]\norder = "xyzw"\n'
    )
    track = read(tmp_path, f"t,x,y,z,a,b,c,d\n0,{point},{q}\n1,{point},0,0,0,1\n", toml).tracks["robot"]
    np.testing.assert_allclose(track.position, [[0, 0, 1], [0, 0, 1]], atol=1e-12)
    assert track.orientation is not None
    np.testing.assert_allclose(Rotation.from_quat(track.orientation).as_euler("zyx")[:, 0], [math.pi / 2, 0], atol=1e-9)


def test_z_down(tmp_path: Path):
    # North, east, down: a robot that is 1 m north and 2 m east of the origin, looks east and turns on to the south.
    toml = 'up = "-z"\n' + ROBOT + 'yaw = "yaw"\nangle = "deg"\nomega = "w"\n'
    track = read(tmp_path, "t,x,y,yaw,w\n0,1,2,90,10\n1,1,2,100,10\n", toml).tracks["robot"]
    np.testing.assert_allclose(track.position[0], [1, -2, 0])
    assert track.orientation is not None
    assert track.twist is not None
    np.testing.assert_allclose(Rotation.from_quat(track.orientation).apply([1, 0, 0])[0], [0, -1, 0], atol=1e-12)
    assert track.twist[0, 1] == pytest.approx(math.radians(-10))


def test_quaternions_with_w_first(tmp_path: Path):
    toml = ROBOT + 'quaternion = ["qw", "qx", "qy", "qz"]\norder = "wxyz"\n'
    track = read(tmp_path, "t,x,y,qw,qx,qy,qz\n0,0,0,0.8,0,0,0.6\n1,1,0,1,0,0,0\n", toml).tracks["robot"]
    assert track.orientation is not None
    np.testing.assert_allclose(track.orientation[0], [0, 0, 0.6, 0.8])


@pytest.mark.parametrize(
    ("unit", "stamps", "epoch", "t"),
    [
        ('"s"', ["1700000000.5", "1700000001.0"], 1700000000.5, [0, 0.5]),
        ('"ms"', ["1700000000500", "1700000001000"], 1700000000.5, [0, 0.5]),
        ('"us"', ["250000", "750000"], None, [0.25, 0.75]),
        ('"ns"', ["1700000000500000000", "1700000001000000000"], 1700000000.5, [0, 0.5]),
        ('"frame"\nrate = 50', ["1", "3"], None, [0.02, 0.06]),
        ('"date"', ["2023-11-14T22:13:20.500", "2023-11-14 22:13:21"], 1700000000.5, [0, 0.5]),
        ('"date"', ["2023-11-14T23:13:20.500+01:00", "2023-11-14T22:13:21Z"], 1700000000.5, [0, 0.5]),
    ],
)
def test_units_of_time(tmp_path: Path, unit: str, stamps: list[str], epoch: float | None, t: list[float]):
    toml = ROBOT.replace('"t"\n', f'"t"\nunit = {unit}\n')
    recording = read(tmp_path, "t,x,y\n" + "".join(f"{s},1,2\n" for s in stamps), toml)
    assert recording.epoch == (None if epoch is None else pytest.approx(epoch, abs=1e-6))
    np.testing.assert_allclose(recording.tracks["robot"].t, t, atol=1e-6)


def test_several_bodies_each_with_lines_of_their_own(tmp_path: Path):
    toml = 'id = "who"\n[time]\ncolumn = "t"\n[bodies.each]\nx = "x"\ny = "y"\n'
    text = "t,who,x,y\n0,robot,0,0\n0,cart,5,5\n1,robot,1,0\n1,cart,5,6\n2,cart,5,7\n"
    recording = read(tmp_path, text, toml)
    assert list(recording.tracks) == ["robot", "cart"]
    assert recording.tracks["robot"].position[:, 0].tolist() == [0, 1]
    assert recording.tracks["cart"].position[:, 1].tolist() == [5, 6, 7]
    assert list(read(tmp_path, text, toml, Want(frozenset({"cart"}))).tracks) == ["cart"]
    with pytest.raises(ClearwayError, match="unknown body 'card'; did you mean 'cart'"):
        read(tmp_path, text, toml, Want(frozenset({"card"})))


def test_several_bodies_by_prefix_and_one_by_one(tmp_path: Path):
    text = "t,robot_x,robot_y,cart_x,cart_y\n0,1,2,3,4\n1,1,2,3,5\n"
    by_prefix = read(
        tmp_path, text, 'prefixes = ["robot_", "cart_"]\n[time]\ncolumn = "t"\n[bodies.each]\nx = "x"\ny = "y"\n'
    )
    one_by_one = read(
        tmp_path,
        text,
        '[time]\ncolumn = "t"\n[bodies.robot]\nx = "robot_x"\ny = "robot_y"\n[bodies.cart]\nx = "cart_x"\ny = "cart_y"\n',
    )
    for recording in (by_prefix, one_by_one):
        assert list(recording.tracks) == ["robot", "cart"]
        assert recording.tracks["cart"].position[:, :2].tolist() == [[3, 4], [3, 5]]


@pytest.mark.parametrize("how", ['[markers]\na = ["a_x", "a_y", "a_z"]\nb = ["b_x", "b_y", "b_z"]\n', None])
def test_markers(tmp_path: Path, how: str | None):
    toml = '[time]\ncolumn = "t"\n' + how if how else 'marker_suffixes = ["_x", "_y", "_z"]\n[time]\ncolumn = "t"\n'
    text = "t,a_x,a_y,a_z,b_x,b_y,b_z\n0,1,2,3,4,5,6\n1,1,2,3,4,,6\n"
    points = read(tmp_path, text, 'units = "cm"\n' + toml).points
    assert points is not None
    assert points.names == ("a", "b")
    np.testing.assert_allclose(points.xyz[0], [[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]])
    assert np.isnan(points.xyz[1, 1]).all()
    wanted = READ(tmp_path / "a.csv", Want(frozenset({"b"}))).points
    assert wanted is not None
    assert wanted.names == ("b",)


def test_no_header_lines_before_it_words_for_nothing_and_blanks(tmp_path: Path):
    toml = 'separator = " "\nheader = "none"\nskip = 2\nmissing = ["?"]\n[time]\ncolumn = "1"\n' + (
        '[bodies.robot]\nx = "2"\ny = "3"\n'
    )
    track = read(tmp_path, "Made by a logger\nversion 3\n0   1  2\n1   ?  3\n2   5  4\n", toml).tracks["robot"]
    assert track.t.tolist() == [0, 1, 2]
    assert np.isnan(track.position[1]).all()


def test_a_comment_may_name_the_columns(tmp_path: Path):
    text = "#timestamp, p x [m], p y [m]\n1700000000000000000,1,2\n1700000001000000000,2,2\n"
    toml = '[time]\ncolumn = "timestamp"\nunit = "ns"\n[bodies.robot]\nx = "p x [m]"\ny = "p y [m]"\n'
    assert read(tmp_path, text, toml).tracks["robot"].t.tolist() == [0, 1]


def test_a_span_is_cut_out(tmp_path: Path):
    text = "t,x,y\n" + "".join(f"{k / 10},{k},0\n" for k in range(50))
    assert read(tmp_path, text, ROBOT, Want(span=(1.0, 1.2))).tracks["robot"].position[:, 0].tolist() == [10, 11, 12]


def test_a_description_by_another_name(tmp_path: Path):
    (tmp_path / "a.csv").write_text("t,x,y\n0,1,2\n1,1,2\n")
    (tmp_path / "log.toml").write_text(ROBOT)
    assert "robot" in table.read_with(tmp_path / "a.csv", tmp_path / "log.toml", Want()).tracks
    (tmp_path / "a.toml").write_text(ROBOT)
    assert "robot" in READ(tmp_path / "a.csv", Want()).tracks
    with pytest.raises(ClearwayError, match="no such file"):
        table.read_with(tmp_path / "a.csv", tmp_path / "none.toml", Want())


def test_a_toml_beside_it_may_be_about_something_else(tmp_path: Path):
    people = tmp_path / "people.txt"
    people.write_text("frame,id,x,y\n" + "".join(f"{k},1,{k / 20},0\n" for k in range(20)))
    (tmp_path / "people.txt.toml").write_text('rate = 20\nunits = "m"')
    assert formats.identify(people).name == "pedestrians"
    (tmp_path / "people.txt.toml").write_text(ROBOT.replace('"t"', '"frame"\nunit = "frame"\nrate = 20'))
    assert formats.identify(people).name == "table"
    (tmp_path / "log.csv").write_text("t,x,y\n0,1,2\n1,1,2\n")
    (tmp_path / "log.toml").write_text('title = "a plan"')
    with pytest.raises(ClearwayError, match="say what its columns are"):
        formats.read(tmp_path / "log.csv")


def test_without_a_description_the_columns_and_a_suggestion_are_shown(tmp_path: Path):
    file = tmp_path / "a.csv"
    file.write_text("time;pos_x;pos_y;yaw;battery\n0,0;1,5;2;0;99\n0,1;1,6;2;0;99\n")
    assert table.sniff(file, file.read_bytes())
    with pytest.raises(ClearwayError, match="They are: time, pos_x, pos_y, yaw, battery") as caught:
        READ(file, Want())
    suggestion = str(caught.value).split("beside it:\n")[1]
    spec = TableSpec.model_validate(tomllib.loads(suggestion))
    assert (spec.separator, spec.decimal, spec.time.column) == (";", ",", "time")
    assert spec.bodies["robot"].yaw == "yaw"
    contents = table.look(file)
    assert [e.name for e in contents.entries] == ["time", "pos_x", "pos_y", "yaw", "battery"]
    # The suggestion, put where it is said to go, is understood.
    (tmp_path / "a.csv.toml").write_text(suggestion)
    track = READ(file, Want()).tracks["robot"]
    assert track.position[:, 0].tolist() == [1.5, 1.6]
    assert table.look(file).entries[0].name == "robot"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time_ms,x_mm,y_mm\n0,1500,2\n10,1510,2\n", {"units": "mm", "time": "ms", "x": [1.5, 1.51], "dt": 0.01}),
        (
            "t [s];x [cm];y [cm];theta_deg\n0;150;2;90\n1;151;2;90\n",
            {"units": "cm", "time": "s", "x": [1.5, 1.51], "dt": 1.0},
        ),
        (
            "stamp,px,py\n1700000000000000000,1,2\n1700000000500000000,2,2\n",
            {"units": "m", "time": "ns", "x": [1, 2], "dt": 0.5},
        ),
        (
            "date,x,y\n2026-03-01T12:00:00,1,2\n2026-03-01T12:00:02,2,2\n",
            {"units": "m", "time": "date", "x": [1, 2], "dt": 2.0},
        ),
        ("frame,x,y\n1,1,2\n2,2,2\n", {"units": "m", "time": "frame", "x": [1, 2], "dt": 0.01}),
        ("0.0 1.0 2.0\n0.1 1.5 2.0\n", {"units": "m", "time": "s", "x": [1, 1.5], "dt": 0.1}),
        ("t,x,y,yaw\n0,1,2,90\n20,2,2,90\n40,3,2,90\n", {"units": "m", "time": "ms", "x": [1, 2, 3], "dt": 0.02}),
        ("t,x,y,yaw\n0,1,2,1.5\n1,2,2,1.5\n", {"units": "m", "time": "s", "x": [1, 2], "dt": 1.0}),
    ],
)
def test_units_are_proposed_as_names_and_sizes_say(tmp_path: Path, text: str, expected: dict[str, Any]):
    file = tmp_path / "a.csv"
    file.write_text(text)
    (note,) = table.look(file).notes
    suggestion = note.split("beside it:\n")[1]
    spec = TableSpec.model_validate(tomllib.loads(suggestion))
    assert (spec.units, spec.time.unit) == (expected["units"], expected["time"])
    (tmp_path / "a.csv.toml").write_text(suggestion)
    track = READ(file, Want()).tracks["robot"]
    assert track.position[:, 0] == pytest.approx(expected["x"])
    assert np.diff(track.t) == pytest.approx(expected["dt"], abs=1e-6)
    if "theta_deg" in text or ",90" in text:
        assert track.orientation is not None
        assert track.orientation[0, 2:] == pytest.approx([0.5**0.5, 0.5**0.5])


@pytest.mark.parametrize(
    "text",
    [
        "Patient,Dose\nMiller,3.5\nSmith,4\n",
        "Patient;Dose;Age\n1;3.5;80\n2;4;81\n",
        "time,x,y\nnoon,here,there\n1,now,then\n",
        "x,y\n1,2\n3,4\n",
    ],
)
def test_nothing_is_proposed_where_nothing_looks_like_poses(tmp_path: Path, text: str):
    file = tmp_path / "a.csv"
    file.write_text(text)
    (note,) = table.look(file).notes
    assert "nothing is proposed" in note
    with pytest.raises(ClearwayError, match="nothing is proposed"):
        READ(file, Want())


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        ("", "time: is missing"),
        ('[time]\ncolumn = "t"\n', "neither bodies nor markers"),
        (ROBOT.replace('"x"', '"xx"'), "unknown column 'xx'; did you mean 'x'"),
        (ROBOT.replace("column", "colum"), "did you mean 'column'"),
        (ROBOT + 'yaw = "t"\nquaternion = ["t", "t", "t", "t"]\n', "yaw or quaternion, not both"),
        (ROBOT.replace('"t"\n', '"t"\nunit = "frame"\n'), "rate in frames a second"),
        (ROBOT.replace('"t"\n', '"t"\nunit = "min"\n'), "'min' is wrong"),
        ('units = "furlong"\n' + ROBOT, "'furlong' is wrong"),
        ('id = "t"\n' + ROBOT, r"\[bodies\.each\]"),
        ('encoding = "klingon"\n' + ROBOT, "'klingon' is no encoding"),
        ('marker_suffixes = ["_a", "_b", "_c"]\n' + ROBOT, "no columns end so"),
        ('separator = ",', "not a TOML file"),
    ],
)
def test_a_wrong_description_is_said(tmp_path: Path, toml: str, message: str):
    with pytest.raises(ClearwayError, match=message):
        read(tmp_path, "t,x,y\n0,1,2\n1,1,2\n", toml)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,x,y\n0,1,2\n1,1,2\n0.5,1,2\n", "time goes backwards from 1.000000 s to 0.500000 s"),
        ("t,x,y\n0,1,2\n9999,1,2\n", "time leaps by 9999 s"),
        ("t,x,y\n0,1,2\n,1,2\n", "data line 2 has no time"),
        ("t,x,y\n0,1,2\n1,one,2\n", "column 'x'.*invalid value 'one'"),
        ("t,x,y\n0,1,2\n1,2\n", "3 columns"),
        ("t,x,y\n0,1,2\n0,1,2\n0,1,2\n0,1,2\n", "several bodies"),
        ("t,x,x,y\n0,1,1,2\n1,1,1,2\n", "several columns of the name 'x'"),
        ("", "is empty"),
        ("\0\0\0\0\0\0", "no text|no line"),
    ],
)
def test_what_is_wrong_in_a_table_is_said(tmp_path: Path, text: str, message: str):
    with pytest.raises(ClearwayError, match=message) as caught:
        read(tmp_path, text, ROBOT)
    assert caught.value.file == str(tmp_path / "a.csv")


def test_a_last_line_that_was_cut_off_is_left_out_and_told(tmp_path: Path):
    cut_off = "the last line has no end and lacks columns: taken as cut off and left out"
    read_ = read(tmp_path, "t,x,y\n0,1,2\n1,1,2\n2,1", ROBOT)
    assert (read_.tracks["robot"].t.tolist(), cut_off in read_.notes) == ([0, 1], True)
    for end in ("2,1,3", "2,1,3\n", "# the end"):
        whole = read(tmp_path, f"t,x,y\n0,1,2\n1,1,2\n{end}", ROBOT)
        assert (len(whole.tracks["robot"].t), cut_off in whole.notes) == (2 + end.startswith("2"), False)


def test_what_is_infinite_was_not_seen(tmp_path: Path):
    position = read(tmp_path, "t,x,y\n0,1,2\n1,inf,2\n2,1,2\n", ROBOT).tracks["robot"].position
    assert np.isnan(position[1]).all()
    assert np.isfinite(position[[0, 2]]).all()


def test_what_is_no_table_is_said(tmp_path: Path):
    file = tmp_path / "a.csv"
    file.write_text("a report\nof the day, in words\n")
    for act in (lambda: READ(file, Want()), lambda: table.look(file)):
        with pytest.raises(ClearwayError, match="is no table"):
            act()


def test_what_is_written_comes_back(tmp_path: Path):
    made = capture()
    cart = made.tracks["cart"]
    twist = np.column_stack((np.full(40, 1.5), np.full(40, 0.8)))
    for name in ("cart", 'odd "name", ü'):
        table.write(tmp_path / "t.csv", replace(made, tracks={name: replace(cart, twist=twist)}))
        recording = READ(tmp_path / "t.csv", Want())
        track = recording.tracks[name]
        assert recording.epoch == pytest.approx(made.epoch)
        np.testing.assert_allclose(track.t, cart.t, atol=3e-7)
        np.testing.assert_allclose(track.position, cart.position, atol=1e-9)
        np.testing.assert_allclose(track.orientation, cart.orientation, atol=2e-9)
        np.testing.assert_allclose(track.twist, twist)
    table.write(tmp_path / "p.csv", replace(made, tracks={}))
    points = READ(tmp_path / "p.csv", Want()).points
    assert points is not None
    assert made.points is not None
    assert points.names == made.points.names
    np.testing.assert_allclose(points.xyz, made.points.xyz, atol=1e-9)
    with pytest.raises(ClearwayError, match="neither a track nor markers"):
        table.write(tmp_path / "p.csv", replace(made, tracks={}, points=None))


TEXT = "t;who;x;y\n" + "".join(f"{k / 10:.1f};{'ab'[k % 2]};{k},5;-1\n" for k in range(12))
TOMLS = (
    "",
    ROBOT,
    'id = "who"\n[time]\ncolumn = "t"\n[bodies.each]\nx = "x"\ny = "y"\nyaw = "y"\n',
    'header = "none"\n[time]\ncolumn = "1"\nunit = "date"\n[bodies.robot]\nx = "3"\ny = "4"\n',
)


@settings(max_examples=80, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_the_file_holds_nothing_but_our_own_error_comes_out(tmp_path: Path, data: st.DataObject):
    description = tmp_path / "f.csv.toml"
    description.unlink(missing_ok=True)
    if toml := data.draw(st.sampled_from(TOMLS)):
        description.write_bytes(toml.encode() if data.draw(st.integers(0, 3)) else data.draw(damaged(toml.encode())))
    nothing_but_clearway_errors(table.FORMATS[0], tmp_path / "f.csv", data.draw(damaged(TEXT.encode())))


@pytest.mark.parametrize(
    ("x", "four"),
    [
        ("x", ("qx", "qy", "qz", "qw")),
        ("x [m]", ("qx", "qy", "qz", "qw")),
        ("tx", ("qx", "qy", "qz", "qw")),
        ("cart_x", ("cart_qx", "cart_qy", "cart_qz", "cart_qw")),
        ("pose.position.x", ("pose.orientation.x", "pose.orientation.y", "pose.orientation.z", "pose.orientation.w")),
        ("pos_x", ("quat_x", "quat_y", "quat_z", "quat_w")),
    ],
)
def test_a_quaternion_is_the_heading_by_its_columns_names(tmp_path: Path, x: str, four: tuple[str, ...]):
    y = x.replace("x", "y", 1) if x != "pose.position.x" else "pose.position.y"
    a, b, c, d = four
    # the columns stand as w, z, y, x: by name they are found all the same
    text = f"t,{x},{y},{d},{c},{b},{a}\n0,1,2,0.6,0.8,0,0\n1,2,2,0.8,0.6,0,0\n"
    recording = read(tmp_path, text, f'[time]\ncolumn = "t"\n[bodies.robot]\nx = "{x}"\ny = "{y}"\n')
    orientation = recording.tracks["robot"].orientation
    assert orientation is not None
    np.testing.assert_allclose(orientation, [[0, 0, 0.8, 0.6], [0, 0, 0.6, 0.8]])
    assert any(f"its heading is that of the columns {a}" in note for note in recording.notes)
    (tmp_path / "a.csv.toml").unlink()
    note = table.look(tmp_path / "a.csv").notes[0]
    assert f'x = "{x}"' in note  # and not the quaternion's own
    assert f'quaternion = ["{a}", "{b}", "{c}", "{d}"]' in note


def test_of_two_bodies_each_has_its_own_quaternion_or_none(tmp_path: Path):
    text = "t,a_x,a_y,a_qx,a_qy,a_qz,a_qw,b_x,b_y,qx,qy,qz,qw\n0,1,2,0,0,0.8,0.6,5,6,0,0,0,1\n1,2,2,0,0,0.6,0.8,6,6,0,0,0,1\n"
    toml = '[time]\ncolumn = "t"\n[bodies.a]\nx = "a_x"\ny = "a_y"\n[bodies.b]\nx = "b_x"\ny = "b_y"\n'
    tracks = read(tmp_path, text, toml).tracks
    assert tracks["a"].orientation is not None
    assert tracks["b"].orientation is None


def test_three_of_four_columns_are_no_quaternion(tmp_path: Path):
    track = read(tmp_path, "t,x,y,qx,qy,qz\n0,1,2,0,0,0\n1,2,2,0,0,0\n", ROBOT).tracks["robot"]
    assert track.orientation is None


def test_a_stated_uncertainty_is_kept_through_reading_and_writing(tmp_path: Path):
    toml = 'units = "mm"\n[time]\ncolumn = "t"\n[bodies.robot]\nx = "x"\ny = "y"\nyaw = "h"\nangle = "deg"\nsigma = "s"\nsigma_yaw = "sh"\n'
    recording = read(tmp_path, "t,x,y,h,s,sh\n0,1,2,0,50,2\n1,2,2,0,,\n", toml)
    sigma = recording.tracks["robot"].sigma
    assert sigma is not None
    np.testing.assert_allclose(sigma[0], [0.05, math.radians(2)])
    assert np.isnan(sigma[1]).all()
    table.write(tmp_path / "b.csv", recording)
    np.testing.assert_allclose(READ(tmp_path / "b.csv", Want()).tracks["robot"].sigma, sigma, atol=1e-9)
