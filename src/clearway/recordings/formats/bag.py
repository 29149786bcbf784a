"""ROS 1 and ROS 2 bags (stub)."""

from __future__ import annotations

from pathlib import Path

from clearway.errors import ClearwayError
from clearway.recordings.formats.format import Format
from clearway.recordings.recording import Contents, Recording, Want


def sniff(path: Path, head: bytes) -> bool:
    """Whether it is a bag."""
    return head.startswith((b"#ROSBAG V", b"\x89MCAP", b"SQLite format 3\0"))


def read(path: Path, want: Want) -> Recording:
    """Read a bag."""
    raise ClearwayError("bags cannot be read yet", file=path)


def look(path: Path) -> Contents:
    """What a bag holds."""
    raise ClearwayError("bags cannot be read yet", file=path)


FORMATS = (Format("bag", "ROS bag", (".bag", ".db3", ".mcap"), sniff, read, look),)
