"""What is to be tuned, as a TOML file says it: parameters and their ranges, an objective, training and held-out trials, a budget."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from clearway.campaigns.plan import CampaignPlan
from clearway.errors import ClearwayError, noted, refuse, shown
from clearway.improving.objective import read_objective
from clearway.quantities import Finite, Positive, Whole
from clearway.reading import read_toml
from clearway.robots import load_robot
from clearway.scenarios.suite import Selection, seed_range
from clearway.validation import Table, problems

Setting = bool | int | float | str
"""A parameter's value."""


@dataclass(frozen=True, slots=True)
class Variable:
    """A parameter that is tuned.

    Attributes:
        name: Its dotted name.
        option: Whether it is an option of the navigator's constructor rather than a value in a file.
        low: Its least value.
        high: Its greatest value.
        log: Whether its logarithm is searched evenly.
        choices: The values it may have, where it is no number; empty otherwise.
        whole: Whether it is a whole number.
    """

    name: str
    option: bool
    low: float = 0.0
    high: float = 1.0
    log: bool = False
    choices: tuple[Setting, ...] = ()
    whole: bool = False

    def value(self, x: float) -> Setting:
        """The value at `x`, 0 to 1 through its range; a number to four digits."""
        x = min(max(x, 0.0), 1.0)
        if self.choices:
            return self.choices[min(int(x * len(self.choices)), len(self.choices) - 1)]
        if self.log:
            number = math.exp(math.log(self.low) + x * (math.log(self.high) - math.log(self.low)))
        else:
            number = self.low + x * (self.high - self.low)
        if self.whole:
            return round(number)
        return min(max(float(f"{number:.4g}"), self.low), self.high)

    def place(self, value: object) -> float:
        """Where in its range a value is, 0 to 1; the middle of none that is known."""
        if self.choices:
            return (self.choices.index(value) + 0.5) / len(self.choices) if value in self.choices else 0.5
        if isinstance(value, bool) or not isinstance(value, int | float):
            return 0.5
        number = min(max(float(value), self.low), self.high)
        if self.log:
            return math.log(number / self.low) / math.log(self.high / self.low)
        return (number - self.low) / (self.high - self.low)


class _Trials(Table):
    """Trials, in the words of `clearway run`."""

    suite: str = Field(min_length=1)
    seed: Whole = Field(default=0, ge=0)
    seeds: str | None = None
    batches: tuple[str, ...] = ()
    configurations: tuple[str, ...] = ()
    scenarios: tuple[str, ...] = ()
    speeds: tuple[Positive, ...] = ()
    obstacle_speeds: tuple[Finite, ...] = ()
    sizes: tuple[Positive, ...] = ()
    gaps: tuple[Finite, ...] = ()
    worlds: tuple[Whole, ...] = ()
    repetitions: Whole | None = None
    floor_plan: str | None = None
    latency: Finite | None = None
    disturbance: Finite | None = None


class Search(Table):
    """How it is searched.

    Attributes:
        method: `cma` (CMA-ES), which needs `clearway[search]`, or `halving` (evenly spread candidates, successive halving).
        trials: How many training trials it may take in all.
        minutes: How long it may take, of wall clock and without the held-out trials; None: as long as it takes.
        population: Candidates a generation.
        first: On how many trials the first candidates are tried; later ones on more and more, up to all.
        finalists: How many candidates are tried on all of the training trials in the end, by halving.
        seed: Of the search.
    """

    method: Literal["cma", "halving"] = "cma"
    trials: Annotated[Whole, Field(ge=1, le=10_000_000)] = 400
    minutes: Positive | None = None
    population: Annotated[Whole, Field(ge=4, le=1000)] = 8
    first: Annotated[Whole, Field(ge=1)] = 6
    finalists: Annotated[Whole, Field(ge=1, le=100)] = 4
    seed: Annotated[Whole, Field(ge=0, lt=2**32 - 1)] = 0


class _File(Table):
    navigator: str = Field(min_length=1)
    robot: str = Field(min_length=1)
    objective: tuple[str, ...] = Field(min_length=1)
    constraints: tuple[str, ...] = ()
    localisation: str | None = None
    tracking: str | None = None
    parameters: dict[str, Any] = Field(default_factory=dict)
    options: dict[str, Any] = Field(default_factory=dict)
    training: _Trials
    held_out: _Trials
    search: Search = Search()

    @model_validator(mode="after")
    def _something(self) -> _File:
        if not self.parameters and not self.options:
            raise ValueError("nothing is to be tuned: name parameters and their ranges under [parameters] or [options]")
        return self


