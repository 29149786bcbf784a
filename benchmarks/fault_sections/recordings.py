"""Mutated recordings of every format: each is listed, read and cleaned, or refused with one of our errors, without a warning of
numpy's that would stand in somebody's terminal."""

from __future__ import annotations

import json
import math
import random
import struct
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats import c3d_writer
from clearway.recordings.formats.beside import beside
from clearway.recordings.lab.unplanned import motions, summary
from clearway.recordings.recording import Recording, Want
from fault_sections import Count, in_turn
from fault_sections.fuzz import SECONDS, mutated

sys.path.append(str(Path(__file__).parents[2] / "tests" / "recordings"))  # for recordings of every kind

from made_bags import KINDS as BAGS
from test_bag_messages import everything
from text_captures import capture

FRAMES = 40
"""Of a recording."""
VICON = (
    "Trajectories\n100\n,,cart:a,,,cart:b,,,cart:c,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm,mm,mm,mm\n"
)
WORKSTATION = "TRAJECTORIES\n120,Hz\n,cart:a,,,cart:b,,,cart:c\nField #,X,Y,Z,X,Y,Z,X,Y,Z\n"


def _rows(separator: str, first: tuple[str, ...], xyz: bool = True) -> str:
    """The markers of the capture in mm, a line a frame; `first`: what stands before them, with `{i}` for the frame."""
    points = capture(FRAMES).points
    assert points is not None
    lines = []
    for i, row in enumerate(points.xyz, 1):
        cells = [f"{1000 * x:.3f}" if math.isfinite(x) else "" for x in row.ravel()] if xyz else []
        lines.append(separator.join([*(f.format(i=i, t=i / 100) for f in first), *cells]))
    return "\n".join(lines) + "\n"


def _json() -> bytes:
    """What QTM exports, with a gap."""
    points = capture(FRAMES).points
    assert points is not None
    xyz = 1000 * np.nan_to_num(points.xyz)

    def parts(values: list[object]) -> list[dict[str, object]]:
        ends = ((0, 9), (14, FRAMES))
        return [{"Range": {"Start": a + 1, "End": b}, "Type": "measured", "Values": values[a:b]} for a, b in ends]

    turns = [0.4 + 0.05 * i for i in range(FRAMES)]
    poses: list[object] = [
        [[10.0 * i, 5.0, 250.0, 0.3], [math.cos(a), math.sin(a), 0, -math.sin(a), math.cos(a), 0, 0, 0, 1]]
        for i, a in enumerate(turns)
    ]
    markers = [{"Name": n, "Parts": parts([[*p, 0.2] for p in xyz[:, k]])} for k, n in enumerate(points.names)]
    return json.dumps(
        {
            "Timebase": {"Frequency": 100, "Range": {"Start": 1, "End": FRAMES}},
            "Markers": markers,
            "RigidBodies": [{"Name": "cart", "Parts": parts(poses)}],
        }
    ).encode()


def _people() -> bytes:
    rows = [f"{10 * k}\t{i}\t{0.1 + 0.5 * k:.3f}\t{1.5 * i + 0.003 * k:.3f}" for k in range(20) for i in (1, 2, 3)]
    return ("\n".join(rows) + "\n").encode()


def _poses(rows: Callable[[float, float, float], str], head: str = "") -> bytes:
    """A text of poses: what a line says of t [s], x [m] and yaw [rad]."""
    return (head + "".join(rows(i / 50, 0.01 * i, 0.02 * i) + "\n" for i in range(2 * FRAMES))).encode()


def _matrix(x: float, yaw: float) -> str:
    c, s = math.cos(yaw), math.sin(yaw)
    return f"{c:.6f} 0 {s:.6f} {x:.4f} 0 1 0 0 {-s:.6f} 0 {c:.6f} {2 * x:.4f}"


def _written(name: str, ending: str, **more: object) -> Callable[[Path], bytes]:
    """By the format's own writer."""

    def make(folder: Path) -> bytes:
        made, path = capture(FRAMES), folder / f"made{ending}"
        if name == "c3d":
            c3d_writer.write(path, made, **more)  # type: ignore[arg-type]
        else:
            write = formats.formats()[name].write
            assert write is not None
            write(path, made)
        return path.read_bytes()

    return make


