"""C3D whose header and parameters disagree: the size of the file decides, what was taken is said, and what nobody can tell is refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from text_captures import capture

from clearway.errors import ClearwayError
from clearway.recordings.formats import c3d
from clearway.recordings.formats.c3d_parameters import integers, parameter_section, real
from clearway.recordings.formats.c3d_writer import write
from clearway.recordings.recording import Recording, Want


def contradicting(file: Path, made: Recording, *, header: int = 24, used: int = 6, rate: float = 400.0) -> None:
    """`made` at 100 Hz with six analog channels at 400 Hz, and what header and parameters say of these."""
    write(file, made)
    assert made.points is not None
    frames, points = made.points.xyz.shape[:2]
    plain = file.read_bytes()
    start = (struct.unpack_from("<H", plain, 16)[0] - 1) * 512
    stride = 16 * points
    analog = np.random.default_rng(0).normal(size=(frames, 24)).astype("<f4")
    body = b"".join(plain[start + i * stride :][:stride] + analog[i].tobytes() for i in range(frames))
    head = bytearray(plain[:start])
    at = head.rindex(b"USED") - 2
    section = parameter_section(
        {"X": {"USED": integers([used], "intel"), "RATE": real(rate, "intel")}}, "intel"
    )  # group and parameters as they stand in a file
    begin = section.index(b"USED") - 2
    values = bytearray(section[begin : section.index(b"RATE") + 4 + 2 + 2 + 4 + 1])
    for name in (b"USED", b"RATE"):
        values[values.index(name) - 1] = head[at + 1]  # the number of the group ANALOG
    head[at : at + len(values)] = values
    struct.pack_into("<H", head, 4, header)
    data = bytes(head[:start]) + body
    file.write_bytes(data + b"\0" * (-len(data) % 512))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({}, ""),
        ({"header": 0}, "analog values a frame: 0 by its header, 24 by its parameters; 24 was taken"),
        ({"header": 60}, "60 by its header, 24 by its parameters; 24 was taken"),
        ({"used": 0}, "24 by its header, 0 by its parameters; 24 was taken"),
        ({"used": 8}, "24 by its header, 32 by its parameters; 24 was taken"),
        ({"rate": 1000.0}, "24 by its header, 60 by its parameters; 24 was taken"),
    ],
)
def test_where_header_and_parameters_disagree_the_size_of_the_file_decides(
    tmp_path: Path, wrong: dict[str, float], said: str
):
    made = capture(n=300)
    contradicting(tmp_path / "a.c3d", made, **wrong)  # type: ignore[arg-type]
    read = c3d.read(tmp_path / "a.c3d", Want())
    assert read.points is not None
    assert made.points is not None
    np.testing.assert_allclose(read.points.xyz, made.points.xyz, atol=3e-7)
    told = [n for n in read.notes if "by its header" in n]
    assert len(told) == bool(said)
    assert said in "".join(told)


def test_where_the_size_of_the_file_does_not_decide_either_it_is_refused(tmp_path: Path):
    file = tmp_path / "a.c3d"
    contradicting(file, capture(n=300), header=60, used=8)
    with pytest.raises(ClearwayError, match="analog values a frame: 60, by its parameters 32"):
        c3d.read(file, Want())
    contradicting(file, capture(n=300), header=0)
    file.write_bytes(file.read_bytes()[:-2000])
    with pytest.raises(ClearwayError, match="truncated"):
        c3d.look(file)


@pytest.mark.parametrize("header", [0, 20, 24, 60])
@pytest.mark.parametrize("lacking", ["ANALOG:RATE", "ANALOG:USED"])
def test_parameters_that_do_not_say_how_many_values_a_frame_has(tmp_path: Path, header: int, lacking: str):
    made = capture(n=300)
    file = tmp_path / "a.c3d"
    if lacking == "ANALOG:RATE":  # as many channels as values then
        contradicting(file, made, header=header, used=24, rate=0.0)
    else:  # nothing says that there are any: there are none
        write(file, made)
        data = bytearray(file.read_bytes().replace(b"ANALOG", b"ANALOX"))
        struct.pack_into("<H", data, 4, header)
        file.write_bytes(data)
    read = c3d.read(file, Want())
    assert read.points is not None
    assert made.points is not None
    np.testing.assert_allclose(read.points.xyz, made.points.xyz, atol=3e-7)


def test_points_and_the_begin_of_the_data_are_told_by_the_size_too(tmp_path: Path):
    file, made = tmp_path / "a.c3d", capture(n=300)
    assert made.points is not None
    write(file, made)
    good = file.read_bytes()
    for at, value in ((2, 1), (16, 2)):  # points a frame, the block of the data
        data = bytearray(good)
        struct.pack_into("<H", data, at, value)
        file.write_bytes(data)
        read = c3d.read(file, Want())
        assert read.points is not None
        np.testing.assert_allclose(read.points.xyz, made.points.xyz, atol=3e-7)
        assert any(f"{value} by its header" in n for n in read.notes)


def test_a_rate_that_the_header_has_otherwise_is_said(tmp_path: Path):
    file = tmp_path / "a.c3d"
    write(file, capture(n=10))
    data = bytearray(file.read_bytes())
    struct.pack_into("<f", data, 20, 120.0)
    file.write_bytes(data)
    read = c3d.read(file, Want())
    assert "POINT:RATE says 100 Hz, the header 120; the parameter was taken" in read.notes
