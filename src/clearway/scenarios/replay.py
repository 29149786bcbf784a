"""Recorded people, and through where a robot is sent: what the suite `replayed` is made of for a user's own recording."""

from __future__ import annotations

from dataclasses import dataclass

MOST_TIMES = 100
"""Times of a recording at which a robot may be sent through it."""


@dataclass(frozen=True, slots=True)
class Walk:
    """How one person walked without a break.

    Attributes:
        name: Of the person, unique in its recording.
        track: t [s, on the recording's clock, rising], x, y [m] of each sample, at least two.
    """

    name: str
    track: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Replay:
    """A recording, and the task among its people.

    Attributes:
        source: What it was read from, for people.
        walks: All who walk there; who was lost from sight for a while walks twice.
        start: Where the robot starts, in the recording's frame: x, y [m], theta [rad].
        goal: Where it goes: x, y [m], and theta [rad] unless its heading there is free.
        times: When it starts, s on the recording's clock; empty: at ten times, spread evenly.
        notes: What was noticed when it was read.
    """

    source: str
    walks: tuple[Walk, ...]
    start: tuple[float, float, float]
    goal: tuple[float, ...]
    times: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
