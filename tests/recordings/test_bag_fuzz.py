"""Damaged bags: whatever is changed in one, nothing but Clearway's own error comes out."""

from __future__ import annotations

import os
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from made_bags import KINDS

from clearway.errors import ClearwayError
from clearway.recordings.formats import bag
from clearway.recordings.recording import Want

EXAMPLES = int(os.environ.get("CLEARWAY_FUZZ", "25"))
NAMES = frozenset({"/odom", "/scan", "/plan", "/goal_pose", "map->base_scan"})
FUZZED = ("ros1", "ros1-bz2", "ros1-lz4", "db3", "ros2-sqlite3-message", "mcap", "mcap-lz4", "mcap-zstd", "mcap-bare")
MAGIC = (b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"SQLite format 3\0", b"\x28\xb5\x2f\xfd")


@cache
def whole(kind: str) -> bytes:
    with TemporaryDirectory() as folder:
        path = KINDS[kind](Path(folder))
        return (path / "a.db3" if path.is_dir() else path).read_bytes()


@st.composite
def damages(draw: st.DrawFn) -> list[tuple[str, float, bytes]]:
    """What to do to a file, where (as a share of it), and with which bytes."""
    what = st.sampled_from(["flip", "cut", "insert", "overwrite", "number", "repeat", "drop"])
    one = st.tuples(what, st.floats(0, 1), st.binary(min_size=1, max_size=16))
    return draw(st.lists(one, min_size=1, max_size=6))


def damaged(data: bytes, how: list[tuple[str, float, bytes]]) -> bytes:
    for what, share, by in how:
        at = int(share * len(data))
        if what == "flip":
            data = data[:at] + bytes(b ^ by[0] for b in data[at : at + 1]) + data[at + 1 :]
        elif what == "cut":
            data = data[:at]
        elif what == "insert":
            data = data[:at] + by + data[at:]
        elif what == "overwrite":
            data = data[:at] + by + data[at + len(by) :]
        elif what == "number":  # an absurd count or length
            data = data[:at] + b"\xff\xff\xff\x7f" + data[at + 4 :]
        elif what == "repeat":
            data = data[:at] + data[at : at + 64 * len(by)] + data[at:]
        else:
            data = data[:at] + data[at + 32 * len(by) :]
    return data


def endure(data: bytes, ending: str) -> None:
    folder = Path(os.environ.get("CLEARWAY_FUZZ_FOLDER") or "/dev/shm")
    with TemporaryDirectory(dir=folder if folder.is_dir() else None) as place:
        path = Path(place) / f"a{ending}"
        path.write_bytes(data)
        bag.sniff(path, data[:65536])
        for call in (
            lambda: bag.look(path),
            lambda: bag.read(path, Want()),
            lambda: bag.read(path, Want(NAMES, (0.5, 2.0))),
        ):
            with suppress(ClearwayError):
                call()


@pytest.mark.parametrize("kind", FUZZED)
@settings(max_examples=EXAMPLES)
@example(how=[("flip", 0.0625, b"\x80")])  # the name of a table is no text any more
@given(how=damages())
def test_a_damaged_bag_gives_nothing_but_the_own_error(kind: str, how: list[tuple[str, float, bytes]]) -> None:
    ending = ".bag" if "ros1" in kind else ".db3" if "sqlite" in kind or kind == "db3" else ".mcap"
    endure(damaged(whole(kind), how), ending)


@settings(max_examples=4 * EXAMPLES)
@given(magic=st.sampled_from(MAGIC), data=st.binary(max_size=400), ending=st.sampled_from([".bag", ".db3", ".mcap"]))
def test_arbitrary_bytes_give_nothing_but_the_own_error(magic: bytes, data: bytes, ending: str) -> None:
    endure(magic + data, ending)


@settings(max_examples=EXAMPLES)
@given(text=st.binary(max_size=300))
def test_an_arbitrary_metadata_file_gives_nothing_but_the_own_error(text: bytes) -> None:
    with TemporaryDirectory() as place:
        (Path(place) / "metadata.yaml").write_bytes(text)
        (Path(place) / "a.mcap").write_bytes(whole("mcap"))
        for call in (bag.look, lambda p: bag.read(p, Want())):
            with suppress(ClearwayError):
                call(Path(place))
