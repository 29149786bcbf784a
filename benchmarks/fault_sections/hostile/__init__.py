"""Hostile files and command lines: each has to be refused with a sentence, or taken, within bounds of time and memory."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from clearway import api  # noqa: F401 - what every command needs is imported before the first is forked
from clearway.campaigns import checks, conformance  # noqa: F401
from clearway.mapping import build_map  # noqa: F401
from clearway.recordings.exports import export  # noqa: F401
from clearway.reports import write_report  # noqa: F401
from clearway.robots import load_robot
from fault_sections import Count
from fault_sections.confined import command
from fault_sections.hostile.campaigns import hostile_campaigns
from fault_sections.hostile.company import hostile_company
from fault_sections.hostile.good import EXAMPLES, KINDS, PLANS, REFUSED, TAKEN, Attack, check_of
from fault_sections.hostile.lines import as_given, command_lines
from fault_sections.hostile.maps import hostile_maps
from fault_sections.hostile.robots_and_plans import hostile_plans, hostile_robots, hostile_test_plans
from fault_sections.hostile.scenarios import hostile_scenarios, hostile_suites
from fault_sections.hostile.texts import HARMLESS, broken_texts, kinds_of_file

SMOKE = 30
"""Of how many attacks a smoke run takes one."""


def attacks() -> Iterator[Attack]:
    """Every attack."""
    for kind, good in KINDS.items():
        for name, text in broken_texts(good):
            yield f"{kind}s, as text", name, check_of(text), TAKEN if name in HARMLESS else REFUSED
    yield from (
        ("kinds of file", name, lay, REFUSED if "beside" not in name else TAKEN) for name, lay in kinds_of_file()
    )
    yield from (("scenarios", name, check_of(text), codes) for name, text, codes in hostile_scenarios())
    yield from (("people, tracks and robots", name, lay, codes) for name, lay, codes in hostile_company())
    yield from (("suites", name, lay, codes) for name, lay, codes in hostile_suites())
    yield from (("robots", name, check_of(text), REFUSED) for name, text in hostile_robots())
    yield from (("floor plans", name, check_of(text), codes) for name, text, codes in hostile_plans())
    yield from (("test plans", name, check_of(text), REFUSED) for name, text in hostile_test_plans())
    yield from (("maps", name, lay, codes) for name, lay, codes in hostile_maps())
    yield from (("campaign.json", name, lay, REFUSED) for name, lay in hostile_campaigns())
    yield from (
        ("command lines", " ".join(a[:60] for a in line[-6:]), as_given(line), codes) for line, codes in command_lines()
    )


def warm_up() -> None:
    """Check a good file of each kind: what is compiled and imported for it is shared by all that are forked."""
    for file in (*EXAMPLES.glob("*.toml"), *PLANS.glob("*.yaml"), EXAMPLES / "06_score_recordings" / "plan.toml"):
        checks.check_file(file, load_robot("tiago"))


def measure(smoke: bool) -> list[Count]:
    """Try every attack, or one of `SMOKE`."""
    warm_up()
    counts: dict[str, Count] = {}
    for number, (fault, name, lay, codes) in enumerate(attacks()):
        if smoke and number % SMOKE:
            continue
        folder = Path(tempfile.mkdtemp(prefix="hostile-"))
        try:
            line = lay(folder)
            ended = command(*line, within=folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        right = [code for code in codes if code != 1 or line[0] == "check"]  # which lists all that it finds
        counts.setdefault(fault, Count(fault)).add(name, ended.wrong(right))
    return list(counts.values())
