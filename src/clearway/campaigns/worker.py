"""What a worker process does: run one simulation, score its trials, and leave them in the store's folder of finished ones."""

from __future__ import annotations

import traceback
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from clearway.campaigns.drawing import drawn
from clearway.campaigns.pilot import compose, dismiss, guarded, prepare_limit
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.campaigns.plan_checks import Known
from clearway.campaigns.pool import Fate
from clearway.campaigns.surroundings import restored
from clearway.campaigns.tuning import tuned
from clearway.contract import EventKind, Localiser
from clearway.errors import ClearwayError
from clearway.foreign import printable, said, traced
from clearway.geometry.grid import OccupancyGrid
from clearway.indicators import score_row
from clearway.navigators.registry import make_navigator
from clearway.perception import make_localiser, make_tracker
from clearway.robots import Robot, load_robot
from clearway.scenarios.behaviours import BEHAVIOURS
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import load_suite
from clearway.trials import Event, Outcome, Trial
from clearway.trials.keeping import Keep, is_kept, outline
from clearway.trials.store import write_partial
from clearway.world import simulation_of
from clearway.world.attempt import attempt_of, run_of
from clearway.world.behaviours.foreign import BehaviourError, Foreign
from clearway.world.bodies import bodies_of
from clearway.world.drive import Driver
from clearway.world.without_robots import completed

_BEHAVIOUR, _PILOT = ("/".join(Path(asks.__code__.co_filename).parts[-3:]) + '"' for asks in (Foreign.step, compose))
"""How the files' names end in which foreign code is asked, as a stack has them."""


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
    plan: CampaignPlan,
    specs: Sequence[TrialSpec],
    known: Mapping[str, Known],
    folder: Path,
    key: str,
    raise_errors: bool = False,
) -> list[Done]:
    """Run trials of one simulation, score them, and write them to a store's folder of finished trials.

    Args:
        plan: The campaign that they belong to.
        specs: The trials.
        known: Of each navigator.
        folder: The store's `partial`.
        key: The store's `key`.
        raise_errors: Whether an error in a trial is raised, and nothing is written; as a debugger needs it.

    Raises:
        ClearwayError: the disk is full, or a file that a trial needs has gone.
    """
    specs = all_drawn(plan, specs, folder)
    if raise_errors:
        trials = run_trials(plan, specs, known, raise_errors)
        return [_keep(trial, spec, folder, key, plan.keep) for trial, spec in zip(trials, specs, strict=True)]
    with restored():
        trials = run_trials(plan, specs, known)
    done = []
    for trial, spec in zip(trials, specs, strict=True):
        try:
            done.append(_keep(trial, spec, folder, key, plan.keep))
        except ClearwayError:
            raise
        except Exception as error:
            reason = f"the trial cannot be scored or stored: {said(error)}"
            done.append(_keep(_broken(plan, spec, known, reason, traced(error)), spec, folder, key, plan.keep))
    return done


def keep_fallen(
    fate: Fate, plan: CampaignPlan, specs: Sequence[TrialSpec], known: Mapping[str, Known], folder: Path, key: str,
    raise_errors: bool = False,
) -> list[Done]:  # fmt: skip
    """Write trials that no worker could complete, as such in which the navigator or a behaviour failed; none of their code runs any more.

    Args:
        fate: What became of the workers.
        plan: The campaign that they belong to.
        specs: The trials.
        known: Of each navigator.
        folder: The store's `partial`.
        key: The store's `key`.
        raise_errors: As for `run_and_keep`.

    Raises:
        ClearwayError: as for `run_and_keep`.
    """
    specs = all_drawn(plan, specs, folder)
    outcome, reason = fell(fate, specs[0].scenario)
    detail = f"{reason}\n{fate.place}" if fate.place else reason
    return [
        _keep(_broken(plan, spec, known, printable(reason), printable(detail), outcome), spec, folder, key, plan.keep)
        for spec in specs
    ]


def fell(fate: Fate, scenario: Scenario) -> tuple[Outcome, str]:
    """What trials end as that no worker could complete, and why: by who was being asked, the navigator or a behaviour of people."""
    asked = next((who for line in fate.place.splitlines() for who in (_BEHAVIOUR, _PILOT) if who in line), _PILOT)
    if asked is _PILOT:  # or nobody knows
        return Outcome.NAVIGATOR_FAILED, f"the worker process {fate.reason}"
    own = dict.fromkeys(p.behaviour for p in scenario.people if p.behaviour not in BEHAVIOURS.shipped)
    return Outcome.SCENARIO_FAILED, f"the behaviour {' or '.join(map(repr, own))} {fate.reason}"


def all_drawn(plan: CampaignPlan, specs: Sequence[TrialSpec], folder: Path | None = None) -> list[TrialSpec]:
    """The trials of one simulation with their whole scenario; arguments as for `drawn`."""
    scenario = drawn(plan, specs[0], folder).scenario
    return [replace(spec, scenario=scenario) for spec in specs]


def patience_of(plan: CampaignPlan) -> float | None:
    """How long a worker may be silent outside a navigator's code, s of wall clock; None: as long as it likes."""
    return None if plan.decision_limit is None else max(30.0 * plan.decision_limit, 60.0)


