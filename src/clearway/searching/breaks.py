"""A whole search: from what was asked to a folder with a scenario file for each different break, run once more from that file."""

from __future__ import annotations

import csv
import dataclasses
import itertools
import json
import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.pool import pool, workers_of
from clearway.campaigns.progress import ProgressCallback, silent
from clearway.errors import ClearwayError
from clearway.placing import make_folder
from clearway.recordings.protocol.toml_text import toml
from clearway.reports.searched import SEARCH
from clearway.robots import load_robot
from clearway.scenarios.check import check_family
from clearway.scenarios.family import Family, load_families, table_of
from clearway.scenarios.floor_plan_files import is_path
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.searching.candidates import Bench, Candidate
from clearway.searching.failures import Failure, failure_named
from clearway.searching.rarity import FEWEST, Rarity, rarity
from clearway.searching.search import Attempted, FamilySpace, different, search
from clearway.searching.shrinking import Shrunk, shrunk, unshrunk
from clearway.searching.strategies import MARGINS, SCREEN, strategy_named
from clearway.trials import BROKEN
from clearway.trials.store import Results, refuse_results

SHRINKING = 150
"""Trials at most that a break's shrinking takes."""


@dataclass(frozen=True, slots=True, eq=False)
class Break:
    """A scenario that breaks a navigator.

    Attributes:
        file: The scenario's file, which `clearway run` replays.
        sentence: What happens.
        at: In which trial of the search it was found, from 1.
        shrunk: The scenario, what came of it, and what became smaller.
    """

    file: Path
    sentence: str
    at: int
    shrunk: Shrunk


@dataclass(frozen=True, slots=True, eq=False)
class Breaks:
    """What a search found.

    Attributes:
        path: The folder: a file for each break, `search.csv` with every trial of the search, `search.json` with what is said here, and
            `results`, a results directory of the breaks.
        breaks: The different breaks, empty where none was found.
        trials: How many trials the search took.
        shrinking: How many more their shrinking took.
        first: In which trial the first break was, from 1; None where there is none.
        least: The least margin of a trial, in `unit`; inf where none can be computed.
        unit: Of the margins.
        failed: In how many trials the navigator itself (raised, hung), or a behaviour of the scenario's people, failed; these count as no break.
        rarity: How probable a break is among all members of the families; None where that was not asked.
        results: The breaks, run from their files; None where there are none.
    """

    path: Path
    breaks: tuple[Break, ...]
    trials: int
    shrinking: int
    first: int | None
    least: float
    unit: str
    failed: int
    rarity: Rarity | None
    results: Results | None

    def __str__(self) -> str:
        """What was found, a line a break, and how rare that is."""
        rare = [f"how rare: {self.rarity}"] if self.rarity else []
        return "\n".join([self.head, *(f"{b.file}: {b.sentence}" for b in self.breaks), *rare])

    @property
    def head(self) -> str:
        """How many breaks there are, in a few words."""
        if not self.breaks:
            least = f"; the least margin was {self.least:.3g} {self.unit}" if math.isfinite(self.least) else ""
            return f"no break in {self.trials} trials{least}"
        return f"{len(self.breaks)} different break{'s' * (len(self.breaks) > 1)} in {self.trials} trials, the first in trial {self.first}"

    def to_json(self) -> dict[str, Any]:
        """What was found, as JSON values; files by their names in the folder."""
        breaks = [
            {
                "file": b.file.name,
                "sentence": b.sentence,
                "trial": b.at,
                "changed": b.shrunk.changed,
                "dropped": b.shrunk.dropped,
            }
            for b in self.breaks
        ]
        about = {
            "found": self.head,
            "trials": self.trials,
            "shrinking": self.shrinking,
            "first": self.first,
            "failed": self.failed,
        }
        least = {"least_margin": self.least if math.isfinite(self.least) else None, "unit": self.unit}
        return about | least | {"breaks": breaks, "rarity": self.rarity and self.rarity.to_json()}


