"""How a recorded attempt ended, and why: by what was measured, and by what the operator saw."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.contract import EventKind
from clearway.errors import ClearwayError
from clearway.recordings.lab.legs import FoundLeg
from clearway.recordings.lab.test_plan import RecordedTrialSpec
from clearway.recordings.motion.motion import Motion
from clearway.trials import Event, Leg, Outcome, Span
from clearway.trials.trial import ASSISTED, BROKEN_OFF, GOING_ON, OBSERVED

ONE_CONTACT = 2.0
"""s; a contact that was measured and one that the operator noted so near to it are one."""
UNDER_WAY = 0.05
"""m/s; a robot that is faster has not stopped."""
SLACK = 1.0
"""s by which a time that an operator noted may lie outside of the recording."""


def outcome_of(
    spec: RecordedTrialSpec,
    legs: Sequence[Leg],
    spans: Sequence[Span],
    events: tuple[Event, ...],
    end: float,
    *,
    zero: float = 0.0,
    going: bool = False,
) -> tuple[Outcome, str, tuple[Event, ...]]:
    """How the attempt ended, why, and its events with what the operator saw; `zero`: when the trial began, s on the first source's
    clock; `going`: the robot was when the record ended.

    Raises:
        ClearwayError: the operator noted a time that is not in the recording.
    """
    for name in ("contact_at", "intervention_at"):
        for at in getattr(spec, name):
            if not -SLACK <= at - zero <= end + SLACK:
                raise ClearwayError(f"{at:g} s is not in the recording, {zero:g} to {zero + end:g} s", field=name)
    events = (
        *events,
        *(Event(at - zero, EventKind.INTERVENTION, ASSISTED) for at in spec.intervention_at),
    )
    if spec.touched is False:  # somebody stood beside it and saw none; overlap that was measured has to be explained
        events = tuple(_denied(e) for e in events)
    touched = [e for e in events if e.kind == EventKind.CONTACT]
    if spec.contact_at:
        also = [at - zero for at in spec.contact_at if all(abs(at - zero - e.t) > ONE_CONTACT for e in touched)]
        seen = [Event(at, EventKind.CONTACT, f"{OBSERVED} at {at:.1f} s") for at in also]
        touched, events = sorted([*touched, *seen], key=lambda e: e.t), (*events, *seen)
    elif spec.contact and not touched:
        possible = [e for e in events if e.kind == EventKind.POSSIBLE_CONTACT]
        when, body = (possible[0].t, possible[0].body) if possible else (end, None)
        touched = [Event(when, EventKind.CONTACT, OBSERVED, body)]
        events = (*events, *touched)
    if touched:
        return Outcome.COLLISION, touched[0].detail, events
    for happened, words in (
        (spec.stopped, BROKEN_OFF[0]),
        (spec.helped, ASSISTED),
        (spec.aborted, BROKEN_OFF[1]),
    ):
        if happened:
            return Outcome.ABORTED, words, events
    for span in spans:
        leg = legs[span.leg]
        if span.end - span.start > leg.time_limit:
            return Outcome.TIMEOUT, f"leg {leg.name} took {span.end - span.start:.1f} s of {leg.time_limit:g} s", events
    reached = {span.leg for span in spans if span.reached}
    for i, leg in enumerate(legs):
        if i not in reached:
            if not (spans and going):
                return Outcome.ABORTED, f"leg {leg.name} was not finished" if spans else "", events
            reason = f"leg {leg.name}: the recording ends at {end:.1f} s, {GOING_ON}"
            said = f"{reason}; give all of it, or say what happened (aborted, stopped, intervention)"
            return Outcome.ABORTED, reason, (*events, Event(end, EventKind.UNSEEN_ARRIVAL, said))
    return Outcome.REACHED, "", events


def going_on(motion: Motion) -> bool:
    """Whether the robot moves when the record ends: over its last half second."""
    last = motion.t >= motion.t[-1] - 0.5
    seen = motion.pose[last][np.isfinite(motion.pose[last, :2]).all(axis=1), :2]
    return len(seen) > 1 and float(np.hypot(*(seen[-1] - seen[0]))) > UNDER_WAY * 0.5


def unseen_ends(leg: Leg, found: FoundLeg, zero: float) -> list[Event]:
    """What did not show of when a leg began and ended."""
    events = []
    for at, gap, kind, what in (
        (found.start, found.unseen[0], EventKind.UNSEEN_DEPARTURE, "start"),
        (found.end, found.unseen[1], EventKind.UNSEEN_ARRIVAL, "end"),
    ):
        if gap:
            said = f"leg {leg.name}: the robot was not seen for {gap:.1f} s about its {what}; give its span"
            events.append(Event(at - zero, kind, said))
    if not found.rested and not found.unseen[1]:
        said = f"leg {leg.name} ended without a rest; give its span, or the goals that were sent"
        events.append(Event(found.end - zero, EventKind.UNSEEN_ARRIVAL, said))
    return events


def _denied(event: Event) -> Event:
    """What becomes of a measured contact of which the operator saw nothing."""
    kind = {
        EventKind.CONTACT: EventKind.POSSIBLE_CONTACT,
        EventKind.POSSIBLE_CONTACT: EventKind.NEAR_MISS,
    }.get(event.kind, event.kind)
    return event if kind is event.kind else Event(event.t, kind, f"{event.detail}; the operator saw none", event.body)
