"""A day in a laboratory that never was: trials as the files that it would have left, and the test plan that scores them.

This is what a round trip needs: the trial goes out through a format's writer, comes back through its reader, and every
indicator can be held against the trial's own.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.contract import PLACED
from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.exports.export import CAPTURES, TARGETS, export, track_of
from clearway.recordings.exports.synthetic import (
    LAB,
    ROBOT,
    System,
    body_name,
    held,
    plan_tables,
    shape_table,
    straight,
    visiting,
)
from clearway.recordings.protocol.toml_text import toml
from clearway.recordings.recording import Recording
from clearway.trials import Body, Outcome, Trial

Table = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Session:
    """Files in `folder` and the plan's content, with every leg's span."""

    folder: Path
    content: Table

    def write_plan(self, name: str = "plan.toml", *, spans: bool = True) -> Path:
        """Write the test plan; without `spans` the legs have to be found."""
        content = dict(self.content)
        if not spans:
            content["trial"] = [{k: v for k, v in t.items() if k != "legs"} for t in content["trial"]]
        path = self.folder / name
        path.write_text(toml(content), encoding="utf-8")
        return path


def record(
    folder: Path, trials: Sequence[Trial], to: str, system: System = LAB, *, coordinates: bool = True
) -> Session:
    """Export trials of one robot to files in `folder`, with what ties them to the map.

    Args:
        to: one of `clearway.recordings.exports.export.TARGETS`. Capture layouts are recorded by `system`, with the robot held on
            A and on B; the others hold the trial as it is, in the map; TUM has a file for every moving obstacle too.
        coordinates: whether the lab knows where the robot's markers sit in base_link; otherwise the frame's place is
            given and a hold and a straight drive tell.

    Raises:
        ClearwayError: the trials are of several robots, or a file can't be written.
    """
    robots = {(t.attempt.robot, t.attempt.navigator, t.attempt.localisation) for t in trials}
    if len(robots) != 1:
        raise ClearwayError(f"a session has one robot, driven by one navigator, not {len(robots)}", field="trials")
    folder.mkdir(parents=True, exist_ok=True)
    first = trials[0].attempt
    content: Table = {
        "test": {
            "suite": first.labels.suite,
            "robot": first.robot,
            "navigator": first.navigator,
            "localisation": first.localisation,
            "floor_plan": first.floor_plan,
            "reference_length": first.reference_length,
        },
        "sources": _Sources(folder, trials, to, system, coordinates).table(),
        ROBOT: _robot(trials[0], to, coordinates) | {"outline": 0.0},  # outlines are exact: nobody built the robot
        "bodies": {},
        "legs": [
            {"name": leg.name, "start": leg.start.tolist(), "goal": leg.goal.tolist(), "scored": leg.scored}
            for leg in first.legs
        ],
        "trial": [_trial(folder, i, trial, to, system) for i, trial in enumerate(trials)],
    }
    for trial in trials:
        content["bodies"] |= _bodies(trial, to)
        if to == "tum":
            content["sources"] |= {
                n: {"clock": "same", "frame": {"same": True}} for n, b in _bodies(trial, to).items() if "source" in b
            }
    return Session(folder, content)


class _Sources:
    """How the capture is tied to the map, and the recordings that it takes."""

    def __init__(self, folder: Path, trials: Sequence[Trial], to: str, system: System, coordinates: bool) -> None:
        self.folder, self.trial, self.to, self.system = folder, trials[0], to, system
        self.coordinates = coordinates

    def table(self) -> Table:
        if self.to not in CAPTURES:
            source: Table = {"format": READ_AS.get(self.to, self.to), "frame": {"same": True}}
            if self.trial.estimate is not None and self.to in ESTIMATE:
                source["estimate"] = ESTIMATE[self.to]
            return {"capture": source}
        leg = self.trial.attempt.legs[0]
        if not self.coordinates:
            _extra(self.folder, self.to, "hold_A", held(self.trial, leg.start, self.system, bodies=self._bodies))
            _extra(self.folder, self.to, "straight", straight(self.trial, leg.start, self.system, bodies=self._bodies))
            return {
                "capture": {"format": self.to, "frame": {"transform": list(self.system.frame), "uncertainty": KNOWN}}
            }
        holds = []
        for name, pose in (("A", leg.start), ("B", leg.goal)):
            file = _extra(
                self.folder, self.to, f"hold_{name}", held(self.trial, pose, self.system, bodies=self._bodies)
            )
            holds.append({"file": file, "pose": pose.tolist()})
        return {"capture": {"format": self.to, "frame": {"static_poses": holds, "uncertainty": KNOWN}}}

    @property
    def _bodies(self) -> bool:
        return self.to == "qualisys-6d"


READ_AS = {"mcap": "bag", "csv": "table"}
"""Formats that are read under another name than they are written."""
KNOWN = [0.0001, 0.0001]
"""m, rad: how exactly a pose is known that was never taped to a floor."""
ESTIMATE = {"mcap": "/amcl_pose", "csv": "estimate"}
"""The robot's own estimate in those that hold it."""


