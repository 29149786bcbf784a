"""One [[trial]] of a test plan becomes a Trial: bodies in the map, clocks tied, legs found, contact judged, outcome told."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from clearway.contract import EventKind
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.alignment import frames
from clearway.recordings.lab import contacts
from clearway.recordings.lab.actions import legs_told
from clearway.recordings.lab.lab import ROBOT, Lab, cut
from clearway.recordings.lab.legs import FoundLeg, find_legs
from clearway.recordings.lab.outcome import going_on, outcome_of, unseen_ends
from clearway.recordings.lab.robot_log import Offsets, Recordings, goals_sent, offset_of, own_view
from clearway.recordings.lab.surroundings import fixtures, obstacles
from clearway.recordings.lab.test_plan import LegPlanSpec, RecordedTrialSpec, by_number
from clearway.recordings.lab.unseen import unseen_contacts
from clearway.recordings.motion.motion import Motion
from clearway.recordings.recording import Goals
from clearway.scenarios.suites import load_suite, suite_names
from clearway.trials import Attempt, Body, Event, Labels, Leg, Snapshot, Span, Trial
from clearway.trials.trial import HELPED, NOT_RECORDED, TOUCHED, UNTIED, UNUSABLE
from clearway.versions import version_of

UNLINKED = (
    "the markers are not tied to base_link: heading, footprint and the distance to a goal are not known, and the path is that "
    "of the markers' middle"
)
SAME = (0.1, 0.2)
"""m, rad: a goal that was sent and one of the plan, or the one sent before, that differ by less are one."""


def assemble(lab: Lab, index: int) -> Trial:
    """The trial number `index` of the plan.

    Raises:
        ClearwayError: a file can't be read, or does not hold what the plan says.
    """
    spec = lab.plan.trials[index]
    try:
        made = _recorded(lab, spec) if lab.files(spec) else _unrecorded(lab, spec)
        return replace(made, provenance={"number": index + 1, **made.provenance})
    except ClearwayError as error:
        if error.file is not None:
            raise
        raise by_number(
            ClearwayError(error.problem, field=f"trial.{index}.{error.field or 'file'}"), lab.path
        ) from error


def unusable(lab: Lab, index: int, why: ClearwayError) -> Trial:
    """The same where the recording can't be used: it counts as attempted, by what the operator noted, and says why.

    Args:
        lab: The plan at work.
        index: The trial's number in the plan, from 0.
        why: What is wrong with the recording.
    """
    spec, said = lab.plan.trials[index], f"{UNUSABLE}: {why}"
    made = _unrecorded(lab, spec, said)
    return replace(
        made,
        events=(*made.events, Event(0.0, EventKind.ERROR, said)),
        provenance={"number": index + 1, **made.provenance, UNUSABLE: str(why)},
    )


class _Measured(NamedTuple):
    """What was measured of the robot in a trial, and by what.

    Attributes:
        files: By the names of the sources.
        recordings: What they hold.
        offsets: What to add to the clock of each other source to have that of the robot's.
        motion: The robot's, within the trial's span.
        keep: (n,) indices of its samples that the trial has.
        tie: How the frame of the robot's source lies in the map, None if nobody says.
    """

    files: Mapping[str, str]
    recordings: Recordings
    offsets: Offsets
    motion: Motion
    keep: Any
    tie: frames.Tie | None


def _measured(lab: Lab, spec: RecordedTrialSpec) -> _Measured:
    files = lab.files(spec)
    recordings = {name: lab.recording(name, file) for name, file in files.items()}
    source = lab.source_of(ROBOT)
    if source not in recordings:
        raise ClearwayError(f"the trial has no file of the source {source!r}, which measures the robot", field="files")
    whole, tie = lab.motion(ROBOT, recordings[source])
    if source != lab.first:  # the trial's span is on the first source's clock
        raise ClearwayError(f"the first source has to measure the robot; it is {source!r}", field="robot.source")
    motion = cut(whole, spec.span, file=recordings[source].file)
    offsets = {
        name: offset_of(lab, name, recording, recordings[source], motion, whole)
        for name, recording in recordings.items()
        if name != source
    }
    return _Measured(files, recordings, offsets, motion, _thin(motion.t, lab.plan.test.rate), tie)


def _recorded(lab: Lab, spec: RecordedTrialSpec) -> Trial:
    measured = _measured(lab, spec)
    _, recordings, offsets, motion, keep, tie = measured
    t, pose = motion.t[keep], motion.wrapped[keep]
    zero = float(t[0])
    since = t - zero
    known, linked = tie is not None, lab.linked(ROBOT)
    sent = goals_sent(lab, recordings, offsets, (float(motion.t[0]), float(motion.t[-1])))
    aimed = sent is not None or any(leg.goal is not None for leg in lab.plan.legs_of(spec))
    legs = _legs(lab, spec, sent, tied=known and linked)
    around = obstacles(lab, spec, recordings, offsets, t, tied=known)
    found = _found(lab, spec, legs, motion, sent, untied=aimed and not known)
    spans = tuple(_span(f, zero, since[-1]) for f in found)
    attempt = _attempt(lab, spec, legs, (*fixtures(lab, known), *around.bodies), float(np.median(np.diff(t))))
    if not linked:
        pose[:, 2] = np.nan
        attempt = replace(attempt, footprint=None)
    sigma = None if motion.sigma is None else np.concatenate([motion.sigma[keep][:, None], around.sigma], axis=1)
    common = None if tie is None or sigma is None else frames.uncertainty(tie, motion.pose[keep])
    touched = (
        *contacts.assess(attempt, since, pose, around.moving_obstacles, sigma, common),
        *unseen_contacts(attempt, since, pose, around.moving_obstacles, sigma, _tested(found, t)),
    )
    outcome, reason, events = outcome_of(
        spec,
        legs,
        spans,
        (*sorted(touched, key=lambda e: e.t), *(e for f in found for e in unseen_ends(legs[f.leg], f, zero))),
        float(since[-1]),
        zero=zero,
        going=going_on(motion),
    )
    estimates, shown = own_view(lab, recordings, offsets, t)
    told = {
        **_origin(lab, measured, aimed=aimed),
        "motion": {ROBOT: motion.told} | dict(around.told),
        "legs": [f"{legs[f.leg].name}: {f.why}" for f in found],
        **_noted(lab, spec),
    }
    if spec.video:  # s of the video at which the trial begins
        told["video"] = {"file": spec.video, "start": zero + (spec.video_offset or 0.0)}
    return Trial(
        attempt=attempt,
        t=since,
        pose=pose,
        velocity=motion.velocity[keep],
        estimate=estimates,
        command=None,
        leg=_leg_at(since, spans),
        moving_obstacles=around.moving_obstacles,
        spans=spans,
        events=events,
        outcome=outcome,
        reason=reason,
        snapshots=tuple(Snapshot(s.t - zero, s.diagnostics) for s in shown if zero <= s.t <= t[-1]),
        provenance=told,
        sigma=sigma,
        tie=common,
    )


def _unrecorded(lab: Lab, spec: RecordedTrialSpec, why: str = "") -> Trial:
    """Attempted, but nothing was recorded, or nothing that can be used: it counts, and says only that it happened, and why."""
    legs = _legs(lab, spec, None, tied=True)
    timeless = {"contact": spec.touched, "contact_at": (), "intervention": bool(spec.helped), "intervention_at": ()}
    outcome, reason, events = outcome_of(spec.model_copy(update=timeless), legs, (), (), 0.0)
    return Trial(
        attempt=_attempt(lab, spec, legs, (), 1 / lab.plan.test.rate),
        t=np.zeros(1),
        pose=np.full((1, 3), np.nan),
        velocity=None,
        estimate=None,
        command=None,
        leg=np.zeros(1, dtype=np.int64),
        moving_obstacles=np.empty((1, 0, 3)),
        spans=(),
        events=events,
        outcome=outcome,
        reason=f"{reason or 'attempted'}{'; ' if reason or why else ', '}{why or NOT_RECORDED}",
        provenance={**_plan(lab), **_noted(lab, spec)},
    )


def _thin(t: FloatArray, rate: float) -> Any:
    """Indices of the samples to keep: every k-th, so that no more than `rate` Hz are left."""
    usual = float(np.median(np.diff(t)))
    every = max(1, math.ceil(1 / (usual * rate) - 1e-6))
    return np.arange(0, len(t), every)


# --- legs ------------------------------------------------------------------------------------------------------------


def _legs(lab: Lab, spec: RecordedTrialSpec, sent: Goals | None, *, tied: bool) -> tuple[Leg, ...]:
    test, robot = lab.plan.test, lab.robot
    xy = test.xy_tolerance or (robot.tolerances.xy if robot else math.nan)
    yaw = test.yaw_tolerance or (robot.tolerances.yaw if robot else math.nan)
    goals = [] if sent is None or not tied else _new_goals(sent)
    legs: list[Leg] = []
    before = np.full(3, np.nan)
    for leg in lab.plan.legs_of(spec):
        goal = lab.pose(leg.goal) if tied else np.full(3, np.nan)
        if goals and (leg.goal is None or _same(goals[0], goal)):
            known = goals.pop(0)
            goal = known if leg.goal is None else goal
        start = lab.pose(leg.start) if leg.start is not None and tied else before
        limit = leg.time_limit or math.inf
        legs.append(Leg(leg.name, start, goal, xy, yaw, leg.scored, limit))
        before = goal
    return tuple(legs)


def _new_goals(sent: Goals) -> list[FloatArray]:
    """The goals in the order in which they were sent; one that was sent again and again is one."""
    return [goal for i, goal in enumerate(sent.pose) if i == 0 or not _same(goal, sent.pose[i - 1])]


def _same(a: FloatArray, b: FloatArray) -> bool:
    turned = math.remainder(float(a[2] - b[2]), math.tau) if math.isfinite(a[2] - b[2]) else 0.0
    return math.hypot(a[0] - b[0], a[1] - b[1]) <= SAME[0] and abs(turned) <= SAME[1]


def _found(
    lab: Lab, spec: RecordedTrialSpec, legs: Sequence[Leg], motion: Motion, sent: Goals | None, *, untied: bool
) -> list[FoundLeg]:
    """When each leg was driven: as the plan says, else as the robot reported, else as the motion shows."""
    specs = lab.plan.legs_of(spec)
    given = {i: _given(i, leg, motion) for i, leg in enumerate(specs) if leg.span is not None}
    found = given
    if len(given) < len(specs):
        told = legs_told(legs, sent, motion)
        at = None if sent is None else sent.t
        searched = find_legs(motion, legs, sent=at, untied=untied) if told is None else told
        found = {f.leg: f for f in searched} | given
    ordered = [found[i] for i in sorted(found)]
    for a, b in pairwise(ordered):
        if b.start < a.end - 1e-9:
            raise ClearwayError(
                f"leg {legs[b.leg].name} would begin at {b.start:.3f} s, before leg {legs[a.leg].name} ends at {a.end:.3f} s; "
                "give the spans of both",
                field="legs.span",
            )
    return ordered


def _given(index: int, leg: LegPlanSpec, motion: Motion) -> FoundLeg:
    assert leg.span is not None
    start, end = leg.span
    if not motion.t[0] - 1e-6 <= start < end <= motion.t[-1] + 1e-6:
        raise ClearwayError(
            f"({start:g}, {end:g}) s of leg {leg.name} is not within the trial, {motion.t[0]:.3f} to {motion.t[-1]:.3f} s",
            field="legs.span",
        )
    return FoundLeg(index, start, end, leg.reached, "span given in the plan")


def _tested(found: Sequence[FoundLeg], t: FloatArray) -> tuple[float, float]:
    """From when to when the robot was tested, s since the trial began: from the first leg's start to the last one's end, with
    the gaps in which these may lie; to the record's end where the last leg was not finished."""
    if not found:
        return 0.0, float(t[-1] - t[0])
    first, last = found[0], found[-1]
    end = last.end + last.unseen[1] if last.reached else float(t[-1])
    return first.start - first.unseen[0] - float(t[0]), end - float(t[0])


