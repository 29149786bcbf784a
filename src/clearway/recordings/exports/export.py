"""Any trial, simulated or recorded, as a file for other tools: bags, trajectories, tables, motion-capture layouts."""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, Protocol, cast, get_args

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.placing import placed
from clearway.recordings import formats
from clearway.recordings.exports import mcap
from clearway.recordings.exports.synthetic import System, captured, obstacles, plan_tables
from clearway.recordings.formats.beside import beside
from clearway.recordings.protocol.toml_text import toml
from clearway.recordings.recording import Recording, Track
from clearway.trials import Trial
from clearway.trials.keeping import is_outline

TARGETS = {
    "mcap": ".mcap",
    "tum": ".tum",
    "csv": ".csv",
    "vicon": ".csv",
    "motive": ".csv",
    "qualisys": ".tsv",
    "qualisys-6d": ".tsv",
    "trc": ".trc",
    "c3d": ".c3d",
}
"""What a trial can be exported to, and the usual ending."""
CAPTURES = ("vicon", "motive", "qualisys", "qualisys-6d", "trc", "c3d")
"""Those that hold what a capture system sees: made-up markers, or rigid bodies, resampled to its rate."""
Which = Literal["both", "true", "estimate"]
LEAD = 2.0
"""Rest that a capture shows before and after the trial, s, as a run sheet asks for."""


def export(
    trial: Trial,
    to: str,
    path: Path,
    *,
    system: System | None = None,
    which: Which = "both",
    scans: bool = True,
) -> tuple[Path, ...]:
    """Write a trial to a file that isn't there yet.

    Args:
        to: One of `TARGETS`.
        path: The file.
        system: What records the capture layouts: its rate, noise, gaps and so on; default: a perfect one at 100 Hz whose frame is
            the map.
        which: What goes into TUM: the true pose, the robot's own estimate, or both as `NAME.true.tum` and `NAME.estimate.tum`.
        scans: Whether MCAP gets the lidar's scans.

    Returns:
        The files that were written: beside a capture `NAME.markers.toml`, what a test plan has to say of its markers.

    Raises:
        ClearwayError: unknown format, the file is there already, nothing was recorded, or it can't be written.
    """
    if to not in TARGETS:
        raise unknown("format", to, TARGETS)
    if not np.isfinite(trial.pose).any():
        raise ClearwayError("the trial was not recorded: there is nothing to export", file=path)
    files = _files(trial, to, Path(path), which)
    for file in files.values():
        if os.path.exists(file):
            raise ClearwayError("is there already; nothing is overwritten: choose another name", file=file)
    with placed(Path(path).parent) as new:
        for what, file in files.items():
            _write(trial, to, new / file.name, what, system or System(), scans)
    return tuple(files.values())


def _files(trial: Trial, to: str, path: Path, which: Which) -> dict[str, Path]:
    """What goes into which file."""
    if to == "csv":
        return {"": path, "description": beside(path)}
    if to in CAPTURES:
        return {"": path, "markers": path.with_name(f"{path.name}.markers.toml")}
    if to != "tum":
        return {"": path}
    if trial.estimate is None and which != "true":
        if which == "estimate":
            raise ClearwayError("the trial doesn't know the robot's own estimate", file=path, field="which")
        which = "true"
    if which != "both":
        return {which: path}
    stem, ending = (path.stem, path.suffix) if path.suffix else (path.name, TARGETS[to])
    return {what: path.with_name(f"{stem}.{what}{ending}") for what in ("true", "estimate")}


def _write(trial: Trial, to: str, file: Path, what: str, system: System, scans: bool) -> None:
    if to == "mcap":
        mcap.write_trial(file, trial, scans=scans)
    elif to == "csv":
        if what == "":
            _write_csv(trial, file)
    elif to == "tum":
        poses = trial.pose if what == "true" or trial.estimate is None else trial.estimate
        _writer("tum")(file, Recording(file, "tum", tracks={what: track_of(trial.t, poses)}))
    elif what == "":
        _writer(to)(file, captured(trial, system, bodies=to == "qualisys-6d"))
    else:
        tables = plan_tables(trial, bodies=to == "qualisys-6d")
        known = "same = true" if not any(system.frame) else f"transform = {list(system.frame)}"
        remark = _MARKERS.format(name=file.name.removesuffix(".markers.toml"), lead=system.lead, frame=known)
        file.write_text(f"{remark}{toml(tables)}", encoding="utf-8")


