"""Broken test plans: whatever passes `clearway check` is scored, every trial of it, and its report is written."""

from __future__ import annotations

import copy
import json
import math
import random
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from clearway.campaigns.scoring import score_plan
from clearway.errors import ClearwayError
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.protocol.toml_text import toml_value
from clearway.reports import write_report
from clearway.trials.trial import UNUSABLE
from fault_sections import Count

sys.path.append(str(Path(__file__).parents[2] / "tests" / "recordings"))  # for the plans' recordings

from driven_trials import forth_and_back
from small_plans import PLAN, RATE, drive, write
from synthetic_session import record

REPORTED = 25
"""Of so many plans that are scored one has its report written, which takes seconds."""

VALUES: tuple[Any, ...] = (
    "", " ", "x", ".", "..", "A", "B", "robot", "cart", "capture", "log", "0.csv", "1.csv", "log0.csv", "plan.toml", "nosuch.csv", "->",
    "a->b", "x:", "tiago", "hosbot", "tiago:fast", "hall", "hospital", "barn", "vicon", "table", "bag", "speed", "epoch", "same",
    "travel", "measured", "none", "residual", "180 deg", "é\u2028", "x" * 300, True, False, 0, 1, -1, 2, 3, 1000, 10**18, 0.0, -0.0, 1e-9,
    0.01, 0.5, 5.0, 30.0, 180.0, 1e3, 1e6, 1e9, -1e9, 1e300, math.inf, -math.inf, math.nan, [], [0.0], [0.0, 1.0], [1.0, 0.0],
    [2.0, 7.0], [0.0, 0.0, 0.0], [1.0, 0.0, 90.0], [1e6, 0.0, 0.0], ["a", "a", "a"], ["robot:m1", "robot:m2"], {}, {"kind": "disc"},
    {"kind": "disc", "radius": 0.3}, {"kind": "disc", "radius": 1e6}, {"kind": "square", "edge": 0.3}, {"kind": "robot", "robot": "hosbot"},
    {"file": "0.csv"}, {"file": "0.csv", "pose": "A"}, {"file": "0.csv", "span": [0.0, 1.0], "pose": "A"}, {"same": True},
    {"transform": [1.0, 2.0, 0.5]}, {"static_poses": [{"file": "0.csv", "pose": "A", "span": [0.0, 1.5]}]},
)  # fmt: skip
"""What is put where a value stood, or under a key that was not there."""

