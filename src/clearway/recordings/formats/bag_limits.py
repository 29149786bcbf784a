"""What a bag may cost: bounds on what its chunks claim and give, so that a small file can't fill the memory.

A chunk says how large it will be once decompressed. That claim is checked before anything is decompressed, and what
comes out is cut off where it exceeds the claim. A claim can't be larger than what any recorder writes, and all claims
of a file together not larger than what data of any robot have been compressed by.
"""

from __future__ import annotations

import bz2
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]

from clearway.errors import ClearwayError

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

CHUNK = 256 << 20
"""Bytes that one chunk or message may hold. Recorders close a chunk at about 1 MB, after the message that fills it."""
RATIO = 100
"""How much smaller than its contents a bag may be; sensor data give 2 to 30."""
FREE = 256 << 20
"""Bytes that a bag may hold whatever its size."""
DEFINITION = 4 << 20
"""Bytes of names and message definitions that one topic may have."""
TOPICS = 100_000
"""Topics of a bag."""
_ZSTD = b"\x28\xb5\x2f\xfd"


class Allowance:
    """How much the chunks of one file may give in all."""

    def __init__(self, file: Path, size: int) -> None:
        self._file, self._left, self._size = file, size * RATIO + FREE, size

    def take(self, compressed: int, claimed: int) -> None:
        """Count a chunk of `compressed` bytes that claims to hold `claimed`.

        Raises:
            ClearwayError: it claims more than a chunk may hold, or all together more than the file may.
        """
        if claimed > CHUNK:
            raise ClearwayError(
                f"a chunk of {compressed} bytes claims to hold {claimed}; at most {CHUNK} are read at once",
                file=self._file,
            )
        self._left -= claimed
        if self._left < 0:
            raise ClearwayError(
                f"its chunks claim to hold more than {RATIO} times the file's {self._size} bytes; this is no recording",
                file=self._file,
            )


def decompress(data: bytes, compression: str, size: int, *, file: Path) -> bytes:
    """Exactly `size` bytes out of `data`.

    Raises:
        ClearwayError: the compression is unknown, the data are damaged, or give fewer or more bytes.
    """
    if compression in ("", "none"):
        raw = data
    elif compression in _DECOMPRESSORS:
        try:
            raw = _DECOMPRESSORS[compression](data, size + 1)
        except (OSError, ValueError, RuntimeError, EOFError, MemoryError, zstd.ZstdError) as error:
            raise ClearwayError(f"a chunk is damaged: {error}", file=file) from error
    else:
        known = ", ".join(sorted(_DECOMPRESSORS))
        raise ClearwayError(f"its chunks are compressed by {compression!r}; known: none, {known}", file=file)
    if len(raw) != size:
        raise ClearwayError(f"a chunk is damaged: it holds not the {size} bytes that it claims", file=file)
    return raw


def whole_message(data: bytes, *, file: Path) -> bytes:
    """A message, decompressed if it was compressed on its own (zstd, as rosbag2 does in any storage), of `CHUNK` bytes at most.

    Neither way of writing messages begins as zstd does: CDR has four bytes before them, ROS 1 a count or a length.

    Raises:
        ClearwayError: it is damaged or too large.
    """
    if not data.startswith(_ZSTD):
        return data
    try:
        raw = _zstd(data, CHUNK + 1)
    except (zstd.ZstdError, EOFError, MemoryError) as error:
        raise ClearwayError(f"a compressed message is damaged: {error}", file=file) from error
    if len(raw) > CHUNK:
        raise ClearwayError(f"a compressed message holds more than {CHUNK} bytes", file=file)
    return raw


def unpack_file(source: Path, target: Path) -> None:
    """Decompress a file that was compressed whole (zstd) to `target`, `RATIO` times its size at most.

    Raises:
        ClearwayError: it is damaged, truncated, or gives too much.
    """
    left = source.stat().st_size * RATIO + FREE
    try:
        with zstd.open(source, "rb") as packed, open(target, "wb") as out:
            while block := packed.read(1 << 20):
                left -= len(block)
                if left < 0:
                    raise ClearwayError(
                        f"holds more than {RATIO} times its own size; this is no recording", file=source
                    )
                out.write(block)
    except (zstd.ZstdError, EOFError, OSError) as error:
        raise ClearwayError(f"cannot be decompressed: {error}", file=source) from error


def _bz2(data: bytes, most: int) -> bytes:
    return bz2.BZ2Decompressor().decompress(data, most)


def _lz4(data: bytes, most: int) -> bytes:
    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, most))


def _zstd(data: bytes, most: int) -> bytes:
    return zstd.ZstdDecompressor().decompress(data, most)


_DECOMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {"bz2": _bz2, "lz4": _lz4, "zstd": _zstd}

Broken = (struct.error, IndexError, KeyError, ValueError, OverflowError)
"""What reading damaged bytes raises before anyone has looked at them."""