@dataclass(frozen=True, slots=True)
class Task:
    """What is to be tuned.

    Attributes:
        file: Where it stands.
        navigator: The navigator, as `clearway run` takes it.
        robot: The robot, likewise.
        variables: What is tuned.
        objective: `maximise NAME` or `minimise NAME`, the most important first; success comes before them, named or not.
        constraints: As in `min MDO >= 0.05`.
        training: The campaign of all training trials, with the parameters that came in.
        held_out: That of the held-out trials.
        search: How it is searched.
    """

    file: str
    navigator: str
    robot: str
    variables: tuple[Variable, ...]
    objective: tuple[str, ...]
    constraints: tuple[str, ...]
    training: CampaignPlan
    held_out: CampaignPlan
    search: Search


def read_task(path: str | Path) -> Task:
    """Read a tuning task.

    Raises:
        ClearwayError: the file can't be read, or fields of it are wrong; it is the first of them and holds the others.
    """
    try:
        read = _File.model_validate(dict(read_toml(path)))
    except ValidationError as error:
        refuse(problems(error, _File, file=path))
        raise
    wrong: list[ClearwayError] = []
    variables: list[Variable] = []
    plans: list[CampaignPlan] = []
    for field, table in (("parameters", read.parameters), ("options", read.options)):
        for name, given in _flat(table):
            with noted(wrong):
                variables.append(_variable(name, given, field == "options", f"{field}.{name}", path))
    with noted(wrong):
        read_objective(read.objective, read.constraints, str(path))
    for field, trials in (("training", read.training), ("held_out", read.held_out)):
        with noted(wrong):
            plans.append(_plan(read, trials, field, path))
    refuse(wrong)
    training, held_out = plans
    return Task(
        str(path), read.navigator, read.robot, tuple(variables), read.objective, read.constraints, training, held_out, read.search
    )  # fmt: skip


def _plan(read: _File, trials: _Trials, field: str, path: str | Path) -> CampaignPlan:
    """The campaign of some trials, of which there are any."""
    try:
        load_robot(read.robot)
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=path, field="robot") from error
    try:
        selection = Selection(
            batches=trials.batches, configurations=trials.configurations, speeds=trials.speeds, sizes=trials.sizes,
            gaps=trials.gaps, obstacle_speeds=trials.obstacle_speeds, repetitions=trials.repetitions, worlds=trials.worlds,
            scenarios=trials.scenarios, floor_plan=trials.floor_plan, latency=trials.latency, disturbance=trials.disturbance,
            seeds=None if trials.seeds is None else seed_range(trials.seeds),
        )  # fmt: skip
        plan = CampaignPlan(
            (trials.suite,),
            (read.robot,),
            (read.navigator,),
            selection,
            trials.seed,
            read.localisation,
            tracking=read.tracking,
        )
        plan.trials()
    except ClearwayError as error:
        raise ClearwayError(
            error.problem, file=path, field=f"{field}.{error.field}" if error.field else field
        ) from error
    return plan


def _flat(table: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    """Every parameter by its dotted name."""
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        name = f"{above}{key}"
        if isinstance(value, dict) and not value.keys() & {"range", "choices"}:
            found += _flat(value, f"{name}.")
        else:
            found.append((name, value))
    return found


def _variable(name: str, given: Any, option: bool, field: str, file: str | Path) -> Variable:
    def wrong(problem: str) -> ClearwayError:
        return ClearwayError(problem, file=file, field=field)

    table = given if isinstance(given, dict) else {"range": given}
    if strange := sorted(table.keys() - {"range", "scale", "choices"}):
        raise wrong(f"{strange[0]!r} is nothing that a range has; it has `range` and `scale`, or `choices`")
    if "choices" in table:
        choices = table["choices"]
        if "range" in table or "scale" in table:
            raise wrong("a parameter has a range, or choices, not both")
        if not isinstance(choices, list) or len(choices) < 2 or not all(isinstance(c, Setting) for c in choices):
            raise wrong(f"{shown(choices)} are no choices; at least two values are, as in ['a', 'b']")
        return Variable(name, option, choices=tuple(choices))
    ends, scale = table["range"], table.get("scale", "linear")
    if not isinstance(ends, list) or len(ends) != 2 or not all(_is_number(end) for end in ends):
        raise wrong(f"{shown(ends)} is no range; [0.5, 2.0] is")
    if not ends[0] < ends[1]:
        raise wrong(f"the range {shown(ends)} is upside down; its first number must be the lower one")
    if scale not in ("linear", "log"):
        raise wrong(f"{shown(scale)} is no scale; 'linear' and 'log' are")
    if scale == "log" and ends[0] <= 0:
        raise wrong(f"a logarithmic range begins above 0, and {shown(ends)} doesn't")
    return Variable(name, option, float(ends[0]), float(ends[1]), scale == "log")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
