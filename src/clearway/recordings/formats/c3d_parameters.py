"""The first half of a C3D file: the header block and the parameter section, in the byte order of any of its processors.

Layout after the C3D user guide (c3d.org): blocks of 512 bytes; block 1 is the header; parameters stand in groups;
counts are 16-bit words, dimensions bytes, and real numbers those of the processor that the file names: Intel's,
DEC's (VAX F floating point) or SGI/MIPS's (big-endian).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.axes import TURNS

BLOCK = 512
KEY = 0x50
PROCESSORS = {84: "intel", 85: "dec", 86: "mips"}


UP = {f"{axis:+>2}".upper(): turn for axis, turn in TURNS.items()}
"""Proper rotations that take the axis that is up in the file to z."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter: `value` is a text, a list of texts, or a float array (k,) with the first dimension fastest.

    Attributes:
        kind: Type of an element, as the file has it: -1 text, else its bytes.
        dims: Length of each dimension, the fastest first.
        data: The elements' bytes.
    """

    kind: int
    dims: tuple[int, ...]
    data: bytes


@dataclass(frozen=True, slots=True)
class Head:
    """What stands before the data of a C3D file.

    Attributes:
        processor: `intel`, `dec` or `mips`.
        points: Number of points in a frame.
        analog: Number of analog values in a frame: channels times samples.
        first: Number of the first frame, as the 16-bit header has it.
        last: Number of the last frame, as the 16-bit header has it.
        scale: What an integer in the data is worth, in the file's unit of length; negative: the data are real numbers.
        data_block: Block in which the data begin, counted from 1.
        rate: Frames in a second, Hz.
        samples: Samples of an analog channel in a frame.
        parameters: The parameters by `GROUP:NAME`.
    """

    processor: str
    points: int
    analog: int
    first: int
    last: int
    scale: float
    data_block: int
    rate: float
    samples: int = 0
    parameters: Mapping[str, Parameter] = field(default_factory=dict)

    def texts(self, name: str) -> tuple[str, ...]:
        """The texts of parameter `name`, trailing blanks removed; none if it isn't there or is no text."""
        parameter = self.parameters.get(name)
        if parameter is None or parameter.kind != -1 or not parameter.data:
            return ()
        length = parameter.dims[0] if parameter.dims else 1
        if length == 0:
            return ()
        cut = [parameter.data[i : i + length] for i in range(0, len(parameter.data) - length + 1, length)]
        return tuple(_text(c) for c in cut)

    def numbers(self, name: str) -> FloatArray:
        """The numbers (k,) of parameter `name`, words as unsigned; none if it isn't there or is a text."""
        parameter = self.parameters.get(name)
        if parameter is None or parameter.kind == -1:
            return np.zeros(0)
        if parameter.kind == 1:
            return np.frombuffer(parameter.data, np.uint8).astype(np.float64)
        if parameter.kind == 2:
            return np.asarray(words(parameter.data, self.processor).view(_word(self.processor, "u")), dtype=np.float64)
        return np.asarray(reals(parameter.data, self.processor), dtype=np.float64)

    def number(self, name: str) -> float | None:
        """The first number of parameter `name`, None if there is none."""
        found = self.numbers(name)
        return float(found[0]) if len(found) else None


