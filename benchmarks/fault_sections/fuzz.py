"""Mutated files of every kind: each is either read, or refused with one of our errors."""

from __future__ import annotations

import json
import random
import re
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from clearway.campaigns import planned
from clearway.campaigns.checks import check_file
from clearway.errors import ClearwayError
from clearway.robots import load_robot
from fault_sections import Count, in_turn
from fault_sections.hostile import good

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PLANS = ROOT / "src" / "clearway" / "scenarios" / "plans"
ROBOTS = ROOT / "src" / "clearway" / "robots"
SECONDS = 10.0
"""Of processor time that a file may take."""

SEEDS: dict[str, Path | str] = {
    "scenario": EXAMPLES / "my_corridor.toml",
    "suite": EXAMPLES / "my_suite.toml",
    "robot": EXAMPLES / "my_robot.toml",
    "floor plan": PLANS / "hall.toml",
    "test plan": EXAMPLES / "06_score_recordings" / "plan.toml",
    "map": PLANS / "hall.yaml",
    "image": PLANS / "hall.pgm",
    "campaign.json": json.dumps(good.CAMPAIGN),
    "people and robots": good.COMPANY,
    "track": good.TRACK,
}
"""The file that is mutated, by kind, or what stands in it."""

VALUES = (
    "true", "nan", "inf", "-inf", "0", "-1", "1e300", "-1e300", "1e-300", "1e9", "9223372036854775807", "9" * 30, '""', '"x"',
    "[]", "[[]]", "{}", "[1, 2, 3]", "[nan, 0, 0]", "2020-01-01", "2021-02-30", "0.1.2", "0x7f", '"\\u0000"', '"\\ud800"', "'",
    '"""', "{ a = 1 }", "&a", "*a", "!!set", "null", "[" * 200, "~", "1_0", "-", "1e", "\\",
)  # fmt: skip
"""What is put where a value stood."""
VALUE = re.compile(rb"(?<=[=:\[,] )[^\s,\]]+|(?<=\[)[^\s,\]]+|(?<== )[^\n]+")


def mutated(good: bytes, draw: random.Random) -> bytes:
    """`good` with one to three things wrong."""
    made = good
    for _ in range(draw.randint(1, 3)):
        made = draw.choice(MUTATIONS)(made, draw)
    return made


def _flip(text: bytes, draw: random.Random) -> bytes:
    out = bytearray(text)
    for _ in range(draw.randint(1, 8)):
        if out:
            out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
    return bytes(out)


def _any_byte(text: bytes, draw: random.Random) -> bytes:
    at = draw.randint(0, len(text))
    return text[:at] + draw.randbytes(draw.randint(1, 4)) + text[at + draw.randint(0, 4) :]


def _cut(text: bytes, draw: random.Random) -> bytes:
    return text[: draw.randint(0, len(text))]


def _drop(text: bytes, draw: random.Random) -> bytes:
    lines = text.split(b"\n")
    at = draw.randrange(len(lines))
    return b"\n".join(lines[:at] + lines[at + draw.randint(1, 3) :])


def _twice(text: bytes, draw: random.Random) -> bytes:
    lines = text.split(b"\n")
    at = draw.randrange(len(lines))
    end = min(len(lines), at + draw.randint(1, 12))
    return b"\n".join(lines[:end] + lines[at:end] * draw.choice((1, 1, 2, 30)) + lines[end:])


def _move(text: bytes, draw: random.Random) -> bytes:
    lines = text.split(b"\n")
    lines.insert(draw.randrange(len(lines) + 1), lines.pop(draw.randrange(len(lines))))
    return b"\n".join(lines)


def _value(text: bytes, draw: random.Random) -> bytes:
    found = list(VALUE.finditer(text[:100_000]))
    if not found:
        return text
    one = draw.choice(found)
    return text[: one.start()] + draw.choice(VALUES).encode() + text[one.end() :]


def _number(text: bytes, draw: random.Random) -> bytes:
    found = list(re.finditer(rb"-?\d+(?:\.\d+)?", text[:100_000]))
    if not found:
        return text
    one = draw.choice(found)
    value = float(one[0]) * draw.choice((-1.0, 0.0, 1e-9, 0.1, 10.0, 1e3, 1e6, 1e12, 1e200))
    words = (repr(value), f"{value:g}", str(int(value)) if abs(value) < 1e300 else "inf")
    return text[: one.start()] + draw.choice(words).encode() + text[one.end() :]


def _nest(text: bytes, draw: random.Random) -> bytes:
    found = list(VALUE.finditer(text[:100_000]))
    if not found:
        return text
    one, depth = draw.choice(found), draw.choice((1, 2, 40, 3000))
    return text[: one.start()] + b"[" * depth + one[0] + b"]" * depth + text[one.end() :]


def _rename(text: bytes, draw: random.Random) -> bytes:
    found = list(re.finditer(rb"[A-Za-z_]\w+", text[:100_000]))
    if len(found) < 2:
        return text
    one, other = draw.choice(found), draw.choice(found)
    return text[: one.start()] + other[0] + text[one.end() :]


MUTATIONS: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _flip, _any_byte, _cut, _drop, _twice, _move, _value, _value, _value, _number, _number, _nest, _rename,
)  # fmt: skip


NAMED = {
    "map": ("map.yaml", "map.yaml"),
    "image": ("hall.pgm", "hall.yaml"),
    "campaign.json": ("campaign.json", "campaign.json"),
    "track": ("mutated.csv", "company.toml"),
}
"""The file that a mutated one becomes, and the one that is read, by kind; of others both are the same."""


class Target:
    """Reads mutated files of every kind as `clearway check` and `clearway run --resume` do.

    Args:
        folder: An empty one to lay them out in.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._robot = folder, load_robot("tiago")
        shutil.copy(EXAMPLES / "my_corridor.toml", folder)
        for name in ("hall.yaml", "hall.pgm"):
            shutil.copy(PLANS / name, folder)
        (folder / "walk.csv").write_text(good.TRACK)
        (folder / "company.toml").write_text(good.COMPANY.replace("walk.csv", "mutated.csv"))
        self._good = {
            kind: file.read_bytes() if isinstance(file, Path) else file.encode() for kind, file in SEEDS.items()
        }

    def try_one(self, kind: str, seed: int) -> str | None:
        """Read one mutated file.

        Returns:
            What went wrong; None where it was read, or refused as it should be.
        """
        text = mutated(self._good[kind], random.Random(f"{kind} {seed}"))
        began = time.process_time()
        try:
            said = self._read(kind, text)
        except ClearwayError as error:
            said = [error]
        except Exception as error:
            return f"{type(error).__name__}: {error}"
        if (seconds := time.process_time() - began) > SECONDS:
            return f"took {seconds:.0f} s"
        if any(len(str(error)) > 6000 for error in said):
            return "an endless sentence"
        return None

    def _read(self, kind: str, text: bytes) -> list[ClearwayError]:
        name, read = NAMED.get(kind, ("it.toml", "it.toml"))
        (self._folder / name).write_bytes(text)
        if kind == "campaign.json":
            planned(self._folder)
            return []
        return check_file(self._folder / read, self._robot)


def measure(tries: int, seed: int) -> list[Count]:
    """Try `tries` mutated files."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        return in_turn(SEEDS, Target(Path(folder)).try_one, tries, seed)
