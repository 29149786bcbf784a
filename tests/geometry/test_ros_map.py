"""ROS maps: what is written is read again, and a damaged file says what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.geometry.ros_map import about_map, read_map, write_map
from clearway.reading import read_pgm

YAML = (
    "image: m.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)

cells = hnp.arrays(
    np.int8, st.tuples(st.integers(1, 12), st.integers(1, 9)), elements=st.sampled_from([FREE, OCCUPIED, UNKNOWN])
)
metres = st.floats(-1e4, 1e4)


@given(cells, st.floats(0.001, 10.0), st.tuples(metres, metres))
@settings(max_examples=60)
def test_round_trip(
    tmp_path_factory: pytest.TempPathFactory, data: np.ndarray, resolution: float, origin: tuple[float, float]
) -> None:
    path = tmp_path_factory.mktemp("map") / "m.yaml"
    write_map(path, OccupancyGrid(data, resolution, origin))
    back = read_map(path)
    assert (back.data == data).all()
    assert back.data.dtype == np.int8
    assert (back.resolution, back.origin) == (resolution, origin)


def write(folder: Path, pgm: bytes, yaml: str = YAML) -> Path:
    (folder / "m.pgm").write_bytes(pgm)
    (folder / "m.yaml").write_text(yaml)
    return folder / "m.yaml"


def test_the_image_s_last_row_is_the_map_s_lowest(tmp_path: Path) -> None:
    grid = read_map(write(tmp_path, b"P5\n2 2\n255\n" + bytes([0, 254, 205, 254])))
    assert grid.data.tolist() == [[UNKNOWN, FREE], [OCCUPIED, FREE]]
    assert grid.origin == (-1.0, 2.0)


def test_plain_pgm_with_comments_and_another_maximum(tmp_path: Path) -> None:
    grid = read_map(write(tmp_path, b"P2 # plain\n# made by hand\n3 1\n# the top\n100\n0 99 # free\n 70\n"))
    assert grid.data.tolist() == [[OCCUPIED, FREE, UNKNOWN]]


def test_raw_pgm_with_a_comment_and_16_bits(tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_bytes(b"P5\n# CREATOR: map_saver\n2 1\n65535\n" + bytes([0, 0, 0xFF, 0xFF]))
    image = read_pgm(tmp_path / "m.pgm")
    assert (image.pixels.tolist(), image.top) == ([[0, 65535]], 65535)


def test_negate_and_thresholds(tmp_path: Path) -> None:
    path = write(tmp_path, b"P5\n3 1\n255\n" + bytes([255, 0, 100]), YAML.replace("negate: 0", "negate: 1"))
    assert read_map(path).data.tolist() == [[OCCUPIED, FREE, UNKNOWN]]


@pytest.mark.parametrize(("threshold", "unknown", "told"), [("0.196", 25, False), ("0.25", 0, True)])
def test_what_a_map_is_for_people(tmp_path: Path, threshold: str, unknown: int, told: bool) -> None:
    """Nav2 saves what is unknown as 205 and 0.25 as the threshold, by which it is free again: as it reads it, so do we, but say it."""
    path = write(tmp_path, b"P5\n4 1\n255\n" + bytes([254, 205, 0, 254]), YAML.replace("0.196", threshold))
    first, *more = about_map(path)
    assert (
        first
        == f"x -1 to -0.8 m, y 2 to 2.05 m, cells of 0.05 m: {75 - unknown} % free, 25 % occupied, {unknown} % unknown"
    )
    assert ["grey of 205" in line for line in more] == [True] * told


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("image: m.pgm", "image: other.pgm", r"m\.yaml: image: 'other\.pgm' does not exist"),
        ("image: m.pgm\n", "", r"image: is missing"),
        ("0.05", "-0.05", r"resolution: -0\.05 must be greater than 0"),
        ("0.05", "fine", r"resolution: 'fine' must be a number"),
        ("[-1.0, 2.0, 0.0]", "[-1.0, 2.0]", r"origin: \[-1\.0, 2\.0\] must be \[x, y, yaw\]"),
        ("[-1.0, 2.0, 0.0]", "[-1.0, .nan, 0.0]", r"origin: nan must be a number"),
        ("[-1.0, 2.0, 0.0]", "[-1.0, 2.0, 0.3]", r"rotated map \(yaw 0\.3\).* with yaw 0 .* by -0\.3 rad"),
        ("0.196", "0.9", r"free_thresh 0\.9 and occupied_thresh 0\.65"),
        ("negate: 0", "negate: 0\nmode: scale", r"mode: 'scale' isn't supported; .* unknown with 'trinary'"),
        ("negate: 0", "negate: 0\nmode: raw", r"mode: 'raw' isn't supported; save it as 'trinary'"),
        ("image: m.pgm", "image: [m.pgm", r"not a YAML file"),
        (YAML, "just a word", r"isn't a ROS map's yaml"),
    ],
)
def test_bad_yaml(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(ClearwayError, match=message):
        read_map(write(tmp_path, b"P5\n1 1\n255\n\x00", YAML.replace(old, new)))


@pytest.mark.parametrize(
    ("pgm", "message"),
    [
        (b"P6\n1 1\n255\n\0\0\0", r"m\.pgm: isn't a PGM"),
        (b"", "isn't a PGM"),
        (b"P5\n2 2\n255\n\0\0\0", "cut short: 3 of 4 pixels"),
        (b"P5\n2 1\n65535\n\0\0\0", "cut short: 1 of 2 pixels"),
        (b"P2\n2 1\n255\n12 x\n", "isn't a number"),
        (b"P2\n1 1\n100\n200\n", "a pixel is 200, above the maximum 100"),
        (b"P5\n0 3\n255\n", "size 0 x 3"),
    ],
)
def test_bad_pgm(tmp_path: Path, pgm: bytes, message: str) -> None:
    with pytest.raises(ClearwayError, match=message):
        read_map(write(tmp_path, pgm))


def test_missing_yaml(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="no such file"):
        read_map(tmp_path / "none.yaml")
