"""What a worker process does: run one trial, score it, and leave it in the store's folder of finished trials."""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.campaigns.drawing import drawn
from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.campaigns.tuning import tuned, tuned_on
from clearway.contract import EventKind
from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.navigators.registry import make_navigator, navigator_class
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import load_suite
from clearway.trials import Event, Outcome, Trial
from clearway.trials.store import write_partial
from clearway.world.bodies import bodies_of
from clearway.world.simulate import attempt_of


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


def run_and_keep(plan: CampaignPlan, spec: TrialSpec, folder: Path, key: str, raise_errors: bool = False) -> Done:
    """Run a trial, score it, and write it to a store's folder of finished trials.

    Args:
        plan: The campaign that it belongs to.
        spec: The trial.
        folder: The store's `partial`.
        key: The store's `key`.
        raise_errors: Whether an error in the trial is raised, and nothing is written; as a debugger needs it.

    Raises:
        ClearwayError: the disk is full, or a file that the trial needs has gone.
    """
    trial = run_trial(plan, drawn(plan, spec, folder), raise_errors)
    row = {"id": spec.id} | score_row(trial)
    write_partial(folder, key, spec.index, trial, row)
    return Done(spec.index, trial.outcome, trial.reason)


def run_trial(plan: CampaignPlan, spec: TrialSpec, raise_errors: bool = False) -> Trial:
    """Run one trial. Whatever breaks in it, other than what the user gave, ends in a trial that says so.

    Args:
        plan: The campaign that it belongs to.
        spec: The trial, its scenario drawn.
        raise_errors: Whether an error in it is raised, as a debugger needs it.

    Raises:
        ClearwayError: a file that it needs has gone, or the navigator can't do this task at all.
    """
    from clearway.world import simulate

    if ":" in spec.suite:
        load_suite(spec.suite)  # it brings its floor plans along
    robot = load_robot(spec.robot)
    navigator = make_navigator(spec.navigator, **plan.options.get(spec.navigator, {}))
    localiser = make_localiser(spec.localisation, robot)
    follows = "obstacles" in getattr(navigator, "needs", frozenset())
    tracker = make_tracker(spec.tracking, robot) if follows else None
    pilot = compose(navigator, localiser, spec.localisation, tracker=tracker, decision_limit=plan.decision_limit)
    about: dict[str, Any] = {
        "navigator": spec.navigator,
        "localisation": spec.localisation,
        "privileged": bool(getattr(navigator_class(spec.navigator), "privileged", False)),
        "setup": spec.setup.name,
        "tracking": spec.tracking if follows else "",
    }
    try:
        granted = granted_map(plan.map, spec.scenario)
        budget = spec.setup.budget
        trial = simulate(spec.scenario, robot, pilot, map=granted, budget=budget, raise_errors=raise_errors, **about)
    except ClearwayError:
        raise
    except Exception as error:
        if raise_errors:
            raise
        trial = _broken(spec, about, f"{type(error).__name__}: {error}", traceback.format_exc())
    near = tuned(tuned_on(spec.navigator, navigator), plan, spec)
    return replace(trial, attempt=replace(trial.attempt, tuned=near))


def _broken(spec: TrialSpec, about: Mapping[str, Any], reason: str, detail: str) -> Trial:
    """A trial of which nothing is known but what was attempted and that it broke: one sample, at its start."""
    bodies = bodies_of(load_floor_plan(spec.scenario.floor_plan).fixtures, spec.scenario)
    return Trial(
        attempt=attempt_of(spec.scenario, load_robot(spec.robot), bodies, **about),
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
