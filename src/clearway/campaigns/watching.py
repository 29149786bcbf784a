"""Scores a day in the lab as it goes: whenever a recording, the ticks or the plan has changed, what is new is scored."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from clearway.campaigns.progress import ProgressCallback
from clearway.campaigns.scoring import score_plan
from clearway.errors import ClearwayError
from clearway.reading import read_toml
from clearway.recordings.lab.captures import file_names
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.lab.test_plan import RecordedTrialSpec, TestPlan
from clearway.recordings.protocol.lab_trials import setting
from clearway.trials.store import Results
from clearway.trials.trial import UNUSABLE, Outcome

LOOK = 1.0
"""s between two looks; a file that did not change from one to the next is whole."""

OPEN = (".active", ".part", ".tmp")
"""Ends of the names of files that whoever writes them renames when they are complete."""
BAGS, METADATA = (".db3", ".mcap"), "metadata.yaml"
"""What lies in a ROS 2 bag's folder."""

Seen = dict[Path, tuple[int, int]]
"""Size [bytes] and time of change [ns] of files."""


@dataclass(frozen=True, slots=True)
class Round:
    """Where the day stands.

    Attributes:
        results: All that is scored; None where nothing is yet.
        trials: How many the plan has.
        coming: The next trial in words; empty where every one was driven.
        repeat: Trials whose recordings can't be used, by number in the plan, with the reason.
        unclear: Trials whose recordings end before their goals while nobody said why, by number, with what is known.
        waits: Recordings that are there and not complete; the operators' table, if it is not there yet.
        problem: Why nothing could be scored this time; empty where it could.
    """

    results: Results | None
    trials: int
    coming: str
    repeat: dict[int, str]
    unclear: dict[int, str]
    waits: tuple[str, ...] = ()
    problem: str = ""

    @property
    def done(self) -> int:
        """How many trials are scored."""
        return 0 if self.results is None else len(self.results)

    @property
    def finished(self) -> bool:
        """Whether all were driven, none has to be repeated, and nothing is waited for."""
        return not (self.coming or self.repeat or self.unclear or self.waits or self.problem)


def watch(
    plan: Path,
    captures: Path,
    out: Path,
    *,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
    pause: Callable[[float], None] = time.sleep,
) -> Iterator[Round]:
    """Score what comes in, until every trial of the plan was driven and can be used.

    Args:
        plan: The test plan's TOML.
        captures: The folder into which recordings come.
        out: The results directory; one that holds results of this plan is gone on with.
        workers: How many processes; None: one a core.
        progress: Told how far each round is.
        pause: Waits between two looks.

    Yields:
        Where the day stands, at the start and whenever something has changed.

    Raises:
        ClearwayError: there is no such folder.
        CampaignInterrupted: Ctrl-C while something is scored.
    """
    if not captures.is_dir():
        raise ClearwayError("no such folder; recordings are to come into it", file=captures)
    captures = Path(os.path.abspath(captures))
    before, scored = _seen(plan, captures, out), Seen()
    first = True
    while True:
        pause(LOOK)
        now = _seen(plan, captures, out)
        written = {p for p, s in now.items() if before.get(p) != s}
        before = now
        news = first or bool(scored.keys() - now.keys()) or any(scored.get(p) != now[p] for p in now.keys() - written)
        if not news or any(captures not in p.parents for p in written):  # the plan or the ticks are being saved
            continue
        first, scored = False, {p: s for p, s in now.items() if p not in written}
        last = _round(plan, captures, out, written, workers, progress)
        yield last
        if last.finished:
            return


def _seen(plan: Path, captures: Path, out: Path) -> Seen:
    """What counts: the plan, its ticks, and everything in the folder but the results."""
    aside = Path(os.path.abspath(out))
    files = [plan, *(p for p in captures.rglob("*") if aside not in p.parents and p.is_file())]
    files += [ticks] if (ticks := _ticks(plan)) else []
    found = Seen()
    for file in files:
        try:
            about = file.stat()
        except OSError:
            continue  # it went while we looked
        found[file] = about.st_size, about.st_mtime_ns
    return found


def _ticks(plan: Path) -> Path | None:
    """The operators' table, if the plan names one."""
    try:
        about = read_toml(plan).get("test")
    except ClearwayError:
        return None  # it is told when the plan is scored
    name = about.get("ticks") if isinstance(about, dict) else None
    return plan.parent / name if isinstance(name, str) and name else None


def _round(
    plan: Path,
    captures: Path,
    out: Path,
    written: set[Path],
    workers: int | None,
    progress: ProgressCallback | None,
) -> Round:
    """Score what is new, beside the files that are still `written`."""
    ticks = _ticks(plan)
    lacking = () if ticks is None or ticks.exists() else (Path(os.path.abspath(ticks)),)
    unready = {*lacking} | {
        p for file in written | _open(captures) for p in (file, *file.parents) if captures in p.parents
    }
    try:
        said = load_test_plan(plan, unready)
    except ClearwayError as error:
        return Round(None, 0, "", {}, {}, problem=str(error))
    results, problem = None, ""
    if any(t.attempted or said.files_of(t) for t in said.trials):
        try:
            results = score_plan(plan, out, workers=workers, resume=True, unready=unready, progress=progress)
        except ClearwayError as error:
            problem = str(error)
    waits = tuple(sorted(p.name for p in unready if p.parent == captures or p in lacking))
    short = {} if results is None else _short(results)
    repeat = {n: why for n, why in short.items() if UNUSABLE in why}
    unclear = {n: why for n, why in short.items() if n not in repeat and not _explained(said.trials[n - 1])}
    return Round(results, len(said.trials), _coming(said), repeat, unclear, waits, problem)


def _open(captures: Path) -> set[Path]:
    """Recordings whose names say that they are not complete, and bags whose folders do: their metadata come last."""
    files = [p for p in captures.rglob("*") if p.suffix in (*BAGS, *OPEN)]
    return {p for p in files if p.suffix in OPEN or (p.parent != captures and not (p.parent / METADATA).exists())}


def _coming(plan: TestPlan) -> str:
    names = file_names(plan)
    for number, (trial, name) in enumerate(zip(plan.trials, names, strict=True), 1):
        if not trial.attempted and not plan.files_of(trial):
            words = [f"no. {number}: {setting(trial)}"]
            words += [] if trial.speed is None else [f"{trial.speed:g} m/s"]
            words += [] if trial.obstacle_speed is None else [f"obstacle {trial.obstacle_speed:g} m/s"]
            words += [f"repetition {trial.repetition}", *([name] if name else [])]
            return ", ".join(words)
    return ""


def _short(results: Results) -> dict[int, str]:
    """Why recorded trials did not get to their goals, by number in the plan, but for collisions and time limits."""
    numbers, rows = results.campaign["numbers"], results.trials.select(["outcome", "reason"]).to_pylist()
    return {n: str(r["reason"]) for n, r in zip(numbers, rows, strict=True) if r["outcome"] == Outcome.ABORTED}


def _explained(trial: RecordedTrialSpec) -> bool:
    """Whether somebody said why a trial ended, or that it was not recorded."""
    return trial.stopped or bool(trial.helped) or trial.aborted or not trial.file