def _span(found: FoundLeg, zero: float, end: float) -> Span:
    """The same in s since the trial began at `zero` [s], within the trial, which ends then at `end`."""
    start, stop = (min(max(at - zero, 0.0), end) for at in (found.start, found.end))
    return Span(found.leg, start, stop, found.reached)


def _leg_at(t: FloatArray, spans: Sequence[Span]) -> Any:
    """(n,) int: the leg that was driven at t; before the first one it, between two the one before."""
    leg = np.zeros(len(t), dtype=np.int64)
    for span in spans:
        leg[t >= span.start] = span.leg
    return leg


# --- what it was, and how it ended -----------------------------------------------------------------------------------


def _attempt(
    lab: Lab, spec: RecordedTrialSpec, legs: tuple[Leg, ...], bodies: tuple[Body, ...], period: float
) -> Attempt:
    test, robot = lab.plan.test, lab.robot
    own = lab.plan.robot.shape
    return Attempt(
        labels=Labels(
            suite=test.suite,
            family=load_suite(test.suite).family if test.suite in suite_names() else "own",
            batch=spec.batch,
            configuration=spec.configuration,
            speed=spec.speed,
            obstacle_speed=spec.obstacle_speed,
            size=spec.size,
            gap=spec.gap,
            repetition=spec.repetition,
        ),
        robot=test.robot or "unknown",
        navigator=test.navigator,
        localisation=test.localisation,
        footprint=own.shape() if own is not None else robot.shape if robot is not None else None,
        legs=legs,
        bodies=bodies,
        speed_limit=spec.speed,
        period=period,
        reference_length=test.reference_length,
        floor_plan=test.floor_plan or "",
        limits=robot.limits(spec.speed) if robot is not None and spec.speed is not None else None,
        source="recorded",
    )


