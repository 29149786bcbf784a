"""Members of families as trials: what is tried, what came of it, and many at once in the house's pool of workers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.campaigns.plan_checks import Known
from clearway.campaigns.pool import Fate, Pool
from clearway.campaigns.surroundings import restored
from clearway.campaigns.worker import all_drawn, fell, patience_of, run_trials
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.indicators import NotComputable
from clearway.indicators.legs import contact_time, ground_speed
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.family import Family
from clearway.scenarios.perturbing import perturbed
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import scenario_seed
from clearway.searching.encounters import hardness
from clearway.searching.failures import Failure, party
from clearway.trials import BROKEN, Outcome, Trial

NOISES = 2**20
"""How many draws of noise there are."""
WORST = 1e3
"""The margin that stands for one that can't be computed."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A member of one of several families.

    Attributes:
        base: Which family.
        point: (n,) where it lies in that family's unit cube.
        noise: Which draw of everything random it meets: sensor noise, odometry, disturbance, placement.
    """

    base: int
    point: FloatArray
    noise: int


class Space(Protocol):
    """What is searched."""

    def __len__(self) -> int:
        """How many families there are."""
        ...

    def size(self, base: int) -> int:
        """How many numbers vary in one."""
        ...

    def hardness(self, candidate: Candidate) -> float:
        """How hard a member looks before any trial of it; -inf where it makes no scenario."""
        ...


def anywhere(space: Space, rng: np.random.Generator) -> Candidate:
    """A member of any family by chance, anywhere in it."""
    base = int(rng.integers(len(space)))
    return Candidate(base, rng.random(space.size(base)), int(rng.integers(NOISES)))


@dataclass(frozen=True, slots=True)
class Tried:
    """What came of a trial.

    Attributes:
        margin: How far it is from failing as it was searched for, 0 or less if it did; inf where that can't be computed.
        outcome: How it ended, or why it failed.
        party: Whom the robot touched; empty for nobody.
        place: Where the robot was at the end: x, y, m.
        t: When that was, s since the trial began.
        speed: How fast the robot was then, m/s.
        leg: On which leg.
        member: Which robot it was, where there are several; empty for one alone.
        why: Why the margin can't be computed, or why the navigator failed; empty otherwise.
    """

    margin: float
    outcome: str
    party: str
    place: tuple[float, float]
    t: float
    speed: float
    leg: str
    member: str = ""
    why: str = ""

    @property
    def broken(self) -> bool:
        """Whether it failed as it was searched for."""
        return self.margin <= 0.0


def as_run(scenario: Scenario) -> Scenario:
    """The scenario with the seed that `clearway run` gives it when it stands in a file of its own."""
    return scenario.model_copy(update={"seed": scenario_seed(0, f"{scenario.name}-v{scenario.speed:g}-r1")})


class Families:
    """The families of a plan's scenarios, made when they are asked for.

    Args:
        groups: The trials of each simulation that the plan asks for.
        own: The families that the user wrote, by scenario's name; others are made by perturbing.
        plan: The plan.
    """

    def __init__(self, plan: CampaignPlan, groups: Sequence[Sequence[TrialSpec]], own: Mapping[str, Family]) -> None:
        self._plan, self._groups, self._own = plan, groups, own
        self._made: dict[int, Family] = {}

    def __len__(self) -> int:
        return len(self._groups)

    def __getitem__(self, base: int) -> Family:
        if base not in self._made:
            spec = all_drawn(self._plan, self._groups[base])[0]
            scenario = spec.scenario
            written = [k for k in self._own if scenario.name == k or scenario.name.startswith(f"{k}-v")]
            update = {"localisation": spec.localisation, "tracking": spec.tracking}
            found = self._own[written[0]] if written else perturbed(scenario)
            self._made[base] = Family.of(found.base.model_copy(update=update), found.variables)
            if not self._made[base].variables:
                raise ClearwayError(f"nothing varies in the scenario {scenario.name!r}", field="family")
        return self._made[base]

    def size(self, base: int) -> int:
        """How many numbers vary."""
        return len(self[base].variables)


class Bench:
    """Where candidates are tried.

    Args:
        plan: The campaign that they would be of: one robot and navigator.
        groups: The trials of each simulation that the plan asks for, one for each family.
        own: The families that the user wrote, by scenario's name.
        known: Of each navigator.
        failure: What is searched for.
        work: The pool of workers.

    Attributes:
        families: The families.
        trials: How many trials were run so far.
    """

    def __init__(
        self, plan: CampaignPlan, groups: Sequence[Sequence[TrialSpec]], own: Mapping[str, Family], known: Mapping[str, Known],
        failure: Failure, work: Pool,
    ) -> None:  # fmt: skip
        self._plan, self._groups, self._known, self._failure, self._work = plan, groups, known, failure, work
        self.families = Families(plan, groups, own)
        self.trials = 0

    @cached_property
    def robot(self) -> Any:
        """The robot that is tested."""
        return load_robot(self._groups[0][0].robot)

    def scenario(self, candidate: Candidate) -> Scenario | None:
        """The candidate's scenario, as it runs; None where it would be meaningless."""
        try:
            made = self._made(candidate)
        except ClearwayError:
            return None
        return self.valid(made)

    def hardness(self, candidate: Candidate) -> float:
        """How hard the candidate's scenario looks, see `encounters`; -inf where it makes none. Whether it is meaningful is not checked."""
        try:
            made = self._made(candidate)
            return hardness(made, [load_robot(name) for name in self._groups[candidate.base][0].robots])
        except ClearwayError:
            return -math.inf

    def _made(self, candidate: Candidate) -> Scenario:
        family = self.families[candidate.base]
        made = family.scenario(family.values(candidate.point))
        return made.model_copy(update={"name": f"{family.base.name} draw {candidate.noise}"})

    def valid(self, scenario: Scenario) -> Scenario | None:
        """The scenario as it runs; None where it would be meaningless."""
        return None if check_scenario(scenario, self.robot) else as_run(scenario)

    def run(self, asked: Sequence[tuple[int, Scenario]]) -> list[Tried]:
        """What comes of scenarios, each a member of the family with the number before it, in their order."""
        calls = []
        for k, (base, scenario) in enumerate(asked):
            specs = [replace(spec, scenario=scenario) for spec in self._groups[base]]
            calls.append((self._plan, specs, self._known, self._failure, k))
        found: dict[int, Tried] = {}
        for k, tried in self._work.each(_tried, calls, patience=patience_of(self._plan), fallen=_fallen):
            found[k] = tried
            self.trials += 1
        return [found[k] for k in range(len(calls))]


