"""Maps come as PNG too."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN
from clearway.geometry.ros_map import read_map
from clearway.reading import read_png

PIXELS = np.array([[0, 254, 205], [254, 0, 254]], dtype=np.uint8)


@pytest.mark.parametrize("mode", ["L", "RGB", "RGBA", "P"])
def test_a_map_is_read_whatever_its_colours_are_kept_as(tmp_path: Path, mode: str) -> None:
    PIL.Image.fromarray(PIXELS).convert(mode).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text("image: m.png\nresolution: 0.05\norigin: [1, 2, 0]\n")
    grid = read_map(tmp_path / "m.yaml")
    assert grid.data.tolist() == [[FREE, OCCUPIED, FREE], [OCCUPIED, FREE, UNKNOWN]]
    assert grid.origin == (1.0, 2.0)


def test_sixteen_bits(tmp_path: Path) -> None:
    PIL.Image.fromarray(PIXELS.astype(np.uint16) * 257).save(tmp_path / "m.png")
    assert read_png(tmp_path / "m.png").top == 65535
    assert (read_png(tmp_path / "m.png").pixels // 257 == PIXELS).all()


def test_what_is_no_image_or_too_large_is_told(tmp_path: Path) -> None:
    file = tmp_path / "m.png"
    PIL.Image.fromarray(np.random.default_rng(0).integers(0, 256, (50, 50), dtype=np.uint8)).save(file)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ClearwayError, match="is damaged"):
        read_png(file)
    file.write_bytes(whole[:16] + struct.pack(">II", 100_000, 100_000) + whole[24:])
    with pytest.raises(ClearwayError, match="100000 x 100000 pixels; at most 16,000,000"):
        read_png(file)
    file.write_bytes(b"P5 1 1 255 x")
    with pytest.raises(ClearwayError, match="isn't a PNG"):
        read_png(file)