def _bag(kind: str) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        path = BAGS[kind](folder)
        return (path / "a.db3" if path.is_dir() else path).read_bytes()

    return make


def _text(made: bytes | str) -> Callable[[Path], bytes]:
    return lambda folder: made if isinstance(made, bytes) else made.encode()


TABLE = "time = { column = 't' }\nunits = 'm'\nup = 'z'\n[bodies.robot]\nx = 'x'\ny = 'y'\nyaw = 'th'\nv = 'v'\n"
SEEDS: dict[str, tuple[str, str, Callable[[Path], bytes]]] = {
    "c3d, real": ("c3d", ".c3d", _written("c3d", ".c3d")),
    "c3d, integer": ("c3d", ".c3d", _written("c3d", ".c3d", scale=0.1, processor="mips")),
    "c3d, dec": ("c3d", ".c3d", _written("c3d", ".c3d", processor="dec", up="+Y")),
    "bag, ros1": ("bag", ".bag", _bag("ros1")),
    "bag, ros1 lz4": ("bag", ".bag", _bag("ros1-lz4")),
    "bag, db3": ("bag", ".db3", _bag("db3")),
    "bag, mcap": ("bag", ".mcap", _bag("mcap-bare")),
    "bag, mcap in chunks": ("bag", ".mcap", _bag("mcap")),
    "bag, mcap zstd": ("bag", ".mcap", _bag("mcap-zstd")),
    "bag, all messages": ("bag", ".mcap", lambda folder: everything()),
    "motive": ("motive", ".csv", _written("motive", ".csv")),
    "vicon": ("vicon", ".csv", _text(VICON + _rows(",", ("{i}", "0")))),
    "vicon workstation": ("vicon", ".csv", _text(WORKSTATION + _rows(",", ("{i}",)))),
    "qualisys": ("qualisys", ".tsv", _written("qualisys", ".tsv")),
    "qualisys-6d": ("qualisys-6d", ".tsv", _written("qualisys-6d", ".tsv")),
    "qualisys-json": ("qualisys-json", ".json", lambda folder: _json()),
    "trc": ("trc", ".trc", _written("trc", ".trc")),
    "tum": ("tum", ".tum", lambda folder: _poses(lambda t, x, a: f"{t:.2f} {x:.3f} 0 0 0 0 {math.sin(a / 2):.6f} {math.cos(a / 2):.6f}")),
    "kitti": ("kitti", ".txt", lambda folder: _poses(lambda t, x, a: _matrix(x, a))),
    "euroc": ("euroc", ".csv", lambda folder: _poses(
        lambda t, x, a: f"{1403636579763555584 + round(1e9 * t)},{x:.3f},0.1,0.2,{math.cos(a / 2):.6f},0,0,{math.sin(a / 2):.6f}",
        "#timestamp [ns],p_x,p_y,p_z,q_w,q_x,q_y,q_z\n")),
    "table": ("table", ".csv", lambda folder: _poses(lambda t, x, a: f"{t:.2f},{x:.3f},0.5,{a:.4f},0.5", "t,x,y,th,v\n")),
    "table's description": ("table", ".toml", _text(TABLE)),
    "pedestrians": ("pedestrians", ".txt", lambda folder: _people()),
}  # fmt: skip
"""By kind: the format, the ending, and what makes a good file."""
BESIDE = {"table": TABLE, "kitti": "rate = 50\n"}
"""What stands beside a file."""
BINARY = ("c3d", "bag")
NUMBERS = (math.nan, math.inf, -math.inf, 1e155, -1e155, 1e308, 1e-308, 1e20, 0.0, -1.0, 2.0**31, 1e9)
WORDS = (
    b"\xff\xff",
    b"\0\0",
    b"\xff\x7f",
    b"\0\x80",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\1\0\0\0",
    b"\0" * 8,
    b"\xff" * 8,
)


