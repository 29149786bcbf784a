"""Success of a trial, the ingredient of SR (paper A, eq. 5).

The headline judges by the true pose, as motion capture can: every scored leg finished, DE and OE within their
tolerances at its end, no contact, no timeout. `success_self` judges the ends by the robot's own estimate, `success_slack` by
the true pose with a slack for what a robot cannot know: how much its localisation errs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from clearway.contract import EventKind
from clearway.geometry.shapes import Circle
from clearway.indicators.column import Kind
from clearway.indicators.goal_error import Whose, distance_error, orientation_error
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, begun, contact_on_a_leg, contact_time, ground_speed
from clearway.trials import Outcome, Trial

AT_REST = 0.01
"""m/s and rad/s below which a robot stands; what turns is not round, see `outline_moves`."""
SLACK = (0.02, 0.02)
"""m and rad; about what AMCL errs at a goal."""
_ROUNDING = 1e-9
"""m or rad; an error that exceeds its tolerance by less is within."""


def failure(trial: Trial, whose: Whose = "true", slack: tuple[float, float] = (0.0, 0.0)) -> str:
    """Why the trial failed: how it ended (`collision`, `timeout`, ...), `unfinished`, `DE`, `OE` or `DE+OE`; empty for a
    success. `slack` [m, rad] is added to the tolerances. `collision at rest`: something ran into the robot while it stood; a failure all the same. A `possible
    contact` is none until a person confirms it.

    Raises:
        NotComputable: it ended well as far as is known, but the pose, the goal or a tolerance is unknown; or its scenario failed.
    """
    if trial.outcome is Outcome.SCENARIO_FAILED:
        raise NotComputable("the scenario failed, by a behaviour of its people or as it was built")
    if contact_time(trial) is not None:
        return f"{Outcome.COLLISION.value} at rest" if _stood(trial) else Outcome.COLLISION.value
    if trial.outcome is not Outcome.REACHED:
        return trial.outcome.value
    reached = {span.leg for span in trial.spans if span.reached}
    if any(i not in reached for i, leg in enumerate(trial.attempt.legs) if leg.scored):
        return "unfinished"
    excess, more = {"DE": False, "OE": False}, dict(zip(("DE", "OE"), slack, strict=True))
    unknown: NotComputable | None = None
    for drive in begun(trial):
        for name, error, allowed in goals(drive, whose):
            try:
                excess[name] |= error() > allowed + more[name] + _ROUNDING
            except NotComputable as reason:
                unknown = unknown or reason
                continue
            if math.isnan(allowed):
                unknown = unknown or NotComputable(f"the tolerance of leg {drive.leg.name} is unknown")
    if unknown is not None and not any(excess.values()):
        raise unknown
    return "+".join(name for name, found in excess.items() if found)


def goals(drive: DrivenLeg, whose: Whose = "true") -> Iterator[tuple[str, Callable[[], float], float]]:
    """What a leg's end is judged by: `DE` and, unless the heading is free, `OE`; how large it is (which raises
    `NotComputable` where nobody knows) and how large it may be, NaN where that is unknown."""
    yield "DE", lambda: distance_error(drive, whose), drive.leg.xy_tolerance
    if not math.isinf(drive.leg.yaw_tolerance):
        yield "OE", lambda: orientation_error(drive, whose), drive.leg.yaw_tolerance


def _stood(trial: Trial) -> bool:
    """Whether the robot stood when it was touched."""
    if trial.velocity is None or not len(trial.t):
        return False
    if trial.attempt.source == "recorded" and not contact_on_a_leg(trial):
        return False  # nobody knows when it was
    touched = next((event.t for event in trial.events if event.kind == EventKind.CONTACT), float(trial.t[-1]))
    if trial.attempt.source == "recorded" and touched >= float(trial.t[-1]):
        return False  # an operator saw it, and didn't say when
    at = min(int(np.searchsorted(trial.t, touched)), len(trial.t) - 1)
    return not outline_moves(trial, at)


def outline_moves(trial: Trial, at: int) -> bool:
    """Whether the robot's outline moves at sample `at` of a trial that has velocities: one that drives, and one that turns unless it is round."""
    assert trial.velocity is not None
    speed, turning = float(ground_speed(trial.velocity[[at]])[0]), abs(float(trial.velocity[at, 1]))
    return not (speed < AT_REST and (turning < AT_REST or isinstance(trial.attempt.footprint, Circle)))


@measure
def success(trial: Trial) -> float:
    """1 for a success by the true pose, else 0."""
    return float(failure(trial) == "")


@measure
def success_self(trial: Trial) -> float:
    """1 for a success by the robot's own estimate, else 0.

    Of a recording without an estimate nobody knows, however it ended: else its failures would count and its successes would not.
    An attempt of which nothing was recorded is none, as by the true pose.
    """
    known = trial.estimate is not None and np.isfinite(trial.estimate).any()
    if not known and np.isfinite(trial.pose).any():
        raise NotComputable("the robot's own estimate is unknown")
    return float(failure(trial, "own") == "")


@measure
def success_slack(trial: Trial) -> float:
    """1 for a success by the true pose with `SLACK` beyond the tolerances, else 0."""
    return float(failure(trial, slack=SLACK) == "")


ALL = (
    Indicator("success", "success", "", "paper A, eq. 5, by the true pose", "higher", success, Kind.BOOLEAN),
    Indicator(
        "success_self",
        "success by the robot's own estimate",
        "",
        "paper A, eq. 5",
        "higher",
        success_self,
        Kind.BOOLEAN,
    ),
    Indicator(
        "success_slack",
        f"success with {100 * SLACK[0]:g} cm and {SLACK[1]:g} rad of slack",
        "",
        "paper A, eq. 5, tolerances widened by what localisation errs",
        "higher",
        success_slack,
        Kind.BOOLEAN,
    ),
)
