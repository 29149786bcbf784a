"""One [[trial]] of a test plan becomes a Trial: bodies in the map, clocks tied, legs found, contact judged, outcome told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from typing import Any

import numpy as np

from clearway.contract import EventKind
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.alignment import frames
from clearway.recordings.alignment.clocks import Offset
from clearway.recordings.lab import contacts
from clearway.recordings.lab.actions import legs_told
from clearway.recordings.lab.lab import ROBOT, Lab, cut
from clearway.recordings.lab.legs import FoundLeg, find_legs
from clearway.recordings.lab.outcome import going_on, outcome_of, unseen_ends
from clearway.recordings.lab.robot_log import goals_sent, offset_of, own_view
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


def _recorded(lab: Lab, spec: RecordedTrialSpec) -> Trial:
    files = lab.files(spec)
    recordings = {name: lab.recording(name, file) for name, file in files.items()}
    source = lab.source_of(ROBOT)
    if source not in recordings:
        raise ClearwayError(f"the trial has no file of the source {source!r}, which measures the robot", field="files")
    offsets: dict[str, Offset] = {}
    whole, tie = lab.motion(ROBOT, recordings[source])
    if source != lab.first:  # the trial's span is on the first source's clock
        raise ClearwayError(f"the first source has to measure the robot; it is {source!r}", field="robot.source")
    motion = cut(whole, spec.span, file=recordings[source].file)
    for name, recording in recordings.items():
        if name != source:
            offsets[name] = offset_of(lab, name, recording, recordings[source], motion, whole)
    keep = _thin(motion.t, lab.plan.test.rate)
    t = motion.t[keep]
    zero = float(t[0])
    known = tie is not None
    sent = goals_sent(lab, recordings, offsets, (float(motion.t[0]), float(motion.t[-1])))
    aimed = sent is not None or any(leg.goal is not None for leg in lab.plan.legs_of(spec))
    linked = lab.linked(ROBOT)
    legs = _legs(lab, spec, sent, tied=known and linked)
    around = obstacles(lab, spec, recordings, offsets, t, tied=known)
    found = _found(lab, spec, legs, motion, sent, untied=aimed and not known)
    spans = tuple(
        Span(f.leg, min(max(f.start - zero, 0.0), t[-1] - zero), min(max(f.end - zero, 0.0), t[-1] - zero), f.reached)
        for f in found
    )
    attempt = _attempt(lab, spec, legs, (*fixtures(lab, known), *around.bodies), float(np.median(np.diff(t))))
    pose = motion.wrapped[keep]
    if not linked:
        pose[:, 2] = np.nan
        attempt = replace(attempt, footprint=None)
    sigma = None
    if motion.sigma is not None:
        sigma = np.concatenate([motion.sigma[keep][:, None], around.sigma], axis=1)
    common = None if tie is None or sigma is None else frames.uncertainty(tie, motion.pose[keep])
    events = contacts.assess(attempt, t - zero, pose, around.moving_obstacles, sigma, common)
    events = (
        *events,
        *unseen_contacts(attempt, t - zero, pose, around.moving_obstacles, sigma, _tested(found, t)),
    )
    events = (*sorted(events, key=lambda e: e.t), *(e for f in found for e in unseen_ends(legs[f.leg], f, zero)))
    outcome, reason, events = outcome_of(
        spec, legs, spans, events, float(t[-1] - zero), zero=zero, going=going_on(motion)
    )
    estimates, shown = own_view(lab, recordings, offsets, t)
    told = {
        "clearway": version_of("clearway"),
        "test_plan": lab.path.name,
        "sources": {
            name: {
                "file": files[name],
                "sha256": lab.digest(files[name]),
                "format": r.format,
                "notes": list(r.notes),
            }
            for name, r in recordings.items()
        },
        "frame": tie.note if tie is not None else UNTIED if aimed else None,
        "clock": {name: asdict(o) for name, o in offsets.items()},
        "base_link": "" if linked else UNLINKED,
        "motion": {ROBOT: motion.told} | dict(around.told),
        "legs": [f"{legs[f.leg].name}: {f.why}" for f in found],
        "conditions": _conditions(lab, spec),
        "start": spec.start,
        TOUCHED: spec.touched,
        HELPED: spec.helped,
        "note": spec.note,
    }
    if spec.video:  # s of the video at which the trial begins
        told["video"] = {"file": spec.video, "start": zero + (spec.video_offset or 0.0)}
    return Trial(
        attempt=attempt,
        t=t - zero,
        pose=pose,
        velocity=motion.velocity[keep],
        estimate=estimates,
        command=None,
        leg=_leg_at(t - zero, spans),
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
        provenance={
            "clearway": version_of("clearway"),
            "test_plan": lab.path.name,
            "conditions": _conditions(lab, spec),
            "start": spec.start,
            TOUCHED: spec.touched,
            HELPED: spec.helped,
            "note": spec.note,
        },
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


def _conditions(lab: Lab, spec: RecordedTrialSpec) -> dict[str, str]:
    whole = lab.plan.conditions.model_dump()
    return {name: getattr(spec, name) or value for name, value in whole.items() if getattr(spec, name) or value}
