"""The first difference of two trials: bit by bit, in time, and in the order in which a control period goes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_trials import make_recorded, make_trial

from clearway.contract import Diagnostics, EventKind
from clearway.trials import Errand, Event, Outcome, Snapshot, Trial
from clearway.trials.differences import Difference, first_difference, first_in_json


def changed(values: Any, *changes: tuple[Any, float]) -> Any:
    new = np.array(values)
    for at, value in changes:
        new[at] = value
    return new


def first(trial: Trial, **changes: Any) -> Difference:
    found = first_difference(trial, replace(trial, **changes))
    assert found is not None
    return found


@pytest.mark.parametrize("trial", [make_trial(0), make_trial(1), make_recorded(3)])
def test_a_trial_does_not_differ_from_itself_whatever_the_clock_says(trial: Trial) -> None:
    again = replace(
        trial,
        timing={"wall": 7.0},
        thinking=np.zeros(len(trial.t)),
        provenance={"clearway": "another"},
        pose=trial.pose.copy(),
    )
    assert first_difference(trial, again) is None


def test_one_bit_is_a_difference() -> None:
    trial = make_trial(3)
    x = float(trial.pose[7, 1])
    found = first(trial, pose=changed(trial.pose, ((7, 1), np.nextafter(x, 9.0)), ((9, 0), 0.0)))
    assert (found.t, found.what, found.unit, found.first) == (trial.t[7], "y", "m", x)
    assert found.second == np.nextafter(x, 9.0)
    zero = replace(trial, command=changed(trial.command, ((4, 0), 0.0)))
    assert first(zero, command=changed(zero.command, ((4, 0), -0.0))).what == "cmd_v"
    absent = replace(trial, moving_obstacles=changed(trial.moving_obstacles, ((slice(0, 5), 0, 0), np.nan)))
    assert first_difference(absent, replace(absent, moving_obstacles=absent.moving_obstacles.copy())) is None


def test_what_comes_first_in_time_and_in_a_period_is_told() -> None:
    trial = make_trial(3)
    command = changed(trial.command, ((5, 0), 9.0))
    estimate = changed(trial.estimate, ((5, 2), 9.0))
    obstacles = changed(trial.moving_obstacles, ((5, 0, 1), 9.0))
    assert first(trial, command=command, estimate=estimate).what == "est_theta"
    found = first(trial, command=command, estimate=estimate, moving_obstacles=obstacles)
    assert (found.t, found.what) == (0.5, "y of 0 in trajectories/obstacles.parquet")
    earlier = (Event(0.3, EventKind.STATUS, "waiting"), *trial.events)
    assert str(first(trial, command=command, events=earlier)) == (
        "event at 0.3 s: status at 0.5 s, 'recovery: clear' before, status at 0.3 s, 'waiting' now"
    )


def test_the_end_and_the_rest() -> None:
    trial = make_trial(3)
    shorter: dict[str, Any] = {
        name: getattr(trial, name)[:-2]
        for name in ("t", "pose", "velocity", "estimate", "command", "leg", "moving_obstacles")
    }
    found = first(trial, **shorter)
    assert (found.t, found.what, found.unit) == (trial.t[38], "the end of the trial", "s")
    assert (found.first, found.second) == (trial.t[39], trial.t[37])
    assert str(first(trial, outcome=Outcome.ABORTED)) == "outcome: reached before, aborted now"
    assert first(trial, reason="stuck").what == "reason"
    assert first(trial, estimate=None).what == "attempt.known"
    leg = replace(trial.attempt.legs[0], xy_tolerance=0.2)
    found = first(trial, attempt=replace(trial.attempt, legs=(leg,)), reason="stuck")
    assert (found.t, found.what, found.first, found.second) == (None, "attempt.legs.0.xy_tolerance", 0.1, 0.2)


def test_what_a_navigator_showed() -> None:
    trial = make_trial(3)
    drawn = trial.snapshots[0].diagnostics
    other = Diagnostics({"global plan": drawn.polylines["global plan"] + 1.0}, status="driving")
    found = first(trial, snapshots=(Snapshot(0.5, other),))
    assert (found.t, found.what) == (0.5, "values of global plan in diagnostics/drawings.parquet")
    assert first(trial, snapshots=(Snapshot(0.5, replace(drawn, status="waiting")),)).second == "waiting"
    more = first(trial, snapshots=(*trial.snapshots, Snapshot(1.5, drawn)))
    assert (more.t, more.what, more.first, more.second) == (1.5, "rows in diagnostics/snapshots.parquet", 1, 2)


def test_a_difference_of_json() -> None:
    assert first_in_json("a", {"b": [1, {"c": 2}]}, {"b": [1, {"c": 3}]}) == ("a.b.1.c", 2, 3)
    assert first_in_json("a", {"b": 1}, {"b": 1, "c": 2}) == ("a.c", None, 2)
    assert first_in_json("a", [1], [1, 2]) == ("a", [1], [1, 2])
    assert first_in_json("a", {"b": 1.0}, {"b": 1.0}) is None


def test_what_became_of_people_comes_last() -> None:
    trial = replace(make_trial(0), errands=(Errand(0, 1, 5.0, 4.0, 4.0, 3.0),))
    later = (Errand(0, 1, 5.0, 4.0, 4.5, 3.0),)
    found = first(trial, errands=later)
    assert (found.t, found.what, found.first, found.second) == (None, "errands.0.4", 4.0, 4.5)
    assert first(trial, errands=later, outcome=Outcome.ABORTED).what == "outcome"
    assert first(trial, errands=()).what == "errands"
