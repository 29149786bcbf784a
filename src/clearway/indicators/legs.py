"""The parts of a trial that count: its scored legs, cut out at exactly the span in which each was driven."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from clearway.contract import EventKind
from clearway.geometry.shapes import FloatArray
from clearway.indicators.indicator import NotComputable
from clearway.trials import Leg, Outcome, Span, Trial
from clearway.trials.trial import UNTIED
from clearway.trials.unseen import longest_step

FASTEST = 10.0
"""m/s; an obstacle that moves faster between two samples was carried."""
_SAME_INSTANT = 1e-9
"""s; time stamps closer than this are one."""


@dataclass(frozen=True, slots=True, eq=False)
class DrivenLeg:
    """One scored leg as it was driven: samples from the span's start to its end, both included (interpolated there).

    Attributes:
        leg: What was asked.
        span: When it was driven, and whether it was called reached.
        t: (n,) time, s.
        pose: (n, 3) true pose in the map: x, y [m], theta [rad].
        velocity: (n, 2) true v [m/s] and omega [rad/s], or None.
        estimate: (n, 3) pose as the robot estimated it, or None.
        moving_obstacles: (n, m, 3) poses of what moves, NaN while absent.
        sigma: (n, 1 + m, 2) standard uncertainties as a trial has them, or None.
        tie: (n, 2) what the frame's tie to the map makes of them, or None.
        carried: (n, m) after which samples what moves was carried elsewhere, as `carried` has it.
        missed: (n - 1,) after which samples a recording has none for too long.
        untied: Whether its goal is given, and only the tie of the recording to the map is missing.
    """

    leg: Leg
    span: Span
    t: FloatArray
    pose: FloatArray
    velocity: FloatArray | None
    estimate: FloatArray | None
    moving_obstacles: FloatArray
    sigma: FloatArray | None
    tie: FloatArray | None
    carried: npt.NDArray[np.bool_]
    missed: npt.NDArray[np.bool_]
    untied: bool


def begun(trial: Trial) -> tuple[DrivenLeg, ...]:
    """The scored legs that were begun, finished or not.

    Raises:
        NotComputable: none was, or a span lies outside the samples.
    """
    drives = tuple(_cut(trial, span) for span in trial.spans if trial.attempt.legs[span.leg].scored)
    if not drives:
        raise NotComputable("no scored leg was begun")
    return drives


def finished(trial: Trial) -> tuple[DrivenLeg, ...]:
    """All scored legs, every one driven to its end.

    Raises:
        NotComputable: one was not begun or not reached, or not before a contact.
    """
    reached = legs_reached(trial)
    for index, leg in enumerate(trial.attempt.legs):
        if leg.scored and index not in reached:
            raise NotComputable(f"leg {leg.name} was not finished ({ended(trial)})")
    return begun(trial)


def time_driven(trial: Trial) -> float:
    """Time of all scored legs together, s.

    Raises:
        NotComputable: one was not finished.
    """
    return sum(drive.span.end - drive.span.start for drive in finished(trial))


def contact_time(trial: Trial) -> float | None:
    """When the trial ended with a contact, s; None without one."""
    touched = [event.t for event in trial.events if event.kind == EventKind.CONTACT]
    if touched or trial.outcome is Outcome.COLLISION:
        return min(touched, default=float(trial.t[-1]) if len(trial.t) else 0.0)
    return None


def ended(trial: Trial) -> str:
    """How the trial ended, in a word; a contact ends it."""
    return (trial.outcome if contact_time(trial) is None else Outcome.COLLISION).value


def legs_reached(trial: Trial) -> frozenset[int]:
    """The legs that were driven to their end. A contact ends a trial, in a recording too, although the real robot may
    drive on: only what was reached before counts. Where it belongs to no leg, because nobody knows when it was, none does."""
    touched = contact_time(trial)
    if touched is None:
        return frozenset(span.leg for span in trial.spans if span.reached)
    if not contact_on_a_leg(trial):
        return frozenset()
    return frozenset(span.leg for span in trial.spans if span.reached and span.end < touched - _SAME_INSTANT)


def contact_on_a_leg(trial: Trial) -> bool:
    """Whether a leg was still to be finished at the contact. One that a person reports without a time stands at the end
    of the recording, where no leg is driven any more."""
    touched = contact_time(trial)
    return touched is not None and any(span.end >= touched - _SAME_INSTANT for span in trial.spans)


@lru_cache(maxsize=8)
def refined(trial: Trial) -> Trial:
    """The trial with its instants between samples among them, bare of what is known at samples only. Cached, as `_cut` is."""
    if trial.between is None:
        return trial
    t = np.concatenate([trial.t, trial.between.t])
    order = np.argsort(t, kind="stable")
    before = np.maximum(np.searchsorted(trial.t, t[order], side="right") - 1, 0)
    return replace(
        trial,
        t=t[order], pose=np.concatenate([trial.pose, trial.between.pose])[order], leg=np.asarray(trial.leg)[before],
        moving_obstacles=np.concatenate([trial.moving_obstacles, trial.between.moving_obstacles])[order],
        velocity=None, estimate=None, command=None, cut=None, sigma=None, tie=None, between=None,
    )  # fmt: skip


def until_contact(trial: Trial) -> Trial:
    """A recording up to its contact, as a simulation ends there; other trials as they are. Bare of what hangs on the end."""
    touched = contact_time(trial)
    if touched is None or trial.attempt.source == "simulated" or not contact_on_a_leg(trial):
        return trial
    n = max(int(np.searchsorted(trial.t, touched + _SAME_INSTANT, side="right")), 1)
    velocity = None if trial.velocity is None else trial.velocity[:n]
    return replace(
        trial, t=trial.t[:n], pose=trial.pose[:n], velocity=velocity, leg=trial.leg[:n], moving_obstacles=trial.moving_obstacles[:n],
        estimate=None, command=None, cut=None, sigma=None, tie=None, between=None,
    )  # fmt: skip


def named(trial: Trial, name: str) -> DrivenLeg:
    """The scored leg called `name`, driven to its end.

    Raises:
        NotComputable: there is none, or it was not reached.
    """
    for index, leg in enumerate(trial.attempt.legs):
        if leg.scored and leg.name == name:
            for span in trial.spans:
                if span.leg == index and index in legs_reached(trial):
                    return _cut(trial, span)
            raise NotComputable(f"leg {name} was not finished ({ended(trial)})")
    raise NotComputable(f"the test has no scored leg {name}")


def ground_speed(velocity: FloatArray) -> FloatArray:
    """(n,) how fast a robot of `velocity` (n, 2), or (n, 3) with v_y, was in whatever direction, m/s."""
    return np.asarray(np.abs(velocity[:, 0]) if velocity.shape[1] < 3 else np.hypot(velocity[:, 0], velocity[:, 2]))


def speed(drive: DrivenLeg) -> FloatArray:
    """(n,) how fast the robot was, m/s.

    Raises:
        NotComputable: the trial has no velocity, or gaps in it.
    """
    if drive.velocity is None:
        raise NotComputable("the trial has no velocity")
    v = ground_speed(drive.velocity)
    _whole("velocity", drive, np.isfinite(v))
    return v


def positions(drive: DrivenLeg) -> FloatArray:
    """(n, 2) true positions without a gap; whoever needs no heading asks for these.

    Raises:
        NotComputable: there is a gap.
    """
    at = drive.pose[:, :2]
    _whole("pose", drive, known_rows(at))
    return at


def track(drive: DrivenLeg) -> FloatArray:
    """(n, 3) true poses without a gap.

    Raises:
        NotComputable: there is a gap, or no heading.
    """
    positions(drive)
    _whole("heading", drive, np.isfinite(drive.pose[:, 2]))
    return drive.pose


def known_rows(values: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,) which rows of `values` (n, k) hold no NaN."""
    return np.asarray(np.isfinite(values).all(axis=1))


