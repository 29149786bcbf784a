"""Hostile results directories."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from clearway.trials.store_results import SCHEMA
from fault_sections.hostile.good import CAMPAIGN

_WRONG_IN_PLANS: tuple[tuple[str, Any], ...] = (
    ("selection.repetitions", 10**9), ("selection.repetitions", "x"), ("selection.repetitions", True),
    ("selection.speeds", ["x"]), ("selection.speeds", [0.6] * 100_000), ("selection.speeds", [k * 1e-6 for k in range(100_000)]),
    ("selection.seeds", [0, 10**12]), ("selection.seeds", ["a", "b"]), ("selection.seeds", [1]), ("selection.scenarios", [3]),
    ("selection.batches", [{}]), ("selection.worlds", ["a"]), ("selection.disturbance", "x"), ("selection.floor_plan", 3),
    ("selection", None), ("robots", [3]), ("robots", [f"r{k}" for k in range(100_000)]), ("navigators", [["a"]]),
    ("navigators", ["hp-st[without=" + "x" * 100_000 + "]"]), ("setups", [3]), ("suites", ["x" * 100_000]), ("options", [1]),
    ("options", {"move-base": 3}), ("seed", "x"), ("decision_limit", "x"), ("localisation", 7), ("tracking", [1]), ("map", 3),
)  # fmt: skip


def hostile_campaigns() -> Iterator[tuple[str, Callable[[Path], list[str]]]]:
    good = json.dumps(CAMPAIGN)
    texts: dict[str, str | bytes] = {
        "nested arrays": good[:-1] + ', "x": ' + "[" * 200_000 + "]" * 200_000 + "}",
        "nested arrays without an end": "[" * 1_000_000,
        "nested objects": '{"a":' * 100_000 + "1" + "}" * 100_000,
        "a number of 5,000 digits": good.replace(": 1,", f": {'9' * 5000},"),
        "10^18 trials": good.replace('"trials": 1', '"trials": 1000000000000000000'),
        "-1 trials": good.replace('"trials": 1', '"trials": -1'),
        "true as trials": good.replace('"trials": 1', '"trials": true'),
        "true as schema": good.replace(f'"schema": {SCHEMA}', '"schema": true'),
        "NaN": good.replace('"trials": 1', '"trials": NaN'),
        "not UTF-8": b'{"format": "\xff"}',
        "100 MB": good.encode() + b" " * 100_000_000,
        "20 million arrays": b'{"x": [' + b"[]," * 20_000_000 + b"0]}",
        "a plan of numbers": json.dumps(CAMPAIGN | {"plan": {"suites": 5, "selection": 5}}),
        "a plan of deep options": good.replace('["hospital"]', "[[[[]]]]"),
        "95 MB of one text": good[:-1] + ', "x": "' + "x" * (95 << 20) + '\U0001f600"}',
        "95 MB of one text of two bytes each": good[:-1] + ', "x": "' + "x" * (95 << 20) + '\u2028"}',
        "20 MB of escapes": good[:-1] + ', "x": "' + '\\"' * (10 << 20) + '\U0001f600"}',
        "95 MB of escapes": good[:-1] + ', "x": "' + '\\"' * (47 << 20) + '\u2028"}',
        "a million long keys": good[:-1]
        + ', "x": {'
        + ",".join(f'"{"k" * 80}{n}": 1' for n in range(1_000_000))
        + "}}",
        "a list": "[]",
        "a run that is a list": good.replace('"run": {}', '"run": [1]'),
        "nothing": "",
        "a surrogate": good.replace("results", "\\ud800"),
    }
    for field, value in _WRONG_IN_PLANS:
        plan = json.loads(json.dumps(CAMPAIGN["plan"]))
        table, _, key = field.rpartition(".")
        (plan[table] if table else plan)[key] = value
        texts[f"{field} = {str(value)[:20]}"] = json.dumps(CAMPAIGN | {"plan": plan})
    for name, text in texts.items():
        for verb in (["report", "."], ["run", "--resume", "."], ["rerun", ".", "--trial", "0"]):

            def lay(folder: Path, text: str | bytes = text, verb: list[str] = verb) -> list[str]:
                (folder / "campaign.json").write_bytes(text if isinstance(text, bytes) else text.encode())
                (folder / ".partial").mkdir()
                return verb

            yield f"{name}, {verb[0]}", lay
