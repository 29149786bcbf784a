"""Which file is which trial's, where a source of a test plan says how its files are named, or only where they lie.

`files = "captures/{configuration}_{repetition}.csv"` names the file of each trial by what the plan says of it;
`files = "captures/"` and `files = "captures/*.csv"` give the files that are there to the trials, in the plan's order.
"""

from __future__ import annotations

import glob
import os
import re
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from string import Formatter

from clearway.errors import ClearwayError, unknown
from clearway.recordings.lab.test_plan import RecordedTrialSpec, TestPlan, source_of

FIELDS = ("number", "batch", "configuration", "speed", "obstacle_speed", "size", "gap", "repetition")
"""What a file's name may say of its trial; `number` is the one that plan and run sheet print."""


def with_files(plan: TestPlan, folder: Path, unready: Collection[Path] = ()) -> TestPlan:
    """The plan with the files of its trials, as far as they are there.

    A trial without its file is then one that was not driven yet, unless it says `attempted = true`; so is one that lacks the file
    of another source which measures something in it.

    Args:
        plan: The plan.
        folder: Its folder.
        unready: Files (absolute) that are still being written, and count as not there.

    Raises:
        ClearwayError: a source's `files` can't be read, or gives a file to two trials.
    """
    plan = _with_videos(plan, folder, unready)
    patterns = {name: source.files for name, source in plan.sources.items() if source.files is not None}
    if not patterns:
        return plan
    found: dict[str, dict[int, str]] = {}
    for name, pattern in patterns.items():
        field = f"sources.{name}.files"
        places = _named(plan, pattern, field)
        found[name] = (
            dict(_in_order(plan, name, folder, unready)) if places is None else _there(places, folder, unready, field)
        )
    trials = tuple(_filled(plan, i, {n: f[i] for n, f in found.items() if i in f}) for i in range(len(plan.trials)))
    return plan.model_copy(update={"trials": trials})


def _with_videos(plan: TestPlan, folder: Path, unready: Collection[Path]) -> TestPlan:
    """The plan with the videos of its trials, as far as they are there, and where in them the first source's clock begins."""
    if plan.video is None:
        return plan
    field = "video.files"
    places = _named(plan, plan.video.files, field)
    if places is None:
        raise ClearwayError(f"{plan.video.files!r} says nothing of trials; such as 'video/{{number}}.mp4'", field=field)
    found = _there(places, folder, unready, field)
    trials = []
    for i, trial in enumerate(plan.trials):
        said = {"video": trial.video or found.get(i, "")}
        trials.append(
            trial.model_copy(
                update=said | ({} if trial.video_offset is not None else {"video_offset": plan.video.offset})
            )
        )
    return plan.model_copy(update={"trials": tuple(trials)})


def file_names(plan: TestPlan) -> list[str]:
    """The file that each trial's recording goes to, for the run sheet; empty where the plan does not say."""
    first, source = next(iter(plan.sources.items()))
    places = None if source.files is None else _named(plan, source.files, f"sources.{first}.files")
    return [t.file or ("" if places is None else places[i]) for i, t in enumerate(plan.trials)]


def nobodys(plan: TestPlan, folder: Path) -> list[str]:
    """Files that lie where a source's files do, and are no trial's.

    Args:
        plan: The plan, with its files.
        folder: Its folder.
    """
    known, found = _known(plan), []
    for source in plan.sources.values():
        if source.files is not None:
            parts = list(Formatter().parse(source.files))
            wide = "".join(_literal(text) + ("*" if field is not None else "") for text, field, _, _ in parts)
            wide = _wide(source.files, folder) if all(field is None for _, field, _, _ in parts) else wide
            found += [f for f in _matching(wide, folder, ()) if os.path.normpath(f) not in known]
    return list(dict.fromkeys(found))


def _literal(text: str) -> str:
    """A literal part of a pattern: its `*` and `?` stand for anything, its brackets for themselves."""
    return text.replace("[", "[[]")


