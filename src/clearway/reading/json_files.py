"""JSON within bounds."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError
from clearway.reading import limits
from clearway.reading.bounded import read_bytes, size
from clearway.reading.values import refuse_monsters, too_deep

_BEYOND = re.compile(rb"[\xf0-\xf4]")
"""What a character beyond U+FFFF begins with, in UTF-8."""


def read_json(path: str | Path) -> Any:
    """What a JSON file holds.

    Args:
        path: Of the file.

    Raises:
        ClearwayError: It can't be read, isn't JSON, or is beyond what is read.
    """
    path = Path(path)
    raw = read_bytes(path, limits.JSON)
    if len(raw) > limits.JSON // 4 and _BEYOND.search(
        raw
    ):  # one of them, and Python takes four bytes for each character
        raise ClearwayError(
            f"is larger than the {size(limits.JSON // 4)} that are read of such a file with characters beyond U+FFFF",
            file=path,
        )
    if sum(map(raw.count, (b",", b"[", b"{"))) > limits.JSON_ENTRIES:  # before anything is built
        raise ClearwayError(f"has more than {limits.JSON_ENTRIES:,} entries, the most that are read", file=path)
    try:
        found = json.loads(raw)
    except RecursionError as error:
        raise too_deep(path) from error
    except ValueError as error:
        raise ClearwayError(f"is not JSON: {error}", file=path) from error
    refuse_monsters(found, path, entries=limits.JSON_ENTRIES, texts=False)
    return found
