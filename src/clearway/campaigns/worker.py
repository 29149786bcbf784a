"""What a worker process does: run one trial, score it, and leave it in the store's folder of finished trials."""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.navigators.registry import make_navigator, navigator_class
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Trial
from clearway.trials.store import write_partial


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


def run_and_keep(plan: CampaignPlan, spec: TrialSpec, folder: Path, key: str) -> Done:
    """Run a trial, score it, and write it to a store's folder of finished trials.

    Args:
        plan: The campaign that it belongs to.
        spec: The trial.
        folder: The store's `partial`.
        key: The store's `key`.

    Raises:
        ClearwayError: the disk is full, or a file that the trial needs has gone.
    """
    trial = run_trial(plan, spec)
    row = {"id": spec.id} | score_row(trial)
    write_partial(folder, key, spec.index, trial, row)
    return Done(spec.index, trial.outcome, trial.reason)


def run_trial(plan: CampaignPlan, spec: TrialSpec) -> Trial:
    """Run one trial. Whatever breaks in it, other than what the user gave, ends in a trial that says so."""
    from clearway.world import simulate

    robot = load_robot(spec.robot)
    navigator = make_navigator(spec.navigator, **plan.options.get(spec.navigator, {}))
    localiser = make_localiser(spec.localisation, robot)
    follows = "obstacles" in getattr(navigator, "needs", frozenset())
    tracker = make_tracker(spec.tracking, robot) if follows else None
    pilot = compose(navigator, localiser, spec.localisation, tracker=tracker, decision_limit=plan.decision_limit)
    try:
        return simulate(
            spec.scenario,
            robot,
            pilot,
            navigator=spec.navigator,
            localisation=spec.localisation,
            map=granted_map(plan.map, spec.scenario),
            privileged=bool(getattr(navigator_class(spec.navigator), "privileged", False)),
            budget=spec.setup.budget,
            setup=spec.setup.name,
            tracking=spec.tracking if follows else "",
        )
    except ClearwayError:
        raise
    except Exception as error:
        return _broken(spec, f"{type(error).__name__}: {error}", traceback.format_exc())


def _broken(spec: TrialSpec, reason: str, detail: str) -> Trial:
    """A trial of which nothing is known but that it broke: one sample, at its start."""
    robot, s = load_robot(spec.robot), spec.scenario
    start = np.array(s.start, dtype=np.float64)
    starts = [start, *(np.array(leg.goal, dtype=np.float64) for leg in s.legs)]
    legs = tuple(
        Leg(
            name=leg.name,
            start=starts[i],
            goal=starts[i + 1],
            xy_tolerance=leg.xy_tolerance or robot.tolerances.xy,
            yaw_tolerance=leg.yaw_tolerance or robot.tolerances.yaw,
            scored=leg.scored,
            time_limit=leg.time_limit,
        )
        for i, leg in enumerate(s.legs)
    )
    labels: dict[str, Any] = s.labels.model_dump() | {"setup": spec.setup.name}
    bodies: tuple[Body, ...] = ()
    attempt = Attempt(
        labels=Labels(speed=s.speed, **labels),
        robot=robot.name,
        navigator=spec.navigator,
        localisation=spec.localisation,
        footprint=robot.shape,
        legs=legs,
        bodies=bodies,
        speed_limit=s.speed,
        period=robot.period,
        reference_length=s.reference_length,
        plan=s.plan,
        scenario=s.name,
        seed=s.seed,
    )
    return Trial(
        attempt=attempt,
        t=np.zeros(1),
        pose=start[None, :],
        velocity=None,
        estimate=None,
        command=None,
        leg=np.zeros(1, dtype=np.int64),
        moving_obstacles=np.empty((1, 0, 3)),
        spans=(),
        events=(Event(0.0, "error", detail),),
        outcome=Outcome.NAVIGATOR_FAILED,
        reason=reason,
    )
