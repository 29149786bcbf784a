"""A small capture as every text format would have it, and what a damaged file may do."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.recordings.formats.format import HEAD, Format
from clearway.recordings.recording import Points, Recording, Track, Want


def capture(n: int = 40, rate: float = 100.0, epoch: float | None = 1_700_000_000.25) -> Recording:
    """Three markers and two upright bodies that drive a curve; some are unseen now and then."""
    t = np.arange(n) / rate
    angle = 0.8 * t
    centre = np.column_stack((2.0 + 1.5 * t, -1.0 + 0.7 * np.sin(angle), np.full(n, 0.31)))
    corners = np.array([[0.2, 0.1, 0.0], [-0.2, 0.1, 0.05], [0.0, -0.15, 0.1]])
    c, s = np.cos(angle), np.sin(angle)
    turned = np.stack(
        (
            c[:, None] * corners[:, 0] - s[:, None] * corners[:, 1],
            s[:, None] * corners[:, 0] + c[:, None] * corners[:, 1],
            np.broadcast_to(corners[:, 2], (n, 3)),
        ),
        axis=-1,
    )
    xyz = centre[:, None] + turned
    xyz[5:9, 1] = np.nan
    orientation = np.column_stack((np.zeros((n, 2)), np.sin(angle / 2), np.cos(angle / 2)))
    position = centre.copy()
    position[10:12], orientation[10:12] = np.nan, np.nan
    tracks = {
        "cart": Track("body", "", "cart", t, position, orientation),
        "box": Track("body", "", "box", t, np.tile([3.0, 1.0, 0.2], (n, 1)), np.tile([0.0, 0.0, 0.6, 0.8], (n, 1))),
    }
    return Recording(Path("made"), "made", Points(("cart:a", "cart:b", "cart:c"), t, xyz), tracks, epoch=epoch)


def damaged(valid: bytes) -> st.SearchStrategy[bytes]:
    """Files made of a valid one by cutting, flipping, dropping, repeating and inserting; and arbitrary bytes."""
    size = len(valid)
    junk = st.sampled_from(
        [
            b"",
            b"\n",
            b"\r",
            b",",
            b";",
            b"\t",
            b"nan",
            b"inf",
            b"1e999",
            b"-",
            b'"',
            b"\0",
            b"\xff\xfe",
            b"1e400,",
            b" ",
        ]
    )

    @st.composite
    def build(draw: Callable[..., object]) -> bytes:
        data = bytearray(valid)
        for _ in range(draw(st.integers(1, 4))):
            i = draw(st.integers(0, max(0, len(data) - 1)))
            kind = draw(st.sampled_from(["cut", "flip", "insert", "drop", "repeat", "junk", "swap"]))
            lines = bytes(data).split(b"\n")
            k = draw(st.integers(0, max(0, len(lines) - 1)))
            if kind == "cut":
                del data[i:]
            elif kind == "flip" and data:
                data[i] = draw(st.integers(0, 255))
            elif kind == "insert":
                data[i:i] = draw(st.binary(max_size=6))
            elif kind == "junk":
                data[i:i] = draw(junk)
            elif kind == "drop":
                data = bytearray(b"\n".join(lines[:k] + lines[k + 1 :]))
            elif kind == "repeat":
                data = bytearray(b"\n".join([*lines[:k], lines[k], *lines[k:]]))
            else:
                other = draw(st.integers(0, len(lines) - 1))
                lines[k], lines[other] = lines[other], lines[k]
                data = bytearray(b"\n".join(lines))
        return bytes(data)

    return st.one_of(build(), st.binary(max_size=300), st.just(valid[: size // 2].decode().encode("utf-16")))


def nothing_but_clearway_errors(made: Format, file: Path, data: bytes) -> None:
    """Recognise, list and read a file that holds `data`."""
    file.write_bytes(data)
    assert made.sniff(file, data[:HEAD]) in (True, False)
    wants = (Want(), Want(span=(0.1, 0.2)))
    for act in (lambda: made.look(file), *(partial(made.read, file, want) for want in wants)):
        with suppress(ClearwayError):
            act()
