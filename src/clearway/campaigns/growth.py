"""Which trials of an earlier scoring still stand, when its plan has grown."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clearway.trials.store_results import CAMPAIGN, read_campaign

NAMED = ("poses", "bodies", "sources")
"""Tables of a plan that may grow: a trial depends on nothing in them that it does not name."""
LISTS = ("attempted", "numbers", "not_attempted", "files", "test_plan")


def kept_of(out: Path, asked: Mapping[str, Any]) -> dict[int, int] | None:
    """The trials that need not be scored again: plan, number and files are what they were.

    Args:
        out: A results directory.
        asked: What is asked now, as campaign.json would hold it.

    Returns:
        Their numbers in the results, now and before; None where there is no earlier scoring, the same was asked, or something
        has changed that all trials depend on.
    """
    if not (out / CAMPAIGN).exists():
        return None
    old, new = read_campaign(out), json.loads(json.dumps(asked))
    if all(old.get(name) == value for name, value in new.items()):
        return None
    if any(old.get(name) != value for name, value in new.items() if name not in LISTS):
        return None
    if any(name not in old for name in LISTS) or not _grown(old["test_plan"], new["test_plan"]):
        return None
    shared = set(old["files"]) - {f for spec in old["attempted"] for f in _files(spec)}
    if any(old["files"][f] != new["files"].get(f) for f in shared):
        return None
    before = {number: i for i, number in enumerate(old["numbers"])}
    kept: dict[int, int] = {}
    for i, (number, spec) in enumerate(zip(new["numbers"], new["attempted"], strict=True)):
        j = before.get(number)
        if j is not None and old["attempted"][j] == spec:
            same = all(old["files"].get(f) == new["files"].get(f) for f in _files(spec))
            kept |= {i: j} if same else {}
    return kept


def _grown(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Whether all that the old plan said still stands, where its files lie apart."""
    old, new = _scored(old), _scored(new)
    if any(old.get(name) != new.get(name) for name in {*old, *new} - {*NAMED}):
        return False
    if next(iter(old["sources"])) != next(iter(new["sources"])):
        return False
    return all(new[table].get(name) == value for table in NAMED for name, value in old[table].items())


def _scored(plan: Mapping[str, Any]) -> dict[str, Any]:
    """A plan without how its files, videos and ticks are found: of these each trial tells by itself."""
    sources = {name: {**source, "files": None} for name, source in plan["sources"].items()}
    return {**plan, "sources": sources, "video": None, "test": {**plan["test"], "ticks": None}}


def _files(spec: Mapping[str, Any]) -> set[str]:
    return {f for f in (spec["file"], *spec["files"].values()) if f}
