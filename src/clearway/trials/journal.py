"""The finished trials of a campaign that is not: every process appends those that it finishes to a file of its own, a journal.

A record is a head (a mark, whose campaign it is of, the trial's number, sizes, the SHA-256 of the rest) and the trial, compressed.
A process that is killed leaves at most half a record at the end of its journal. What is damaged is not found, or told by its
digest, and run again. To know what is there, heads are read and nothing else.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import secrets
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.ipc

from clearway.placing import sync
from clearway.trials.store_tables import FILES, Tables

JOURNALS = "*.trials"
"""What journals are called."""
_MARK = b"\x93trial\r\n"
_HEAD, _CHECK = struct.Struct("<8s8sIIQ32s"), struct.Struct("<I")
_LONG = _HEAD.size + _CHECK.size
_OWN = secrets.token_hex(8)
"""This process's, so that it appends to nobody else's journal, whatever number it has been given."""


def record(key: str, index: int, tables: Tables, row: Mapping[str, Any]) -> bytes:
    """A finished trial as journals hold it.

    Args:
        key: Its campaign's.
        index: Its number.
        tables: As `to_tables` makes them.
        row: Its row in the table of trials.
    """
    batches = {name: table.combine_chunks().to_batches()[0].serialize() for name, table in tables.items() if len(table)}
    rest = json.dumps([{name: batch.size for name, batch in batches.items()}, row]).encode()
    plain = b"".join([*batches.values(), rest])
    body = len(rest).to_bytes(8, "little") + pa.compress(plain, codec="zstd", asbytes=True)
    head = _HEAD.pack(_MARK, _owner(key), index, len(plain), len(body), _digest(key, index, len(plain), body))
    return b"".join([head, _CHECK.pack(zlib.crc32(head)), body])


def append(folder: Path, records: bytes) -> None:
    """Append whole records to this process's journal in `folder`, and have them on the disk for good.

    Raises:
        OSError: they can't be written.
    """
    file = folder / f"{os.getpid()}-{_OWN}{JOURNALS[1:]}"
    new = not file.exists()
    with open(file, "ab", buffering=0) as journal:
        left = memoryview(records)
        while left:
            left = left[journal.write(left) :]
        os.fsync(journal.fileno())
    if new:
        sync(folder)


def count(folder: Path) -> int:
    """How many trials there are in the journals of a folder, damaged or not."""
    return len({index for file in folder.glob(JOURNALS) for _, _, index, _ in _heads(file, 0)})


class Journals:
    """What is in the journals of a folder, of one campaign.

    Args:
        folder: Where they lie.
        key: The campaign's.
        total: How many trials it has.
    """

    def __init__(self, folder: Path, key: str, total: int) -> None:
        self._folder, self._key = folder, key
        self._files: list[Path] = []
        self._ends: list[int] = []
        self._file = np.full(total, -1, np.int32)
        self._at, self._whole = np.zeros(total, np.int64), np.zeros(total, np.bool_)

    def missing(self) -> list[int]:
        """The trials that are not there; where all are, those that are damaged, which are not there from then on. One that was
        once found whole is not read again."""
        self._look()
        if not (self._file < 0).any():
            for index in np.flatnonzero(~self._whole).tolist():
                self._whole[index] = self._body(index) is not None
                if not self._whole[index]:
                    self._strike(index)
        found: list[int] = np.flatnonzero(self._file < 0).tolist()
        return found

    def done(self) -> int:
        """How many trials are there, damaged or not."""
        self._look()
        return int((self._file >= 0).sum())

    def read(self, index: int) -> tuple[Tables, dict[str, Any]] | None:
        """The tables and the row of a trial; None where it is not there, or damaged."""
        if self._file[index] < 0 or (found := self._body(index)) is None:
            return None
        plain, length = found
        body = pa.decompress(memoryview(plain)[8:], decompressed_size=length, codec="zstd")
        begin, end = 0, length - int.from_bytes(plain[:8], "little")
        sizes, row = json.loads(body[end:length].to_pybytes())
        tables = {name: file.schema.empty_table() for name, file in FILES.items()}
        for name, size in sizes.items():
            schema = FILES[name].schema
            batch = pyarrow.ipc.read_record_batch(body[begin : begin + size], schema)
            tables[name] = pa.Table.from_batches([batch], schema)
            begin += size
        return tables, row

    def _look(self) -> None:
        """Take note of what has come since."""
        owner = _owner(self._key)
        for file in sorted(self._folder.glob(JOURNALS)):
            if file not in self._files:
                self._files.append(file)
                self._ends.append(0)
            number = self._files.index(file)
            for at, whose, index, end in _heads(file, self._ends[number]):
                self._ends[number] = end
                if whose == owner and index < len(self._file):
                    self._file[index], self._at[index], self._whole[index] = number, at, False

    def _body(self, index: int) -> tuple[bytes, int] | None:
        """A record without its head, and what its trial is long, plain; None where it is damaged."""
        with suppress(OSError, struct.error), open(self._files[self._file[index]], "rb") as journal:
            journal.seek(self._at[index])
            mark, owner, number, plain, size, digest = _HEAD.unpack(journal.read(_LONG)[: _HEAD.size])
            body = journal.read(size)
            right = (_MARK, _owner(self._key), index, _digest(self._key, index, plain, body))
            if (mark, owner, number, digest) == right:
                return body, plain
        return None

    def _strike(self, index: int) -> None:
        """Have a record found no more."""
        with suppress(OSError), open(self._files[self._file[index]], "r+b") as journal:
            journal.seek(self._at[index])
            journal.write(bytes(len(_MARK)))
        self._file[index] = -1


def _heads(file: Path, at: int) -> Iterator[tuple[int, bytes, int, int]]:
    """Of each record from `at` on where it begins, whose it is, the number of its trial, and where it ends."""
    with suppress(FileNotFoundError), open(file, "rb") as journal:
        size, back = os.fstat(journal.fileno()).st_size, at
        while 0 <= at <= size - _LONG:
            head = os.pread(journal.fileno(), _LONG, at)
            mark, owner, index, _, length, _ = _HEAD.unpack_from(head)
            end = at + _LONG + length
            right = mark == _MARK and _CHECK.unpack_from(head, _HEAD.size) == (zlib.crc32(head[: _HEAD.size]),)
            if right and end <= size:
                yield at, owner, index, end
                at, back = end, at + 1
            else:  # damaged, or what comes before it was cut off
                at = back = _next(journal.fileno(), back + (at == back))


def _next(journal: int, at: int) -> int:
    """Where a mark stands next; -1: nowhere."""
    with mmap.mmap(journal, 0, access=mmap.ACCESS_READ) as content:
        return content.find(_MARK, at)


def _owner(key: str) -> bytes:
    return hashlib.sha256(key.encode()).digest()[:8]


def _digest(key: str, index: int, plain: int, body: bytes) -> bytes:
    return hashlib.sha256(f"{key} {index} {plain} ".encode() + body).digest()
