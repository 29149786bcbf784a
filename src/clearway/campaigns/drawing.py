"""Scenarios that are drawn from seeds: when a trial needs one, by the process that runs it, and kept for those that follow.

A draw takes half a second, and there may be thousands: none waits for all of them. A campaign's plan lists outlines, what is
known of a scenario without drawing.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.robots import load_robot
from clearway.scenarios.suites import load_suite

KEPT = "drawn"
"""The folder, beside a store's finished trials, of what has been drawn for them."""


def drawn(plan: CampaignPlan, spec: TrialSpec, folder: Path | None = None) -> TrialSpec:
    """The trial with its whole scenario; as it is, unless the plan draws from seeds.

    Args:
        plan: The campaign that it belongs to.
        spec: The trial.
        folder: The store's `partial`, where what is drawn is kept; None: nowhere.

    Raises:
        ClearwayError: the seed gives no scenario.
    """
    suite = load_suite(spec.suite)
    if plan.selection.seeds is None or suite.generator is None:
        return spec
    only = dataclasses.replace(plan.selection, scenarios=(spec.scenario.name,))
    if not (calls := suite.generator.calls(only)):
        return spec  # its outline is all of it
    for arguments in calls if folder is not None else ():
        if arguments not in suite.generator.drawn:
            name = hashlib.sha256(f"{suite.name} {arguments!r}".encode()).hexdigest()[:32]
            _draw_or_read(suite.generator, arguments, Path(folder or "") / KEPT / f"{name}.json")
    (scenario,) = suite.build(load_robot(spec.robot), only, plan.seed)
    return dataclasses.replace(spec, scenario=scenario)


def _draw_or_read(generator: Any, arguments: tuple[Any, ...], file: Path) -> None:
    """Have the generator hold what it draws for these arguments; from its file, if an earlier trial has left one."""
    with contextlib.suppress(OSError, ValueError):  # not there, or damaged
        digest, _, text = file.read_text("utf-8").partition("\n")
        if digest == hashlib.sha256(text.encode()).hexdigest():
            generator.hold(arguments, generator.read(json.loads(text)))
            return
    text = json.dumps(generator.written(generator(*arguments)))
    with contextlib.suppress(OSError):  # then it is not kept; the trial itself complains of a full disk
        file.parent.mkdir(exist_ok=True)
        new = file.with_suffix(f".{os.getpid()}")
        new.write_text(f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}", "utf-8")
        os.replace(new, file)
