"""Everything that can be wrong with a test plan and the files that it names, found before anything is scored."""

from __future__ import annotations

import difflib
import os
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from pydantic import ValidationError

from clearway.errors import ClearwayError, unknown
from clearway.reading import read_toml
from clearway.recordings import formats
from clearway.recordings.formats import table
from clearway.recordings.formats.bag_actions import action_of
from clearway.recordings.formats.bag_file import SEVERAL
from clearway.recordings.lab.test_plan import (
    BodySpec,
    Span,
    TestPlan,
    by_number,
    problems_in,
    seen_from,
    shape_of,
    without_coordinates,
)
from clearway.recordings.lab.tie_checks import problems_of_ties
from clearway.recordings.motion.markers import resolve
from clearway.recordings.recording import Contents, Want, contents_of
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import load_suite, suite_names


def problems_of(path: str | Path, *, inside: bool = True) -> list[ClearwayError]:
    """Everything that is wrong with a test plan; empty if there is nothing.

    Args:
        inside: Whether to look into the recordings, too: whether they hold the markers, tracks and spans that the plan names.
    """
    file = Path(path)
    try:
        plan = TestPlan.model_validate(read_toml(file))
    except ClearwayError as error:
        return [error]
    except ValidationError as error:
        return problems_in(error, file)
    found = [*_names(plan, file.parent), *_sources(plan), *_bodies(plan), *_spans(plan), *_files(plan, file.parent)]
    if inside:
        found += _contents(plan, file.parent)
    if inside and not found:  # what ties is found wrong only where all that it needs is there
        found += problems_of_ties(file)
    return [by_number(e, file) for e in found]


def summary(path: str | Path) -> list[str]:
    """How many trials were recorded, attempted without a file, not yet done, in lines; none of a plan that is wrong."""
    try:
        plan = TestPlan.model_validate(read_toml(Path(path)))
    except (ClearwayError, ValidationError):
        return []
    count = Counter("recorded" if plan.files_of(t) else "unrecorded" if t.attempted else "left" for t in plan.trials)
    lines = [f"{len(plan.trials)} trials, {count['recorded']} of them recorded"]
    if count["unrecorded"]:
        lines.append(f"{count['unrecorded']} attempted without a file: they count as attempted")
    if count["left"]:
        lines.append(f"{count['left']} not yet done")
    return lines


def _at(i: int, field: str) -> str:
    return f"trial.{i}.{field}"


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
        close = difflib.get_close_matches(plan.test.suite, suite_names(), n=1, cutoff=0.8)
        if close and not plan.test.suite.startswith(close[0]):  # hospital-2026 is somebody's own
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
                yield ClearwayError(unknown(field, value, known).problem, field=_at(i, field))


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
                field=_at(i, "speed"),
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
                    field=_at(i, f"obstacles.{j}"),
                )
        given = plan.files_of(trial)
        needed = {_source(plan, plan.robot)} | {
            _source(plan, plan.bodies[o.body]) for o in trial.obstacles if o.pose is None
        }
        for source in sorted(needed - set(given)) if given else ():
            yield ClearwayError(
                f"has no file of the source {source!r}, which measures something in it", field=_at(i, "files")
            )


def _tied(body: BodySpec) -> bool:
    """Whether something says where base_link, and with it the shape, is among the body's markers."""
    return any(way is not None for way in (body.coordinates, body.offset, body.static, body.straight, body.turn))


def _source(plan: TestPlan, body: BodySpec) -> str:
    return body.source or next(iter(plan.sources))


def _spans(plan: TestPlan) -> Iterator[ClearwayError]:
    """Spans that end before they begin, that overlap within one file, or that leave their trial."""
    taken: dict[str, list[tuple[int, Span | None]]] = {}
    for i, trial in enumerate(plan.trials):
        for field, span in [("span", trial.span), *((f"legs.{j}.span", leg.span) for j, leg in enumerate(trial.legs))]:
            if span is not None and not span[0] < span[1]:
                yield ClearwayError(f"{list(span)} ends before it begins; [start, end] in s", field=_at(i, field))
            elif (
                span is not None
                and trial.span is not None
                and not (trial.span[0] <= span[0] and span[1] <= trial.span[1])
            ):
                yield ClearwayError(f"{list(span)} is not within the trial's {list(trial.span)}", field=_at(i, field))
        if trial.file:
            same = os.path.normpath(trial.file)
            for other, span in taken.setdefault(same, []):
                if _overlap(span, trial.span):
                    yield ClearwayError(
                        f"{_said(trial.span)} of {trial.file!r} overlaps {_said(span)} of it, which is trial no. {other + 1}; "
                        "give each its span",
                        field=_at(i, "span"),
                    )
                    break
            taken[same].append((i, trial.span))