def _tried(plan: CampaignPlan, specs: Sequence[TrialSpec], known: Mapping[str, Known], failure: Failure, k: int) -> tuple[int, Tried]:  # fmt: skip
    with restored():
        trials = run_trials(plan, specs, known)
    return k, min((_judged(trial, failure) for trial in trials), key=lambda tried: tried.margin)


def _fallen(
    fate: Fate, plan: CampaignPlan, specs: Sequence[TrialSpec], known: Mapping[str, Known], failure: Failure, k: int
) -> tuple[int, Tried]:
    outcome, why = fell(fate, specs[0].scenario)
    return k, Tried(math.inf, outcome.value, "", (math.nan, math.nan), 0.0, 0.0, "", why=why)


def _judged(trial: Trial, failure: Failure) -> Tried:
    failed = trial.outcome in BROKEN
    why = trial.reason if failed else ""
    try:
        margin = failure.margin(trial) if trial.outcome is not Outcome.SCENARIO_FAILED else math.inf
    except NotComputable as reason:
        margin, why = math.inf, why or str(reason)
    touched = contact_time(trial)
    speed = 0.0 if trial.velocity is None or not len(trial.velocity) else float(ground_speed(trial.velocity[-1:])[0])
    x, y = (float(v) for v in trial.pose[-1, :2])
    return Tried(
        margin=margin,
        outcome=trial.outcome.value,
        party=party(trial),
        place=(x, y),
        t=float(trial.t[-1]) if touched is None else float(touched),
        speed=speed,
        leg=trial.attempt.legs[int(np.asarray(trial.leg)[-1])].name,
        member=trial.attempt.member,
        why=why,
    )
