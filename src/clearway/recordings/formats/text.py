"""Text files of numbers: their encoding, their lines, their decimal mark, and large blocks of them in bounded memory.

A block of numbers is read a few megabytes at a time by pyarrow; lines that it refuses are first brought to one length
and then, if that doesn't help, taken one by one, so that the error names the line and the cell. An empty cell, and one
that says that there is no number (`NaN`, `NULL`, `inf`), is NaN.
"""

from __future__ import annotations

import codecs
import csv
import os
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pc

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.reading import opened as bounded

CHUNK = 1 << 22
"""Bytes of a block that are read at once."""

LONGEST_LINE = 1 << 22
"""Bytes; a longer line is not one of a table of numbers."""

MOST_COLUMNS = 100_000
"""Of a line; what comes behind is not taken apart."""

NOTHING = ("", "nan", "-nan", "+nan", "null", "none", "na", "n/a", "-nan(ind)", "nan(ind)", "inf", "+inf", "-inf")
"""What a cell says that holds no number, in lower case."""

_NULLS = sorted({form for word in NOTHING for form in (word, word.upper(), word.title(), "NaN", "-NaN")})
_EMPTY = re.compile(rb"[ \t,;]*\r?\n")
_BLANKS = b" \t,;\r\n"
_BLANK = np.isin(np.arange(256), list(_BLANKS))
_MOST_LACKING = 1_000_000


class Lines:
    """The lines of a text file, one after another, as text; knows where each begins.

    Attributes:
        file: The file's path, for errors.
        binary: Its bytes, in an encoding in which ASCII is ASCII.
        size: How many bytes it has.
        at: Byte offset of the next line.
        number: Number of the line that was read last, from 1.
        cut_off: Whether a block's last line was left out, as it has no end and lacks cells.
    """

    def __init__(self, file: Path, binary: IO[bytes], encoding: str) -> None:
        self.file, self.binary, self._encoding = file, binary, encoding
        self.number = 0
        self.cut_off = False
        self.at = binary.tell()
        self.size = os.fstat(binary.fileno()).st_size

    def next(self) -> str | None:
        """The next line without its end, None behind the last.

        Raises:
            ClearwayError: it is longer than a line of a table can be.
        """
        raw = self.binary.readline(LONGEST_LINE)
        if not raw:
            return None
        if len(raw) == LONGEST_LINE:
            raise ClearwayError(
                f"line {self.number + 1} is longer than {LONGEST_LINE >> 20} MB; this is no table", file=self.file
            )
        self.number += 1
        self.at += len(raw)
        return self._decoded(raw).rstrip("\r\n")

    def back_to(self, at: int, number: int) -> None:
        """Read on from the byte `at`, behind line `number`."""
        self.binary.seek(at)
        self.at, self.number = at, number

    def _decoded(self, raw: bytes) -> str:
        try:
            return raw.decode(self._encoding)
        except UnicodeDecodeError:
            return raw.decode("latin-1")  # never fails; what is cut off or mixed is in a name, not in a number


@contextmanager
def opened(file: Path) -> Iterator[Lines]:
    """Open a text file of whatever encoding: UTF-8 with and without mark, UTF-16, else Windows' Western one.

    Raises:
        ClearwayError: it can't be read.
    """
    with bounded(file) as raw:
        encoding = encoding_of(raw.read(4096))
        if encoding.startswith("utf-16"):
            with tempfile.TemporaryFile() as plain:  # on disk: the file may be large
                raw.seek(0)
                _transcode(raw, plain, encoding)
                plain.seek(0)
                yield Lines(file, plain, "utf-8")
        else:
            raw.seek(len(codecs.BOM_UTF8) if encoding == "utf-8-sig" else 0)
            yield Lines(file, raw, "utf-8" if encoding == "utf-8-sig" else encoding)


