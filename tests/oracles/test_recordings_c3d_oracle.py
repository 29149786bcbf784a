"""C3D against ezc3d (C++) and c3d (pure Python): what they write, we read alike; what we write, they read alike."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import numpy as np
import pytest

from clearway.recordings.formats import c3d as ours
from clearway.recordings.formats.c3d_writer import write
from clearway.recordings.recording import Points, Recording, Want

ezc3d = pytest.importorskip("ezc3d")
c3d = pytest.importorskip("c3d")

NAMES = ("robot:front", "robot:left", "robot:back", "box 1")


def points(n: int = 50) -> Points:
    rng = np.random.default_rng(5)
    xyz = rng.uniform(-3, 3, (n, len(NAMES), 3))
    xyz[7:11, 2] = np.nan
    xyz[0, 0] = np.nan
    return Points(NAMES, np.arange(n) / 200.0, xyz)


def theirs_by_ezc3d(file: Path) -> tuple[list[str], float, np.ndarray]:
    """Labels, rate, (n, m, 3) in the file's unit, NaN where unseen."""
    read = ezc3d.c3d(str(file))
    point = read["parameters"]["POINT"]
    return point["LABELS"]["value"], point["RATE"]["value"][0], read["data"]["points"][:3].transpose(2, 1, 0)


def theirs_by_c3d(file: Path) -> tuple[list[str], float, np.ndarray]:
    with open(file, "rb") as handle, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = c3d.Reader(handle)
        frames = np.array([p for _, p, _ in reader.read_frames(copy=True)], dtype=np.float64)
    xyz = frames[..., :3]
    xyz[frames[..., 3] < 0] = np.nan
    return [label.strip() for label in reader.point_labels], reader.point_rate, xyz


@pytest.mark.parametrize("scale", [-0.1, 0.1])
@pytest.mark.parametrize("processor", ["intel", "dec", "mips"])
def test_they_read_what_we_write(tmp_path: Path, processor: str, scale: float):
    file = tmp_path / "a.c3d"
    made = points()
    write(file, Recording(file, "c3d", made), processor=processor, scale=scale)
    readers = [theirs_by_c3d] if processor == "mips" else [theirs_by_c3d, theirs_by_ezc3d]  # ezc3d knows no MIPS
    for reader in readers:
        labels, rate, xyz = reader(file)
        assert tuple(labels) == NAMES
        assert rate == pytest.approx(200.0)
        np.testing.assert_allclose(xyz / 1000, made.xyz, atol=5.1e-5 if scale > 0 else 3e-7)


def test_they_read_our_file_of_more_frames_than_sixteen_bits_count(tmp_path: Path):
    n = 66_000
    xyz = np.zeros((n, 1, 3))
    xyz[:, 0, 0] = np.arange(n) * 1e-5
    file = tmp_path / "long.c3d"
    write(file, Recording(file, "c3d", Points(("m",), np.arange(n) / 100, xyz)))
    for reader, surplus in (
        (theirs_by_c3d, 0),
        (theirs_by_ezc3d, 32),
    ):  # ezc3d takes the last block's padding for frames
        read = reader(file)[2]
        assert n <= len(read) <= n + surplus
        np.testing.assert_allclose(read[:n] / 1000, xyz, atol=1e-7)


def with_channels(file: Path, made: Points) -> None:
    """By ezc3d: markers at 200 Hz beside three analog channels at 1,000 Hz."""
    data = np.ones((4, len(NAMES), len(made.t)))
    data[:3] = made.xyz.transpose(2, 1, 0) * 1000
    out = ezc3d.c3d()
    out["parameters"]["POINT"]["RATE"]["value"] = [200.0]
    out["parameters"]["POINT"]["LABELS"]["value"] = list(NAMES)
    out["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    out["data"]["points"] = data
    out["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
    out["parameters"]["ANALOG"]["LABELS"]["value"] = ["Fx", "Fy", "Fz"]
    out["data"]["analogs"] = np.random.default_rng(1).normal(size=(1, 3, 5 * len(made.t)))
    out.write(str(file))


def test_we_read_what_ezc3d_writes_analog_channels_and_all(tmp_path: Path):
    made = points()
    with_channels(tmp_path / "a.c3d", made)
    read = ours.read(tmp_path / "a.c3d", Want())
    assert read.points is not None
    assert read.points.names == NAMES
    np.testing.assert_allclose(np.diff(read.points.t), 1 / 200, atol=1e-9)
    np.testing.assert_allclose(read.points.xyz, made.xyz, atol=3e-7)


@pytest.mark.parametrize(
    ("at", "value"), [("header", 12), ("header", 0), ("USED", 4), ("RATE", 200.0), ("RATE", 2000.0)]
)
def test_a_count_that_contradicts_the_other_changes_nothing(tmp_path: Path, at: str, value: float):
    # ezc3d believes the parameters, whatever the header says: of a wrong header its answer is the oracle.
    made = points(500)
    file = tmp_path / "a.c3d"
    with_channels(file, made)
    data = bytearray(file.read_bytes())
    if at == "header":
        struct.pack_into("<H", data, 4, int(value))
    else:
        group = data.index(b"ANALOG")
        place = data.index(at.encode(), group) + len(at) + 4
        struct.pack_into("<H" if at == "USED" else "<f", data, place, value if at == "RATE" else int(value))
    file.write_bytes(data)
    read = ours.read(file, Want())
    assert read.points is not None
    np.testing.assert_allclose(read.points.xyz, made.xyz, atol=3e-7)
    assert any("by the file's size" in note for note in read.notes)
    if at == "header":
        np.testing.assert_allclose(read.points.xyz, theirs_by_ezc3d(file)[2] / 1000, atol=1e-9)


def test_we_refuse_what_ezc3d_writes_without_a_unit(tmp_path: Path):
    from clearway.errors import ClearwayError

    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["m"]
    file["data"]["points"] = np.ones((4, 1, 3))
    file["parameters"]["POINT"]["UNITS"]["value"] = []
    file.write(str(tmp_path / "a.c3d"))
    with pytest.raises(ClearwayError, match=r"POINT:UNITS"):
        ours.read(tmp_path / "a.c3d", Want())


@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_we_read_what_c3d_writes_analog_channels_and_all(tmp_path: Path, scale: float):
    made = points()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        writer = c3d.Writer(point_rate=200.0, analog_rate=400.0, point_scale=scale, point_units="mm")
        writer.set_point_labels(list(NAMES))
        writer.set_analog_labels(["Fx", "Fy"])
        writer.set_screen_axis("+X", "+Z")
        analog = np.arange(4.0).reshape(2, 2)
        for frame in made.xyz:
            rows = np.zeros((len(NAMES), 5))
            rows[:, :3] = np.nan_to_num(frame) * 1000
            rows[np.isnan(frame[:, 0]), 3:] = -1
            writer.add_frames([(rows, analog)])
        with open(tmp_path / "a.c3d", "wb") as handle:
            writer.write(handle)
    read = ours.read(tmp_path / "a.c3d", Want())
    again = theirs_by_c3d(tmp_path / "a.c3d")[2]
    assert read.points is not None
    assert read.points.names == NAMES
    np.testing.assert_allclose(read.points.xyz, again / 1000, atol=1e-6)
    np.testing.assert_allclose(read.points.xyz, made.xyz, atol=1.1e-4 if scale > 0 else 3e-7)  # it truncates integers