def words(data: bytes, processor: str) -> Any:
    """int16 (k,) of the bytes."""
    return np.frombuffer(data, _word(processor, "i"), count=len(data) // 2)


def reals(data: bytes, processor: str) -> Any:
    """float32 (k,) of the bytes.

    A VAX F number is an IEEE one with its two halves exchanged and an exponent that is larger by two.
    """
    if processor == "mips":
        return np.frombuffer(data, ">f4", count=len(data) // 4)
    if processor == "intel":
        return np.frombuffer(data, "<f4", count=len(data) // 4)
    halves = np.frombuffer(data, "<u2", count=len(data) // 4 * 2).reshape(-1, 2)
    with np.errstate(all="ignore"):
        return np.ascontiguousarray(halves[:, ::-1]).view("<f4")[:, 0] / np.float32(4)


def word_bytes(values: Any, processor: str) -> bytes:
    """Integers as 16-bit words; the inverse of `words`."""
    return bytes(np.asarray(values).astype(np.int64).astype("u2").astype(_word(processor, "u")).tobytes())


def real_bytes(values: Any, processor: str) -> bytes:
    """Numbers as the processor's 32-bit real numbers; the inverse of `reals`."""
    data = np.asarray(values, dtype=np.float32)
    if processor == "mips":
        return data.astype(">f4").tobytes()
    if processor == "intel":
        return data.astype("<f4").tobytes()
    halves = np.atleast_1d(data * np.float32(4)).astype("<f4").reshape(-1).view("<u2").reshape(-1, 2)
    return np.ascontiguousarray(halves[:, ::-1]).tobytes()


def read_head(source: BinaryIO, size: int, file: object) -> Head:
    """The header and the parameters of a C3D file of `size` bytes.

    Raises:
        ClearwayError: it is none, its processor is unknown, or it ends too early.
    """
    header = source.read(BLOCK)
    if len(header) < BLOCK or header[1] != KEY:
        raise ClearwayError("is no C3D file: it doesn't begin with a C3D header block of 512 bytes", file=file)
    start = (header[0] - 1) * BLOCK
    if header[0] < 2 or start + 4 > size:
        raise ClearwayError(
            f"its parameters are said to begin in block {header[0]}, the file has {size} bytes: it is truncated or damaged",
            file=file,
        )
    source.seek(start)
    begin = source.read(4)
    processor = PROCESSORS.get(begin[3])
    if processor is None:
        raise ClearwayError(
            f"processor type {begin[3]} is unknown; 84 (Intel), 85 (DEC) and 86 (SGI/MIPS) are known", file=file
        )
    # Some writers leave the number of blocks 0: then they end where the data begin, or after 255 blocks at the latest.
    blocks = begin[2] or 255
    section = source.read(blocks * BLOCK - 4)
    counts = words(header, processor).view(_word(processor, "u"))
    scale, rate = float(reals(header[12:16], processor)[0]), float(reals(header[20:24], processor)[0])
    return Head(
        processor,
        points=int(counts[1]),
        analog=int(counts[2]),
        first=int(counts[3]),
        last=int(counts[4]),
        scale=scale,
        data_block=int(counts[8]),
        rate=rate,
        samples=int(counts[9]),
        parameters=_parameters(section, processor),
    )


def _parameters(section: bytes, processor: str) -> dict[str, Parameter]:
    """Every parameter that is whole, by `GROUP:NAME` in capitals; a damaged one ends the list."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Parameter]] = []
    order = ">" if processor == "mips" else "<"
    at = 0
    while at + 4 <= len(section):
        length, group = struct.unpack_from("bb", section, at)
        length = abs(length)
        if length == 0 or at + 4 + length > len(section):
            break
        name = _text(section[at + 2 : at + 2 + length]).upper()
        link = at + 2 + length
        (offset,) = struct.unpack_from(order + "H", section, link)
        if group < 0:
            groups[-group] = name
        elif (parameter := _parameter(section, link + 2)) is not None:
            found.append((group, name, parameter))
        if offset == 0:
            break
        at = link + offset
    return {f"{groups.get(group, group)}:{name}": parameter for group, name, parameter in found}


def _parameter(section: bytes, at: int) -> Parameter | None:
    if at + 2 > len(section):
        return None
    kind, many = struct.unpack_from("bB", section, at)
    if kind not in (-1, 1, 2, 4) or at + 2 + many > len(section):
        return None
    dims = tuple(section[at + 2 : at + 2 + many])
    count = 1
    for d in dims:
        count *= d
        if count > len(section):
            return None
    start = at + 2 + many
    data = section[start : start + count * abs(kind)]
    return Parameter(kind, dims, data) if len(data) == count * abs(kind) else None


def text_parameter(values: Sequence[str]) -> Parameter:
    """A list of texts as a parameter."""
    data = [v.encode() for v in values]
    length = max((len(d) for d in data), default=0) or 1
    return Parameter(-1, (length, len(data)), b"".join(d.ljust(length) for d in data))


def one_text(value: str) -> Parameter:
    """A single text as a parameter."""
    data = value.encode()
    return Parameter(-1, (len(data),), data)


def integers(values: Sequence[int], processor: str) -> Parameter:
    """16-bit words as a parameter: one of them without a dimension."""
    return Parameter(2, () if len(values) == 1 else (len(values),), word_bytes(values, processor))


def real(value: float, processor: str) -> Parameter:
    """A real number as a parameter."""
    return Parameter(4, (), real_bytes([value], processor))


def parameter_section(groups: Mapping[str, Mapping[str, Parameter]], processor: str) -> bytes:
    """The parameter section of `groups`, padded to whole blocks."""
    order = ">" if processor == "mips" else "<"
    out = bytearray()
    for number, (group, parameters) in enumerate(groups.items(), start=1):
        name = group.encode()
        out += struct.pack("bb", len(name), -number) + name + struct.pack(order + "H", 3) + b"\0"
        for title, p in parameters.items():
            name = title.encode()
            body = struct.pack("bB", p.kind, len(p.dims)) + bytes(p.dims) + p.data + b"\0"
            out += struct.pack("bb", len(name), number) + name + struct.pack(order + "H", len(body) + 2) + body
    out += b"\0\0"
    blocks = -(-(len(out) + 4) // BLOCK)
    kind = next(k for k, v in PROCESSORS.items() if v == processor)
    return (bytes((1, KEY, blocks, kind)) + bytes(out)).ljust(blocks * BLOCK, b"\0")


def header_block(head: Head) -> bytes:
    """The header block of `head`, its parameters in block 2."""
    p = head.processor
    first = word_bytes([head.points, head.analog, min(head.first, 65535), min(head.last, 65535), 10], p)
    block = bytes((2, KEY)) + first + real_bytes([head.scale], p) + word_bytes([head.data_block, 0], p)
    return (block + real_bytes([head.rate], p)).ljust(BLOCK, b"\0")


def _word(processor: str, sign: str) -> str:
    return f"{'>' if processor == 'mips' else '<'}{sign}2"


def _text(data: bytes) -> str:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return text.replace("\0", " ").strip()
