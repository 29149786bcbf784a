"""What a measurement cannot decide by itself: a person has to look at the replay, or at the video; or nobody can tell."""

from __future__ import annotations

from clearway.contract import EventKind
from clearway.indicators.indicator import NotComputable
from clearway.indicators.legs import contact_time, named
from clearway.indicators.success import goals
from clearway.indicators.uncertainty import end_uncertainty, shown_digits
from clearway.trials import Trial

_UNITS = {"DE": "m", "OE": "rad"}


def to_confirm(trial: Trial) -> str:
    """Possible contacts, unless a contact was confirmed, starts and ends of legs that did not show, and recordings that can't be
    used, in phrases joined by `; `; empty where there is nothing to confirm."""
    possible = (
        [] if contact_time(trial) is not None else [e for e in trial.events if e.kind == EventKind.POSSIBLE_CONTACT]
    )
    said = [f"possible contact at {e.t:.1f} s" + (f" ({e.detail})" if e.detail else "") for e in possible]
    said += [e.detail for e in trial.events if e.kind in (EventKind.UNSEEN_DEPARTURE, EventKind.UNSEEN_ARRIVAL)]
    if trial.attempt.source == "recorded":
        said += [e.detail.replace("; ", ", ") for e in trial.events if e.kind == EventKind.ERROR]
    return "; ".join(said).replace("+-", "±")


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
