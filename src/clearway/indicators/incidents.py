"""Contacts and interventions of a trial: how many, and when the first was. None: nobody knows."""

from __future__ import annotations

from clearway.contract import PLACED, EventKind
from clearway.indicators.clearance import bounds, minimum_distance, minimum_distance_walls
from clearway.trials import Outcome, Trial
from clearway.trials.trial import HELPED, OBSERVED, TOUCHED


def contacts(trial: Trial) -> int | None:
    """How often the robot touched something. None of a recording where neither a person nor the geometry tells: a possible contact
    that is to be confirmed, or no clearance from obstacles (from walls, where the test has no obstacle) and nobody's word; nor of a
    trial whose scenario failed."""
    if trial.outcome is Outcome.SCENARIO_FAILED:
        return None
    known = sum(event.kind == EventKind.CONTACT for event in trial.events)
    if known or trial.attempt.source == "simulated" or trial.provenance.get(TOUCHED) is False:
        return known
    if any(event.kind == EventKind.POSSIBLE_CONTACT for event in trial.events):
        return None
    placed = any(body.kind in PLACED for body in trial.attempt.bodies)
    clearance = (minimum_distance if placed else minimum_distance_walls)(trial).value
    least = clearance if clearance is not None else (bounds(trial) or (0.0,))[0]
    return 0 if least > 0.0 else None


def first_contact(trial: Trial) -> float | None:
    """When the first of them was whose time is known, s since the trial began."""
    timed = [e.t for e in trial.events if e.kind == EventKind.CONTACT and (e.detail != OBSERVED or e.body is not None)]
    return min(timed, default=None)


def interventions(trial: Trial) -> int | None:
    """How often a person had to help. None where nobody said, and of simulations, in which nobody can."""
    count = trial.provenance.get(HELPED)
    return count if isinstance(count, int) else None


def first_intervention(trial: Trial) -> float | None:
    """When the first of them was whose time is known, s since the trial began."""
    return min((e.t for e in trial.events if e.kind == EventKind.INTERVENTION), default=None)
