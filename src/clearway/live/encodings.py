"""How messages are written: MessagePack with its length before it, or JSON, a message a line."""

from __future__ import annotations

import json
import math
from typing import Any, Protocol

import numpy.typing as npt

LONGEST = 1 << 20
"""Bytes of a message that a navigator may send."""

Message = dict[str, Any]

_LENGTH = 4


class Nonsense(ValueError):
    """What came is no message."""


class Encoding(Protocol):
    """Messages to bytes and back.

    Attributes:
        name: As it is told.
    """

    name: str

    def pack(self, message: Message) -> bytes:
        """A message, ready to be sent."""

    def array(self, values: npt.NDArray[Any]) -> Any:
        """An array as it stands in a message: row by row, without its shape."""

    def end(self, held: bytearray) -> int:
        """How many bytes the first message has of those that have come, 0 while it is not complete.

        Raises:
            Nonsense: it is longer than `LONGEST`.
        """

    def unpack(self, frame: bytes) -> Message:
        """The message of which these are the bytes.

        Raises:
            Nonsense: it is none.
        """


class MessagePack:
    """Four bytes with the length, the highest first, then so many bytes of MessagePack: a map."""

    name = "MessagePack"

    def __init__(self) -> None:
        import msgpack

        self._packb, self._unpackb = msgpack.Packer(autoreset=True).pack, msgpack.unpackb

    def pack(self, message: Message) -> bytes:
        body: bytes = self._packb(message)
        return len(body).to_bytes(_LENGTH, "big") + body

    def array(self, values: npt.NDArray[Any]) -> bytes:
        return values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()

    def end(self, held: bytearray) -> int:
        if len(held) < _LENGTH:
            return 0
        if held[0]:  # no message has 16 MB
            raise Nonsense(f"said {shown(held)}, which is no message")
        length = int.from_bytes(held[:_LENGTH], "big")
        if length > LONGEST:
            raise Nonsense(f"said a message of {length:,} bytes; {LONGEST:,} are the most")
        end = _LENGTH + length
        return end if len(held) >= end else 0

    def unpack(self, frame: bytes) -> Message:
        try:
            return _map(self._unpackb(frame[_LENGTH:], raw=False))
        except (ValueError, RecursionError) as error:  # of another kind than those nothing is raised
            raise Nonsense(f"said {shown(frame[_LENGTH:])}, which is no message in MessagePack") from error


class JsonLines:
    """A JSON object a line. What JSON has no number for (infinity, not a number) is null."""

    name = "JSON lines"

    def pack(self, message: Message) -> bytes:
        return json.dumps(_finite(message), separators=(",", ":"), allow_nan=False).encode() + b"\n"

    def array(self, values: npt.NDArray[Any]) -> list[Any]:
        flat: list[Any] = values.ravel().tolist()
        return flat

    def end(self, held: bytearray) -> int:
        end = held.find(b"\n") + 1
        if (end or len(held)) > LONGEST:
            raise Nonsense(f"said {shown(held)} in a line of more than {LONGEST:,} bytes, which are the most")
        return end

    def unpack(self, frame: bytes) -> Message:
        try:
            return _map(json.loads(frame))
        except (ValueError, RecursionError) as error:
            raise Nonsense(f"said {shown(frame)}, which is no message in JSON") from error


def spoken(first: int) -> Encoding | None:
    """The encoding of which the first byte that a navigator sends is a sign; None: of none.

    Raises:
        ModuleNotFoundError: it takes a package that is not installed.
    """
    if first == ord("{"):
        return JsonLines()
    return MessagePack() if first == 0 else None  # no message has 16 MB


def shown(said: bytes | bytearray) -> str:
    """The first of what was said, for people."""
    line = bytes(said[:80]).partition(b"\n")[0]
    return repr(line.decode()) if line.isascii() else repr(line)


def _map(found: Any) -> Message:
    if not isinstance(found, dict) or not all(isinstance(key, str) for key in found):
        raise ValueError("no map")
    return found


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
