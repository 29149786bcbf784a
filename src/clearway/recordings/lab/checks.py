"""Everything that can be wrong with a test plan and the files that it names, found before anything is scored."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from clearway.errors import ClearwayError, nearest, unknown
from clearway.recordings import formats
from clearway.recordings.lab.captures import nobodys
from clearway.recordings.lab.lab import Lab
from clearway.recordings.lab.plan_file import WrongPlan, load_test_plan
from clearway.recordings.lab.recording_checks import Finding, findings_in, references, trial_of
from clearway.recordings.lab.source_spec import Span
from clearway.recordings.lab.test_plan import (
    BodySpec,
    TestPlan,
    at,
    by_number,
    seen_from,
    shape_of,
    source_of,
)
from clearway.recordings.lab.trial_checks import problems_of_ties, problems_of_trials
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import load_suite, suite_names


def problems_of(path: str | Path, *, inside: bool = True) -> list[ClearwayError]:
    """Everything that is wrong with a test plan; empty if there is nothing.

    Args:
        path: The plan's file.
        inside: Whether to look into the recordings, too: whether they hold the markers, tracks and spans that the plan names, and
            whether every trial can be made of them.
    """
    found = findings(path, inside=inside)
    if inside:
        found += problems_of_trials(Path(path), found)
    return [finding.error for finding in found]


def findings(
    path: str | Path, *, inside: bool = True, plan: TestPlan | None = None, fresh: Collection[int] | None = None
) -> list[Finding]:
    """What is wrong with a test plan and, of what is seen without making trials, with its recordings.

    Args:
        path: The plan's file.
        inside: Whether to look into the recordings, too.
        plan: What the plan says, if it was read before.
        fresh: The trials, by index, into whose recordings to look; None: all.
    """
    file = Path(path)
    try:
        plan = plan or load_test_plan(file)
    except WrongPlan as error:
        return [Finding(e) for e in error.found]
    folder = file.parent
    found = [Finding(e) for e in (*_names(plan, folder), *_sources(plan), *_bodies(plan), *_spans(plan))]
    found += [*_without_files(plan), *_files(plan, folder)]
    if inside:
        found += findings_in(plan, folder, fresh)
    if inside and all(f.trials for f in found):  # what ties is found wrong only where all that it needs is there
        found += problems_of_ties(Lab(file, plan), frozenset(i for f in found for i in f.trials))
    return [Finding(by_number(f.error, file), f.trials) for f in found]


def summary(path: str | Path) -> list[str]:
    """How many trials were recorded, attempted without a file, not yet done, in lines; none of a plan that is wrong."""
    try:
        plan = load_test_plan(path)
    except WrongPlan:
        return []
    count = Counter("recorded" if plan.files_of(t) else "unrecorded" if t.attempted else "left" for t in plan.trials)
    lines = [f"{len(plan.trials)} trials, {count['recorded']} of them recorded"]
    if count["unrecorded"]:
        lines.append(f"{count['unrecorded']} attempted without a file: they count as attempted")
    if count["left"]:
        lines.append(f"{count['left']} not yet done")
    unticked = [i for i, t in enumerate(plan.trials, 1) if plan.files_of(t) and t.contact is None]
    if plan.test.ticks is not None and unticked:
        lines.append(f"touched or not is not ticked of {len(unticked)} of them: {_few(unticked)}")
    if others := nobodys(plan, Path(path).parent):
        lines.append(f"{len(others)} files are no trial's: {_few(others)}")
    return lines


def _few(names: Sequence[object]) -> str:
    return ", ".join(str(n) for n in names[:5]) + (", ..." if len(names) > 5 else "")


def _names(plan: TestPlan, folder: Path) -> Iterator[ClearwayError]:
    """Robot, floor plan, batches and configurations that do not exist."""
    for field, name, load in (
        ("robot", plan.test.robot, load_robot),
        ("floor_plan", plan.test.floor_plan, load_floor_plan),
    ):
        try:
            if name is not None:
                load(seen_from(folder, name))
        except ClearwayError as error:
            yield ClearwayError(error.problem, file=error.file, field=f"test.{field}")
    for name, body in plan.bodies.items():
        try:
            if body.shape is not None:
                shape_of(body.shape, folder)
        except ClearwayError as error:
            yield ClearwayError(error.problem, file=error.file, field=f"bodies.{name}.shape")
    yield from _too_fast(plan, folder)
    if plan.test.suite not in suite_names():
        close = nearest(plan.test.suite, suite_names(), 0.8)
        if close and not plan.test.suite.startswith(close):  # hospital-2026 is somebody's own
            wrong = unknown("suite", plan.test.suite, suite_names())
            yield ClearwayError(f"{wrong.problem}; one of your own needs a name less like ours", field="test.suite")
        return
    suite = load_suite(plan.test.suite)
    for i, trial in enumerate(plan.trials):
        for field, value, known in (
            ("batch", trial.batch, suite.batches),
            ("configuration", trial.configuration, suite.configurations),
        ):
            if value not in known:
                yield ClearwayError(unknown(field, value, known).problem, field=at(i, field))


def _too_fast(plan: TestPlan, folder: Path) -> Iterator[ClearwayError]:
    """Set speeds that the robot can't drive; each once."""
    try:
        robot = None if plan.test.robot is None else load_robot(seen_from(folder, plan.test.robot))
    except ClearwayError:
        return
    if robot is None:
        return
    said: set[float] = set()
    for i, trial in enumerate(plan.trials):
        if trial.speed is not None and trial.speed > robot.drive.v_max * (1 + 1e-6) and trial.speed not in said:
            said.add(trial.speed)
            yield ClearwayError(
                f"{trial.speed:g} m/s is more than the {robot.drive.v_max:g} m/s that {plan.test.robot} can drive",
                field=at(i, "speed"),
            )


