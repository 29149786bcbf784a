"""What the recordings of a test plan lack of what it names. Each file is looked at once."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from clearway.errors import ClearwayError, unknown
from clearway.recordings import formats
from clearway.recordings.formats import table
from clearway.recordings.formats.bag_actions import action_of
from clearway.recordings.formats.bag_file import SEVERAL
from clearway.recordings.lab.source_spec import Span
from clearway.recordings.lab.test_plan import BodySpec, TestPlan, at, source_of, without_coordinates
from clearway.recordings.lab.wildcards import several
from clearway.recordings.motion.markers import resolve
from clearway.recordings.recording import Contents, Want, contents_of


def references(plan: TestPlan) -> Iterator[tuple[str, str, str, Span | None]]:
    """Every recording that the plan names: field, source, file, span."""
    for name, source in plan.sources.items():
        if source.frame.file is not None:
            yield f"sources.{name}.frame.file", name, source.frame.file, None
        for j, pose in enumerate(source.frame.static_poses):
            yield f"sources.{name}.frame.static_poses.{j}", name, pose.file, pose.span
    recorded = {"robot"} | {
        f"bodies.{o.body}" for t in plan.trials if plan.files_of(t) for o in t.obstacles if o.pose is None
    }
    for where, body in all_bodies(plan):
        if where not in recorded:
            continue  # what ties it is not needed yet
        for kind, stretch in (("static", body.static), ("straight", body.straight), ("turn", body.turn)):
            if stretch is not None:
                yield f"{where}.{kind}", source_of(plan, body), stretch.file, stretch.span
    for i, trial in enumerate(plan.trials):
        for name, file in plan.files_of(trial).items():
            first = bool(trial.file) and name == next(iter(plan.sources))
            yield at(i, "file" if first else f"files.{name}"), name, file, trial.span if first else None


def all_bodies(plan: TestPlan) -> list[tuple[str, BodySpec]]:
    return [("robot", plan.robot), *((f"bodies.{name}", body) for name, body in plan.bodies.items())]


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong with a plan or with a recording of it.

    Attributes:
        error: What is wrong, and where.
        trials: The trials, by index, whose recordings it lies in, while others are as they should be; empty: it lies in the plan
            or in what all trials need.
    """

    error: ClearwayError
    trials: frozenset[int] = frozenset()


def findings_in(plan: TestPlan, folder: Path, fresh: Collection[int] | None = None) -> list[Finding]:
    """What the recordings lack of what the plan names.

    Args:
        plan: The plan.
        folder: Its folder.
        fresh: The trials, by index, into whose recordings to look; None: all.
    """

    @cache
    def look(source: str, file: str) -> Contents | ClearwayError:
        spec = plan.sources[source]
        try:
            if spec.table is not None:
                return contents_of(table.read_with(folder / file, folder / spec.table, Want()))
            return formats.look(folder / file, format=spec.format, time=spec.time)
        except ClearwayError as error:
            return error

    kept = _Kept()
    for field, source, file, span in references(plan):
        spec, trial = plan.sources[source], trial_of(field)
        if trial is not None and fresh is not None and trial not in fresh:
            continue
        if not os.path.exists(folder / file) or (spec.format or "table") not in formats.formats():
            continue
        if spec.table is not None and not os.path.isfile(folder / spec.table):
            continue
        held = look(source, file)
        if isinstance(held, ClearwayError):
            error = ClearwayError(held.problem, file=held.file or folder / file, field=held.field)
            kept.add(str(held), error, trial)
            continue
        if (
            span is not None
            and held.start is not None
            and held.end is not None
            and not (held.start - 1e-6 <= span[0] and span[1] <= held.end + 1e-6)
        ):
            error = ClearwayError(
                f"{span[0]:g} to {span[1]:g} s is not within {file!r}, which has {held.start:g} to {held.end:g} s",
                field=field if field.endswith(("static", "straight", "turn")) else f"{field.rpartition('.')[0]}.span",
            )
            kept.add(str(error), error, trial)
        for where, wrong in _missing(plan, field, source, held):
            error = ClearwayError(f"{wrong.problem} (in {file!r})", field=where)
            kept.add(f"{where}{wrong.problem}", error, trial, where)
    return kept.findings(plan)


