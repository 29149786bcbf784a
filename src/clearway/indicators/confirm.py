"""What a measurement cannot decide by itself: a person has to look at the replay, or at the video; or nobody can tell."""

from __future__ import annotations

import math

import numpy as np

from clearway.contract import EventKind
from clearway.geometry.angles import wrap
from clearway.indicators.indicator import NotComputable
from clearway.indicators.legs import contact_time, named
from clearway.indicators.success import goals
from clearway.indicators.uncertainty import end_uncertainty, shown_digits
from clearway.trials import Outcome, Trial

_UNITS = {"DE": "m", "OE": "rad"}
_FASTER, _SLOWER, _MOVED = 3.0, 0.1, 1.0
"""Times the set speed at which nobody drives, and m by which it moved for that to be told."""
_SPINS = 10.0
"""rad/s"""
_ASIDE, _TURNED = 0.3, 0.8
"""m, rad beside its start at which no robot begins that a person put there, or that drove there by itself."""


def to_confirm(trial: Trial) -> str:
    """Possible contacts, unless a contact was confirmed, starts and ends of legs that did not show, recordings that can't be
    used, and such as can't be right, in phrases joined by `; `; empty where there is nothing to confirm."""
    possible = (
        [] if contact_time(trial) is not None else [e for e in trial.events if e.kind == EventKind.POSSIBLE_CONTACT]
    )
    said = [f"possible contact at {e.t:.1f} s" + (f" ({e.detail})" if e.detail else "") for e in possible]
    said += [e.detail for e in trial.events if e.kind in (EventKind.UNSEEN_DEPARTURE, EventKind.UNSEEN_ARRIVAL)]
    if trial.attempt.source == "recorded":
        said += [e.detail.replace("; ", ", ") for e in trial.events if e.kind == EventKind.ERROR]
        said += [*_strange(trial), *_elsewhere(trial)]
    return "; ".join(said).replace("+-", "±")


def _strange(trial: Trial) -> list[str]:
    """What nobody drives: a recording's times, lengths or angles are of another unit, or its plan says another speed."""
    seen = np.isfinite(trial.pose[:, :2]).all(axis=1)
    if trial.velocity is None or seen.sum() < 2:
        return []
    said, told = [], trial.attempt.labels.speed
    v, omega = (np.abs(trial.velocity[:, k]) for k in (0, -1))
    moves = v[v > 0.1 * np.nanmax(v)] if np.isfinite(v).any() else v[:0]
    far = math.hypot(*np.ptp(trial.pose[seen, :2], axis=0))
    usual = float(np.nanmedian(moves)) if len(moves) else math.nan
    if told and far > _MOVED and not _SLOWER * told < usual < _FASTER * told:
        said.append(
            f"drives at {usual:.3g} m/s where {told:g} m/s is set: are the recording's times and lengths, and that, right?"
        )
    if np.isfinite(omega).any() and (turns := float(np.nanquantile(omega, 0.95))) > _SPINS:
        said.append(f"turns at {turns:.3g} rad/s: are its headings in the unit that is said?")
    return said


def _elsewhere(trial: Trial) -> list[str]:
    """That it began elsewhere than its first leg does, or drove there first and never ended: another test may have been driven, the
    frame be tied wrongly, or the robot's own frame be turned on it, none of which is a failure of the robot's."""
    if not trial.spans or trial.spans[0].leg > 0:
        return []
    span, leg = trial.spans[0], trial.attempt.legs[0]
    seen = np.isfinite(trial.pose[:, :2]).all(axis=1)
    begun = np.flatnonzero(seen & (trial.t >= span.start))
    if not len(begun) or not np.isfinite(leg.start[:2]).all():
        return []
    beside = trial.pose[begun[0]] - leg.start
    away, turned = math.hypot(*beside[:2]), abs(wrap(float(beside[2]))) if math.isfinite(beside[2]) else 0.0
    if away > max(_ASIDE, 1.5 * leg.xy_tolerance) or turned > _TURNED:
        where = f"{away:.2f} m and {math.degrees(turned):.0f}° from where its start is said to be"
        return [
            f"begins leg {leg.name} {where}: was the robot put there, are the map's frame and the robot's own right?"
        ]
    driven = float(np.hypot(*np.diff(trial.pose[seen & (trial.t <= span.start), :2], axis=0).T).sum())
    if trial.outcome != Outcome.REACHED and driven > _MOVED:
        return [
            f"drove {driven:.1f} m before leg {leg.name}, which begins at {span.start:.1f} s: did it start elsewhere?"
        ]
    return []


def near_tolerance(trial: Trial) -> str:
    """Ends whose DE or OE is closer to its tolerance than its expanded uncertainty, in phrases joined by `; `. Nobody can
    confirm these: success keeps to the values."""
    said = []
    for leg in trial.attempt.legs:
        if trial.attempt.source == "simulated" or not leg.scored:
            continue
        try:
            drive = named(trial, leg.name)
        except NotComputable:
            continue
        for name, error, allowed in goals(drive):
            try:
                value, u = error(), end_uncertainty(trial, drive, name)
            except NotComputable:
                continue
            if abs(value - allowed) < u:
                unit, d = _UNITS[name], shown_digits(u, 3)
                said.append(f"{name} of leg {leg.name} is {value:.{d}f} ± {u:.{d}f} {unit}, {allowed:g} {unit} allowed")
    return "; ".join(said)
