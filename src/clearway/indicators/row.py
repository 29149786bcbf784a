"""A trial as one row of `trials.parquet`: its labels, how it ended, every indicator, and what could not be computed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from clearway.indicators import barn, optimal
from clearway.indicators.avoidable import avoidable
from clearway.indicators.cause import cause, who_moved
from clearway.indicators.confirm import near_tolerance, to_confirm
from clearway.indicators.indicator import Indicator, NotComputable
from clearway.indicators.success import failure
from clearway.trials import Trial

Cell: TypeAlias = str | float | int | bool | None

LABELS: dict[str, tuple[str, str]] = {
    "scenario": ("string", ""),
    "suite": ("string", ""),
    "batch": ("string", ""),
    "configuration": ("string", ""),
    "robot": ("string", ""),
    "navigator": ("string", ""),
    "setup": ("string", ""),
    "localisation": ("string", ""),
    "tracking": ("string", ""),
    "privileged": ("bool", ""),
    "floor_plan": ("string", ""),
    "speed": ("double", "m/s"),
    "obstacle_speed": ("double", "m/s"),
    "size": ("double", "m"),
    "gap": ("double", "d_base"),
    "repetition": ("int64", ""),
    "seed": ("uint64", ""),
    "outcome": ("string", ""),
    "reason": ("string", ""),
    "failure": ("string", ""),
    "cause": ("string", ""),
    "moved_at_contact": ("string", ""),
    "avoidable": ("string", ""),
    "violations": ("int64", ""),
    "source": ("string", ""),
    "legs_by_motion": ("bool", ""),
    "to_confirm": ("string", ""),
    "near_tolerance": ("string", ""),
    "note": ("string", ""),
}
"""Columns that are not indicators: name -> (Arrow type, unit)."""


def score(trial: Trial, indicators: Mapping[str, Indicator]) -> dict[str, Cell]:
    """The row of `trial`: `LABELS`, then each of `indicators`, then `not_computable` (JSON: name -> why).

    What does not apply or cannot be computed is None. `success` and `success_self` are True or False. `failure` is
    empty for a success and None where nobody can tell; `cause`, `moved_at_contact` and `avoidable` are empty then.
    `violations` counts how often an assumption of the navigator's guarantee was seen to be untrue. `to_confirm` says what a person
    has to look at, `near_tolerance` which ends lie within their uncertainty of a tolerance. Of a recording,
    `not_computable` leaves out what is no question there: the scores of other suites, and what only a simulator knows.
    """
    attempt, labels = trial.attempt, trial.attempt.labels
    try:
        failed: str | None = failure(trial)
    except NotComputable:
        failed = None
    row: dict[str, Cell] = {
        "scenario": attempt.scenario,
        "suite": labels.suite,
        "batch": labels.batch,
        "configuration": labels.configuration,
        "robot": attempt.robot,
        "navigator": attempt.navigator,
        "setup": labels.setup,
        "localisation": attempt.localisation,
        "tracking": attempt.tracking,
        "privileged": attempt.privileged,
        "floor_plan": attempt.floor_plan,
        "speed": labels.speed,
        "obstacle_speed": labels.obstacle_speed,
        "size": labels.size,
        "gap": labels.gap,
        "repetition": labels.repetition,
        "seed": attempt.seed,
        "outcome": trial.outcome.value,
        "reason": trial.reason,
        "failure": failed,
        "cause": cause(trial),
        "moved_at_contact": who_moved(trial),
        "avoidable": avoidable(trial),
        "violations": sum(event.kind == "assumption" for event in trial.events),
        "source": attempt.source,
        "legs_by_motion": _by_motion(trial),
        "to_confirm": to_confirm(trial),
        "near_tolerance": near_tolerance(trial),
        "note": str(trial.provenance.get("note", "")),
    }
    why: dict[str, str] = {}
    beside_the_point = _beside_the_point(trial)
    recorded = attempt.source == "simulated" or bool(np.isfinite(trial.pose).any())
    for name, indicator in indicators.items():
        answer = indicator.function(trial)
        if answer.value is None and name not in beside_the_point:
            why[name] = answer.why if recorded else "not recorded"
        row[name] = bool(answer.value) if _is_bool(name) and answer.value is not None else answer.value
    row["not_computable"] = json.dumps(why)
    return row


def schema(indicators: Mapping[str, Indicator]) -> Any:
    """The Arrow schema of a table of such rows; each field's metadata holds its `unit`, an indicator's its `title` too."""
    import pyarrow as pa

    kinds = {
        "string": pa.string(),
        "double": pa.float64(),
        "int64": pa.int64(),
        "uint64": pa.uint64(),
        "bool": pa.bool_(),
    }
    fields = [pa.field(name, kinds[kind], metadata={"unit": unit}) for name, (kind, unit) in LABELS.items()]
    for name, indicator in indicators.items():
        about = {
            "unit": indicator.unit,
            "title": indicator.title,
            "source": indicator.source,
            "better": indicator.better,
        }
        fields.append(pa.field(name, kinds["bool" if _is_bool(name) else "double"], metadata=about))
    return pa.schema([*fields, pa.field("not_computable", pa.string())])


def _by_motion(trial: Trial) -> bool:
    """Whether a leg of a recording begins where the robot moved off: neither a goal nor the test plan says when."""
    told = trial.provenance.get("legs")
    legs = [leg for leg in told if isinstance(leg, str)] if isinstance(told, list | tuple) else []
    given = ("goal sent", "span given")
    return trial.attempt.source == "recorded" and any(not any(how in leg for how in given) for leg in legs)


def _beside_the_point(trial: Trial) -> frozenset[str]:
    """Indicators that no recording of this suite can ever have."""
    if trial.attempt.source == "simulated":
        return frozenset()
    other = () if trial.attempt.labels.suite in barn.SUITES else barn.ALL
    return frozenset(indicator.name for indicator in (*other, *optimal.ALL))


def _is_bool(name: str) -> bool:
    return name.startswith("success")