def find_breaks(
    plan: CampaignPlan,
    out: Path,
    *,
    failure: str,
    trials: int,
    breaks: int,
    method: str | None = None,
    shrink: bool = True,
    rare: int = 0,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Breaks:
    """Search the families of a plan's scenarios for what breaks its navigator, and write what is found.

    Args:
        plan: The campaign that is searched around: one suite or scenario, robot and navigator. A scenario's file with a table
            `[family]` says what varies; of any other scenario everything continuous does.
        out: The folder, made if it isn't there.
        failure: What counts as a break, as `failures` has it.
        trials: How many trials the search may take.
        breaks: How many different breaks are enough.
        method: One of `strategies.METHODS`; None: by what looks hard where a contact is searched for, else by margins.
        shrink: Whether breaks are made smaller.
        rare: About how many trials more may tell how rare a break is; 0: none.
        workers: How many processes; None: one a core.
        progress: Told how far it is.

    Raises:
        ClearwayError: something that was given is wrong, or what is searched for can't be computed of any trial.
    """
    sought, tell, processes = failure_named(failure), progress or silent, workers_of(workers, least=0)
    for what, number in (("trials", trials), ("breaks", breaks)):
        if number < 1:
            raise ClearwayError(f"{number} is wrong: at least 1", field=what)
    if rare and rare < FEWEST:
        raise ClearwayError(f"{rare} trials are too few: at least {FEWEST}, or 0 for not asking", field="rarity")
    refuse_results(out / "results")
    if (out / SEARCH).exists():
        raise ClearwayError("holds another search; choose another folder", file=out)
    with pool(processes, out) as work:
        bench, batch = bench_of(plan, sought, work), max(1, processes)
        make_folder(out)
        usual = SCREEN if sought.touches else MARGINS
        strategy = strategy_named(usual if method is None else method, FamilySpace(bench), batch, plan.seed)
        done = search(bench, strategy, trials, breaks, tell)
        _write_table(done, out / "search.csv")
        found = []
        for number, one in enumerate(different(done, bench.families, breaks), 1):
            tell(number - 1, number, "shrinking a break")
            family = bench.families[one.candidate.base]
            small = shrunk(bench, one, batch, SHRINKING) if shrink else unshrunk(one, family)
            file = out / f"break-{number}.toml"
            sentence = _sentence(small, family, plan, sought)
            _write_scenario(small.scenario, file, sentence, plan)
            found.append(Break(file, sentence, done.index(one) + 1, small))
        about = _rarity(sought, bench, rare, plan.seed, tell) if rare else None
    finite = [a.tried.margin for a in done if math.isfinite(a.tried.margin)]
    everything = Breaks(
        path=out,
        breaks=tuple(found),
        trials=len(done),
        shrinking=sum(b.shrunk.trials for b in found),
        first=next((k for k, a in enumerate(done, 1) if a.tried.broken), None),
        least=min(finite, default=math.inf),
        unit=sought.unit,
        failed=sum(a.tried.outcome in BROKEN for a in done),
        rarity=about,
        results=_run_once_more(found, plan, out, processes) if found else None,
    )
    told = json.dumps(everything.to_json(), indent=2) + "\n"
    for folder in [out, *([out / "results"] if found else [])]:  # the results are to be whole by themselves
        (folder / SEARCH).write_text(told, encoding="utf-8")
    return everything


def _rarity(sought: Failure, bench: Bench, trials: int, seed: int, tell: ProgressCallback) -> Rarity:
    failed = 0

    def judge(asked: Sequence[Candidate]) -> list[float | None]:
        nonlocal failed
        made = [(c.base, bench.scenario(c)) for c in asked]
        found = bench.run([(base, scenario) for base, scenario in made if scenario is not None])
        failed += sum(tried.outcome in BROKEN for tried in found)
        each = iter(found)
        return [None if scenario is None else next(each).margin for _, scenario in made]

    return replace(rarity(sought.name, bench.families, judge, trials, seed, tell), failed=failed)


def bench_of(plan: CampaignPlan, failure: Failure, work: object) -> Bench:
    """Where candidates of the plan's families are tried.

    Args:
        plan: As for `find_breaks`.
        failure: What is searched for.
        work: The pool of workers.

    Raises:
        ClearwayError: more than one robot, navigator or set-up is asked for, a family is wrong, or no scenario can fail so.
    """
    for what in ("robots", "navigators", "setups"):
        if len(getattr(plan, what)) > 1:
            raise ClearwayError(
                f"a search breaks one at a time; name one of {', '.join(getattr(plan, what))}", field=what
            )
    plan = dataclasses.replace(plan, selection=dataclasses.replace(plan.selection, repetitions=1))
    own: dict[str, Family] = {}
    for suite in plan.suites:
        if (file := load_suite(suite).file) is not None:
            for family in load_families(file):
                for problem in check_family(family, load_robot(plan.robots[0])):
                    raise ClearwayError(problem.problem, file=file, field=problem.field)
                own[family.base.name] = family
    specs = plan.specs()
    groups: list[list[TrialSpec]] = [list(run) for _, run in itertools.groupby(specs, key=lambda spec: spec.run)]
    possible = [group for group in groups if failure.possible(group[0].scenario)]
    if not possible:
        raise ClearwayError(
            "no livelock ends a trial of these scenarios; `livelock = true` in a scenario has it end so",
            field="failure",
        )
    return Bench(plan, possible, own, check_plan(plan, specs, work), failure, work)  # type: ignore[arg-type]


def _sentence(small: Shrunk, family: Family, plan: CampaignPlan, failure: Failure) -> str:
    """What happens, and what differs from the scenario that it came of."""
    tried, where = small.tried, f"at ({small.tried.place[0]:.2f}, {small.tried.place[1]:.2f})"
    who = f"{tried.member or plan.robots[0]}, driven by {plan.navigators[0]},"
    when = f"{tried.t:.1f} s after the start, {where}, on the leg {tried.leg!r}"
    if tried.party and failure.indicator == "":
        moves = f"touches {tried.party} while driving at {tried.speed:.2f} m/s"
        what = moves if tried.speed > 0.0 else f"is touched by {tried.party} while it stands"
    elif failure.indicator:
        value = failure.limit - tried.margin if failure.beyond else failure.limit + tried.margin
        what = f"has {failure.indicator} {value:.4g} {failure.unit}".rstrip() + f" and ends ({tried.outcome})"
    else:
        what = f"ends in a {tried.outcome}"
    changes = ", ".join(f"{name} = {value:g} instead of {nominal:g}" for name, nominal, value in small.changed[:6])
    more = f" and {len(small.changed) - 6} more numbers" if len(small.changed) > 6 else ""
    told = f"with {changes}{more}" if small.changed else "as it stands"
    left = f", without {', '.join(small.dropped[:6])}" if small.dropped else ""
    left += f" and {len(small.dropped) - 6} more" if len(small.dropped) > 6 else ""
    return f"{who} {what} {when}: {family.base.name!r} {told}{left}."


def _write_scenario(scenario: Scenario, file: Path, sentence: str, plan: CampaignPlan) -> None:
    table = table_of(_from_anywhere(scenario))
    table.pop("seed", None)  # which `run` makes of the name
    options = [*(("--map", plan.map) if plan.map else ()), *(("--setup", plan.setups[0]) if plan.setups else ())]
    words = ["clearway", "run", str(file), "--robot", plan.robots[0], "--navigator", plan.navigators[0], *options]
    file.write_text(f"# {sentence}\n# Again:  {shlex.join(words)}\n{toml(table)}", encoding="utf-8")


def _from_anywhere(scenario: Scenario) -> Scenario:
    """The scenario with the files that it names by their whole paths."""

    def whole(name: str | None) -> str | None:
        if not name or not (is_path(name) or ".toml" in name or ".py:" in name):
            return name
        file, colon, rest = name.partition(":")
        return f"{Path(file).resolve()}{colon}{rest}"

    def changed(parts: Sequence[object], *names: str) -> tuple[object, ...]:
        return tuple(p.model_copy(update={n: whole(getattr(p, n)) for n in names if whole(getattr(p, n)) != getattr(p, n)}) for p in parts)  # type: ignore[attr-defined] # fmt: skip

    obstacles = tuple(
        o.model_copy(update={"shape": changed([o.shape], "robot")[0]}) if o.shape.kind == "robot" else o
        for o in scenario.obstacles
    )
    update = {
        "floor_plan": whole(scenario.floor_plan), "people": changed(scenario.people, "behaviour"),
        "robots": changed(scenario.robots, "robot", "navigator"), "obstacles": obstacles,
    }  # fmt: skip
    return scenario.model_copy(update=update)


def _write_table(done: Sequence[Attempted], file: Path) -> None:
    with file.open("w", newline="", encoding="utf-8") as opened:
        table = csv.writer(opened)
        table.writerow(["trial", "scenario", "margin", "outcome", "party", "t", "x", "y", "why"])
        for k, one in enumerate(done, 1):
            t = one.tried
            where = [f"{t.t:.6g}", *(f"{v:.6g}" for v in t.place)]
            table.writerow(
                [k, one.scenario.name, f"{t.margin:.9g}", t.outcome, t.party, *where, " ".join(t.why.split())[:200]]
            )


def _run_once_more(found: Sequence[Break], plan: CampaignPlan, out: Path, workers: int) -> Results:
    """The breaks as a campaign, each run from its file."""
    suite = out / "breaks.toml"
    title = f"What breaks {plan.navigators[0]}"
    suite.write_text(toml({"name": "breaks", "title": title, "files": [b.file.name for b in found]}), encoding="utf-8")
    again = dataclasses.replace(
        plan, suites=(str(suite),), selection=Selection(), seed=0, localisation=None, tracking=None
    )
    return run_campaign(again, out / "results", workers)
