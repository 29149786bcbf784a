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
from clearway.errors import ClearwayError, shown
from clearway.improving.objective import Objective, read_objective
from clearway.improving.search import cma_module, refuse_little
from clearway.improving.settings import Settings, Together
from clearway.improving.task import Task, Variable, read_task
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
        ClearwayError: something in it is wrong.
    """
    objective = read_objective(asked.objective, asked.constraints, asked.file)
    if asked.search.method == "cma":
        cma_module()
    same_places = refuse_overlap(asked.training, asked.held_out, asked.file)
    groups = _shuffled(asked.training.specs(), asked.search.seed)
    refuse_little(asked.search, len(groups), asked.file)
    settings = Together(asked.robot, asked.navigator, asked.variables)
    try:
        before = settings.before([v.name for v in asked.variables])
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=asked.file, field=error.field or "parameters") from error
    variables = tuple(_whole(v, before[v.name], asked) for v in asked.variables)
    return Prepared(replace(asked, variables=variables), objective, settings, before, groups, same_places)


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
    try:
        ready = prepared(read_task(file))
        asked = ready.asked
        with tempfile.TemporaryDirectory(prefix="clearway-check-") as scratch:
            for plan in (asked.training, asked.held_out):
                check_plan(plan, plan.specs())
            check_ends(asked, ready.settings, Path(scratch))
    except ClearwayError as error:
        yield False, str(error)
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
    field = f"{'options' if variable.option else 'parameters'}.{variable.name}"
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
        ClearwayError: one is refused.
    """
    for k, variable in enumerate(asked.variables):
        for j, value in enumerate(variable.choices or (variable.value(0.0), variable.value(1.0))):
            robot, navigator, _ = settings.write({variable.name: value}, folder, f"end-{k}-{j}")
            plan = replace(asked.training, robots=(robot,), navigators=(navigator,))
            field = f"{'options' if variable.option else 'parameters'}.{variable.name}"
            try:
                check_plan(plan, [replace(asked.training.specs()[0], robot=robot, navigator=navigator)])
            except ClearwayError as error:
                raise ClearwayError(
                    f"{shown(value)} is refused: {error.problem}", file=asked.file, field=field
                ) from error


def _shuffled(specs: Sequence[TrialSpec], seed: int) -> list[list[TrialSpec]]:
    """The simulations in an order by chance, so that the first few are of every kind."""
    groups = [list(run) for _, run in itertools.groupby(specs, key=lambda spec: spec.run)]
    return [groups[k] for k in np.random.default_rng(seed).permutation(len(groups))]
