"""Runs one trial of a campaign again, alone and in this process, and says whether it went as before, to the last bit."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.campaigns.campaign import planned
from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.campaigns.plan_checks import check_plan
from clearway.campaigns.provenance import asked_of_plan, machine, now
from clearway.campaigns.tuning import in_words
from clearway.campaigns.worker import all_drawn, run_trials
from clearway.errors import ClearwayError
from clearway.indicators import row_schema, score_row
from clearway.robots import load_robot
from clearway.trials import Trial
from clearway.trials.differences import Difference, first_difference, first_in_json
from clearway.trials.keeping import is_outline
from clearway.trials.store import Results, TrialStore, refuse_results, write_partial

_UNLISTED = ("navigator", "privileged", "tuned", "reason", "not_computable")
"""Columns that are not listed as changed: they say who drove, or what stands elsewhere."""


_TUNED = "navigators"
"""The table of a robot's file that holds parameters of navigators."""


@dataclass(frozen=True, slots=True, eq=False)
class Rerun:
    """A trial of a results directory that was run again.

    Attributes:
        number: The trial's number in the results.
        id: The trial's `id` there.
        navigator: Who drove this time.
        before: The trial as the results have it.
        now: The trial as it went this time.
        difference: Where the two first differ; None: nowhere, or another navigator drove.
        changed: Columns of the table of trials that differ, each with its value before and now.
        remarks: Why the bits may differ although nothing was changed, for people.
        results: The results directory with this one trial, and with those of its simulation's other robots, if one was
            asked for.
    """

    number: int
    id: str
    navigator: str
    before: Trial
    now: Trial
    difference: Difference | None
    changed: Mapping[str, tuple[Any, Any]]
    remarks: tuple[str, ...] = ()
    results: Results | None = None

    @property
    def same_navigator(self) -> bool:
        """Whether the navigator that drove before drove again, so that the bits can be compared."""
        return self.navigator == self.before.attempt.navigator

    @property
    def compared_by_row(self) -> bool:
        """Whether only the row in the table could be compared, as the trial was not kept."""
        return is_outline(self.before)

    def __str__(self) -> str:
        head = f"trial {self.number} ({self.id})"
        if not self.same_navigator:
            before = self.before.outcome.value if self.compared_by_row else _ended(self.before)
            return f"{head}: {before} before; with {self.navigator} {_ended(self.now)}"
        if self.difference is None:
            bits = (
                "its row in the table is the same again; the rest was not kept"
                if self.compared_by_row
                else "the same bits again"
            )
            return f"{head}: {bits}; {_ended(self.now)}"
        remarks = f" ({'; '.join(self.remarks)})" if self.remarks else ""
        return f"{head}: not the same bits. The first difference is {self.difference}{remarks}"


def rerun(
    results: Results,
    number: int,
    *,
    navigator: str | None = None,
    out: Path | None = None,
    raise_errors: bool = False,
) -> Rerun:
    """Run one trial of a campaign again, alone and in this process, with no limit on a decision's wall clock.

    Args:
        results: What the campaign gave.
        number: The trial's number there.
        navigator: Who is to drive on the very same scenario; None: who drove before.
        out: A results directory to make for this one trial; None: none.
        raise_errors: Whether an error of the navigator is raised, as a debugger needs it, instead of ending the trial.

    Raises:
        ClearwayError: there is no such trial, it was recorded, or what it was run on has changed since; or `out` can't be
            used.
    """
    before = results.remains(number)
    if before.attempt.source == "recorded":
        raise ClearwayError(
            f"trial {number} was recorded with a real robot and cannot be rerun; `clearway replay` shows it",
            file=results.path,
        )
    if out is not None:
        refuse_results(out)
    row_before = results.trials.slice(number, 1).to_pylist()[0]
    campaign = planned(results.path)
    plan = alone(campaign, _found(campaign, row_before, results, number), navigator)
    specs = plan.specs()
    spec = next(
        one for one in specs if one.scenario.names()[one.member] == (row_before["member"] or one.scenario.member)
    )
    asked = asked_of_plan(plan, specs)
    _refuse_changed(asked, spec, results, number)
    known = check_plan(plan, specs)
    run = machine() | {"started": now(), "rerun": {"results": str(results.path), "trial": number}}
    run |= {"tuned_on": {name: in_words(one.tuned_on) for name, one in known.items()}}
    store = None if out is None else TrialStore(out, asked, len(specs), row_schema(), run=run)
    done = None
    try:
        trials = run_trials(plan, all_drawn(plan, specs), known, raise_errors)
        again = trials[specs.index(spec)]
        row = score_row(again)
        if store is not None:
            for one, trial in zip(specs, trials, strict=True):
                scored = row if trial is again else score_row(trial)
                write_partial(store.partial, store.key, one.index, trial, {"id": one.id} | scored)
            done = store.finish({"finished": now()})
    except BaseException:
        if store is not None:
            store.withdraw()
        raise
    finally:
        if store is not None:
            store.close()
    same, kept = spec.driver == before.attempt.navigator, not is_outline(before)
    changed = {
        name: (row_before.get(name), value)
        for name, value in row.items()
        if name not in _UNLISTED and value != row_before.get(name)
    }
    columns = [Difference(None, f"the column {name}", "", *both) for name, both in changed.items()]
    return Rerun(
        number=number,
        id=row_before["id"],
        navigator=spec.driver,
        before=before,
        now=again,
        difference=None if not same else first_difference(before, again) if kept else next(iter(columns), None),
        changed=changed,
        remarks=_remarks(results.campaign, asked, spec),
        results=done,
    )


