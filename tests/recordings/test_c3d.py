"""C3D: what is written comes back, byte orders and number formats agree, and what is wrong is said."""

from __future__ import annotations

import struct
import tracemalloc
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from text_captures import capture

from clearway.errors import ClearwayError
from clearway.recordings.formats import c3d
from clearway.recordings.formats.c3d_parameters import (
    UP,
    Head,
    reals,
    text_parameter,
)
from clearway.recordings.formats.c3d_writer import write
from clearway.recordings.formats.format import HEAD
from clearway.recordings.recording import Points, Recording, Want


def recording(xyz: np.ndarray, names: tuple[str, ...] | None = None, rate: float = 100.0, first: int = 0) -> Recording:
    names = names or tuple(f"m{i}" for i in range(xyz.shape[1]))
    return Recording(Path("made"), "c3d", Points(names, (np.arange(len(xyz)) + first) / rate, xyz))


@pytest.mark.parametrize("up", sorted(UP))
@pytest.mark.parametrize("scale", [-0.1, 0.1])
@pytest.mark.parametrize("processor", ["intel", "dec", "mips"])
def test_what_is_written_comes_back(tmp_path: Path, processor: str, scale: float, up: str):
    made = capture()
    file = tmp_path / "a.c3d"
    write(file, made, processor=processor, scale=scale, up=up)
    if up.startswith("-"):
        (tmp_path / "a.c3d.toml").write_text(f'up = "{up}"')  # the sign in the file isn't believed
    points = c3d.read(file, Want()).points
    assert points is not None
    assert made.points is not None
    assert points.names == made.points.names
    np.testing.assert_allclose(points.t, made.points.t, atol=1e-9)
    # Half a unit of 0.1 mm, or float32's resolution of some metres in mm.
    np.testing.assert_allclose(points.xyz, made.points.xyz, atol=5.1e-5 if scale > 0 else 3e-7)
    assert c3d.sniff(file, file.read_bytes()[:HEAD])


def test_dec_numbers_are_vax_f_floating_point():
    # From the VAX architecture: 1.0 is 0x00004080 in memory order 80 40 00 00; sign and fraction as in IEEE.
    data = bytes([0x80, 0x40, 0, 0, 0x80, 0xC0, 0, 0, 0x20, 0x41, 0, 0, 0, 0, 0, 0])
    assert reals(data, "dec").tolist() == [1.0, -1.0, 2.5, 0.0]


def test_unseen_markers_are_nan_and_counted(tmp_path: Path):
    xyz = np.ones((10, 2, 3))
    xyz[3:6, 1] = np.nan
    write(tmp_path / "a.c3d", recording(xyz))
    points = c3d.read(tmp_path / "a.c3d", Want()).points
    assert points is not None
    assert np.array_equal(np.isnan(points.xyz), np.isnan(xyz))
    seen, gappy = c3d.look(tmp_path / "a.c3d").entries
    assert (seen.count, seen.missing, seen.longest_gap) == (10, 0.0, 0.0)
    assert gappy.count == 7
    assert gappy.missing == pytest.approx(0.3)
    assert gappy.longest_gap == pytest.approx(0.04)
    assert gappy.rate == pytest.approx(100)


def test_a_marker_at_the_origin_is_one_if_a_camera_saw_it(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.zeros((2, 1, 3))))
    read = c3d.read(file, Want()).points
    assert read is not None
    assert (read.xyz == 0).all()
    data = bytearray(file.read_bytes())
    start = (struct.unpack_from("<H", data, 16)[0] - 1) * 512
    data[start + 12 : start + 16] = struct.pack("<f", 0.0)  # no camera and no residual
    file.write_bytes(data)
    again = c3d.read(file, Want())
    assert again.points is not None
    assert np.isnan(again.points.xyz[0, 0]).all()
    assert any("0, 0, 0" in n for n in again.notes)