def _extra(folder: Path, to: str, name: str, recording: Recording) -> str:
    write = formats.formats()[to].write
    assert write is not None
    file = f"{name}{TARGETS[to]}"
    write(folder / file, recording)
    return file


def _robot(trial: Trial, to: str, coordinates: bool) -> Table:
    if to == "tum":
        return {"track": "trajectory"}
    if to == "mcap":
        return {"track": "/ground_truth/pose"}
    if to == "csv":
        return {"track": "robot"}
    seen: Table = {"track": ROBOT} if to == "qualisys-6d" else {"markers": f"{ROBOT}:"}
    if coordinates:
        return dict(plan_tables(trial, bodies=to == "qualisys-6d")[ROBOT])
    leg = trial.attempt.legs[0]
    return seen | {
        "static": {"file": f"hold_A{TARGETS[to]}", "pose": leg.start.tolist()},
        "straight": {"file": f"straight{TARGETS[to]}"},
    }


def _bodies(trial: Trial, to: str) -> Table:
    bodies: Table = {}
    for body in trial.attempt.bodies:
        if body.kind not in PLACED:
            continue
        name = body_name(body)
        entry: Table = {"shape": shape_table(body.shape), "outline": 0.0} | visiting(trial, body)
        if to in CAPTURES:
            entry |= plan_tables(trial, bodies=to == "qualisys-6d")["bodies"][name]
        elif to == "csv":
            entry |= {"track": name}
        elif to == "tum" and body.pose is None:
            entry |= {"source": name, "track": "trajectory"}
        elif to == "mcap" and body.pose is None:
            entry |= {"track": f"/obstacles/{re.sub(r'[^A-Za-z0-9_]+', '_', body.name)}/pose"}
        bodies[name] = entry
    return bodies


def _trial(folder: Path, i: int, trial: Trial, to: str, system: System) -> Table:
    labels, file = trial.attempt.labels, f"trial_{i:03d}{TARGETS[to]}"
    lead = system.lead if to in CAPTURES else 0.0
    export(trial, to, folder / file, system=replace(system, seed=system.seed + i), which="true", scans=False)
    table: Table = {"file": file}
    if to == "tum":
        table["files"] = _moving_obstacles(folder, i, trial)
    for name in ("batch", "configuration", "speed", "obstacle_speed", "size", "gap", "repetition"):
        if (value := getattr(labels, name)) is not None:
            table[name] = value
    placed = []
    there = seen_moving(trial)
    for body in trial.attempt.bodies:
        if body.kind in PLACED and (body.pose is not None or body in there):
            seen = to in CAPTURES or to == "csv" or body.pose is None
            placed.append(
                {"body": body_name(body)} | ({} if seen or body.pose is None else {"pose": body.pose.tolist()})
            )
    table["obstacles"] = placed
    table["legs"] = [
        {"name": trial.attempt.legs[s.leg].name, "span": [lead + s.start, lead + s.end], "reached": s.reached}
        for s in trial.spans
        if s.end > s.start
    ]
    if trial.outcome is Outcome.COLLISION:
        table["contact"] = True
    elif trial.outcome in (Outcome.ABORTED, Outcome.NAVIGATOR_FAILED, Outcome.LIVELOCK):
        table["aborted"] = True
    return table


def seen_moving(trial: Trial) -> dict[Body, int]:
    """The moving obstacles that are there for two samples or more, and their columns."""
    moving = [b for b in trial.attempt.bodies if b.pose is None]
    return {b: k for k, b in enumerate(moving) if np.isfinite(trial.moving_obstacles[:, k]).all(axis=1).sum() > 1}


def _moving_obstacles(folder: Path, i: int, trial: Trial) -> dict[str, str]:
    """A TUM file of every moving obstacle that was ever there."""
    files: dict[str, str] = {}
    write = formats.formats()["tum"].write
    assert write is not None
    for body, k in seen_moving(trial).items():
        name = body_name(body)
        files[name] = f"trial_{i:03d}_{name}.tum"
        track = track_of(trial.t, trial.moving_obstacles[:, k])
        write(folder / files[name], Recording(Path(), "tum", tracks={name: track}))
    return files
