"""PGM images within bounds: the header is read by hand, and says how much there is before it is."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError
from clearway.reading.bounded import opened, take
from clearway.reading.limits import CELLS, PGM_HEADER, PLAIN_CELL

_BLANKS = b" \t\n\v\f\r"
_DIGITS = b"0123456789"


class Image(NamedTuple):
    """A grey image.

    Attributes:
        pixels: (rows, cols) uint8 or uint16; first row on top.
        top: Value of a white pixel.
    """

    pixels: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    top: int


def read_pgm(path: str | Path) -> Image:
    """A PGM image, plain (P2) or raw (P5).

    Raises:
        ClearwayError: It isn't a PGM, is cut short, or has more pixels than a grid may have cells.
    """
    path = Path(path)
    with opened(path) as file:
        head = take(file, PGM_HEADER)
        if head[:2] not in (b"P2", b"P5"):
            raise ClearwayError("isn't a PGM image (P2 or P5)", file=path)
        cols, at = _number(head, 2, path)
        rows, at = _number(head, at, path)
        top, at = _number(head, at, path)
        if not (cols and rows and 0 < top < 65536):
            raise ClearwayError(f"size {cols} x {rows} or maximum {top} is wrong", file=path)
        if rows * cols > CELLS:
            raise ClearwayError(f"has {cols} x {rows} pixels; at most {CELLS:,} are read", file=path)
        plain = head[:2] == b"P2"
        file.seek(at)
        values = _plain(file, rows * cols, path) if plain else _raw(file, head, at, rows * cols, top)
    if values.size < rows * cols:
        raise ClearwayError(f"is cut short: {values.size} of {rows * cols} pixels", file=path)
    if values.max() > top:
        raise ClearwayError(f"a pixel is {values.max()}, above the maximum {top}", file=path)
    return Image(values.reshape(rows, cols), top)


def _number(head: bytes, at: int, path: Path) -> tuple[int, int]:
    """The number of the header behind blanks and comments from `at` on, and where it ends."""
    begin = at
    while at < len(head) and (head[at] in _BLANKS or head[at] == 0x23):  # a comment begins with #
        end = head.find(b"\n", at)
        at = at + 1 if head[at] in _BLANKS else len(head) if end < 0 else end
    end = at
    while end < len(head) and head[end] in _DIGITS and end - at <= 9:
        end += 1
    if at == begin or not 0 < end - at <= 9:
        raise ClearwayError("isn't a PGM image (P2 or P5): its size and maximum can't be read", file=path)
    return int(head[at:end]), end


def _raw(file: BinaryIO, head: bytes, at: int, count: int, top: int) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint16]:
    """The pixels behind the white space, or the comment and the line's end, that ends the header at `at`."""
    start = at
    while start < len(head) and head[start] in b" \t":
        start += 1
    if head[start : start + 1] == b"#":
        end = head.find(b"\n", start)
        start = len(head) if end < 0 else end
    else:
        start = at
    file.seek(start + 1)
    size = 2 if top > 255 else 1
    body = take(file, count * size)
    if size == 1:
        return np.frombuffer(body, dtype=np.uint8)
    return np.frombuffer(body[: len(body) // 2 * 2], dtype=">u2").astype(np.uint16)


def _plain(file: BinaryIO, count: int, path: Path) -> npt.NDArray[np.uint16]:
    """The numbers that are written out, without comments."""
    most = PLAIN_CELL * count + PGM_HEADER
    body = take(file, most + 1)
    if len(body) > most:
        raise ClearwayError(f"takes more than {PLAIN_CELL} bytes for a pixel", file=path)
    if b"#" in body:
        body = b"\n".join(line.split(b"#", 1)[0] for line in body.split(b"\n"))
    text = np.frombuffer(b" " + body + b" ", dtype=np.uint8)
    digit = (text >= 0x30) & (text <= 0x39)
    if not (digit | np.isin(text, np.frombuffer(_BLANKS, dtype=np.uint8))).all():
        raise ClearwayError("holds something that isn't a number", file=path)
    first = np.flatnonzero(digit[1:] & ~digit[:-1])[:count].astype(np.int32) + 1
    last = np.flatnonzero(digit[:-1] & ~digit[1:])[:count].astype(np.int32)
    length = last - first + 1
    if length.size and length.max() > 5:
        raise ClearwayError("a pixel has more than five digits", file=path)
    values = np.zeros(len(last), dtype=np.int32)
    for k in range(int(length.max(initial=0))):
        here = length > k
        values[here] += (text[last[here] - k].astype(np.int32) - 0x30) * 10**k
    if values.size and values.max() > 65535:
        raise ClearwayError("a pixel is above 65535", file=path)
    return values.astype(np.uint16)