# --- where it comes from ---------------------------------------------------------------------------------------------


def _plan(lab: Lab) -> dict[str, Any]:
    return {"clearway": version_of("clearway"), "test_plan": lab.path.name}


def _origin(lab: Lab, measured: _Measured, *, aimed: bool) -> dict[str, Any]:
    """What was recorded by what, and how it was put together; `aimed` if there is a goal in the map."""
    tie = measured.tie
    return {
        **_plan(lab),
        "sources": {
            name: {
                "file": measured.files[name],
                "sha256": lab.digest(measured.files[name]),
                "format": recording.format,
                "notes": list(recording.notes),
            }
            for name, recording in measured.recordings.items()
        },
        "frame": tie.note if tie is not None else UNTIED if aimed else None,
        "clock": {name: asdict(offset) for name, offset in measured.offsets.items()},
        "base_link": "" if lab.linked(ROBOT) else UNLINKED,
    }


def _noted(lab: Lab, spec: RecordedTrialSpec) -> dict[str, Any]:
    """What the plan and the operator say of it."""
    whole = lab.plan.conditions.model_dump()
    return {
        "conditions": {name: said for name, value in whole.items() if (said := getattr(spec, name) or value)},
        "start": spec.start,
        TOUCHED: spec.touched,
        HELPED: spec.helped,
        "note": spec.note,
    }
