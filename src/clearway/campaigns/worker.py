"""What a worker process does: run one trial, score it, and leave it in the store's folder of finished trials."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from clearway.campaigns.drawing import drawn
from clearway.campaigns.pilot import compose, guarded, prepare_limit
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.campaigns.plan_checks import Known
from clearway.campaigns.pool import Fate
from clearway.campaigns.surroundings import restored
from clearway.campaigns.tuning import tuned
from clearway.contract import EventKind
from clearway.errors import ClearwayError
from clearway.foreign import printable, said, traced
from clearway.indicators import score_row
from clearway.navigators.registry import make_navigator
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import load_suite
from clearway.trials import Event, Outcome, Trial
from clearway.trials.store import write_partial
from clearway.world.attempt import attempt_of
from clearway.world.bodies import bodies_of


@dataclass(frozen=True, slots=True)
class Done:
    """What a worker tells of a finished trial.

    Attributes:
        index: Its number in the results.
        outcome: How it ended.
        reason: Why, for people.
    """

    index: int
    outcome: Outcome
    reason: str


def run_and_keep(
    plan: CampaignPlan, spec: TrialSpec, known: Known, folder: Path, key: str, raise_errors: bool = False
) -> Done:
    """Run a trial, score it, and write it to a store's folder of finished trials.

    Args:
        plan: The campaign that it belongs to.
        spec: The trial.
        known: Of its navigator.
        folder: The store's `partial`.
        key: The store's `key`.
        raise_errors: Whether an error in the trial is raised, and nothing is written; as a debugger needs it.

    Raises:
        ClearwayError: the disk is full, or a file that the trial needs has gone.
    """
    spec = drawn(plan, spec, folder)
    if raise_errors:
        return _keep(run_trial(plan, spec, known, raise_errors), spec, folder, key)
    with restored():
        trial = run_trial(plan, spec, known)
    try:
        return _keep(trial, spec, folder, key)
    except ClearwayError:
        raise
    except Exception as error:
        reason = f"the trial cannot be scored or stored: {said(error)}"
        return _keep(_broken(plan, spec, known, reason, traced(error)), spec, folder, key)


def keep_fallen(
    fate: Fate, plan: CampaignPlan, spec: TrialSpec, known: Known, folder: Path, key: str, raise_errors: bool = False
) -> Done:
    """Write a trial that no worker could complete, as one in which the navigator failed; none of its code runs any more.

    Args:
        fate: What became of the workers.
        plan: The campaign that it belongs to.
        spec: The trial.
        known: Of its navigator.
        folder: The store's `partial`.
        key: The store's `key`.
        raise_errors: As for `run_and_keep`.

    Raises:
        ClearwayError: as for `run_and_keep`.
    """
    spec = drawn(plan, spec, folder)
    reason = f"the worker process {fate.reason}"
    detail = f"{reason}\n{fate.place}" if fate.place else reason
    return _keep(_broken(plan, spec, known, printable(reason), printable(detail)), spec, folder, key)


def patience_of(plan: CampaignPlan) -> float | None:
    """How long a worker may be silent outside a navigator's code, s of wall clock; None: as long as it likes."""
    return None if plan.decision_limit is None else max(30.0 * plan.decision_limit, 60.0)


def run_trial(plan: CampaignPlan, spec: TrialSpec, known: Known, raise_errors: bool = False) -> Trial:
    """Run one trial. Whatever breaks in it, other than what the user gave, ends in a trial that says so.

    Args:
        plan: The campaign that it belongs to.
        spec: The trial, its scenario drawn.
        known: Of its navigator.
        raise_errors: Whether an error in it is raised, as a debugger needs it.

    Raises:
        ClearwayError: a file that it needs has gone.
    """
    from clearway.world import simulate

    if ":" in spec.suite:
        load_suite(spec.suite)  # it brings its floor plans along
    robot, budget, limit = load_robot(spec.robot), spec.setup.budget, plan.decision_limit
    localiser, granted = make_localiser(spec.localisation, robot), granted_map(plan.map, spec.scenario)
    tracker = make_tracker(spec.tracking, robot) if "obstacles" in known.needs else None
    try:
        options = plan.options.get(spec.navigator, {})
        navigator = guarded(prepare_limit(limit), "to be made", partial(make_navigator, spec.navigator, **options))
        pilot = compose(navigator, localiser, spec.localisation, tracker=tracker, decision_limit=limit)
        trial = simulate(
            spec.scenario, robot, pilot, map=granted, budget=budget, real_time=spec.setup.real_time,
            raise_errors=raise_errors, **_about(spec, known),
        )  # fmt: skip
    except Exception as error:
        if raise_errors:
            raise
        return _broken(plan, spec, known, said(error), traced(error))
    return _marked(trial, plan, spec, known)


def _about(spec: TrialSpec, known: Known) -> dict[str, Any]:
    return {
        "navigator": spec.navigator,
        "localisation": spec.localisation,
        "privileged": known.privileged,
        "setup": spec.setup.name,
        "tracking": spec.tracking if "obstacles" in known.needs else "",
    }


def _marked(trial: Trial, plan: CampaignPlan, spec: TrialSpec, known: Known) -> Trial:
    return replace(trial, attempt=replace(trial.attempt, tuned=tuned(known.tuned_on, plan, spec)))


def _keep(trial: Trial, spec: TrialSpec, folder: Path, key: str) -> Done:
    row = {"id": spec.id} | score_row(trial)
    write_partial(folder, key, spec.index, trial, row)
    return Done(spec.index, trial.outcome, trial.reason)


def _broken(plan: CampaignPlan, spec: TrialSpec, known: Known, reason: str, detail: str) -> Trial:
    """A trial of which nothing is known but what was attempted and that it broke: one sample, at its start."""
    bodies = bodies_of(load_floor_plan(spec.scenario.floor_plan).fixtures, spec.scenario)
    trial = Trial(
        attempt=attempt_of(spec.scenario, load_robot(spec.robot), bodies, **_about(spec, known)),
        t=np.zeros(1),
        pose=np.array([spec.scenario.start], dtype=np.float64),
        velocity=None,
        estimate=None,
        command=None,
        leg=np.zeros(1, dtype=np.int64),
        moving_obstacles=np.full((1, sum(body.pose is None for body in bodies), 3), np.nan),
        spans=(),
        events=(Event(0.0, EventKind.ERROR, detail),),
        outcome=Outcome.NAVIGATOR_FAILED,
        reason=reason,
    )
    return _marked(trial, plan, spec, known)
