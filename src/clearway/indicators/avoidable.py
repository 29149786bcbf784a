"""Whether a contact could have been avoided, and by what: decided from the trial alone by tests that are stated here.

An escape is a manoeuvre of the base from where the robot truly was that touches nothing until `AFTER` past the
contact, by one who knows how everything moves (`clearway.indicators.escape`). An escape at one moment implies one at
every earlier moment, as the robot got there without contact. So each contact is one of

- `planner's fault`: `WINDOW` (0.75 s) before the contact there still was an escape;
- `escape existed when first seen`: then there was none any more, but there had been one at the moment when the
  touched obstacle first reached into the range of perception (or `EARLIEST` before the contact, if that is later): it
  took better foresight;
- `seen too late`: not even then.

An obstacle that was first seen less than `WINDOW` before the contact is judged from that moment: `planner's fault` or
`seen too late`. Walls and furniture count as seen from the start. A lidar's range is taken as if nothing hid anything.
"""

from __future__ import annotations

import numpy as np

from clearway.contract import PLACED, EventKind
from clearway.geometry.shapes import circumscribed_radius
from clearway.indicators.cause import WINDOW
from clearway.indicators.escape import escapes
from clearway.indicators.legs import contact_on_a_leg, contact_time, stretches, until_contact
from clearway.trials import Body, Trial

AFTER = 1.5
"""s past the contact that an escape has to last."""
EARLIEST = 4.5
"""s before the contact: no escape is looked for from an earlier moment, which bounds the search."""
TOO_LATE, FORESIGHT, PLANNER = "seen too late", "escape existed when first seen", "planner's fault"
CLASSES = (TOO_LATE, FORESIGHT, PLANNER)


def avoidable(trial: Trial) -> str:
    """One of `CLASSES`; empty without a contact, or where nobody can tell."""
    touched = contact_time(trial)
    if touched is None or (trial.attempt.source == "recorded" and not contact_on_a_leg(trial)):
        return ""
    trial = until_contact(trial)
    if len(trial.t) < 2:
        return ""
    end, first = float(trial.t[-1]), float(trial.t[0])
    seen = _first_seen(trial)
    last = max(end - WINDOW, first, first if seen is None else seen)
    way_out = escapes(trial, last, end + AFTER)
    if way_out is None or (seen is None and not way_out):
        return ""
    if way_out:
        return PLANNER
    assert seen is not None
    earliest = max(seen, first, end - EARLIEST)
    for begin in (earliest, end - 3 * WINDOW):  # the second only to be surer: an escape then is one before
        if earliest <= begin < last and escapes(trial, begin, end + AFTER):
            return FORESIGHT
    return TOO_LATE


def _first_seen(trial: Trial) -> float | None:
    """When the touched body first reached into the range of perception, s; None where nobody knows."""
    body = touched_body(trial)
    if body is None:
        return None
    if body.kind not in PLACED:
        return float(trial.t[0])
    if trial.attempt.sight is None:
        return None
    since = 0
    if body.pose is None:
        moving = [b for b in trial.attempt.bodies if b.pose is None]
        k = next(k for k, b in enumerate(moving) if b is body)
        at, since = trial.moving_obstacles[:, k, :2], stretches(trial, k)[-1].start
    else:
        at = np.broadcast_to(body.pose[:2], (len(trial.t), 2))
    away = np.hypot(*(at - trial.pose[:, :2]).T) - circumscribed_radius(body.shape)
    within = since + np.flatnonzero(
        away[since:] <= trial.attempt.sight
    )  # where it was before it was carried tells nothing
    return float(trial.t[within[0]]) if len(within) else float(trial.t[-1])


def touched_body(trial: Trial) -> Body | None:
    """The body that was touched; None without a contact, or where nobody knows."""
    touched = next((e.body for e in reversed(trial.events) if e.kind == EventKind.CONTACT), None)
    return None if touched is None else trial.attempt.bodies[touched]
