"""Bodies that stand for as many as a file holds: `track = "person*"` is every track of it whose name fits, and everyone whose
markers do: of `person1:head` and `person1:left` the name is `person1`, and where it is the middle of the two.

`people = "person*"` and `movers = "cart*"` in a plan are such bodies, called `people` and `movers`, in every trial.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_file import SEVERAL
from clearway.recordings.formats.capture_fields import is_unlabelled
from clearway.recordings.lab.test_plan import BodySpec, PlacedSpec, TestPlan
from clearway.recordings.motion.middle import group_of, middle_of
from clearway.recordings.recording import Contents, Recording
from clearway.scenarios.scenario import DiscSpec

PERSON = DiscSpec(kind="disc", radius=0.25)
"""A person whom nobody measured: half the breadth of most people's shoulders, m."""
OTHERS = ("marker", "scan", "goal", "action", "path", "command", "other", "tf", *SEVERAL[2:])
"""Kinds of what a file holds that are no tracks by their own names."""


def with_everyone(plan: TestPlan) -> TestPlan:
    """The plan with its `people` and `movers` as bodies of every trial.

    Raises:
        ClearwayError: it has a body of that name that is seen in another way.
    """
    for name, pattern in (("people", plan.people), ("movers", plan.movers)):
        if pattern is None:
            continue
        own = plan.bodies.get(name, BodySpec())
        if own.measured:
            raise ClearwayError(f"says how they are seen, and so does {name} = {pattern!r}", field=f"bodies.{name}")
        said = {"track": pattern} | ({"kind": "person"} if name == "people" else {})
        bodies = {**plan.bodies, name: own.model_copy(update=said)}
        trials = tuple(t.model_copy(update={"obstacles": (*t.obstacles, PlacedSpec(body=name))}) for t in plan.trials)
        plan = plan.model_copy(update={"bodies": bodies, "trials": trials})
    people = {n: b for n, b in plan.bodies.items() if b.kind == "person" and b.shape is None}
    return plan.model_copy(
        update={"bodies": plan.bodies | {n: b.model_copy(update={"shape": PERSON}) for n, b in people.items()}}
    )


def several(body: BodySpec) -> bool:
    """Whether a body stands for all tracks that fit its pattern."""
    return body.track is not None and ("*" in body.track or "?" in body.track)


def fitting(plan: TestPlan, body: BodySpec, tracks: Iterable[str]) -> list[str]:
    """Of the tracks, those that a body stands for: none that the plan names itself."""
    named = {b.track for b in (plan.robot, *plan.bodies.values())}
    return sorted(t for t in tracks if t not in named and fnmatchcase(t, body.track or ""))


def there(plan: TestPlan, body: BodySpec, recording: Recording) -> list[str]:
    """Of a recording's tracks, those that a body stands for. A person who comes and goes, and was not seen once, was not there."""
    comes = body.kind == "person" and body.visits is not False
    seen = (
        n for n, track in recording.tracks.items() if not comes or np.isfinite(track.position[:, :2]).all(axis=1).any()
    )
    return fitting(plan, body, seen)


def wanted(plan: TestPlan, body: BodySpec, held: Contents) -> set[str]:
    """What has to be read of a file, so that all that a body stands for is there."""
    tracks = [e.name for e in held.entries if e.kind not in OTHERS]
    found = set(fitting(plan, body, tracks))
    for markers in _bearers(plan, body, (e.name for e in held.entries if e.kind == "marker"), tracks).values():
        found |= set(markers)
    # of a topic that holds several things nobody knows their names before it is read
    return found | {e.name for e in held.entries if e.kind in SEVERAL and (body.track or "").startswith(f"{e.name}/")}


def with_bearers(plan: TestPlan, source: str, recording: Recording) -> Recording:
    """The recording of a source with a track more for everyone whose markers fit a body that stands for several."""
    points, first = recording.points, next(iter(plan.sources))
    if points is None:
        return recording
    found: dict[str, list[str]] = {}
    for body in plan.bodies.values():
        if several(body) and (body.source or first) == source:
            found |= _bearers(plan, body, points.names, recording.tracks)
    if not found:
        return recording
    made = {name: middle_of(points, markers) for name, markers in found.items()}
    note = "the middle of its markers: " + ", ".join(f"{name} ({len(markers)})" for name, markers in found.items())
    return replace(recording, tracks={**recording.tracks, **made}, notes=(*recording.notes, note))


def _bearers(plan: TestPlan, body: BodySpec, markers: Iterable[str], tracks: Collection[str]) -> dict[str, list[str]]:
    """The markers of everyone for whom a body stands, by name: none that a body of the plan has, or that show a body of the file."""
    taken = [b.markers or tuple(b.coordinates or ()) for b in (plan.robot, *plan.bodies.values())]
    found: dict[str, list[str]] = defaultdict(list)
    for marker in markers:
        has = any(marker.startswith(names) if isinstance(names, str) else marker in names for names in taken if names)
        shows = any(marker.startswith(track) and not marker[len(track) :][:1].isalnum() for track in tracks)
        if not (has or shows or is_unlabelled(marker)) and fnmatchcase(group_of(marker), body.track or ""):
            found[group_of(marker)].append(marker)
    return dict(found)


def called(track: str, taken: Collection[str]) -> str:
    """What one of several bodies is called: as its track, unless another has that name."""
    return track if track not in taken else f"{track} (track)"
