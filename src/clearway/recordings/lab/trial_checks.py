"""Whether what ties a plan's frames and bodies does so: the stretches are read and fitted, as scoring would."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.recordings.lab.lab import ROBOT, Lab
from clearway.recordings.lab.test_plan import RecordedTrialSpec


def problems_of_ties(path: Path) -> list[ClearwayError]:
    """Ties that scoring would refuse: static poses not at rest, drives that aren't straight, coordinates that
    don't fit the markers. Each frame and body is tied once, by the smallest recording that has it.

    Args:
        path: A plan in which nothing else is wrong.
    """
    lab = Lab(path)
    recorded = sorted((t for t in lab.plan.trials if lab.files(t)), key=lambda t: _size(lab, t))
    return [] if not recorded else list(_problems(lab, recorded))


def _problems(lab: Lab, recorded: list[RecordedTrialSpec]) -> Iterator[ClearwayError]:
    untied: set[str] = set()
    for source in lab.plan.sources:
        trial = next((t for t in recorded if source in lab.files(t)), None)
        if trial is not None and (wrong := _wrong(partial(_tie, lab, source, trial), f"sources.{source}.frame")):
            untied.add(source)
            yield wrong
    for name in (ROBOT, *lab.plan.bodies):
        source, field = lab.source_of(name), name if name == ROBOT else f"bodies.{name}"
        trial = next((t for t in recorded if source in lab.files(t) and _there(name, t)), None)
        if trial is None or source in untied or not lab.body(name).measured:
            continue
        if wrong := _wrong(partial(_raw, lab, name, source, trial), field):
            yield wrong
        elif lab.body(name).static is not None and not lab.linked(name):
            yield ClearwayError(
                f"`static` says where it stands in the map, but the frame of {source!r} is not tied to the map: its markers "
                f"are tied to nothing; give sources.{source}.frame",
                field=f"{field}.static",
            )


def _wrong(attempt: Callable[[], object], field: str) -> ClearwayError | None:
    try:
        attempt()
    except ClearwayError as error:
        return error if error.field else ClearwayError(error.problem, file=error.file, field=field)
    return None


def _there(name: str, trial: RecordedTrialSpec) -> bool:
    return name == ROBOT or any(o.body == name and o.pose is None for o in trial.obstacles)


def _tie(lab: Lab, source: str, trial: RecordedTrialSpec) -> object:
    return lab.tie(source, lab.recording(source, lab.files(trial)[source]))


def _raw(lab: Lab, name: str, source: str, trial: RecordedTrialSpec) -> object:
    return lab.raw(name, lab.recording(source, lab.files(trial)[source]))


def _size(lab: Lab, trial: RecordedTrialSpec) -> int:
    """Bytes of the trial's files, of a folder those within it."""
    paths = [lab.folder / file for file in lab.files(trial).values()]
    files = [p for path in paths for p in (path.iterdir() if path.is_dir() else (path,))]
    return sum(os.path.getsize(p) for p in files if p.is_file())