def _sources(plan: TestPlan) -> Iterator[ClearwayError]:
    for name, source in plan.sources.items():
        if source.format is not None and source.format not in formats.formats():
            wrong = unknown("format", source.format, formats.formats())
            yield ClearwayError(wrong.problem, field=f"sources.{name}.format")
    first = next(iter(plan.sources))
    if plan.robot.source not in (None, first):
        yield ClearwayError(
            f"the first source, {first!r}, has to measure the robot; put {plan.robot.source!r} first",
            field="robot.source",
        )


def _bodies(plan: TestPlan) -> Iterator[ClearwayError]:
    """Bodies of which a trial can know nothing, or not where they are."""
    for name, body in plan.bodies.items():
        if body.shape is not None and body.markers is not None and not _tied(body):
            yield ClearwayError(
                "has a shape and markers, but nothing that ties them: MDO and collisions with it can't be told; give "
                "`coordinates` of its markers, or `static`, a recording of it at rest on a known pose",
                field=f"bodies.{name}",
            )
    if not plan.robot.measured and any(plan.files_of(t) for t in plan.trials):
        yield ClearwayError("needs its markers or its track, or nothing is known of how it moved", field="robot")
    for i, trial in enumerate(plan.trials):
        for j, placed in enumerate(trial.obstacles):
            if placed.pose is None and not plan.bodies[placed.body].measured:
                yield ClearwayError(
                    f"{placed.body!r} is neither placed here by a pose nor measured by markers or a track",
                    field=at(i, f"obstacles.{j}"),
                )


def _without_files(plan: TestPlan) -> Iterator[Finding]:
    """Recorded trials that have no file of a source that measures something in them."""
    for i, trial in enumerate(plan.trials):
        given = plan.files_of(trial)
        needed = {source_of(plan, plan.robot)} | {
            source_of(plan, plan.bodies[o.body]) for o in trial.obstacles if o.pose is None
        }
        for source in sorted(needed - set(given)) if given else ():
            said = f"has no file of the source {source!r}, which measures something in it"
            yield Finding(ClearwayError(said, field=at(i, "files")), frozenset({i}))


def _tied(body: BodySpec) -> bool:
    """Whether something says where base_link, and with it the shape, is among the body's markers."""
    return any(way is not None for way in (body.coordinates, body.offset, body.static, body.straight, body.turn))


def _spans(plan: TestPlan) -> Iterator[ClearwayError]:
    """Spans that end before they begin, that overlap within one file, or that leave their trial."""
    taken: dict[str, list[tuple[int, Span | None]]] = {}
    for i, trial in enumerate(plan.trials):
        for field, span in [("span", trial.span), *((f"legs.{j}.span", leg.span) for j, leg in enumerate(trial.legs))]:
            if span is not None and not span[0] < span[1]:
                yield ClearwayError(f"{list(span)} ends before it begins; [start, end] in s", field=at(i, field))
            elif (
                span is not None
                and trial.span is not None
                and not (trial.span[0] <= span[0] and span[1] <= trial.span[1])
            ):
                yield ClearwayError(f"{list(span)} is not within the trial's {list(trial.span)}", field=at(i, field))
        if trial.file:
            same = os.path.normpath(trial.file)
            for other, span in taken.setdefault(same, []):
                if _overlap(span, trial.span):
                    yield ClearwayError(
                        f"{_said(trial.span)} of {trial.file!r} overlaps {_said(span)} of it, which is trial no. {other + 1}; "
                        "give each its span",
                        field=at(i, "span"),
                    )
                    break
            taken[same].append((i, trial.span))


def _overlap(a: Span | None, b: Span | None) -> bool:
    return a is None or b is None or (a[0] < b[1] and b[0] < a[1])


def _said(span: Span | None) -> str:
    return "all" if span is None else f"{span[0]:g} to {span[1]:g} s"


def _files(plan: TestPlan, folder: Path) -> Iterator[Finding]:
    """Files that are not there. Those that tie frames are only needed once something was recorded."""
    for name, source in plan.sources.items():
        if source.table is not None and not os.path.isfile(folder / source.table):
            yield Finding(ClearwayError(f"no such file: {source.table}", field=f"sources.{name}.table"))
    if not any(plan.files_of(t) for t in plan.trials):
        return
    for field, _, file, _ in references(plan):
        if not os.path.exists(folder / file):
            error = ClearwayError(f"no such file: {file!r}{_close(folder, file)}", field=field)
            trial = trial_of(field)
            yield Finding(error, frozenset() if trial is None else frozenset({trial}))


def _close(folder: Path, file: str) -> str:
    """The file of that folder whose name is closest."""
    there = (folder / file).parent
    try:
        names = [p.name for p in there.iterdir()] if there.is_dir() else []
    except OSError:
        names = []
    close = nearest(Path(file).name, names)
    return f"; did you mean {str(Path(file).parent / close)!r}?" if close else ""
