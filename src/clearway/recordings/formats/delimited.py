"""Text with one sample a line and its values in columns, read in pieces: tables, trajectories, pedestrian sets.

Lines are tidied here (encoding, comments, runs of blanks) and handed to pyarrow's parser, piece by piece, so that a
file of any length takes the memory of the columns that are wanted of it.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal, TextIO, TypeAlias

import numpy as np
import pyarrow as pa
import pyarrow.csv

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.reading import opened, take
from clearway.recordings.formats.format import HEAD
from clearway.recordings.formats.text import cells, head_text

PIECE = 1 << 20
"""Bytes that are read at a time, and the longest line that is taken for one."""

MISSING = ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "n/a", "null", "NULL", "None", "-")

Header: TypeAlias = Literal["line", "comment", "none"]

_EMPTY = re.compile(r"^[ \t]+\n", re.MULTILINE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a file writes its columns.

    Attributes:
        separator: One character; " " means runs of blanks and tabs.
        decimal: The decimal mark, "." or ",".
        encoding: The encoding, by Python's name.
        skip: How many lines stand before the header.
        header: What names the columns: the first "line", the last "comment" before the data, or "none": then they are
            "1", "2", ...
        comment: Lines that begin with it are none; empty: there are no comments.
        missing: Words that stand for no value.
    """

    separator: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    skip: int = 0
    header: Header = "line"
    comment: str = "#"
    missing: tuple[str, ...] = MISSING


def head_of(path: Path) -> bytes:
    """The first bytes of a file, as a `sniff` is shown them.

    Raises:
        ClearwayError: it can't be read, or is empty.
    """
    with opened(path) as f:
        head = take(f, HEAD)
    if not head:
        raise ClearwayError("is empty", file=path)
    return head


@contextmanager
def written(path: Path) -> Iterator[TextIO]:
    """A text file to write; what the system says against it as our own error."""
    try:
        with open(path, "w", encoding="utf-8", newline="\n") as f:
            yield f
    except OSError as error:
        raise ClearwayError(f"cannot be written: {error.strerror}", file=path) from error


def is_number(word: str, decimal: str = ".") -> bool:
    """Whether a word is a number as people write it."""
    return bool(_NUMBER.fullmatch(word.replace(decimal, ".", 1)))


def first_lines(head: bytes, many: int = 50) -> list[str]:
    """The first whole lines of a file, from its first bytes; none if it is no text."""
    text = head_text(head)
    if "\0" in text or text.count("\ufffd") > len(text) / 20:
        return []
    lines = re.split(r"\r\n|\n|\r", text)
    return lines[: min(many, max(1, len(lines) - 1))]


def dialect_of(lines: Sequence[str], encoding: str = "utf-8") -> Dialect | None:
    """The dialect of a table from its first lines; None if they aren't one.

    Of the separators that split every line into the same number of columns, at least two, the one is taken that
    gives the most columns of numbers; `;` and tabs leave the comma to be a decimal one.
    """
    marked = [line.lstrip().startswith("#") for line in lines]
    body = [line for line, comment in zip(lines, marked, strict=True) if line.strip() and not comment]
    first = marked.index(False) if False in marked else 0
    best: tuple[tuple[float, int], Dialect] | None = None
    for separator, decimal in ((";", ","), (";", "."), ("\t", ","), ("\t", "."), (",", "."), (" ", ","), (" ", ".")):
        rows = [split(line, separator) for line in body]
        if len(rows) < 2 or len(rows[0]) < 2 or any(len(r) != len(rows[0]) for r in rows):
            continue
        header: Header = "none" if any(is_number(w, decimal) for w in rows[0]) else "line"
        if header == "none" and first:
            names = split(lines[first - 1].lstrip().lstrip("#"), separator)
            if len(names) == len(rows[0]) and len(set(names)) == len(names) and not any(map(is_number, names)):
                header = "comment"
        words = [w for row in rows[header == "line" :] for w in row]
        numbers = sum(is_number(w, decimal) or w in MISSING for w in words) / len(words)
        if numbers == 0 or (decimal == "," and not any("," in w for w in words)):
            continue
        if best is None or (numbers, len(rows[0])) > best[0]:
            best = ((numbers, len(rows[0])), Dialect(separator, decimal, encoding, 0, header))
    return None if best is None else best[1]