class _Kept:
    """What was found, each said once, with the trials that it was found in."""

    def __init__(self) -> None:
        self._errors: dict[str, ClearwayError] = {}
        self._trials: dict[str, set[int | None]] = {}
        self._where: dict[str, str] = {}

    def add(self, key: str, error: ClearwayError, trial: int | None, where: str = "") -> None:
        """Keep it; `trial`: None of a recording that all need; `where`: the plan's field whose name the recording lacks."""
        self._errors.setdefault(key, error)
        self._trials.setdefault(key, set()).add(trial)
        if where:
            self._where[key] = where

    def findings(self, plan: TestPlan) -> list[Finding]:
        """All of it; what every recording lacks that should have it lies in the plan."""
        lacking: dict[str, set[int | None]] = {}
        for key, where in self._where.items():
            lacking.setdefault(where, set()).update(self._trials[key])
        found = []
        for key, error in self._errors.items():
            trials, where = self._trials[key], self._where.get(key, "")
            shared = None in trials or bool(where and lacking[where] >= _should_have(plan, where))
            found.append(Finding(error, frozenset() if shared else frozenset(i for i in trials if i is not None)))
        return found


def _should_have(plan: TestPlan, where: str) -> set[int]:
    """The recorded trials whose files should have what a field of the plan names."""
    recorded = {i: plan.files_of(t) for i, t in enumerate(plan.trials) if plan.files_of(t)}
    for name in plan.sources:
        if where.startswith(f"sources.{name}."):
            return {i for i, files in recorded.items() if name in files}
    for name in plan.bodies:
        if where.startswith(f"bodies.{name}."):
            return {i for i in recorded if any(o.body == name and o.pose is None for o in plan.trials[i].obstacles)}
    return set(recorded)


def trial_of(field: str) -> int | None:
    """The trial, by index, that a field belongs to."""
    return int(field.split(".")[1]) if field.startswith("trial.") else None


def _missing(plan: TestPlan, field: str, source: str, held: Contents) -> Iterator[tuple[str, ClearwayError]]:
    """Names that a file lacks: the field that has the name, and the problem."""
    markers = [e.name for e in held.entries if e.kind == "marker"]
    for where, body in _looked_for(plan, field, source):
        named = body.markers or tuple(body.coordinates or ())
        if (
            named and body.track is None and not any(e.kind == "markers" for e in held.entries)
        ):  # told when they are read
            try:
                names = resolve(markers, named)
            except ClearwayError as error:
                yield f"{where}.{'coordinates' if body.markers is None else 'markers'}", error
            else:
                if (lacking := without_coordinates(names, body)) is not None:
                    yield f"{where}.coordinates", ClearwayError(lacking)
        if body.track is not None and not several(body) and (wrong := _no_track(body.track, held, "track")):
            yield f"{where}.track", wrong
    frame = plan.sources[source].frame
    if field == f"sources.{source}.frame.file" or (field.startswith("trial.") and frame.file is None):
        for j, s in enumerate(frame.surveyed):
            if s.marker not in markers:
                yield f"sources.{source}.frame.surveyed.{j}.marker", unknown("marker", s.marker, markers)
    if field.startswith("trial."):
        spec = plan.sources[source]
        for name in ("estimate", "odometry", "goals", "plans"):
            wanted = getattr(spec, name)
            if wanted is not None and (wrong := _no_track(wanted, held, "topic or track")):
                yield f"sources.{source}.{name}", wrong


def _looked_for(plan: TestPlan, field: str, source: str) -> list[tuple[str, BodySpec]]:
    """The bodies that have to be in a file, by the field that names it."""
    if field.startswith("trial."):
        trial = plan.trials[int(field.split(".")[1])]
        there = {f"bodies.{o.body}" for o in trial.obstacles if o.pose is None} | {"robot"}
    elif field.endswith((".static", ".straight", ".turn")):
        there = {field.rpartition(".")[0]}
    elif ".frame.static_poses." in field:
        there = {"robot"}
    else:
        there = set()
    return [(w, b) for w, b in all_bodies(plan) if w in there and source_of(plan, b) == source]


def _no_track(name: str, held: Contents, kind: str) -> ClearwayError | None:
    """What a file holds need not be all: of a bag's /tf it is topics, and a pair of frames is told when it is read."""
    known = [e.name for e in held.entries if e.kind != "marker"]
    parts_of_topics = any(name.startswith(f"{e.name}/") for e in held.entries if e.kind in SEVERAL)
    action = any(action_of(e.name) == name for e in held.entries if e.kind == "action")
    pair = "->" in name and any(e.kind == "tf" for e in held.entries)
    return None if name in known or parts_of_topics or action or pair else unknown(kind, name, known)
