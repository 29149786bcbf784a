"""TOML within bounds: what Python's parser would take too long over is refused before it is parsed."""

from __future__ import annotations

import re
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError
from clearway.reading import limits
from clearway.reading.bounded import read_bytes
from clearway.reading.values import refuse_monsters, too_deep

_TOKEN = re.compile(
    r"""
    \#[^\n]*                                   # comment
    | \"{3} (?:[^\\]|\\.)*? (?:\"{3,5}|\Z)     # texts of four kinds; one without an end goes to the file's
    | '{3} .*? (?:'{3,5}|\Z)
    | \" (?:[^"\\\n]|\\.)* \"?
    | ' [^'\n]* '?
    | [0-9A-Za-z_+-]+                          # a number, a date, a key
    | [\[\]{}.=,\n]
    """,
    re.VERBOSE | re.DOTALL,
)
"""Each alternative is linear: none can match the same text in two ways."""


def read_toml(path: str | Path) -> dict[str, Any]:
    """The table of a TOML file; not to be changed, as who reads the same text next is given the same one.

    Raises:
        ClearwayError: It can't be read, isn't TOML (with the line), or is beyond what is read.
    """
    path = Path(path)
    raw = read_bytes(path, limits.TOML)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ClearwayError(f"not a TOML file: it is not UTF-8 at byte {error.start}", file=path) from error
    return parse_toml(text, path)


def parse_toml(text: str, path: Path | None = None) -> dict[str, Any]:
    """The table of a text in TOML; as for `read_toml`, which says where it stands.

    Raises:
        ClearwayError: It isn't TOML, or is beyond what is read.
    """
    found = _parsed(text)
    if isinstance(found, ClearwayError):
        raise ClearwayError(found.problem, file=path, field=found.field)
    return found


@lru_cache(maxsize=4)
def _parsed(text: str) -> dict[str, Any] | ClearwayError:
    """The table or what is wrong, kept for those who look at a file again: which kind it is, what it holds."""
    try:
        _refuse_bulk(text)
        table = tomllib.loads(text)
        refuse_monsters(table, None)
    except tomllib.TOMLDecodeError as error:
        return ClearwayError(f"not a TOML file: {error}{_comma(text, str(error))}")
    except (ValueError, RecursionError) as error:  # a date that is none, within the parser
        return ClearwayError(f"not a TOML file: {error}")
    except ClearwayError as error:
        return error
    return table


def _refuse_bulk(text: str) -> None:
    """Refuse what nests too deep, words that are too long and entries that are too many, before anything is built."""
    brackets = dots = entries = 0
    for found in _TOKEN.finditer(text):
        token = found[0]
        first = token[0]
        if first == ".":
            dots += 1
            if dots > limits.NESTING:
                raise too_deep(None)
        elif first in "\n=,":
            dots, entries = 0, entries + (first != "\n")
            if entries > limits.ENTRIES:
                raise ClearwayError(f"has more than {limits.ENTRIES:,} entries, the most that are read")
        elif first in "[{":
            brackets, dots = brackets + 1, 0
            if brackets > limits.NESTING:
                raise too_deep(None)
        elif first in "]}":
            brackets = max(0, brackets - 1)
        elif first not in "#\"'" and len(token) > limits.WORD:
            raise ClearwayError(
                f"line {text.count(chr(10), 0, found.start()) + 1}: a number or key has at most {limits.WORD} characters; "
                f"this one has {len(token):,}"
            )


def _comma(text: str, problem: str) -> str:
    """What to write instead, where the line of a syntax error has a decimal comma."""
    at = re.search(r"at line (\d+)", problem)
    lines = text.split("\n")
    if at is None or int(at[1]) > len(lines):
        return ""
    number = re.search(r"=\s*([+-]?\d{1,30}),(\d{1,30})\s*(#.*)?$", lines[int(at[1]) - 1][:200])
    return "" if number is None else f"; a number has a decimal point: {number[1]}.{number[2]}"