def split(line: str, separator: str) -> list[str]:
    """The words of one line."""
    return line.split() if separator == " " else cells(line, separator)


def header_of(path: Path, dialect: Dialect) -> tuple[str, ...]:
    """The columns' names.

    Raises:
        ClearwayError: the file can't be read, or holds no line.
    """
    with _opened(path, dialect) as tidy:
        line = tidy.first
    if line is None:
        raise ClearwayError("holds no line of a table", file=path)
    words = split(line, dialect.separator)
    return tuple(str(i + 1) for i in range(len(words))) if dialect.header == "none" else tuple(words)


def pieces(
    path: Path, dialect: Dialect, numbers: Sequence[str], texts: Sequence[str] = (), notes: list[str] | None = None
) -> Iterator[dict[str, Any]]:
    """The wanted columns by name, a piece of the file at a time: `numbers` as float64 (k,) with NaN where there is no
    value, `texts` as arrays of pyarrow, null where there is none. A last line that was cut off is left out; `notes` are told.

    Raises:
        ClearwayError: the file can't be read, a line has other columns than the first, or a value is no number.
    """
    names = header_of(path, dialect)
    twice = sorted({n for n in (*numbers, *texts) if names.count(n) > 1})
    if twice:
        raise ClearwayError(f"has several columns of the name {twice[0]!r}", file=path)
    unique = [n if names.index(n) == i else f"\0{i}" for i, n in enumerate(names)]
    convert = pyarrow.csv.ConvertOptions(
        check_utf8=False,
        include_columns=[*numbers, *texts],
        column_types={n: pa.float64() for n in numbers} | {n: pa.string() for n in texts},
        null_values=list(dialect.missing),
        strings_can_be_null=True,
        decimal_point=dialect.decimal,
    )
    parse = pyarrow.csv.ParseOptions(delimiter=dialect.separator, newlines_in_values=False)
    done = 0
    with _opened(path, dialect) as tidy:
        for data in tidy.pieces():
            # One piece after another and not pyarrow's own stream: that reads ahead in a thread, which outlives an error.
            block = pyarrow.csv.ReadOptions(use_threads=False, block_size=len(data) + 1, column_names=unique)
            try:
                found = pyarrow.csv.read_csv(pa.BufferReader(data), block, parse, convert).combine_chunks()
            except (pa.ArrowInvalid, pa.ArrowKeyError, pa.ArrowNotImplementedError, UnicodeError) as error:
                raise ClearwayError(
                    f"is no table of {len(names)} columns all through: {_named(str(error), names, done)}", file=path
                ) from error
            done += found.num_rows
            if found.num_rows:
                values = {n: found.column(n).to_numpy().astype(np.float64) for n in numbers}
                yield {**values, **{n: found.column(n).combine_chunks() for n in texts}}
        if notes is not None and tidy.cut_off:
            notes.append("the last line has no end and lacks columns: taken as cut off and left out")


def stacked(chunks: Iterable[FloatArray], width: int) -> FloatArray:
    """Rows that come in chunks (r, width) as one array (n, width)."""
    return np.concatenate([np.zeros((0, width)), *chunks])


class Codes:
    """Texts as small numbers, in the order in which they first come; `names` are the texts."""

    def __init__(self) -> None:
        self.names: dict[str, int] = {}

    def of(self, texts: Any) -> FloatArray:
        """The numbers (k,) of an array of pyarrow, NaN for null."""
        encoded = texts.dictionary_encode()
        code = [float(self.names.setdefault(t, len(self.names))) for t in encoded.dictionary.to_pylist()]
        index = encoded.indices.fill_null(len(code)).to_numpy(zero_copy_only=False)
        return np.asarray(np.array([*code, np.nan])[index])


def _named(problem: str, names: Sequence[str], before: int) -> str:
    """pyarrow's sentence, with the name of the column that it numbers, and lines counted from the file's first."""
    problem = re.sub(r"\s+", " ", problem)
    problem = re.sub(r"Row #(\d+)", lambda m: f"data line {before + int(m[1])}", problem)
    found = re.search(r"In CSV column #(\d+): ", problem)
    if found is None or int(found[1]) >= len(names):
        return problem
    return problem.replace(found[0], f"column {names[int(found[1])]!r}: ")


