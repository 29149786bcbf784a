"""Trials of candidates, run as a campaign runs them, many at once; and whether held-out trials are others than those of training."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.campaigns.plan_checks import Known
from clearway.campaigns.pool import Fate, Pool
from clearway.campaigns.surroundings import restored
from clearway.campaigns.worker import all_drawn, fell, patience_of, run_trials
from clearway.errors import ClearwayError
from clearway.improving.objective import FAILED, Answers
from clearway.improving.search import Values
from clearway.improving.settings import Settings, Written
from clearway.indicators import INDICATORS
from clearway.scenarios.suites import suite_names
from clearway.trials import Outcome


class Bench:
    """Runs training trials with other parameters.

    Args:
        plan: The campaign with the parameters that came in.
        groups: Its trials, those of one simulation together.
        known: Of its navigator.
        settings: Where parameters stand.
        indicators: Which ones are asked for.
        folder: Where candidates' files are written.
        work: The workers.
    """

    def __init__(
        self, plan: CampaignPlan, groups: Sequence[Sequence[TrialSpec]], known: Mapping[str, Known], settings: Settings,
        indicators: Sequence[str], folder: Path, work: Pool,
    ) -> None:  # fmt: skip
        self._plan, self._groups, self._known, self._settings = plan, groups, known, settings
        self._indicators, self._folder, self._work = tuple(indicators), folder, work
        self._written: dict[int, Written] = {0: Written(plan.robots[0], plan.navigators[0])}

    def __call__(self, asked: Sequence[tuple[int, Values, Sequence[int]]]) -> dict[tuple[int, int], Answers]:
        """Answers by candidate and trial, as `search.Try` has it."""
        calls = []
        for number, values, trials in asked:
            if number not in self._written:
                self._written[number] = self._settings.write(values, self._folder, f"candidate-{number}")
            calls += [self._call(number, trial) for trial in trials]
        patience = patience_of(self._plan)
        return dict(self._work.each(_run, calls, patience=patience, fallen=_fallen))

    def _call(
        self, number: int, trial: int
    ) -> tuple[tuple[int, int], CampaignPlan, list[TrialSpec], dict[str, Known], tuple[str, ...]]:
        robot, navigator, _ = self._written[number]
        plan = replace(self._plan, robots=(robot,), navigators=(navigator,))
        specs = [replace(spec, robot=robot, navigator=navigator) for spec in self._groups[trial]]
        known = dict(self._known) | {navigator: self._known[self._plan.navigators[0]]}
        return (number, trial), plan, specs, known, self._indicators


def _run(
    key: tuple[int, int],
    plan: CampaignPlan,
    specs: Sequence[TrialSpec],
    known: Mapping[str, Known],
    indicators: Sequence[str],
) -> tuple[tuple[int, int], dict[str, float | None]]:
    """One simulation's answers; of several robots their mean; none if its scenario failed."""
    specs = all_drawn(plan, specs)
    with restored():
        trials = [trial for trial in run_trials(plan, specs, known) if trial.outcome is not Outcome.SCENARIO_FAILED]
    answers: dict[str, float | None] = {}
    for name in indicators:
        found = [
            v for trial in trials if (v := INDICATORS[name].function(trial).value) is not None and math.isfinite(v)
        ]
        answers[name] = float(np.mean(found)) if found else None
    answers[FAILED] = float(any(trial.outcome is Outcome.NAVIGATOR_FAILED for trial in trials))
    return key, answers


def _fallen(
    fate: Fate, key: tuple[int, int], plan: CampaignPlan, specs: Sequence[TrialSpec], known: Mapping[str, Known],
    indicators: Sequence[str],
) -> tuple[tuple[int, int], dict[str, float | None]]:  # fmt: skip
    outcome, _ = fell(fate, specs[0].scenario)
    return key, dict.fromkeys(indicators) | {FAILED: float(outcome is Outcome.NAVIGATOR_FAILED)}


def refuse_overlap(training: CampaignPlan, held_out: CampaignPlan, file: str) -> bool:
    """Complain of held-out trials that are training trials too.

    Returns:
        Whether some held-out trials are in places of training, and only noise, timing and the like differ.

    Raises:
        ClearwayError: a trial is among both.
    """
    first, second = training.selection.seeds, held_out.selection.seeds
    if first and second and training.suites == held_out.suites and max(first[0], second[0]) < min(first[1], second[1]):
        low, high = max(first[0], second[0]), min(first[1], second[1])
        both = f"seed {low} is" if high - low == 1 else f"seeds {low} to {high - 1} are"
        raise ClearwayError(
            f"{second[0]}:{second[1]} overlaps with training's {first[0]}:{first[1]}, {both} in both; "
            f"{first[1]}:{first[1] + second[1] - second[0]} has as many seeds, and none of training",
            file=file, field="held_out.seeds",
        )  # fmt: skip
    ours: dict[str, TrialSpec] = {}
    places: set[str] = set()
    for spec in training.specs():
        ours[_test(spec)] = spec
        places.add(_place(spec))
    same = False
    for spec in held_out.specs():
        if (other := ours.get(_test(spec))) is not None:
            raise ClearwayError(
                f"the trial {spec.scenario.name!r} of {spec.suite!r} is held out and, as {other.scenario.name!r}, in training too; hold out "
                f"{_elsewhere(training, held_out)}",
                file=file, field="held_out",
            )  # fmt: skip
        same = same or (held_out.selection.seeds is None and _place(spec) in places)
    return same


def _elsewhere(training: CampaignPlan, held_out: CampaignPlan) -> str:
    """What trials that are none of training could be."""
    drawn, kin = training.selection.seeds, f"{held_out.suites[0]}-held-out"
    ways = [f"seeds from {drawn[1]} on" if drawn else f"with another seed (seed = {training.seed + 1})"]
    ways += ["other scenarios"] if held_out.selection.seeds is None else []
    ways += [f"the suite {kin!r}"] if kin in suite_names() else []
    return ", or ".join(ways)


_PLACE = {"floor_plan", "start", "legs", "obstacles", "people", "robots"}
"""Fields of a scenario that make a place another one; latency, say, makes none."""
_TIMING = {"obstacles": {"__all__": {"runs": {"__all__": {"delay"}}}}}
"""What of them a seed alone may change."""


def _test(spec: TrialSpec) -> str:
    return spec.scenario.model_dump_json(include=_PLACE | {"speed", "seed"})


def _place(spec: TrialSpec) -> str:
    return spec.scenario.model_dump_json(include=_PLACE, exclude=_TIMING)
