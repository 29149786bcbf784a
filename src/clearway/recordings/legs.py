"""Finds when each leg of a trial was driven: departure, arrival, the turn between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from clearway.recordings.motion import Motion
from clearway.trials import Leg


@dataclass(frozen=True, slots=True)
class FoundLeg:
    """When leg `leg` (index) was driven, from `start` to `end` [s on the motion's clock]; `reached`: whether it came to rest
    at the goal; `why`: a sentence for people, who may correct it in the plan."""

    leg: int
    start: float
    end: float
    reached: bool
    why: str


def find_legs(motion: Motion, legs: Sequence[Leg], *, rest: float = 2.0) -> list[FoundLeg]:
    """The legs that were begun, in order.

    Args:
        motion: of base_link, in the map where goals are known. legs: of the trial, goals NaN where unknown.
        rest: s; so long a rest separates legs whose goals are unknown.
    """
    raise NotImplementedError
