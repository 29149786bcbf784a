"""The waist: a Trial, simulated or recorded, and its store. Everything below makes trials, everything above reads them."""

from clearway.trials.trial import (
    BROKEN,
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
