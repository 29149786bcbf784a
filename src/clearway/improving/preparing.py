"""What has to be right in a task before anything runs: `clearway check` and `clearway tune` ask the same."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.campaigns.plan import TrialSpec
from clearway.campaigns.plan_checks import check_plan
from clearway.errors import ClearwayError, noted, refuse, shown
from clearway.improving.objective import Objective, read_objective
from clearway.improving.search import cma_module, refuse_little
from clearway.improving.settings import Settings, Together
from clearway.improving.task import Setting, Task, Variable, read_task
from clearway.improving.trials import refuse_overlap
from clearway.reading import read_toml


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """A task of which all is known that can be without a trial.

    Attributes:
        asked: The task; its variables know whether they are whole numbers.
        objective: What is better.
        settings: Where the parameters stand.
        before: The values that came in.
        groups: The training simulations, in an order by chance.
        same_places: Whether some held-out trials are in places of training.
    """

    asked: Task
    objective: Objective
    settings: Settings
    before: dict[str, Any]
    groups: list[list[TrialSpec]]
    same_places: bool


def prepared(asked: Task) -> Prepared:
    """Read and check what a task names.

    Raises:
        ClearwayError: something in it is wrong; it is the first of that and holds the others.
    """
    wrong: list[ClearwayError] = []
    with noted(wrong):
        objective = read_objective(asked.objective, asked.constraints, asked.file)
    if asked.search.method == "cma":
        with noted(wrong):
            cma_module()
    with noted(wrong):
        same_places = refuse_overlap(asked.training, asked.held_out, asked.file)
    with noted(wrong):
        groups = _shuffled(asked.training.specs(), asked.search.seed)
        refuse_little(asked.search, len(groups), asked.file)
    variables: list[Variable] = []
    with noted(wrong):
        settings = Together(asked.robot, asked.navigator, asked.variables)
        before = _before(settings, asked)
        for v in asked.variables:
            with noted(wrong):
                variables.append(_whole(v, before[v.name], asked))
    refuse(wrong)
    return Prepared(replace(asked, variables=tuple(variables)), objective, settings, before, groups, same_places)


def is_task(table: dict[str, Any]) -> bool:
    """Whether a TOML table is meant as a task of `clearway tune`."""
    return bool(table.keys() & {"objective", "training", "held_out"})


def task_findings(file: Path) -> Iterator[tuple[bool | None, str]] | None:
    """What is right and wrong with a task, as `clearway check` tells it; None: the file is none.

    Args:
        file: A TOML file, or anything else.
    """
    try:
        mine = file.suffix == ".toml" and is_task(dict(read_toml(file)))
    except ClearwayError:
        return None
    return _findings(file) if mine else None


def _findings(file: Path) -> Iterator[tuple[bool | None, str]]:
    wrong: list[ClearwayError] = []
    with noted(wrong):
        ready = prepared(read_task(file))
        asked = ready.asked
        for plan in (asked.training, asked.held_out):
            with noted(wrong):
                check_plan(plan, plan.specs())
        with noted(wrong), tempfile.TemporaryDirectory(prefix="clearway-check-") as scratch:
            check_ends(asked, ready.settings, Path(scratch))
    if wrong:
        yield from ((False, text) for text in dict.fromkeys(map(str, wrong)))
        return
    for v in asked.variables:
        yield True, f"{v.name} is {shown(ready.before[v.name])}"
    yield (
        True,
        f"{len(ready.groups)} training tests of {asked.training.suites[0]}, {len(asked.held_out.specs())} held out",
    )
    if ready.same_places:
        yield None, "whether a gain holds elsewhere: the held-out trials are in places of training"


def _whole(variable: Variable, before: Any, asked: Task) -> Variable:
    """The variable, a whole number where what came in is one."""
    field = _field(variable)
    if variable.choices:
        return variable
    if isinstance(before, bool | str | list | tuple):
        raise ClearwayError(f"is {shown(before)}, and has no range; give it `choices`", file=asked.file, field=field)
    whole = isinstance(before, int)
    if whole and not (variable.low.is_integer() and variable.high.is_integer()):
        raise ClearwayError("is a whole number; its range ends at whole ones", file=asked.file, field=field)
    return replace(variable, whole=whole)


def check_ends(asked: Task, settings: Settings, folder: Path) -> None:
    """Have the navigator read each parameter at both ends of its range, and every one of its choices.

    Raises:
        ClearwayError: one is refused; it is the first of those that are and holds the others.
    """
    wrong: list[ClearwayError] = []
    first = asked.training.specs()[0]
    for k, variable in enumerate(asked.variables):
        refused: dict[str, Setting] = {}
        for j, value in enumerate(variable.choices or (variable.value(0.0), variable.value(1.0))):
            robot, navigator, _ = settings.write({variable.name: value}, folder, f"end-{k}-{j}")
            plan = replace(asked.training, robots=(robot,), navigators=(navigator,))
            try:
                check_plan(plan, [replace(first, robot=robot, navigator=navigator)])
            except ClearwayError as error:
                refused.setdefault(error.problem, value)
        wrong += [
            ClearwayError(f"{shown(value)} is refused: {problem}", file=asked.file, field=_field(variable))
            for problem, value in refused.items()
        ]
    refuse(wrong)


def _field(variable: Variable) -> str:
    return f"{'options' if variable.option else 'parameters'}.{variable.name}"


def _before(settings: Settings, asked: Task) -> dict[str, Any]:
    """The values that came in.

    Raises:
        ClearwayError: parameters of these names aren't known; it is of the first of them and holds the others.
    """
    try:
        return settings.before([v.name for v in asked.variables])
    except ClearwayError as error:
        refuse(
            ClearwayError(one.problem, file=asked.file, field=one.field or "parameters")
            for one in (error, *error.others)
        )
        raise


def _shuffled(specs: Sequence[TrialSpec], seed: int) -> list[list[TrialSpec]]:
    """The simulations in an order by chance, so that the first few are of every kind."""
    groups = [list(run) for _, run in itertools.groupby(specs, key=lambda spec: spec.run)]
    return [groups[k] for k in np.random.default_rng(seed).permutation(len(groups))]