def _overlap(a: Span | None, b: Span | None) -> bool:
    return a is None or b is None or (a[0] < b[1] and b[0] < a[1])


def _said(span: Span | None) -> str:
    return "all" if span is None else f"{span[0]:g} to {span[1]:g} s"


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
    for where, body in _all_bodies(plan):
        if where not in recorded:
            continue  # what ties it is not needed yet
        for kind, stretch in (("static", body.static), ("straight", body.straight), ("turn", body.turn)):
            if stretch is not None:
                yield f"{where}.{kind}", _source(plan, body), stretch.file, stretch.span
    for i, trial in enumerate(plan.trials):
        for name, file in plan.files_of(trial).items():
            first = bool(trial.file) and name == next(iter(plan.sources))
            yield _at(i, "file" if first else f"files.{name}"), name, file, trial.span if first else None


def _all_bodies(plan: TestPlan) -> list[tuple[str, BodySpec]]:
    return [("robot", plan.robot), *((f"bodies.{name}", body) for name, body in plan.bodies.items())]


def _files(plan: TestPlan, folder: Path) -> Iterator[ClearwayError]:
    """Files that are not there. Those that tie frames are only needed once something was recorded."""
    for name, source in plan.sources.items():
        if source.table is not None and not os.path.isfile(folder / source.table):
            yield ClearwayError(f"no such file: {source.table}", field=f"sources.{name}.table")
    if not any(plan.files_of(t) for t in plan.trials):
        return
    for field, _, file, _ in references(plan):
        if not os.path.exists(folder / file):
            yield ClearwayError(f"no such file: {file!r}{_close(folder, file)}", field=field)


def _close(folder: Path, file: str) -> str:
    """The file of that folder whose name is closest."""
    there = (folder / file).parent
    try:
        names = [p.name for p in there.iterdir()] if there.is_dir() else []
    except OSError:
        names = []
    close = difflib.get_close_matches(Path(file).name, names, n=1, cutoff=0.6)
    return f"; did you mean {str(Path(file).parent / close[0])!r}?" if close else ""


def _contents(plan: TestPlan, folder: Path) -> Iterator[ClearwayError]:
    """What the recordings lack of what the plan names. Each is looked at once."""

    @cache
    def look(source: str, file: str) -> Contents | ClearwayError:
        spec = plan.sources[source]
        try:
            if spec.table is not None:
                return contents_of(table.read_with(folder / file, folder / spec.table, Want()))
            return formats.look(folder / file, format=spec.format)
        except ClearwayError as error:
            return error

    said: set[str] = set()
    for field, source, file, span in references(plan):
        spec = plan.sources[source]
        if not os.path.exists(folder / file) or (spec.format or "table") not in formats.formats():
            continue
        if spec.table is not None and not os.path.isfile(folder / spec.table):
            continue
        held = look(source, file)
        if isinstance(held, ClearwayError):
            if str(held) not in said:
                said.add(str(held))
                yield ClearwayError(held.problem, file=held.file or folder / file, field=held.field)
            continue
        if (
            span is not None
            and held.start is not None
            and held.end is not None
            and not (held.start - 1e-6 <= span[0] and span[1] <= held.end + 1e-6)
        ):
            yield ClearwayError(
                f"{span[0]:g} to {span[1]:g} s is not within {file!r}, which has {held.start:g} to {held.end:g} s",
                field=field if field.endswith(("static", "straight", "turn")) else f"{field.rpartition('.')[0]}.span",
            )
        for where, wrong in _missing(plan, field, source, held):
            text = f"{wrong.problem} (in {file!r})"
            if (key := f"{where}{wrong.problem}") not in said:
                said.add(key)
                yield ClearwayError(text, field=where)


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
        if body.track is not None and (wrong := _no_track(body.track, held, "track")):
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
    return [(w, b) for w, b in _all_bodies(plan) if w in there and _source(plan, b) == source]


def _no_track(name: str, held: Contents, kind: str) -> ClearwayError | None:
    """What a file holds need not be all: of a bag's /tf it is topics, and a pair of frames is told when it is read."""
    known = [e.name for e in held.entries if e.kind != "marker"]
    parts_of_topics = any(name.startswith(f"{e.name}/") for e in held.entries if e.kind in SEVERAL)
    action = any(action_of(e.name) == name for e in held.entries if e.kind == "action")
    pair = "->" in name and any(e.kind == "tf" for e in held.entries)
    return None if name in known or parts_of_topics or action or pair else unknown(kind, name, known)
