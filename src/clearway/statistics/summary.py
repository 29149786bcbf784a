"""One table of a results directory: a row a system, suite, batch and speed, with success and indicators and their intervals."""

from __future__ import annotations

from typing import Any

import pyarrow as pa

from clearway.indicators import HEADLINE, INDICATORS
from clearway.statistics.columns import GROUP
from clearway.statistics.describe import describe, success_rates


def summary(table: pa.Table) -> pa.Table:
    """Success in per cent with its exact 95 % interval, and each of paper A's indicators with its mean and the bootstrap's.

    Args:
        table: Results, as in `trials.parquet`.

    Returns:
        A row a robot, navigator, set-up, suite, batch and speed; an indicator that no trial of it has is null. A column's unit is in
        its field's metadata.
    """
    means = {(*(r[c] for c in GROUP), r["indicator"]): r for r in describe(table, HEADLINE).to_pylist()}
    rows: list[dict[str, Any]] = []
    for rate in success_rates(table).to_pylist():
        group = {name: rate[name] for name in GROUP}
        row = group | {
            "n": rate["n"] + rate["unknown"],
            "SR": rate["SR"],
            "SR_low": rate["low"],
            "SR_high": rate["high"],
        }
        row |= {"SR_self": rate["SR_self"], "failures": rate["failures"]}
        for name in HEADLINE:
            mean = means.get((*group.values(), name), {})
            row |= {name: mean.get("mean"), f"{name}_low": mean.get("boot_low"), f"{name}_high": mean.get("boot_high")}
        rows.append(row)
    return pa.Table.from_pylist(rows, schema=_SCHEMA)


_TEXT, _NUMBER = pa.string(), pa.float64()
_KINDS: dict[str, Any] = {name: _NUMBER if name == "speed" else _TEXT for name in GROUP} | {"n": pa.int64()}
_KINDS |= dict.fromkeys(("SR", "SR_low", "SR_high", "SR_self"), _NUMBER) | {"failures": _TEXT}
_KINDS |= {f"{name}{end}": _NUMBER for name in HEADLINE for end in ("", "_low", "_high")}


def _unit(column: str) -> str:
    name = column.partition("_")[0]
    return {"speed": "m/s", "SR": "%"}.get(name) or (INDICATORS[name].unit if name in INDICATORS else "")


_SCHEMA = pa.schema([pa.field(name, kind, metadata={"unit": _unit(name)}) for name, kind in _KINDS.items()])
