"""Bodies that stand for as many as a file holds: `track = "person*"` is every track of it whose name fits.

`people = "person*"` and `movers = "cart*"` in a plan are such bodies, called `people` and `movers`, in every trial.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from fnmatch import fnmatchcase

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_file import SEVERAL
from clearway.recordings.lab.test_plan import BodySpec, PlacedSpec, TestPlan
from clearway.recordings.recording import Contents
from clearway.scenarios.scenario import DiscSpec

PERSON = DiscSpec(kind="disc", radius=0.25)
"""A person whom nobody measured: half the breadth of most people's shoulders, m."""
OTHERS = ("marker", "scan", "goal", "action", "path", "other", "tf", *SEVERAL[2:])
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


def wanted(plan: TestPlan, body: BodySpec, held: Contents) -> set[str]:
    """What has to be read of a file, so that all that a body stands for is there."""
    found = set(fitting(plan, body, (e.name for e in held.entries if e.kind not in OTHERS)))
    # of a topic that holds several things nobody knows their names before it is read
    return found | {e.name for e in held.entries if e.kind in SEVERAL and (body.track or "").startswith(f"{e.name}/")}


def called(track: str, taken: Collection[str]) -> str:
    """What one of several bodies is called: as its track, unless another has that name."""
    return track if track not in taken else f"{track} (track)"