def gap_time(t: FloatArray, known: npt.NDArray[np.bool_]) -> float:
    """Seconds of `t` (n,) [s] in which nothing is known: from the last sample that is `known` (n,) to the next one."""
    if not len(t):
        return 0.0
    return float(np.diff(t)[~(known[:-1] & known[1:])].sum())


def _whole(what: str, drive: DrivenLeg, known: npt.NDArray[np.bool_]) -> None:
    if not known.any():
        raise NotComputable(f"the {what} is unknown")
    gaps = ~(known[:-1] & known[1:]) | drive.missed
    if not known.all() or gaps.any():
        raise NotComputable(f"the {what} has gaps ({float(np.diff(drive.t)[gaps].sum()):.1f} s)")


def missed(trial: Trial, t: FloatArray) -> npt.NDArray[np.bool_]:
    """(n - 1,) after which of the samples at `t` (n,) [s] a recording has none for too long."""
    return np.asarray((trial.attempt.source == "recorded") & (np.diff(t) > longest_step(trial.attempt)))


@lru_cache(maxsize=8)
def carried(trial: Trial) -> npt.NDArray[np.bool_]:
    """(n, m) after which samples of a trial each of what moves was elsewhere at once: gone in between, or faster than
    `FASTEST`; never after the last. No line joins those two places, and the difference between them is no velocity."""
    found = np.zeros(trial.moving_obstacles.shape[:2], np.bool_)
    leap = np.hypot(*np.moveaxis(np.diff(trial.moving_obstacles[:, :, :2], axis=0), 2, 0))
    found[:-1] = leap > FASTEST * np.diff(trial.t)[:, None]
    if trial.between is not None:
        after = np.searchsorted(trial.t[:-1], trial.between.t) - 1
        np.logical_or.at(found, after, ~np.isfinite(trial.between.moving_obstacles[:, :, 0]))
    return found