def test_more_frames_than_sixteen_bits_count(tmp_path: Path):
    n = 70_000
    xyz = np.zeros((n, 1, 3))
    xyz[:, 0, 0] = np.arange(n) / n
    write(tmp_path / "a.c3d", recording(xyz, rate=200.0))
    points = c3d.read(tmp_path / "a.c3d", Want(span=(349.99, 350.0))).points
    assert points is not None
    assert len(points.t) == 2
    assert points.xyz[-1, 0, 0] == pytest.approx((n - 1) / n, abs=1e-6)
    assert c3d.look(tmp_path / "a.c3d").entries[0].count == n


def test_only_what_is_wanted_is_read(tmp_path: Path):
    xyz = np.arange(60.0).reshape(10, 2, 3) / 100
    write(tmp_path / "a.c3d", recording(xyz, ("a", "b"), first=5))
    points = c3d.read(tmp_path / "a.c3d", Want(frozenset({"b"}), (0.07, 0.09))).points
    assert points is not None
    assert points.names == ("b",)
    np.testing.assert_allclose(points.t, [0.07, 0.08, 0.09])
    np.testing.assert_allclose(points.xyz[:, 0], xyz[2:5, 1], atol=1e-7)
    with pytest.raises(ClearwayError, match=r"unknown marker 'bb'; did you mean 'b'\?"):
        c3d.read(tmp_path / "a.c3d", Want(frozenset({"bb"})))


def test_frames_that_a_recording_lacks_are_written_as_unseen(tmp_path: Path):
    made = recording(np.ones((10, 1, 3)))
    assert made.points is not None
    keep = np.array([0, 1, 2, 6, 7, 8, 9])
    points = Points(made.points.names, made.points.t[keep], made.points.xyz[keep])
    write(tmp_path / "a.c3d", replace(made, points=points))
    read = c3d.read(tmp_path / "a.c3d", Want()).points
    assert read is not None
    assert np.flatnonzero(np.isnan(read.xyz[:, 0, 0])).tolist() == [3, 4, 5]


def test_three_hundred_markers_need_a_second_list_of_labels(tmp_path: Path):
    names = tuple(f"marker{i}" for i in range(300))
    write(tmp_path / "a.c3d", recording(np.ones((3, 300, 3)), names))
    assert tuple(e.name for e in c3d.look(tmp_path / "a.c3d").entries) == names


def test_points_of_one_name_get_different_ones(tmp_path: Path):
    write(tmp_path / "a.c3d", recording(np.ones((3, 3, 3)), ("a", "a", "")))
    assert [e.name for e in c3d.look(tmp_path / "a.c3d").entries] == ["a", "a (2)", "point 3"]


def test_what_nobody_labelled_is_read_by_name_only(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((3, 3, 3)), ("a", "*7", "U_8")))
    assert [(e.name, e.detail) for e in c3d.look(file).entries] == [
        ("a", ""),
        ("*7", "unlabelled"),
        ("U_8", "unlabelled"),
    ]
    every, one = c3d.read(file, Want()).points, c3d.read(file, Want(frozenset({"*7"}))).points
    assert every is not None
    assert one is not None
    assert (every.names, one.names) == (("a",), ("*7",))


def patched(file: Path, name: bytes, new: bytes) -> None:
    """Overwrite a parameter's name."""
    data = file.read_bytes()
    assert data.count(name) == 1
    file.write_bytes(data.replace(name, new))


def test_outputs_of_a_body_model_are_no_positions(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((3, 2, 3)), ("HEAD", "LKneeAngles")))
    # X_SCREEN has the same layout; the name of the list is all that matters.
    data = file.read_bytes()
    at = data.index(b"UNITS") - 2
    parameter = text_parameter(["LKneeAngles"])
    body = struct.pack("bB", -1, 2) + bytes(parameter.dims) + parameter.data + b"\0"
    extra = struct.pack("bb", 6, 1) + b"ANGLES" + struct.pack("<H", len(body) + 2) + body
    data = data[:at] + extra + data[at:]
    section = (struct.unpack_from("<H", data, 16)[0] - 1) * 512
    file.write_bytes(data[:section] + data[section + len(extra) :])
    contents = c3d.look(file)
    assert [e.name for e in contents.entries] == ["HEAD"]
    assert any("left out 1 points" in n for n in contents.notes)


