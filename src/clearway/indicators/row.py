"""A trial as one row of `trials.parquet`: its labels, how it ended, every indicator, and what could not be computed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from clearway.indicators import barn, comfort, delay, optimal, smoothness
from clearway.indicators.column import Cell, Column, Kind
from clearway.indicators.indicator import Indicator, Value
from clearway.trials import Outcome, Trial
from clearway.trials.trial import NOT_RECORDED, UNUSABLE

_BROKEN = Value(None, "the scenario failed, by a behaviour of its people or as it was built")
_LAST = "not_computable"
_ABOUT_LAST = "JSON: indicator -> why its cell is empty"


def score(trial: Trial, columns: Iterable[Column], indicators: Mapping[str, Indicator]) -> dict[str, Cell]:
    """The row of `trial`: each of `columns`, then each of `indicators`, then `not_computable` (JSON: name -> why).

    What does not apply or cannot be computed is None. Of a recording, `not_computable` leaves out what is no question
    there: the scores of other suites, and what only a simulator knows; of any trial also what is about people or what moves, where there is none.
    """
    row: dict[str, Cell] = {column.name: column.value(trial) for column in columns}
    why: dict[str, str] = {}
    beside_the_point = _beside_the_point(trial)
    recorded = trial.attempt.source == "simulated" or bool(np.isfinite(trial.pose).any())
    unmeasured = UNUSABLE if UNUSABLE in trial.reason else NOT_RECORDED
    for name, indicator in indicators.items():
        answer = indicator.function(trial) if trial.outcome is not Outcome.SCENARIO_FAILED else _BROKEN
        if answer.value is None and name not in beside_the_point:
            why[name] = answer.why if recorded else unmeasured
        row[name] = bool(answer.value) if indicator.kind is Kind.BOOLEAN and answer.value is not None else answer.value
    row[_LAST] = json.dumps(why)
    return row


def schema(columns: Iterable[Column], indicators: Mapping[str, Indicator]) -> Any:
    """The Arrow schema of a table of such rows; each field's metadata holds its `unit` and `title`, and an indicator's
    `source` and which way is `better`."""
    import pyarrow as pa

    fields = [
        pa.field(c.name, pa.type_for_alias(c.arrow or c.kind.arrow), metadata={"unit": c.unit, "title": c.text})
        for c in columns
    ]
    for name, indicator in indicators.items():
        about = {
            "unit": indicator.unit,
            "title": indicator.title,
            "source": indicator.source,
            "better": indicator.better,
        }
        fields.append(pa.field(name, pa.type_for_alias(indicator.kind.arrow), metadata=about))
    return pa.schema([*fields, pa.field(_LAST, pa.string(), metadata={"unit": "", "title": _ABOUT_LAST})])


def _beside_the_point(trial: Trial) -> frozenset[str]:
    """Indicators that no recording of this suite can ever have, and those of people where there are none."""
    kinds = {body.kind for body in trial.attempt.bodies}
    people = () if kinds & comfort.PEOPLE else (*comfort.OF_PEOPLE, *delay.ALL)
    moving = () if kinds & comfort.MOVING else comfort.OF_MOVING
    if trial.attempt.source == "simulated":
        return frozenset(indicator.name for indicator in (*people, *moving))
    other = () if trial.attempt.labels.family == barn.FAMILY else barn.ALL
    simulated = (*optimal.ALL, *smoothness.OF_SIMULATIONS, *delay.ALL)
    return frozenset(indicator.name for indicator in (*people, *moving, *other, *simulated))