def stretches(trial: Trial, moving_obstacle: int) -> list[slice]:
    """The samples of one of what moves, parted where it was carried, came or went."""
    there = np.isfinite(trial.moving_obstacles[:, moving_obstacle, 0])
    parts = np.flatnonzero(carried(trial)[:-1, moving_obstacle] | (there[1:] != there[:-1])) + 1
    return [slice(a, b) for a, b in pairwise([0, *(int(b) for b in parts), len(trial.t)])]


def goal_of(drive: DrivenLeg) -> FloatArray:
    """The goal (3,) of a leg; its heading may be NaN.

    Raises:
        NotComputable: nobody knows where it is.
    """
    if not np.isfinite(drive.leg.goal[:2]).all():
        if drive.untied:
            raise NotComputable(f"where the goal of leg {drive.leg.name} lies is unknown: {UNTIED}")
        raise NotComputable(f"the goal of leg {drive.leg.name} is unknown")
    return drive.leg.goal


def speed_limit(trial: Trial) -> float:
    """The set speed of the test, m/s.

    Raises:
        NotComputable: nobody knows it.
    """
    limit = trial.attempt.speed_limit
    if limit is None or not limit > 0:
        raise NotComputable("the set speed is unknown")
    return limit


@lru_cache(maxsize=8)
def _cut(trial: Trial, span: Span) -> DrivenLeg:
    """Cached, as some thirty indicators ask for the same legs of the same trial in turn (a trial's hash is its identity)."""
    t = trial.t
    if not (len(t) and t[0] - _SAME_INSTANT <= span.start <= span.end <= t[-1] + _SAME_INSTANT):
        raise NotComputable(f"leg {trial.attempt.legs[span.leg].name} lies outside the recorded time")
    inner = t[(t > span.start + _SAME_INSTANT) & (t < span.end - _SAME_INSTANT)]
    at = np.concatenate(([span.start], inner, [span.end]))
    after = np.clip(np.searchsorted(t, at - _SAME_INSTANT), 0, len(t) - 1)
    before = np.where(np.abs(t[after] - at) <= 2 * _SAME_INSTANT, after, np.maximum(after - 1, 0))
    width = np.where(after > before, t[after] - t[before], 1.0)
    share = np.where(after > before, (at - t[before]) / width, 0.0)

    def cut(values: FloatArray, *, angle: bool = False) -> FloatArray:
        values = np.asarray(values, dtype=np.float64)
        low, step = values[before], values[after] - values[before]
        if angle:
            step[..., 2] = np.remainder(step[..., 2] + np.pi, 2 * np.pi) - np.pi
        by = share.reshape(-1, *[1] * (values.ndim - 1))
        return np.where(by > 0, low + by * step, low)

    return DrivenLeg(
        trial.attempt.legs[span.leg],
        span,
        at,
        cut(trial.pose, angle=True),
        None if trial.velocity is None else cut(trial.velocity),
        None if trial.estimate is None else cut(trial.estimate, angle=True),
        cut(trial.moving_obstacles, angle=True),
        None if trial.sigma is None else cut(trial.sigma),
        None if trial.tie is None else cut(trial.tie),
        carried(trial)[before],
        missed(trial, at),
        trial.provenance.get("frame") == UNTIED,
    )