def _named(plan: TestPlan, pattern: str, field: str) -> list[str] | None:
    """The name of each trial's file, which may have wildcards; None where the pattern says nothing of trials."""
    try:
        parts = list(Formatter().parse(pattern))
    except ValueError as error:
        raise ClearwayError(
            f"{pattern!r} is no pattern: {error}; such as 'trial_{{number}}.csv'", field=field
        ) from error
    names = [name for _, name, _, _ in parts if name is not None]
    for name in names:
        if name not in FIELDS:
            raise unknown("field of a trial", name, FIELDS, field=field)
    if not names:
        return None
    made = []
    for number, trial in enumerate(plan.trials, 1):
        text = ""
        for literal, key, spec, _ in parts:
            text += _literal(literal)
            if key is not None:
                value = number if key == "number" else getattr(trial, key)
                text += glob.escape(_said(value, spec or "", field))
        made.append(text)
    own = [name for name, trial in zip(made, plan.trials, strict=True) if not trial.file]
    twice = next((name for name, n in Counter(own).items() if n > 1), None)
    if twice is not None:
        who = " and ".join(f"no. {i}" for i, name in enumerate(made, 1) if name == twice)
        raise ClearwayError(
            f"{pattern!r} gives trials {who} the same file, {twice!r}; more of {', '.join(FIELDS)} tells them apart",
            field=field,
        )
    return made


def _said(value: str | float | None, spec: str, field: str) -> str:
    if value is None:
        return ""
    try:
        return format(value, spec or ("g" if isinstance(value, float) else ""))
    except ValueError as error:
        raise ClearwayError(f"{value!r} can't be written as {spec!r}: {error}", field=field) from error


def _there(places: list[str], folder: Path, unready: Collection[Path], field: str) -> dict[int, str]:
    """Of the names, those that are there, by trial."""
    found = {}
    for i, name in enumerate(places):
        match = _matching(name, folder, unready)
        if len(match) > 1:
            raise ClearwayError(
                f"{match[0]!r} and {match[1]!r} both are trial no. {i + 1}'s; leave one of them", field=field
            )
        if match:
            found[i] = match[0]
    return found


def _in_order(plan: TestPlan, source: str, folder: Path, unready: Collection[Path]) -> Iterator[tuple[int, str]]:
    """What is there, to the trials that need a file, in the plan's order."""
    pattern, known = plan.sources[source].files or "", _known(plan)
    files = [f for f in _matching(_wide(pattern, folder), folder, unready) if os.path.normpath(f) not in known]
    need = [i for i, t in enumerate(plan.trials) if t.recorded and source not in plan.files_of(t)]
    yield from zip(need, files, strict=False)


def _wide(pattern: str, folder: Path) -> str:
    """A pattern that says nothing of trials: of a folder, everything in it."""
    return os.path.join(pattern, "*") if (folder / pattern).is_dir() else pattern


def _matching(pattern: str, folder: Path, unready: Collection[Path]) -> list[str]:
    """Files that a pattern with wildcards names, by their names, with 2 before 10, as the plan would name them. Descriptions
    (TOML) and hidden files are none."""
    seen = [
        n
        for n in glob.glob(pattern, root_dir=folder)
        if not n.endswith(".toml") and Path(os.path.abspath(folder / n)) not in unready
    ]
    return sorted(seen, key=_natural)


def _natural(name: str) -> list[tuple[int, int, str]]:
    return [(0, int(p), "") if p.isdigit() else (1, 0, p) for p in re.split(r"(\d+)", name) if p]


def _known(plan: TestPlan) -> set[str]:
    """Files that the plan names itself."""
    stretches = [s for b in (plan.robot, *plan.bodies.values()) for s in (b.static, b.straight, b.turn) if s]
    frames = [source.frame for source in plan.sources.values()]
    names = [s.file for s in stretches] + [p.file for f in frames for p in f.static_poses]
    names += [f.file for f in frames if f.file] + [f for t in plan.trials for f in plan.files_of(t).values()]
    names += [n for n in (plan.test.ticks, *(s.table for s in plan.sources.values())) if n]
    return {os.path.normpath(n) for n in names}


def _filled(plan: TestPlan, index: int, found: dict[str, str]) -> RecordedTrialSpec:
    trial, first = plan.trials[index], next(iter(plan.sources))
    files = found | plan.files_of(trial)
    measured = {source_of(plan, plan.bodies[o.body]) for o in trial.obstacles if o.pose is None}
    if {first, *measured} <= set(files):
        return trial.model_copy(update={"file": files[first], "files": {n: f for n, f in files.items() if n != first}})
    known = "attempted" in trial.model_fields_set or plan.files_of(trial) or not trial.recorded
    return trial if known else trial.model_copy(update={"attempted": False})