def run_trials(
    plan: CampaignPlan, specs: Sequence[TrialSpec], known: Mapping[str, Known], raise_errors: bool = False
) -> list[Trial]:
    """Run trials of one simulation. Whatever breaks in it, other than what the user gave, ends in trials that say so.

    Args:
        plan: The campaign that they belong to.
        specs: The trials, their scenario drawn.
        known: Of each navigator.
        raise_errors: Whether an error in it is raised, as a debugger needs it.

    Raises:
        ClearwayError: a file that it needs has gone.
    """
    from clearway.world import simulate_all

    first = specs[0]
    if ":" in first.suite:
        load_suite(first.suite)  # it brings its floor plans along
    robots = list(zip(map(load_robot, first.robots), first.navigators, strict=True))
    localisers = [make_localiser(first.localisation, robot) for robot, _ in robots]
    granted = granted_map(plan.map, first.scenario)
    try:
        with ExitStack() as after:
            drivers = [
                _driver(plan, first, robot, name, localiser, known[name], granted, after)
                for (robot, name), localiser in zip(robots, localisers, strict=True)
            ]
            trials = simulate_all(first.scenario, drivers, raise_errors=raise_errors)
        errands = completed(first.scenario, trials[0].errands, trials[0].spans)
    except Exception as error:
        if raise_errors:
            raise
        return [_broken(plan, spec, known, said(error), traced(error), _whose(error)) for spec in specs]
    return [_marked(replace(trials[spec.member], errands=errands), plan, spec, known) for spec in specs]


def _driver(
    plan: CampaignPlan, spec: TrialSpec, robot: Robot, name: str, localiser: Localiser, known: Known, granted: OccupancyGrid | None,
    after: ExitStack,
) -> Driver:  # fmt: skip
    limit = plan.decision_limit
    tracker = make_tracker(spec.tracking, robot) if "obstacles" in known.needs else None
    options = plan.options.get(name, {})
    navigator = guarded(prepare_limit(limit), "to be made", partial(make_navigator, name, **options))
    after.callback(dismiss, navigator, limit)
    pilot = compose(navigator, localiser, tracker=tracker, decision_limit=limit)
    return Driver(
        robot, pilot, map=granted, budget=spec.setup.budget, real_time=spec.setup.real_time, **_about(spec, name, known)
    )


def _about(spec: TrialSpec, navigator: str, known: Known) -> dict[str, Any]:
    return {
        "navigator": navigator,
        "localisation": spec.localisation,
        "privileged": known.privileged,
        "setup": spec.setup.name,
        "tracking": spec.tracking if "obstacles" in known.needs else "",
    }


def _marked(trial: Trial, plan: CampaignPlan, spec: TrialSpec, known: Mapping[str, Known]) -> Trial:
    return replace(trial, attempt=replace(trial.attempt, tuned=tuned(known[spec.driver].tuned_on, plan, spec)))


def _keep(trial: Trial, spec: TrialSpec, folder: Path, key: str, keep: Keep) -> Done:
    row = {"id": spec.id, "duration": float(trial.t[-1])} | score_row(trial)
    if not is_kept(keep, row):
        trial = outline(trial, keep)
    write_partial(folder, key, spec.index, trial, row)
    return Done(spec.index, trial.outcome, trial.reason)


def _whose(error: Exception) -> Outcome:
    """What a trial ends as that `error` broke: no navigator is asked anything while the simulation is built."""
    building = any(frame.f_code is simulation_of.__code__ for frame, _ in traceback.walk_tb(error.__traceback__))
    scenarios = building or isinstance(error, BehaviourError)
    return Outcome.SCENARIO_FAILED if scenarios else Outcome.NAVIGATOR_FAILED


def _broken(
    plan: CampaignPlan, spec: TrialSpec, known: Mapping[str, Known], reason: str, detail: str,
    outcome: Outcome = Outcome.NAVIGATOR_FAILED,
) -> Trial:  # fmt: skip
    """A trial of which nothing is known but what was attempted and that it broke: one sample, at its start."""
    robots, scenario = [load_robot(name) for name in spec.robots], spec.scenario.members()[spec.member]
    bodies = bodies_of(load_floor_plan(scenario.floor_plan).fixtures, spec.scenario, robots, spec.member)
    about = _about(spec, spec.driver, known[spec.driver])
    run = run_of(spec.scenario, robots, spec.navigators, spec.setup.name)
    trial = Trial(
        attempt=attempt_of(scenario, robots[spec.member], bodies, run=run, **about),
        t=np.zeros(1),
        pose=np.array([scenario.start], dtype=np.float64),
        velocity=None,
        estimate=None,
        command=None,
        leg=np.zeros(1, dtype=np.int64),
        moving_obstacles=np.full((1, sum(body.pose is None for body in bodies), 3), np.nan),
        spans=(),
        events=(Event(0.0, EventKind.ERROR, detail),),
        outcome=outcome,
        reason=reason,
    )
    return _marked(trial, plan, spec, known)