def test_units_are_never_guessed(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((3, 1, 3))))
    patched(file, b"UNITS", b"UNITZ")
    with pytest.raises(ClearwayError, match=r"POINT:UNITS: is empty.*a\.c3d\.toml") as caught:
        c3d.read(file, Want())
    assert caught.value.field == "POINT:UNITS"
    contents = c3d.look(file)  # what is in it can be seen before anything is configured
    assert contents.entries[0].count == 3
    assert any("POINT:UNITS is empty" in n for n in contents.notes)
    (tmp_path / "a.c3d.toml").write_text('units = "mm"')
    read = c3d.read(file, Want()).points
    assert read is not None
    assert read.xyz[0, 0, 0] == pytest.approx(1.0)
    (tmp_path / "a.c3d.toml").write_text('unit = "mm"')
    with pytest.raises(ClearwayError, match="did you mean 'units'"):
        c3d.read(file, Want())


def test_an_unknown_unit_is_refused(tmp_path: Path):
    write(tmp_path / "a.c3d", recording(np.ones((3, 1, 3))), units="cm")
    assert c3d.look(tmp_path / "a.c3d").entries[0].count == 3
    patched(tmp_path / "a.c3d", b"cm", b"qm")
    with pytest.raises(ClearwayError, match="'qm' is no unit of length"):
        c3d.read(tmp_path / "a.c3d", Want())


def test_a_minus_on_the_screen_does_not_turn_the_lab_upside_down(tmp_path: Path):
    # Qualisys writes Y_SCREEN = -Z for captures whose z grows upwards.
    file = tmp_path / "a.c3d"
    write(file, recording(np.tile([1.0, 2.0, 3.0], (3, 1, 1))))
    data = file.read_bytes()
    at = data.index(b"Y_SCREEN")
    file.write_bytes(data[:at] + data[at:].replace(b"+Z", b"-Z", 1))
    read = c3d.read(file, Want())
    assert read.points is not None
    np.testing.assert_allclose(read.points.xyz[0, 0], [1, 2, 3], atol=1e-6)
    assert any("-Z" in n for n in read.notes)


def test_no_up_axis_is_taken_as_z_and_said(tmp_path: Path):
    write(tmp_path / "a.c3d", recording(np.ones((3, 1, 3))))
    patched(tmp_path / "a.c3d", b"Y_SCREEN", b"Y_SCREEM")
    assert any("which axis is up" in n for n in c3d.look(tmp_path / "a.c3d").notes)


@pytest.mark.parametrize("share", [0.0005, 0.01, 0.2, 0.5, 0.9])
def test_a_truncated_file_is_refused(tmp_path: Path, share: float):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((2000, 3, 3))))
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    for act in (lambda: c3d.read(file, Want()), lambda: c3d.look(file)):
        with pytest.raises(ClearwayError, match=r"truncated|no C3D|is empty|header") as caught:
            act()
        assert caught.value.file == str(file)


def test_absurd_counts_are_refused_before_anything_is_allocated(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((3, 1, 3))))
    data = bytearray(file.read_bytes())
    struct.pack_into("<4H", data, 2, 65535, 0, 1, 65535)
    for name, value in ((b"USED", 65535), (b"FRAMES", 65534)):
        at = data.index(name) + len(name)
        struct.pack_into("<H", data, at + 4, value)
    file.write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(ClearwayError, match=r"promises 65534 frames of \d+ bytes"):
            c3d.read(file, Want())
        assert tracemalloc.get_traced_memory()[1] < 20e6  # one name a promised point at most
    finally:
        tracemalloc.stop()