def damaged(good: bytes, draw: random.Random) -> bytes:
    """A binary file with one to four things wrong."""
    made = bytearray(good)
    for _ in range(draw.randint(1, 4)):
        # headers can mislead most
        at = draw.randrange(min(len(made), 2048) if draw.random() < 0.4 else max(len(made), 1)) if made else 0
        match draw.choice(("flip", "number", "number", "single", "word", "word", "cut", "insert", "drop", "twice")):
            case "flip":
                made[at : at + 1] = bytes(b ^ 1 << draw.randrange(8) for b in made[at : at + 1])
            case "number":
                at = _number_in(made, "<d", draw)
                made[at : at + 8] = struct.pack("<d", draw.choice(NUMBERS))[: len(made) - at]
            case "single":
                code = draw.choice("<>") + "f"
                at = _number_in(made, code, draw)
                made[at : at + 4] = struct.pack(code, np.clip(draw.choice(NUMBERS), -3e38, 3e38))[: len(made) - at]
            case "word":
                word = draw.choice(WORDS)
                made[at : at + len(word)] = word[: len(made) - at]
            case "cut":
                del made[at if draw.random() < 0.3 else len(made) - draw.randint(0, min(len(made), 64)) :]
            case "insert":
                made[at:at] = draw.randbytes(draw.randint(1, 16))
            case "drop":
                del made[at : at + draw.randint(1, 512)]
            case _:
                made[at:at] = made[at : at + draw.randint(1, 512)]
    return bytes(made)


def _number_in(made: bytearray, code: str, draw: random.Random) -> int:
    """A place at which a number stands that somebody may have measured; any, if none is found."""
    at = 0
    for _ in range(100):
        at = draw.randrange(max(1, len(made) - struct.calcsize(code)))
        if len(made) >= at + struct.calcsize(code) and 1e-5 < abs(struct.unpack_from(code, made, at)[0]) < 1e5:
            break
    return at


class Target:
    """Reads mutated recordings as `clearway import` does.

    Args:
        folder: An empty one to lay them out in.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._good: dict[str, bytes] = {}

    def try_one(self, kind: str, seed: int) -> str | None:
        """Read one mutated file.

        Returns:
            What went wrong; None where it was read, or refused as it should be.
        """
        format, ending, make = SEEDS[kind]
        if kind not in self._good:
            with tempfile.TemporaryDirectory(dir=self._folder) as place:
                self._good[kind] = make(Path(place))
        draw = random.Random(f"{kind} {seed}")
        change = damaged if format in BINARY else mutated
        path = self._laid(kind, ending, change(self._good[kind], draw))
        began = time.perf_counter()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                said = [str(error) for error in self._read(path, None if seed % 4 else format)]
        except Exception as error:
            return f"{type(error).__name__}: {error}"
        if (seconds := time.perf_counter() - began) > SECONDS:
            return f"took {seconds:.0f} s"
        return "an endless sentence" if any(len(words) > 6000 for words in said) else None

    def _laid(self, kind: str, ending: str, text: bytes) -> Path:
        for old in self._folder.glob("it.*"):
            old.unlink()
        path = self._folder / f"it{ending}"
        if kind == "table's description":
            path = self._folder / "it.csv"
            beside(path).write_bytes(text)
            text = SEEDS["table"][2](self._folder)
        elif kind in BESIDE:
            beside(path).write_text(BESIDE[kind])
        path.write_bytes(text)
        return path

    def _read(self, path: Path, format: str | None) -> list[ClearwayError]:
        """What was said against it."""
        said = []
        for act in (
            lambda: formats.look(path, format=format),
            lambda: formats.read(path, Want(span=(0.1, 0.3)), format=format),
            lambda: [summary(found.motion) for found in motions(path, format=format) if found.motion is not None],
        ):
            try:
                act()
            except ClearwayError as error:
                said.append(error)
        return said


def good(folder: Path) -> dict[str, Recording]:
    """Every kind as it was before it was mutated, read."""
    target, found = Target(folder), {}
    for kind, (format, ending, make) in SEEDS.items():
        with tempfile.TemporaryDirectory(dir=folder) as place:
            text = make(Path(place))
        found[kind] = formats.read(target._laid(kind, ending, text), format=format)
    return found


def measure(tries: int, seed: int) -> list[Count]:
    """Try `tries` mutated recordings."""
    with tempfile.TemporaryDirectory(prefix="recordings-") as folder:
        return in_turn(SEEDS, Target(Path(folder)).try_one, tries, seed)