_MARKERS = """\
# What a test plan says of the bodies in {name}, to be pasted into it: where the made-up markers sit on them.
# The trial begins at {lead:g} s of the file. Its frame in the map, for [sources.capture]: frame = {{ {frame} }}
"""


def _writer(name: str) -> Any:
    write = formats.formats()[name].write
    assert write is not None, name
    return write


def track_of(t: FloatArray, pose: FloatArray) -> Track:
    """Poses (n, 3) in the map as a track of base_link; without samples where there is no position."""
    there = np.isfinite(pose[:, :2]).all(axis=1)
    t, pose = t[there], pose[there]
    zero = np.zeros(len(t))
    turn = np.column_stack([zero, zero, np.sin(pose[:, 2] / 2), np.cos(pose[:, 2] / 2)])
    return Track("pose", "map", "base_link", t, np.column_stack([pose[:, :2], zero]), turn)


# --- CSV -------------------------------------------------------------------------------------------------------------


def columns(trial: Trial) -> dict[str, FloatArray]:
    """The trial as columns, header (with its unit) -> (n,): time, the robot, its estimate and command, the leg, and every
    obstacle; NaN where something is unknown or absent."""
    pose = ("x [m]", "y [m]", "theta [rad]")
    rates = ("v [m/s]", "omega [rad/s]", "v_y [m/s]")
    parts: list[tuple[str, Sequence[str], FloatArray | None]] = [
        ("", ("t [s]",), trial.t[:, None]),
        ("robot ", pose, trial.pose),
        ("robot ", rates, trial.velocity),
        ("estimate ", pose, trial.estimate),
        ("command ", rates, trial.command),
        ("", ("leg",), np.asarray(trial.leg, dtype=np.float64)[:, None]),
    ]
    for name, (body, column) in obstacles(trial).items():
        track = trial.moving_obstacles[:, column] if body.pose is None else np.tile(body.pose, (len(trial.t), 1))
        parts.append((f"{name} ", pose, track))
    return {
        f"{who}{name}": values[:, i]
        for who, names, values in parts
        if values is not None
        for i, name in enumerate(names[: values.shape[1]])
    }


def _write_csv(trial: Trial, file: Path) -> None:
    found = columns(trial)
    with open(file, "x", newline="", encoding="utf-8") as f:
        writer = csv.writer(f, lineterminator="\n")
        writer.writerow(found)
        for row in zip(*(values.tolist() for values in found.values()), strict=True):
            writer.writerow([_text(value) for value in row])
    beside(file).write_text(toml(_description(found)), encoding="utf-8")


def _description(found: Iterable[str]) -> dict[str, Any]:
    """What lets the table be read again: whose columns are which."""
    bodies: dict[str, dict[str, str]] = {}
    for header in found:
        who, _, rest = header.partition(" ")
        name = rest.split(" ")[0]
        if name in _READ_AS and who != "command":
            bodies.setdefault(who, {})[_READ_AS[name]] = header
    return {"separator": ",", "decimal": ".", "units": "m", "up": "z", "frame": "map",
            "time": {"column": "t [s]"}, "bodies": bodies}  # fmt: skip


_READ_AS = {"x": "x", "y": "y", "theta": "yaw", "v": "v", "omega": "omega"}
"""Names of our columns -> what a table's description calls them."""


def _text(value: float) -> str:
    """The shortest text that reads back as the same number; nothing for NaN."""
    return "" if value != value else repr(value).removesuffix(".0")


# --- several ---------------------------------------------------------------------------------------------------------


