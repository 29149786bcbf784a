"""Why a trial failed, in paper B's words, each decided by a test that is stated here.

A contact while the robot stood (`success.outline_moves` says whether) is `contact at rest`. Otherwise, if no way out was left
`WINDOW` before the contact, it was a `crushing zone`; a way out is a manoeuvre of two commands within the base's limits,
its accelerations among them, each held for a window, that touches nothing while the obstacles move as they did, and after the contact as they did
last: so to put the contact off by a moment is no way out. If there was one, the navigator's own last word
before the contact tells: `iteration limit`, `input-limit violation`, `infeasible`; without such a word the contact
was `unforeseen`. Outcomes without contact are causes of their own.
"""

from __future__ import annotations

import numpy as np

from clearway.contract import EventKind, Status
from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import FloatArray
from clearway.indicators.escape import commands, state_at, stepped
from clearway.indicators.indicator import NotComputable
from clearway.indicators.legs import contact_on_a_leg, stretches, until_contact
from clearway.indicators.success import AT_REST, failure, outline_moves
from clearway.robots.drive_limits import DriveLimits
from clearway.trials import Outcome, Trial

WINDOW = 0.75
"""s before the contact: paper B's prediction window, N^P = 5 periods of 0.15 s."""
_SPEEDS, _TURNS, _STEP = 6, 7, 0.05
_WORDS: dict[str, str] = {
    Status.ITERATION_LIMIT: "iteration limit",
    Status.INPUT_LIMIT: "input-limit violation",
    Status.INFEASIBLE: "infeasible",
    Status.BRAKING: "infeasible",
    Status.NO_PATH: "infeasible",
}
"""A navigator's status -> cause."""
CAUSES = ("contact at rest", "crushing zone", *dict.fromkeys(_WORDS.values()), "unforeseen")
"""Of a contact; of another failure it is that."""


def cause(trial: Trial) -> str:
    """Why the trial failed; empty for a success, or where nobody can tell."""
    try:
        how = failure(trial)
    except NotComputable:
        return ""
    if not how.startswith(Outcome.COLLISION.value):
        return how
    if how != Outcome.COLLISION.value:
        return "contact at rest"
    crushed, said = _crushed(until_contact(trial)), [e.detail for e in trial.events if e.kind == EventKind.STATUS]
    if crushed:
        return "crushing zone"
    if trial.attempt.source == "recorded" and (crushed is None or not said):
        return ""  # there may have been no way out, or the navigator may have said why where nobody recorded it
    return _WORDS.get(said[-1] if said else "", "unforeseen")


def who_moved(trial: Trial) -> str:
    """Who moved at the contact that ended the trial: `robot`, `obstacle`, `both` or `neither`; empty without a contact.

    A round robot that only turns on the spot does not move in this sense: its outline stays where it is.
    """
    if trial.outcome is not Outcome.COLLISION or trial.velocity is None or len(trial.t) < 2:
        return ""
    if trial.attempt.source == "recorded" and not contact_on_a_leg(trial):
        return ""  # nobody knows when it was
    trial = until_contact(trial)
    if trial.velocity is None or len(trial.t) < 2:
        return ""
    if not np.isfinite(trial.velocity[-1]).all():
        return ""
    robot = outline_moves(trial, -1)
    k = _touched(trial)
    obstacle = False
    if k is not None:
        moved = float(np.hypot(*(trial.moving_obstacles[-1, k, :2] - trial.moving_obstacles[-2, k, :2])))
        if trial.attempt.source == "recorded" and not np.isfinite(moved):
            return ""
        appeared = not np.isfinite(moved)
        obstacle = appeared or moved >= AT_REST * max(float(trial.t[-1] - trial.t[-2]), 1e-9)
    return {(True, True): "both", (True, False): "robot", (False, True): "obstacle"}.get((robot, obstacle), "neither")


def _touched(trial: Trial) -> int | None:
    """The column of the moving body that was touched; None if that one stands, or nobody knows which it was."""
    touched = next((e.body for e in reversed(trial.events) if e.kind == EventKind.CONTACT), None)
    moving = [i for i, b in enumerate(trial.attempt.bodies) if b.pose is None]
    return moving.index(touched) if touched in moving else None


def _crushed(trial: Trial) -> bool | None:
    """Whether each sampled manoeuvre from `WINDOW` before the end touches something until the end; None: unknown."""
    a = trial.attempt
    if a.footprint is None or a.limits is None or trial.velocity is None or not len(trial.t):
        return None
    if a.limits.kind != "differential":
        return None  # manoeuvres are those of a differential drive
    begin = max(float(trial.t[-1]) - WINDOW, float(trial.t[0]))
    start = state_at(trial, begin)
    times = begin + np.arange(_STEP, 2.0 * WINDOW + 1e-9, _STEP)
    if not np.isfinite(start).all():
        return None
    poses = _manoeuvres(start, a.limits, len(times))
    tracks = [_track(trial, m, times) for m in range(trial.moving_obstacles.shape[1])]
    moving_obstacles = np.stack(tracks, axis=1) if tracks else np.empty((len(times), 0, 3))
    gaps = min_clearance(a.footprint, poses.reshape(-1, 3), a.bodies, np.tile(moving_obstacles, (len(poses), 1, 1)))
    crushed = bool((gaps.reshape(poses.shape[:2]) <= 0.0).any(axis=1).all())
    return crushed if crushed or all(b.outlined for b in a.bodies) else None


def _manoeuvres(start: FloatArray, limits: DriveLimits, steps: int) -> FloatArray:
    """(k, steps, 3) poses from `start` (5,) along every pair of commands, the second from the middle on."""
    targets = commands(limits, _SPEEDS, _TURNS)
    first, second = np.repeat(targets, len(targets), axis=0), np.tile(targets, (len(targets), 1))
    states, out = np.tile(start, (len(first), 1)), np.empty((len(first), steps, 3))
    for k in range(steps):
        states = stepped(states, first if k < steps // 2 else second, limits, _STEP)
        out[:, k] = states[:, :3]
    return out


def _track(trial: Trial, moving_obstacle: int, times: FloatArray) -> FloatArray:
    """(n, 3) poses of a moving obstacle, after the end of the trial on at its last velocity; NaN while absent, or carried."""
    at = trial.moving_obstacles[:, moving_obstacle]
    out = np.full((len(times), 3), np.nan)
    for part in stretches(trial, moving_obstacle):
        t = trial.t[part]
        here = (times >= t[0]) & ((times <= t[-1]) | (part.stop == len(at)))
        out[here, :2] = np.stack([np.interp(times[here], t, at[part, i]) for i in (0, 1)], axis=1)
    t, late = trial.t[part], times > trial.t[-1]
    if late.any() and len(t) > 1 and t[-1] > t[-2]:
        out[late, :2] = at[-1, :2] + (times[late] - t[-1])[:, None] * (at[-1, :2] - at[-2, :2]) / (t[-1] - t[-2])
    out[:, 2] = at[np.searchsorted(trial.t, times, side="right") - 1, 2]
    return out