KEYS = (
    "robot", "bodies", "sources", "poses", "legs", "motion", "test", "conditions", "span", "pose", "file", "files", "body", "obstacles",
    "track", "markers", "coordinates", "offset", "static", "straight", "turn", "heading", "source", "shape", "outline", "uncertainty",
    "visits", "frame", "clock", "estimate", "odometry", "goals", "plans", "format", "table", "start", "goal", "scored", "time_limit",
    "reached", "name", "xy_tolerance", "yaw_tolerance", "reference_length", "rate", "floor_plan", "suite", "navigator", "speed",
    "obstacle_speed", "size", "gap", "repetition", "batch", "configuration", "contact", "intervention", "stopped", "aborted", "attempted",
    "note", "cutoff", "spline", "operator", "date", "localisation", "contact", "contact", "intervention", "stopped", "visits", "visits",
    "clock", "clock", "estimate", "estimate", "goals", "goals", "plans", "plans", "span", "span", "speed", "speed", "time_limit", "residual", "same", "transform", "surveyed", "static_poses", "place", "up",
)  # fmt: skip
"""Keys that a plan may have somewhere."""


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path of everything in a plan, tables and lists too."""
    pairs: Any = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in pairs:
        yield (*path, key)
        yield from places(inner, (*path, key))


def broken(good: dict[str, Any], draw: random.Random) -> dict[str, Any]:
    """`good` with one to three things changed."""
    made = copy.deepcopy(good)
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        *path, key = draw.choice(list(places(made)) or [("trial",)])
        inside: Any = made
        for step in path:
            inside = inside[step]
        kind = draw.choice(("set", "set", "scale", "drop", "add", "copy"))
        if kind == "drop":
            del inside[key]
        elif kind == "add" and isinstance(inside, dict):
            inside[draw.choice(KEYS)] = copy.deepcopy(draw.choice(VALUES))
        elif kind == "copy":
            *others, last = draw.choice(list(places(made)))
            source: Any = made
            for step in others:
                source = source[step]
            inside[key] = copy.deepcopy(source[last])
        elif kind == "scale" and isinstance(inside[key], int | float):
            inside[key] = inside[key] * draw.choice((-1, 0, 0.1, 0.5, 2, 10, 57.29578, 1000))
        else:
            alike = [v for v in VALUES if isinstance(v, type(inside[key]))] if draw.random() < 0.8 else list(VALUES)
            inside[key] = copy.deepcopy(draw.choice(alike or VALUES))
    return made


def tables(folder: Path) -> dict[str, Any]:
    """Two trials with an obstacle, as tables, and the robot's own log beside them on a clock of its own."""
    for i in range(2):
        rows = drive(cart=(1.0, 0.8), cart_drives=i == 1)
        write(folder, f"{i}.csv", rows)
        log = rows[int(0.5 * RATE) :].copy()
        log[:, 0] += 100.0
        write(folder, f"log{i}.csv", log)
    trials = [
        {"file": f"{i}.csv", "files": {"log": f"log{i}.csv"}, "speed": 0.5, "repetition": i + 1, "obstacles": [{"body": "cart"}]}
        for i in range(2)
    ]  # fmt: skip
    log = {"format": "table", "frame": {"same": True}, "clock": "speed", "estimate": "robot"}
    return PLAN | {"sources": PLAN["sources"] | {"log": log}, "trial": trials}


def capture(folder: Path, *, coordinates: bool) -> dict[str, Any]:
    """A trial as Nexus would have captured it, its frame and markers tied by recordings of their own."""
    session = record(folder, [forth_and_back()], "vicon", coordinates=coordinates)
    plan: dict[str, Any] = tomllib.loads(session.write_plan(spans=False).read_text("utf-8"))
    return plan


BASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    "tables and a log": tables,
    "markers": lambda folder: capture(folder, coordinates=True),
    "markers that stretches tie": lambda folder: capture(folder, coordinates=False),
}
"""The plans that are broken."""


def tried(path: Path, out: Path, *, report: bool) -> tuple[bool, str | None]:
    """Whether `clearway check` has nothing to say of a plan, and what then went wrong; None where nothing did."""
    try:
        if problems_of(path):
            return False, None
        results = score_plan(path, out, workers=1)
        bad = [r for r in results.trials["reason"].to_pylist() if UNUSABLE in str(r)]
        if report:
            write_report(out)
    except ClearwayError as error:
        return True, f"passed the check, and then: {error}"
    except Exception as error:
        return True, f"{type(error).__name__}: {error}"
    finally:
        shutil.rmtree(out, ignore_errors=True)
    return True, f"passed the check, and then: {bad[0]}" if bad else None


def measure(tries: int, seed: int) -> list[Count]:
    """Try `tries` broken plans; the names tell how many passed the check."""
    found = []
    with tempfile.TemporaryDirectory(prefix="plans-") as root:
        for name, make in BASES.items():
            folder = Path(root) / name
            folder.mkdir()
            good = make(folder)
            count, passed = Count(f"test plan, broken: {name}"), 0
            for n in range(tries // len(BASES)):
                draw = random.Random(f"{name} {seed + n}")
                plan = folder / "plan.toml"
                text = "".join(f"{json.dumps(k)} = {toml_value(v)}\n" for k, v in broken(good, draw).items())
                plan.write_text(text, encoding="utf-8", errors="replace")
                ok, wrong = tried(plan, folder / "out", report=passed % REPORTED == 0)
                passed += ok
                count.add(f"seed {seed + n}", wrong)
            count.fault += f" ({passed} passed the check and were scored)"
            found.append(count)
    return found