def test_counts_that_contradict_each_other(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((40, 2, 3))))
    data = bytearray(file.read_bytes())
    at = data.index(b"FRAMES") + 6
    struct.pack_into("<H", data, at + 4, 1000)  # more than the file can hold; the header's 40 fit to the block
    file.write_bytes(data)
    contents = c3d.look(file)
    assert contents.entries[0].count == 40
    assert any("counts of frames differ" in n for n in contents.notes)


def test_an_unknown_processor_is_refused(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, recording(np.ones((3, 1, 3))))
    data = bytearray(file.read_bytes())
    data[512 + 3] = 90
    file.write_bytes(data)
    with pytest.raises(ClearwayError, match="processor type 90"):
        c3d.read(file, Want())


def test_what_cannot_be_written_is_refused(tmp_path: Path):
    made = recording(np.ones((5, 1, 3)))
    assert made.points is not None
    uneven = Points(made.points.names, np.array([0.0, 0.01, 0.024, 0.03, 0.04]), made.points.xyz)
    with pytest.raises(ClearwayError, match="frames at one rate"):
        write(tmp_path / "a.c3d", replace(made, points=uneven))
    with pytest.raises(ClearwayError, match="no markers"):
        write(tmp_path / "a.c3d", replace(made, points=None))
    with pytest.raises(ClearwayError, match="16 bits"):
        write(tmp_path / "a.c3d", made, scale=0.01)
    with pytest.raises(ClearwayError, match="cannot be written"):
        write(tmp_path / "a.c3d" / "b.c3d", made)


def test_no_such_file(tmp_path: Path):
    with pytest.raises(ClearwayError, match="no such file"):
        c3d.read(tmp_path / "none.c3d", Want())


def test_a_head_gives_nothing_for_what_is_not_there():
    head = Head("intel", 0, 0, 1, 1, -1.0, 2, 100.0)
    assert head.texts("POINT:LABELS") == ()
    assert head.number("POINT:RATE") is None


@st.composite
def damaged(draw: st.DrawFn, valid: bytes) -> bytes:
    data = bytearray(valid)
    for _ in range(draw(st.integers(1, 6))):
        # The header and the parameters are what can mislead; two thirds of all damage is there.
        at = draw(
            st.integers(0, min(len(data), 1600) - 1) if draw(st.integers(0, 2)) else st.integers(0, len(data) - 1)
        )
        kind = draw(st.sampled_from(("flip", "word", "cut", "insert", "delete")))
        if kind == "flip":
            data[at] = draw(st.integers(0, 255))
        elif kind == "word":
            data[at : at + 2] = draw(st.sampled_from((b"\xff\xff", b"\0\0", b"\xff\x7f", b"\0\x80", b"\xc0\x7f")))
        elif kind == "cut":
            del data[max(at, 1) :]
        elif kind == "insert":
            data[at:at] = draw(st.binary(max_size=8))
        elif len(data) > 20:
            del data[at : at + draw(st.integers(1, 8))]
    return bytes(data)


def valid(folder: Path) -> list[bytes]:
    out = []
    for processor, scale in (("intel", -0.1), ("dec", 0.1), ("mips", -0.1)):
        write(folder / "v.c3d", capture(n=12), processor=processor, scale=scale)
        out.append((folder / "v.c3d").read_bytes())
    return out


@settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_whatever_the_file_holds_nothing_but_our_own_error_comes_out(tmp_path: Path, data: st.DataObject):
    files = valid(tmp_path)
    content = data.draw(st.one_of(st.binary(max_size=2000), *(damaged(f) for f in files)))
    file = tmp_path / "f.c3d"
    file.write_bytes(content)
    assert c3d.sniff(file, content[:HEAD]) in (True, False)
    for act in (
        lambda: c3d.look(file),
        lambda: c3d.read(file, Want(span=(0.02, 0.05))),
        lambda: c3d.read(file, Want()),
    ):
        with suppress(ClearwayError):
            act()