def telling_name(trial: Trial, number: int, to: str) -> str:
    """`0005-SO-parallel-v0.6-s0.3-d1.5-r1.mcap`: the trial's number in its results, and what it was."""
    labels = trial.attempt.labels
    said = trial.attempt.scenario or "-".join(
        [labels.batch, labels.configuration]
        + [
            f"{letter}{value:g}"
            for letter, value in zip(
                "vosd", (labels.speed, labels.obstacle_speed, labels.size, labels.gap), strict=True
            )
            if value is not None
        ]
        + [f"r{labels.repetition}"]
    )
    return f"{number:04d}-{re.sub(r'[^A-Za-z0-9.+-]+', '_', said)}{TARGETS[to]}"


class Trials(Protocol):
    """Where trials come from, such as a results directory."""

    def __len__(self) -> int: ...

    def trial(self, index: int) -> Trial:
        """Trial number `index`."""
        ...

    def remains(self, index: int) -> Trial:
        """The same, or what is left of it where it was not kept."""
        ...


def settings(to: str, said: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `export_trials` from what was said on a command line; None: nothing was.

    Args:
        said: `which`, `scans`, fields of `System`, and `lead` for rest before and after, default 2 s.

    Raises:
        ClearwayError: unknown format, or something was said that means nothing for it.
    """
    if to not in TARGETS:
        raise unknown("format", to, TARGETS)
    given = {name: value for name, value in said.items() if value is not None}
    for name in given:
        means = {"which": ("tum",), "scans": ("mcap",)}.get(name, CAPTURES)
        if to not in means:
            raise ClearwayError(f"means nothing for {to}, only for {', '.join(means)}", field=f"--{name}")
    arguments: dict[str, Any] = {name: given.pop(name) for name in ("which", "scans") if name in given}
    if to in CAPTURES:
        lead = given.pop("lead", LEAD)
        arguments["system"] = System(**given, lead=lead, tail=lead)
    return arguments


def export_trials(
    trials: Trials,
    wanted: Sequence[int] | None,
    to: str,
    out: Path,
    *,
    system: System | None = None,
    which: str = "both",
    scans: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[tuple[Path, ...], tuple[int, ...]]:
    """Write trials of a results directory: a single one to the file `out` (into it, if it is a folder), several into the
    folder `out`, each under a telling name. Arguments as for `export`; `progress` is told (done, total).

    Args:
        wanted: Which; None: all that were recorded, and kept.

    Returns:
        The files that were written, and the trials that were not recorded, or not kept, where all were wanted.

    Raises:
        ClearwayError: as for `export`; no trial is wanted, or one that isn't there.
    """
    if to not in TARGETS:
        raise unknown("format", to, TARGETS)
    if which not in get_args(Which):
        raise unknown("choice", which, get_args(Which))
    every = wanted is None
    wanted = range(len(trials)) if wanted is None else wanted
    if not wanted:
        raise ClearwayError("say which: --trial N, as often as you like, or --all", field="trial")
    out = Path(out)
    alone = len(wanted) == 1 and not os.path.isdir(out)
    if not alone and os.path.exists(out) and not os.path.isdir(out):
        raise ClearwayError("is a file; several trials go into a folder", file=out)
    if twice := [n for n, times in Counter(wanted).items() if times > 1]:
        raise ClearwayError(f"{twice[0]} is named twice", field="trial")
    left_out, paths = list[int](), dict[int, Path]()
    for number in wanted:  # before anything is written
        trial = trials.remains(number) if every else trials.trial(number)
        if every and (is_outline(trial) or not np.isfinite(trial.pose).any()):
            left_out.append(number)
            continue
        paths[number] = out if alone else out / telling_name(trial, number, to)
        if os.path.lexists(paths[number]) and not os.path.isdir(paths[number]):
            raise ClearwayError("is there already; nothing is overwritten: choose another name", file=paths[number])
    files: list[Path] = []
    for done, (number, path) in enumerate(paths.items()):
        trial = trials.trial(number)
        own = system and replace(system, seed=system.seed + number)
        files += export(trial, to, path, system=own, which=cast(Which, which), scans=scans)
        if progress is not None:
            progress(done + 1, len(paths))
    if not files:
        raise ClearwayError("no trial was recorded: there is nothing to export", file=out)
    return tuple(files), tuple(left_out)