def alone(plan: CampaignPlan, spec: TrialSpec, navigator: str | None = None) -> CampaignPlan:
    """The plan of a campaign of one trial.

    Args:
        plan: The campaign that the trial is of.
        spec: The trial.
        navigator: Who is to drive instead; None: who drives in the trial.
    """
    return dataclasses.replace(
        plan,
        suites=(spec.suite,),
        robots=(spec.robot,),
        navigators=(navigator or spec.navigator,),
        setups=() if spec.setup.name is None else (spec.setup.name,),
        selection=dataclasses.replace(plan.selection, scenarios=(spec.scenario.name,)),
        decision_limit=None,
        keep="trajectories",
    )


def _found(plan: CampaignPlan, row: Mapping[str, Any], results: Results, number: int) -> TrialSpec:
    """The trial's place in its campaign's plan."""
    some = dataclasses.replace(plan.selection, scenarios=(str(row["scenario"]),))
    try:
        specs = dataclasses.replace(plan, selection=some).specs()
    except ClearwayError as error:
        raise ClearwayError(f"trial {number} cannot be rerun: {error}", file=results.path) from error
    for spec in specs:
        if spec.id == row["id"]:
            return spec
    raise ClearwayError(f"trial {number} cannot be rerun: its suite has no {row['id']!r} any more", file=results.path)


def _refuse_changed(asked: Mapping[str, Any], spec: TrialSpec, results: Results, number: int) -> None:
    """Refuse a trial whose robots, scenario, floor plan or map are not what they were; parameters of navigators may change."""
    then, what, floor = results.campaign, "", spec.scenario.floor_plan
    driving = dict.fromkeys(load_robot(which).name for which in spec.robots)
    untuned = [
        {r: {n: p for n, p in c["robots"].get(r, {}).items() if n != _TUNED} for r in driving} for c in (then, asked)
    ]
    bodies = then.get("bodies", asked["bodies"])
    if (differs := first_in_json("robots", *untuned)) is not None:
        what = f"{differs[0]} was {differs[1]!r} and is {differs[2]!r}"
    elif other := next((name for name, found in asked["bodies"].items() if bodies.get(name) != found), None):
        what = f"the robot {other!r}, whose body an obstacle has, is not what it was"
    elif then["tasks"].get(spec.task, asked["tasks"][spec.task]) != asked["tasks"][spec.task]:
        what = f"the scenario {spec.scenario.name!r} is not what it was"
    elif then["floor_plans"].get(floor, asked["floor_plans"][floor]) != asked["floor_plans"][floor]:
        what = f"the floor plan {floor!r} is not what it was"
    elif then["map"] != asked["map"]:
        what = "the map is not what it was"
    if what:
        raise ClearwayError(f"trial {number} cannot be rerun: {what}; put that back first", file=results.path)


def _remarks(then: Mapping[str, Any], asked: Mapping[str, Any], spec: TrialSpec) -> tuple[str, ...]:
    before, today = ({"clearway": c["clearway"], **c["versions"]} for c in (then, asked))
    found = [f"made with {n} {before.get(n)}, this is {today[n]}" for n in today if before.get(n) != today[n]]
    found += [
        f"the code of {n}, or a file that it is given, has changed since"
        for n, d in asked["code"].items()
        if then["code"].get(n) != d
    ]
    robot = load_robot(spec.robot).name
    tuned = (c["robots"][robot][_TUNED] for c in (then, asked))
    if (differs := first_in_json(f"robots.{robot}.{_TUNED}", *tuned)) is not None:
        found.append(f"{differs[0]} was {differs[1]!r} and is {differs[2]!r}")
    if spec.setup.clocked:
        found.append(f"the set-up {spec.setup.name!r} goes by wall clock: no two runs have the same bits")
    return tuple(found)


def _ended(trial: Trial) -> str:
    why = f" ({' '.join(trial.reason.split())})" if trial.reason else ""
    return f"{trial.outcome.value} after {trial.t[-1]:.2f} s{why}"