def encoding_of(head: bytes) -> str:
    """The encoding of a text that begins with `head`: `utf-8`, `utf-8-sig`, `utf-16-le`, `utf-16-be` or `cp1252`."""
    if head.startswith(codecs.BOM_UTF8):
        return "utf-8-sig"
    if head.startswith(codecs.BOM_UTF16_LE):
        return "utf-16-le"
    if head.startswith(codecs.BOM_UTF16_BE):
        return "utf-16-be"
    sample = head[:512]
    if len(sample) > 3 and b"\0" in sample:  # UTF-16 without a mark: every other byte of plain letters is zero
        low, high = sample[::2].count(0), sample[1::2].count(0)
        return "utf-16-le" if high > low else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def head_text(head: bytes) -> str:
    """The beginning of a file as text, for a `sniff`; whatever bytes they are."""
    return head.decode(encoding_of(head), errors="replace").lstrip("\ufeff")


def cells(line: str, separator: str) -> list[str]:
    """The cells of a line, without quotes and surrounding blanks."""
    if '"' not in line or line.count(separator) > MOST_COLUMNS:
        return [c.strip() for c in line.split(separator, MOST_COLUMNS)]
    try:
        return [c.strip() for c in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:
        return [c.strip().strip('"') for c in line.split(separator)]


def number(text: str) -> float | None:
    """The finite number that a cell of a header says, with either decimal mark; None if it says none."""
    plain = text.strip().replace(",", ".")
    if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", plain):
        return None
    value = float(plain)
    return value if np.isfinite(value) else None


@dataclass(frozen=True, slots=True)
class Block:
    """A block of numbers in a text file.

    Attributes:
        start: Byte offset of its first line.
        line: That line's number, from 1.
        columns: Number of cells in a whole line.
        separator: What stands between cells.
        point: How many cells make one thing: a line that lacks whole things at its end lacks them as unseen.
        ends: Whether an empty line ends it, and another block may follow.
        surplus: Whether a line may have more things at its end, which are passed over.
    """

    start: int
    line: int
    columns: int
    separator: str
    point: int = 3
    ends: bool = False
    surplus: bool = False


def rows(lines: Lines, block: Block, wanted: Sequence[int]) -> Iterator[FloatArray]:
    """The `wanted` columns of a block, some thousand rows at a time: (r, k), NaN where a cell is empty.

    The block ends at the end of the file or at its first empty line, as it says. A last line without an end counts if
    it has all its cells; one that lacks some was cut off: it is left out, and `lines.cut_off` says so.

    Raises:
        ClearwayError: a cell is no number, or a line has too many or too few; the message names the line.
    """
    lines.back_to(block.start, block.line - 1)
    rest = b""
    before = b""
    extra: int | None = None
    while piece := lines.binary.read(CHUNK):
        data = rest + piece
        cut = data.rfind(b"\n") + 1
        if not cut and len(data) > LONGEST_LINE:
            raise ClearwayError(f"line {lines.number + 1} has no end; this is no table", file=lines.file)
        data, rest = data[:cut], data[cut:]
        stop = _first_empty(data) if block.ends else None
        data = data[:stop]
        if data:
            extra = _extra(data, block) if extra is None else extra
            values = _numbers(data, block, extra, wanted, lines)
            lines.at += len(data)
            before = data[data.rfind(b"\n", 0, -1) + 1 :]
            yield values
        if stop is not None:
            return
    if not rest.strip(_BLANKS):
        return
    if not _whole(rest, before, block):
        lines.cut_off = True
        return
    data = rest + b"\n"
    yield _numbers(data, block, _extra(data, block) if extra is None else extra, wanted, lines)
    lines.at += len(rest)


def gather(chunks: Iterable[FloatArray], width: int, share: Callable[[], float]) -> FloatArray:
    """Rows that come in chunks (r, width) as one array (n, width), holding it only once.

    Args:
        share: Share of all chunks' bytes that have come already, so that the whole can be estimated.
    """
    held: Any = np.empty((0, width))
    n = 0
    for chunk in chunks:
        if n + len(chunk) > len(held):
            whole = 1.02 * (n + len(chunk)) / min(1.0, max(share(), 1e-3))
            held.resize((max(n + len(chunk), min(int(whole), 64 * (n + len(chunk)))), width), refcheck=False)
        held[n : n + len(chunk)] = chunk
        n += len(chunk)
    held.resize((n, width), refcheck=False)
    return np.asarray(held)


def write_rows(out: IO[bytes], columns: Sequence[Any], separator: str) -> None:
    """Append columns of numbers, all of one length; NaN becomes an empty cell. Lines end in CR LF, as Windows' do."""
    n = len(columns[0])
    step = max(1, 400_000 // max(1, len(columns)))
    options = pc.WriteOptions(include_header=False, delimiter=separator, quoting_style="none")
    for i in range(0, n, step):
        names = [str(k) for k in range(len(columns))]
        table = pa.table([pa.array(np.ascontiguousarray(c[i : i + step]), from_pandas=True) for c in columns], names)
        text = pa.BufferOutputStream()
        pc.write_csv(table, text, options)
        out.write(text.getvalue().to_pybytes().replace(b"\n", b"\r\n"))


@contextmanager
def writing(path: Path) -> Iterator[IO[bytes]]:
    """A file to write bytes to.

    Raises:
        ClearwayError: it can't be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "wb") as out:
            yield out
    except OSError as error:
        raise ClearwayError(f"cannot be written: {error.strerror or error}", file=path) from error


def _transcode(raw: IO[bytes], plain: IO[bytes], encoding: str) -> None:
    decoder = codecs.getincrementaldecoder(encoding)(errors="replace")
    first = True
    while piece := raw.read(CHUNK):
        text = decoder.decode(piece)
        plain.write((text.lstrip("\ufeff") if first else text).encode("utf-8", errors="replace"))
        first = False


def pass_over(lines: Lines) -> None:
    """Stand behind the next line that is empty or holds nothing but separators, or at the end."""
    rest = b""
    while piece := lines.binary.read(CHUNK):
        data = rest + piece
        stop = _first_empty(data)
        cut = (data.rfind(b"\n") if stop is None else data.find(b"\n", stop)) + 1
        lines.number += data.count(b"\n", 0, cut)
        lines.at += cut
        rest = data[cut:][-LONGEST_LINE:]
        if stop is not None:
            break
    else:
        return
    lines.back_to(lines.at, lines.number)


def _first_empty(data: bytes) -> int | None:
    """Where the first line begins that holds nothing but separators and blanks; whole lines only."""
    letters = np.frombuffer(data, dtype=np.uint8)
    begins = np.concatenate(([0], np.flatnonzero(letters == ord("\n")) + 1))
    begins = begins[begins < len(data)]
    for at in begins[_BLANK[letters[begins]]]:
        if _EMPTY.match(data, at):
            return int(at)
    return None


def _whole(line: bytes, before: bytes, block: Block) -> bool:
    """Whether a last line without an end has as many cells as the one `before` it, and a number in the last of them."""
    row = cells(line.decode("latin-1"), block.separator)
    usual = len(cells(before.decode("latin-1").rstrip("\r\n"), block.separator)) if before else block.columns
    return len(row) >= min(block.columns, usual) and (row[-1].lower() in NOTHING or number(row[-1]) is not None)


def _extra(data: bytes, block: Block) -> int:
    """How many empty cells every line has behind the last column, judged by the first: a tab, or a sheet's full width."""
    row = cells(data.split(b"\n", 1)[0].decode("latin-1").rstrip("\r"), block.separator)
    return 0 if any(row[block.columns :]) else max(0, len(row) - block.columns)


def _numbers(data: bytes, block: Block, extra: int, wanted: Sequence[int], lines: Lines) -> FloatArray:
    """The wanted columns of whole lines."""
    values = _fast(data, block, block.columns + extra, wanted)
    if values is None:
        evened = _evened(data, block, extra, lines)
        values = _fast(evened, block, block.columns, wanted)
        if values is None:
            values = _careful(evened, block, wanted, lines)
    lines.number += len(values)
    values[~np.isfinite(values)] = np.nan
    return values


def _fast(data: bytes, block: Block, columns: int, wanted: Sequence[int]) -> FloatArray | None:
    """As pyarrow reads it; None if it doesn't."""
    comma = block.separator != "," and b"," in data
    names = [str(i) for i in range(columns)]
    try:
        table = pc.read_csv(
            pa.BufferReader(data),
            # by no thread, which would outlive an error and end the process as that ends
            read_options=pc.ReadOptions(use_threads=False, column_names=names, block_size=1 << 20),
            parse_options=pc.ParseOptions(delimiter=block.separator, ignore_empty_lines=True),
            convert_options=pc.ConvertOptions(
                column_types={names[i]: pa.float64() for i in wanted},
                include_columns=[names[i] for i in dict.fromkeys(wanted)],
                null_values=_NULLS,
                decimal_point="," if comma else ".",
            ),
        )
    except (pa.ArrowException, ValueError):
        return None
    found = {name: table.column(name).to_numpy() for name in table.column_names}
    values = np.empty((table.num_rows, len(wanted)))
    for k, i in enumerate(wanted):
        values[:, k] = found[names[i]]
    return values


def _evened(data: bytes, block: Block, extra: int, lines: Lines) -> bytes:
    """Every line brought to the block's number of columns, where that loses nothing, invents nothing and shifts nothing."""
    separator = block.separator.encode()
    even = []
    lacking = 0
    for i, raw in enumerate(data.split(b"\n")):
        line = raw.rstrip(b"\r")
        if not line.strip(b" "):
            continue
        quoted = b'"' in line
        count = len(cells(line.decode("latin-1"), block.separator)) if quoted else line.count(separator) + 1
        if extra and count == block.columns + extra and line.endswith(separator * extra):
            line = line[: -len(separator) * extra]
            count = block.columns
        if block.surplus and count > block.columns and not (count - block.columns) % block.point and not quoted:
            line = separator.join(line.split(separator, block.columns)[: block.columns])
            count = block.columns
        missing = block.columns - count
        if missing < 0 or missing % block.point:
            raise ClearwayError(
                f"line {lines.number + 1 + i} has {count} columns; the header has {block.columns}", file=lines.file
            )
        lacking += missing
        if lacking > _MOST_LACKING + 2 * len(data):  # before memory is filled with cells that the file doesn't have
            raise ClearwayError(
                f"most lines up to line {lines.number + 1 + i} lack columns; each needs {block.columns}",
                file=lines.file,
            )
        even.append(line + separator * missing)
    return b"\n".join(even) + b"\n"


def _careful(data: bytes, block: Block, wanted: Sequence[int], lines: Lines) -> FloatArray:
    """Cell by cell, for what pyarrow refuses."""
    comma = block.separator != "," and b"," in data
    values = []
    for i, raw in enumerate(data.decode("latin-1").rstrip("\n").split("\n")):
        row = cells(raw, block.separator)
        line = lines.number + 1 + i
        if len(row) != block.columns:
            raise ClearwayError(f"line {line} has {len(row)} columns; the header has {block.columns}", file=lines.file)
        values.append([_cell(row[k], comma, line, k, lines.file) for k in wanted])
    return np.array(values, dtype=np.float64).reshape(len(values), len(wanted))


def _cell(text: str, comma: bool, line: int, column: int, file: Path) -> float:
    if text.lower() in NOTHING:
        return np.nan
    value = None if ("." if comma else ",") in text else number(text)  # 1.234 beside decimal commas: a thousand?
    if value is None:
        raise ClearwayError(f"line {line}, column {column + 1}: {text[:40]!r} is no number", file=file)
    return value