@contextmanager
def _opened(path: Path, dialect: Dialect) -> Iterator[_Tidied]:
    with opened(path) as file:
        yield _Tidied(path, file, dialect)


class _Tidied:
    """A file's data lines, tidied, as bytes of UTF-8 for the parser. `first`: the header, or the first line; `cut_off`: whether the
    last one was left out, as it has no end and fewer columns than the one before it."""

    def __init__(self, path: Path, file: BinaryIO, dialect: Dialect) -> None:
        self.path, self._file, self.dialect = path, file, dialect
        self._rest, self._ended, self.cut_off = "", False, False
        self._columns = 0
        self._remark = re.compile(rf"^[ \t]*{re.escape(dialect.comment)}(.*)\n", re.MULTILINE)
        try:
            self._decoder = codecs.getincrementaldecoder(dialect.encoding)()
        except LookupError as error:
            raise ClearwayError(f"{dialect.encoding!r} is no encoding; utf-8, cp1252, utf-16 are", file=path) from error
        skip, text = dialect.skip, ""
        remark: str | None = None
        while not text and not self._ended:
            text = self._piece()
            while skip and text:
                skip, text = skip - 1, text[text.find("\n") + 1 :]
            # The last comment of those that come first, which may name the columns.
            while self.dialect.comment and (found := self._remark.match(text)):
                remark, text = found[1].lstrip(self.dialect.comment), text[found.end() :].lstrip("\n")
            text = self._tidied(text)
        line, _, rest = text.partition("\n")
        self.first = remark if self.dialect.header == "comment" else line or None
        self._ready = rest if self.dialect.header == "line" else text

    def pieces(self) -> Iterator[bytes]:
        """The lines below the header, a piece of the file at a time."""
        text = self._ready
        while text or not self._ended:
            if text:
                yield text.encode("utf-8", errors="replace")
            text = "" if self._ended else self._tidied(self._piece())

    def _piece(self) -> str:
        """The next whole lines, each with a line feed at its end."""
        try:
            data = self._file.read(PIECE)
            text = self._rest + self._decoder.decode(data, final=not data)
        except UnicodeError as error:
            raise ClearwayError(f"is not {self.dialect.encoding}: {error}", file=self.path) from error
        text = text.removeprefix("\ufeff")
        self._ended = not data
        if "\0" in text:
            raise ClearwayError("holds zero bytes: it is no text", file=self.path)
        if "\r" in text:
            # A carriage return at the end may be half of a line's end.
            held = "\r" if text.endswith("\r") and data else ""
            text = text[: len(text) - len(held)].replace("\r\n", "\n").replace("\r", "\n") + held
        if self._ended:
            self._rest = ""
            if not text or text.endswith("\n"):
                return text
            whole, _, last = text.rpartition("\n")
            remark = bool(self.dialect.comment) and last.lstrip().startswith(self.dialect.comment)
            self.cut_off = bool(last.strip()) and not remark and self._width(last) < self._width(whole)
            return f"{whole}\n" * bool(whole) if self.cut_off else text + "\n"
        end = text.rfind("\n") + 1
        text, self._rest = text[:end], text[end:]
        self._columns = self._width(text[:-1])
        if len(self._rest) > PIECE:
            raise ClearwayError(f"has a line of more than {PIECE} characters: it is no table", file=self.path)
        return text

    def _width(self, lines: str) -> int:
        """How many columns the last of these lines has, or the one before them."""
        last = lines.rpartition("\n")[2]
        return len(split(last, self.dialect.separator)) if last.strip() else self._columns

    def _tidied(self, text: str) -> str:
        """Without comments and lines of blanks; blanks that separate are single ones."""
        if self.dialect.comment and self.dialect.comment in text:
            text = self._remark.sub("", text)
        if self.dialect.separator == " ":
            text = text.replace("\t", " ")
            while "  " in text:
                text = text.replace("  ", " ")
            text = text.replace(" \n", "\n").replace("\n ", "\n").removeprefix(" ")
        elif _EMPTY.search(text):
            text = _EMPTY.sub("", text)
        return text.lstrip("\n")
