"""The container MCAP (mcap.dev/spec): records of an opcode, a length and a body; chunks of messages, each followed by one
index a channel; schemas and channels within the chunks and once more in the summary."""

from __future__ import annotations

import struct
import zlib
from array import array
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_limits import DEFINITION, TOPICS, Allowance, Broken, decompress, whole_message
from clearway.recordings.formats.bag_store import EVER, NEVER, Channel, Message, OneFile, Times, joined

MAGIC = b"\x89MCAP0\r\n"
MEND = "mend it with `mcap recover`"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _INDEX = 2, 3, 4, 5, 6, 7
_RECORD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
_MESSAGE_HEAD = struct.Struct("<HIQQ")


@dataclass(slots=True)
class _Chunk:
    at: int  # of its header
    end: int
    index: dict[int, Times] = field(default_factory=dict)


class McapStore(OneFile):
    """An MCAP file, open.

    Raises:
        ClearwayError: it is no MCAP, is truncated or damaged, or promises too much.
    """

    def __init__(self, path: Path, named: Path | None = None) -> None:
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._chunks: list[_Chunk] = []
        self._loose: defaultdict[int, array[int]] = defaultdict(lambda: array("q"))  # time, at, size of each
        super().__init__(path, named or path, MEND)

    def messages(self, numbers: frozenset[int], start: int = NEVER, end: int = EVER) -> Iterator[Message]:
        for number, stamp, data in self._messages(numbers, start, end):
            yield number, stamp, whole_message(data, file=self._path)

    def _messages(self, numbers: frozenset[int], start: int, end: int) -> Iterator[Message]:
        for chunk in self._chunks:
            if not any(number in numbers and ((t >= start) & (t <= end)).any() for number, t in chunk.index.items()):
                continue
            try:
                yield from _messages_in(self._unpack(chunk), numbers, start, end)
            except Broken as error:
                raise self._damaged(f"{error}") from error
        for number in sorted(numbers & self._loose.keys()):
            for stamp, at, size in np.frombuffer(self._loose[number], dtype=np.int64).reshape(-1, 3).tolist():
                if start <= stamp <= end:
                    self._file.seek(at)
                    yield number, stamp, self._file.read(size)

    def _walk(self, size: int) -> None:
        if self._file.read(8) != MAGIC:
            raise ClearwayError("is no MCAP file of version 0", file=self._path)
        allowance = Allowance(self._path, size)
        at, ended = 8, False
        while not ended:
            self._file.seek(at)
            head = self._file.read(9)
            if len(head) < 9:
                raise self._truncated(at)
            op, length = _RECORD.unpack(head)
            begin = at + 9
            at = begin + length
            if at > size:
                raise self._truncated(begin - 9)
            if op in (_SCHEMA, _CHANNEL):
                self._describe(op, self._body(length))
            elif op == _CHUNK:
                self._chunk(begin, at, allowance)
            elif op == _INDEX and self._chunks:
                body = self._body(length)
                number, count = struct.unpack_from("<HI", body)
                if count + 6 > length or count % 16:
                    raise self._damaged(f"an index of {count} bytes")
                stamps = _checked(np.frombuffer(body, dtype="<u8", count=count // 8, offset=6)[::2])
                before = self._chunks[-1].index
                before[number] = np.concatenate([before[number], stamps]) if number in before else stamps
            elif op == _MESSAGE:
                number, _, stamp, _ = _MESSAGE_HEAD.unpack(self._file.read(_MESSAGE_HEAD.size))
                if length < _MESSAGE_HEAD.size:
                    raise self._damaged(f"a message of {length} bytes")
                self._loose[number].extend((stamp, begin + _MESSAGE_HEAD.size, length - _MESSAGE_HEAD.size))
            ended = op == _FOOTER
        self._file.seek(at)
        if self._file.read(8) != MAGIC:
            raise self._truncated(at)
        self._finish()

    def _finish(self) -> None:
        """Look into the chunks that have no index, or hold channels that are described nowhere else."""
        for chunk in self._chunks:
            if not chunk.index or any(number not in self.channels for number in chunk.index):
                found: defaultdict[int, list[int]] = defaultdict(list)
                for op, raw, begin, end in _records(self._unpack(chunk)):
                    if op in (_SCHEMA, _CHANNEL):
                        self._describe(op, raw[begin:end])
                    elif op == _MESSAGE:
                        number, _, stamp, _ = _MESSAGE_HEAD.unpack_from(raw, begin)
                        found[number].append(stamp)
                chunk.index = {number: _checked(np.array(stamps, dtype=np.uint64)) for number, stamps in found.items()}
        times: defaultdict[int, list[Times]] = defaultdict(list)
        for chunk in self._chunks:
            for number, stamps in chunk.index.items():
                times[number].append(stamps)
        for number, loose in self._loose.items():
            times[number].append(np.frombuffer(loose, dtype=np.int64)[::3])
        if lost := sorted(set(times) - set(self.channels)):
            raise self._damaged(f"messages of a channel {lost[0]} that it doesn't describe")
        self.times = joined(times)

    def _body(self, length: int) -> bytes:
        if length > 16 * DEFINITION:
            raise self._damaged(f"a description of {length} bytes")
        return self._file.read(length)

    def _describe(self, op: int, body: bytes) -> None:
        if op == _SCHEMA:
            (number,) = struct.unpack_from("<H", body)
            name, at = _string(body, 2)
            encoding, at = _string(body, at)
            definition, _ = _string(body, at)
            self._schemas[number] = (name, encoding, definition)
            return
        number, schema = struct.unpack_from("<HH", body)
        topic, at = _string(body, 4)
        encoding, _ = _string(body, at)
        if len(self.channels) >= TOPICS:
            raise ClearwayError(f"has more than {TOPICS} topics; this is no recording", file=self._path)
        self.channels[number] = Channel(number, topic, *_typed(encoding, self._schemas.get(schema, ("", "", ""))))

    def _chunk(self, begin: int, end: int, allowance: Allowance) -> None:
        _, _, claimed, _ = _CHUNK_HEAD.unpack(self._file.read(_CHUNK_HEAD.size))
        allowance.take(end - begin, claimed)
        self._chunks.append(_Chunk(begin, end))

    def _unpack(self, chunk: _Chunk) -> bytes:
        self._file.seek(chunk.at)
        body = self._file.read(chunk.end - chunk.at)
        _, _, size, crc = _CHUNK_HEAD.unpack_from(body)
        compression, at = _string(body, _CHUNK_HEAD.size)
        (length,) = struct.unpack_from("<Q", body, at)
        if at + 8 + length > len(body):
            raise self._damaged("a chunk that ends beyond its record")
        raw = decompress(body[at + 8 : at + 8 + length], compression, size, file=self._path)
        if crc and zlib.crc32(raw) != crc:
            raise self._damaged("a chunk's checksum differs")
        return raw

    def _truncated(self, at: int) -> ClearwayError:
        return ClearwayError(f"is truncated: a record at byte {at} ends beyond the file; {MEND}", file=self._path)


def _typed(encoding: str, schema: tuple[str, str, str]) -> tuple[str, str, str, str]:
    name, written, definition = schema
    return name, encoding, written, definition


def _records(raw: bytes) -> Iterator[tuple[int, bytes, int, int]]:
    """Opcode, and where the body begins and ends, of each record in a chunk."""
    at = 0
    while at < len(raw):
        op, length = _RECORD.unpack_from(raw, at)
        begin = at + _RECORD.size
        at = begin + length
        if at > len(raw):
            raise ValueError("a record that ends beyond its chunk")
        yield op, raw, begin, at


def _messages_in(raw: bytes, numbers: frozenset[int], start: int, end: int) -> Iterator[Message]:
    for op, _, begin, stop in _records(raw):
        if op == _MESSAGE:
            number, _, stamp, _ = _MESSAGE_HEAD.unpack_from(raw, begin)
            if number in numbers and start <= stamp <= end:
                yield number, stamp, raw[begin + _MESSAGE_HEAD.size : stop]


def _string(body: bytes, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", body, at)
    end = at + 4 + length
    if end > len(body):
        raise ValueError("a text that ends beyond its record")
    return body[at + 4 : end].decode(errors="replace"), end


def _checked(stamps: np.ndarray) -> Times:
    if len(stamps) and int(stamps.max()) > EVER:
        raise ValueError("a time beyond the year 2262")
    return stamps.astype(np.int64)
