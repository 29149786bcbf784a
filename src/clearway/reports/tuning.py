"""On what the navigators' parameters were chosen, beside their results: a sign in a table, its meaning below, and in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from clearway.reports.selection import Row
from clearway.tuning import Tuned

_SIGNS = {Tuned.SCENARIO: "†", Tuned.GEOMETRY: "‡", Tuned.SUITE: "§"}
_MEANING = {
    Tuned.SCENARIO: "on some of these very scenarios",
    Tuned.GEOMETRY: "on this geometry (with other noise, timing, speed or another robot)",
    Tuned.SUITE: "on other scenarios of the suite",
}


def sign(rows: Iterable[Row]) -> str:
    """The sign of the nearest test among those of these trials on which parameters were chosen; empty if there is none."""
    there = {r.get("tuned") for r in rows}
    return next((sign for near, sign in _SIGNS.items() if near in there), "")


def footnote(rows: Iterable[Row]) -> str:
    """What the signs beside groups of these trials mean, in a sentence that ends a caption; empty if there is none."""
    there = {r.get("tuned") for r in rows}
    said = [f"{sign} {_MEANING[near]}" for near, sign in _SIGNS.items() if near in there]
    return f" On what parameters were chosen: {'; '.join(said)}." if said else ""


def sentence(rows: Sequence[Row]) -> str:
    """How near to these trials' tests their navigator's parameters were chosen, as part of a sentence; empty if it says
    nothing."""
    counts = Counter(r.get("tuned") or "" for r in rows)
    known = [near for near in Tuned if counts[near] and near is not Tuned.UNDECLARED]
    if not known:
        return ""
    if known == [Tuned.NO]:
        return "parameters chosen on none of these tests"
    several = len(counts) > 1
    parts = [
        f"{near.value} in {counts[near]} of {len(rows)} trials" if several else near.value
        for near in known
        if near is not Tuned.NO
    ]
    return f"parameters chosen {', '.join(parts)}"


def declarations(campaign: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Each navigator of a campaign with what it declares, in words; nothing of results that don't say."""
    run = campaign.get("run")
    told = run.get("tuned_on") if isinstance(run, dict) else None
    return [(name, _declared(tests)) for name, tests in told.items()] if isinstance(told, dict) else []


def _declared(tests: Any) -> str:
    if not isinstance(tests, list):
        return "says nothing"
    return "; ".join(map(str, tests)) or "nothing that can be run here"
