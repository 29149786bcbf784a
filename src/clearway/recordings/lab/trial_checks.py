"""Whether trials can be made of a plan's recordings: what ties its frames and bodies is read and fitted, and every trial is
made, as scoring would."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from itertools import islice
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.recordings.lab import wildcards
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.lab import ROBOT, Lab
from clearway.recordings.lab.recording_checks import Finding
from clearway.recordings.lab.test_plan import by_number

TRIED = 3
"""Recordings by which a frame or a body is tied: where none of them does it, the plan is wrong."""


def problems_of_ties(lab: Lab, unusable: Collection[int]) -> list[Finding]:
    """Ties that scoring would refuse: static poses not at rest, drives that aren't straight, coordinates that
    don't fit the markers. Each frame and body is tied by the smallest recording that has it, or by the next.

    Args:
        lab: A plan in which nothing else is wrong.
        unusable: Trials, by index, whose recordings can't be used.
    """
    recorded = [i for i, t in enumerate(lab.plan.trials) if lab.files(t) and i not in unusable]
    return list(_problems(lab, sorted(recorded, key=lambda i: _size(lab, i))))


def _problems(lab: Lab, recorded: Sequence[int]) -> Iterator[Finding]:
    untied: set[str] = set()
    for source in lab.plan.sources:
        have = [i for i in recorded if source in lab.files(lab.plan.trials[i])]
        found = _tried(have, partial(_tie, lab, source), f"sources.{source}.frame")
        untied |= {source} if any(not f.trials for f in found) else set()
        yield from found
    for name in (ROBOT, *lab.plan.bodies):
        source, field = lab.source_of(name), name if name == ROBOT else f"bodies.{name}"
        have = [i for i in recorded if source in lab.files(lab.plan.trials[i]) and _there(lab, name, i)]
        if not have or source in untied or not lab.body(name).measured or wildcards.several(lab.body(name)):
            continue
        found = _tried(have, partial(_raw, lab, name, source), field)
        yield from found
        if all(f.trials for f in found) and lab.body(name).static is not None and not lab.linked(name):
            said = (
                f"`static` says where it stands in the map, but the frame of {source!r} is not tied to the map: its markers "
                f"are tied to nothing; give sources.{source}.frame"
            )
            yield Finding(ClearwayError(said, field=f"{field}.static"))


def _tried(recorded: Sequence[int], attempt: Callable[[int], object], field: str) -> list[Finding]:
    """What was wrong with the recordings up to the first that could be tied."""
    wrong: list[Finding] = []
    for index in islice(recorded, TRIED):
        try:
            attempt(index)
        except ClearwayError as error:
            said = error if error.field else ClearwayError(error.problem, file=error.file, field=field)
            wrong.append(Finding(said, frozenset({index})))
        else:
            return wrong
    return [Finding(wrong[0].error)] if wrong else []


def _there(lab: Lab, name: str, index: int) -> bool:
    return name == ROBOT or any(o.body == name and o.pose is None for o in lab.plan.trials[index].obstacles)


def _tie(lab: Lab, source: str, index: int) -> object:
    return lab.tie(source, lab.recording(source, lab.files(lab.plan.trials[index])[source]))


def _raw(lab: Lab, name: str, source: str, index: int) -> object:
    return lab.raw(name, lab.recording(source, lab.files(lab.plan.trials[index])[source]))


def _size(lab: Lab, index: int) -> int:
    """Bytes of the trial's files, of a folder those within it."""
    paths = [lab.folder / file for file in lab.files(lab.plan.trials[index]).values()]
    files = [p for path in paths for p in (path.iterdir() if path.is_dir() else (path,))]
    return sum(os.path.getsize(p) for p in files if p.is_file())


def problems_of_trials(path: Path, found: Sequence[Finding]) -> list[Finding]:
    """Why trials can't be made of their recordings, each reason once.

    Args:
        path: The plan.
        found: What was found wrong before; trials that it concerns are not tried again, and none where it concerns all.
    """
    if any(not f.trials for f in found):
        return []
    lab, known = Lab(path), {i for f in found for i in f.trials}
    said: dict[str, Finding] = {}
    recorded = [i for i, t in enumerate(lab.plan.trials) if lab.files(t) and i not in known]
    for index in sorted(
        recorded, key=lambda i: (lab.plan.trials[i].file, i)
    ):  # a file is read once for all of its trials
        try:
            assemble(lab, index)
        except ClearwayError as error:
            one = by_number(error, path)
            before = said.get(str(one))
            said[str(one)] = Finding(one, frozenset({index}) | (before.trials if before else frozenset()))
    return [*said.values(), *_unfitted(lab, len(said) < len(recorded))]


def _unfitted(lab: Lab, recorded: bool) -> Iterator[Finding]:
    """Patterns that nothing in any recording fits."""
    for name, body in lab.plan.bodies.items():
        if recorded and wildcards.several(body) and name not in lab.fitted:
            field = name if getattr(lab.plan, name, None) == body.track else f"bodies.{name}.track"
            yield Finding(
                ClearwayError(f"no recording has a track, or markers, whose name fits {body.track!r}", field=field)
            )
