"""The waist: a Trial, simulated or recorded, and its store. Everything below makes trials, everything above reads them."""

from clearway.trials.trial import (
    BROKEN,
    LATE,
    Attempt,
    Body,
    Errand,
    Event,
    Instants,
    Labels,
    Leg,
    Outcome,
    Snapshot,
    Span,
    Trial,
    Wish,
)

__all__ = [
    "BROKEN",
    "LATE",
    "Attempt",
    "Body",
    "Errand",
    "Event",
    "Instants",
    "Labels",
    "Leg",
    "Outcome",
    "Snapshot",
    "Span",
    "Trial",
    "Wish",
]
