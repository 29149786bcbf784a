"""Values for what paper B doesn't print. They are ours, all of them, and they stand in one file: stand_ins.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("stand_ins.toml")


def stand_ins(section: str) -> dict[str, Any]:
    """A fresh copy of one table of the file, such as `hp-tmpc`."""
    return dict(_tables()[section])


@cache
def _tables() -> dict[str, dict[str, Any]]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))
