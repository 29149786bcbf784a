"""Files of ROS 2 bags: rosbag2's sqlite3 tables, and the folder with metadata.yaml that holds one or more files."""

from __future__ import annotations

import sqlite3
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

import numpy as np

from clearway.errors import ClearwayError
from clearway.reading import read_yaml
from clearway.reading.limits import BAG_METADATA
from clearway.recordings.formats.bag_limits import CHUNK, TOPICS, unpack_file, whole_message
from clearway.recordings.formats.bag_mcap import McapStore
from clearway.recordings.formats.bag_store import EVER, NEVER, Channel, Message, Store, Times, joined

MAGIC = b"SQLite format 3\0"
MEND = "mend it with `sqlite3 FILE .recover`, or `ros2 bag reindex` the folder"
ENDINGS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
_BROKEN = (sqlite3.Error, ValueError, OverflowError, MemoryError)  # even its messages need not be text


class SqliteStore:
    """A `.db3` of rosbag2, open. A message that was compressed on its own (zstd) is decompressed.

    Raises:
        ClearwayError: it is no rosbag2 file, was not closed, or is damaged.
    """

    def __init__(self, path: Path, named: Path | None = None) -> None:
        self._path = path if named is None else named  # for people; `path` may be a copy of it
        self._check_size(path)
        wal = path.with_name(path.name + "-wal")
        if wal.is_file() and wal.stat().st_size:
            raise ClearwayError(
                f"was not closed: its last messages are still in {wal.name}; merge them with"
                f" `sqlite3 {path.name} 'PRAGMA wal_checkpoint(TRUNCATE)'`",
                file=path,
            )
        try:
            self._base = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        except sqlite3.Error as error:
            raise self._damaged(error) from error
        try:
            self._base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, CHUNK)
            self._base.execute("PRAGMA trusted_schema = OFF")
            self.channels = self._channels()
            self.times = self._times()
        except _BROKEN as error:
            self.close()
            raise self._damaged(error) from error
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        self._base.close()

    def messages(self, numbers: frozenset[int], start: int = NEVER, end: int = EVER) -> Iterator[Message]:
        ids = ",".join(str(n) for n in sorted(numbers))
        query = (
            f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({ids}) AND timestamp BETWEEN ? AND ?"
        )
        try:
            for number, stamp, data in self._base.execute(query, (start, end)):
                if not isinstance(data, bytes):
                    raise ClearwayError("is damaged: a message without bytes", file=self._path)
                yield number, stamp, whole_message(data, file=self._path)
        except _BROKEN as error:
            raise self._damaged(error) from error

    def _check_size(self, path: Path) -> None:
        """Compare the file's size with the number of pages that its header says (sqlite.org/fileformat2.html, 1.3)."""
        with open(path, "rb") as f:
            head = f.read(100)
        if len(head) < 100:
            raise ClearwayError(f"is truncated; {MEND}", file=self._path)
        page = int.from_bytes(head[16:18], "big")
        whole = (65536 if page == 1 else page) * int.from_bytes(head[28:32], "big")
        size = path.stat().st_size
        if head[24:28] == head[92:96] and size < whole:
            raise ClearwayError(f"is truncated: {size} of {whole} bytes are there; {MEND}", file=self._path)

    def _channels(self) -> dict[int, Channel]:
        tables = {name for (name,) in self._base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"topics", "messages"} <= tables:
            raise ClearwayError(
                "is an SQLite file, but none of rosbag2: it has no topics and messages", file=self._path
            )
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in tables:
            query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions LIMIT ?"
            definitions = {str(n): (str(e), str(d)) for n, e, d in self._base.execute(query, (TOPICS,))}
        query = "SELECT id, name, type, serialization_format FROM topics LIMIT ?"
        rows = self._base.execute(query, (TOPICS + 1,)).fetchall()
        if len(rows) > TOPICS:
            raise ClearwayError(f"has more than {TOPICS} topics; this is no recording", file=self._path)
        return {
            _whole(number, self._path): Channel(
                number, str(name), str(kind), str(form), *definitions.get(kind, ("", ""))
            )
            for number, name, kind, form in rows
        }

    def _times(self) -> dict[int, Times]:
        parts: defaultdict[int, list[Times]] = defaultdict(list)
        cursor = self._base.execute("SELECT topic_id, timestamp FROM messages")
        while rows := cursor.fetchmany(50_000):
            try:
                block = np.array(rows, dtype=np.int64)
            except (TypeError, ValueError) as error:
                raise ClearwayError(f"is damaged: a message without topic or time; {MEND}", file=self._path) from error
            for number in np.unique(block[:, 0]).tolist():
                parts[number].append(block[block[:, 0] == number, 1])
        if lost := sorted(set(parts) - set(self.channels)):
            raise ClearwayError(f"is damaged: messages of a topic {lost[0]} that it doesn't describe", file=self._path)
        return joined(parts)

    def _damaged(self, error: BaseException) -> ClearwayError:
        return ClearwayError(f"is damaged: {error}; {MEND}", file=self._path)


def storage_files(folder: Path) -> list[Path]:
    """The files of a ROS 2 bag's folder, without having read anything; empty where it is none."""
    try:
        return sorted(f for f in folder.iterdir() if f.name.endswith(ENDINGS) and f.is_file())
    except OSError:
        return []


def open_folder(folder: Path, stack: ExitStack) -> tuple[list[Store], list[str]]:
    """Every file of a bag's folder, open until `stack` ends, and notes.

    Raises:
        ClearwayError: metadata.yaml is damaged or names a file that is missing; a file of it can't be read.
    """
    notes = []
    metadata = folder / "metadata.yaml"
    files = storage_files(folder)
    if metadata.is_file():
        files = _listed(metadata, folder)
    elif files:
        notes.append("no metadata.yaml: every file in the folder was taken (`ros2 bag reindex` writes one)")
    if not files:
        raise ClearwayError("is no ROS 2 bag: it has no metadata.yaml, no .mcap and no .db3", file=folder)
    return [open_file(f, stack) for f in files], notes


def open_file(path: Path, stack: ExitStack) -> Store:
    """A `.db3` or `.mcap`, maybe compressed whole, open until `stack` ends.

    Raises:
        ClearwayError: it can't be read.
    """
    given = path
    try:
        if path.suffix == ".zstd":
            whole = Path(stack.enter_context(TemporaryDirectory())) / path.stem
            unpack_file(path, whole)
            path = whole
        with open(path, "rb") as f:
            sqlite = f.read(len(MAGIC)) == MAGIC
        store: Store = SqliteStore(path, given) if sqlite else McapStore(path, given)
    except OSError as error:
        raise ClearwayError(f"cannot be read: {error.strerror}", file=given) from error
    stack.callback(store.close)
    return store


def _listed(metadata: Path, folder: Path) -> list[Path]:
    try:
        table = read_yaml(metadata, BAG_METADATA, texts=False)
        names = table["rosbag2_bagfile_information"]["relative_file_paths"]
        files = [folder / PurePosixPath(name).name for name in names]
    except (ClearwayError, KeyError, TypeError) as error:
        raise ClearwayError(
            f"is no metadata of a ROS 2 bag: {type(error).__name__}; `ros2 bag reindex` writes a new one", file=metadata
        ) from error
    for file in files:
        if not file.is_file():
            raise ClearwayError(f"names the file {file.name}, which is missing", file=metadata)
    return files


def _whole(number: object, path: Path) -> int:
    if not isinstance(number, int):
        raise ClearwayError(f"is damaged: a topic's number is {number!r}", file=path)
    return number
