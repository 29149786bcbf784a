"""What a buyer asks: is it accepted, what does it need, what breaks it, what should change."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from clearway.api.arguments import NavigatorLike, free_directory
from clearway.api.results import open_results
from clearway.campaigns import CampaignPlan
from clearway.campaigns.objects import names_of, navigator_name
from clearway.campaigns.pilot import prepare_limit
from clearway.campaigns.pool import pool, workers_of
from clearway.campaigns.progress import ProgressCallback
from clearway.campaigns.variants import variants
from clearway.errors import ClearwayError, shown
from clearway.given import PREFIX
from clearway.improving.tune import tune as run_tuning
from clearway.improving.tuning import Tuning
from clearway.robots import Robot
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.selecting import numbers, selection_of
from clearway.scenarios.suite import Suite
from clearway.scenarios.suites import load_suite
from clearway.searching.breaks import Breaks
from clearway.searching.breaks import find_breaks as search_breaks
from clearway.trials import store
from clearway.trials.differences import first_in_json

if TYPE_CHECKING:
    from clearway.navigators.common.parameter_table import ParameterTable
    from clearway.reports.passable import Passable
    from clearway.reports.requirement import Requirement
    from clearway.statistics import Criteria, Outlook, Verdict


def accept(
    criteria: str | Path | Criteria,
    *results: str | Path | store.Results,
    test_plan: str | Path | None = None,
    junit: str | Path | None = None,
) -> Verdict:
    """Is the robot accepted? Criteria held against all trials of results directories, one after the other.

    A verdict is valid however often it is asked for while trials come in: each of its two errors keeps to its probability. Of a
    test plan that has gaps the trials behind the first of them wait.

    Args:
        criteria: Their TOML file, or as `clearway.statistics.load_criteria` reads it.
        results: Results directories or their paths, in the order in which they were made.
        test_plan: Of recordings that still come in: their plan, which says what groups of trials there will be; there may be no
            results yet.
        junit: A JUnit file to write, a test case a criterion; None: none.

    Returns:
        The verdict with its reasons: `verdict.decision` is `accepted`, `rejected` or `go on`; printed, it says about how many more
        trials decide.

    Raises:
        ClearwayError: a criterion that is wrong or that no number of trials can meet, a group without trials, results of several
            robots or navigators, trials that are not independent, or campaigns in another order than they were begun in.
    """
    from clearway.recordings.lab.plan_file import load_test_plan
    from clearway.recordings.protocol.lab_trials import labels_in
    from clearway.reports.acceptance import write_junit
    from clearway.statistics import judge, load_criteria, refuse_strange_groups

    if not results and test_plan is None:
        raise ClearwayError("say which results are to be judged", field="results")
    opened = [one if isinstance(one, store.Results) else open_results(one) for one in results]
    paths = [os.path.realpath(one.path) for one in opened]
    if twice := next((p for p in paths if paths.count(p) > 1), None):
        raise ClearwayError("is named twice; each trial counts once", file=twice)
    file = None if not isinstance(criteria, str | Path) else criteria
    asked = load_criteria(criteria) if isinstance(criteria, str | Path) else criteria
    _refuse_others(opened, asked)
    _refuse_other_order(opened)
    planned = None if test_plan is None else labels_in(load_test_plan(test_plan))
    try:
        if planned is not None:
            refuse_strange_groups(asked, planned)
        found = judge([_numbered(one) for one in opened], asked, complete=planned is None)
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=error.file or file, field=error.field) from None
    growing = [
        f"{one.campaign['not_attempted']} of {one.path}" for one in opened[:-1] if one.campaign.get("not_attempted")
    ]
    if growing:
        note = (
            f"trials of a test plan are still to come ({', '.join(growing)}) that would count before those of the results after it; finish "
            "one plan before you begin the next"
        )
        found = replace(found, notes=(*found.notes, note))
    if junit is not None:
        write_junit(found, Path(junit))
    return found


def _refuse_others(opened: Sequence[store.Results], asked: Criteria) -> None:
    """Nothing, unless what bears one name is another robot, navigator, indicator or Clearway in some of the results, and criteria ask for it,
    or they share a recording.

    Raises:
        ClearwayError: it is, or they do.
    """
    known: dict[tuple[str, str], tuple[Any, Path]] = {}
    recordings: dict[tuple[str, str], Path] = {}
    for one in opened:
        said, idle = one.campaign, _idle(one, asked)
        plan = said.get("plan") or {}
        options = {name: plan.get("options", {}).get(name) for name in plan.get("navigators", ())}
        for kind, named in (("robots", said.get("robots", {})), ("code", said.get("code", {})), ("options", options)):
            for name, own in named.items():
                if _base(name) in idle:
                    continue
                other, folder = known.setdefault((kind, name), (own, one.path))
                if (differs := first_in_json(f"{kind}.{name}", other, own)) is not None:
                    at, was, now = differs
                    raise ClearwayError(
                        f"is not on the same system as {folder}: they differ in {at}, which is {shown(now)} here and {shown(was)} "
                        "there; a verdict is on one, so make one of them anew",
                        file=one.path,
                    )
        for spec in said.get("attempted", ()):
            recording = (said["files"].get(spec["file"]), json.dumps(spec.get("span")))
            if recording[0] and (folder := recordings.setdefault(recording, one.path)) != one.path:
                raise ClearwayError(
                    f"holds the recording {shown(spec['file'])}, as {folder} does; each trial counts once",
                    file=one.path,
                )


def _idle(one: store.Results, asked: Criteria) -> set[str]:
    """Names of what no criterion asks for: robots and navigators of no trial that is chosen, nor beside one, and other indicators."""
    from clearway.indicators import INDICATORS
    from clearway.statistics.acceptance_trials import fits

    rows = one.trials.to_pylist()
    chosen = [r for r in rows if fits(r, asked.where)]
    runs = {r["run"] for r in chosen if r.get("run")}
    beside = [*chosen, *(r for r in rows if r.get("run") in runs)]

    def names(of: Sequence[dict[str, Any]]) -> set[str]:
        return {_base(str(r.get(column))) for r in of for column in ("robot", "navigator")}

    return names(rows) - names(beside) | {
        f"indicator {name}" for name in {*INDICATORS} - {c.indicator for c in asked.criterion}
    }


def _base(name: str) -> str:
    """A navigator's name without its options."""
    return name.partition("[")[0]


def _refuse_other_order(opened: Sequence[store.Results]) -> None:
    """Nothing, unless campaigns are named in another order than they were begun in, which could be chosen by what came of them.

    Raises:
        ClearwayError: they are.
    """
    begun = [
        (str(run["started"]), one.path)
        for one in opened
        if "plan" in one.campaign and "started" in (run := one.campaign["run"])
    ]
    right = sorted(begun, key=lambda one: one[0])
    if begun != right:
        wrong = next(path for (_, path), (_, other) in zip(begun, right, strict=True) if path != other)
        named = " ".join(str(path) for _, path in right)
        raise ClearwayError(
            f"is not named in the order in which campaigns were begun, and earlier trials count first: {named}",
            file=wrong,
        )


def _numbered(one: store.Results) -> pa.Table:
    """The table of trials; of recordings also where each stands in its plan."""
    from clearway.statistics.acceptance_trials import NUMBER

    numbers = one.campaign.get("numbers")
    return one.trials if numbers is None else one.trials.append_column(NUMBER, pa.array(numbers, pa.int64()))


def acceptance_plan(criteria: str | Path | Criteria, rates: float | Iterable[float] = ()) -> list[Outlook]:
    """How many trials criteria take: before the first one, for each criterion.

    Args:
        criteria: As for `accept`.
        rates: True shares of conforming trials to look at; empty: a robot that never fails, the limit, and one that fails twice as
            often as it may.

    Returns:
        By criterion: how many trials it takes at least and as planned, and at each share how probably it is accepted, with the
        mean and the quantiles of how many trials that takes; all of them exact.

    Raises:
        ClearwayError: a criterion that is wrong or that no number of trials can meet, or a rate that is none.
    """
    from clearway.statistics import load_criteria, outlooks

    asked = load_criteria(criteria) if isinstance(criteria, str | Path) else criteria
    return outlooks(asked, numbers(rates, "rates"))


def requirement(
    offer: str,
    robot: str | Robot = "tiago",
    navigator: NavigatorLike = "move-base",
    *,
    reliability: float = 0.95,
    confidence: float = 0.95,
    between: tuple[float, float] | None = None,
    step: float | None = None,
    speed: float = 0.6,
    trials: int = 400,
    seed: int = 0,
    localisation: str | None = None,
    tracking: str | None = None,
    judged: str = "success_slack",
    workers: int | None = None,
    out: str | Path | None = None,
    progress: ProgressCallback | None = None,
) -> Requirement:
    """Find out what the environment must offer, such as how wide a door, for a robot to succeed often enough.

    Args:
        offer: What: `door`, `corridor`, `gap`, `lane`, `density`, `latency`, `lidar-noise`, `odometry-noise`, or the address of an
            `Offer` of your own.
        robot: Its name, preset or file, or a `Robot`.
        navigator: Its name or address, or its class.
        reliability: The success that is asked for, in (0, 1).
        confidence: That the interval holds, in (0, 1).
        between: Least and greatest value to look at, in the offer's unit; None: what is usual for the robot.
        step: Distance of neighbouring values; None: the offer's usual one.
        speed: Set speed, m/s.
        trials: How many there may be; the search needs fewer where the answer is clear.
        seed: Of the campaign.
        localisation: As for `run`.
        tracking: As for `run`.
        judged: What counts as a success: the column `success_slack`, `success` or `success_self`.
        workers: How many processes, as for `run`.
        out: A folder for tests, results, page and numbers, in which an earlier search of the same goes on; None:
            `results/requirement-OFFER`, numbered if that is taken.
        progress: Called with (done, total, note).

    Returns:
        What came of it; printed, it is one sentence.

    Raises:
        ClearwayError: something that was given is wrong; one sentence says what and what would be right.
    """
    from clearway.campaigns.requirement import find_requirement
    from clearway.scenarios.offers import find_offer

    found = find_offer(offer)
    plan = CampaignPlan(
        suites=(f"requirement-{found.name}",), robots=names_of(robot, "robots"), navigators=(navigator_name(navigator),),
        seed=seed, localisation=localisation, tracking=tracking,
    )  # fmt: skip
    return find_requirement(
        found, plan, free_directory(plan.suites) if out is None else Path(out), speed=speed, reliability=reliability,
        confidence=confidence, between=between, step=step, trials=trials, judged=judged, workers=workers, progress=progress,
    )  # fmt: skip


def passable(
    found: Requirement | str | Path,
    floor_plan: str | Path,
    *,
    start: tuple[float, float] | None = None,
    out: str | Path | None = None,
) -> Passable:
    """Colour a map by the probability with which a robot passes the narrowest passage on its way to each place.

    Args:
        found: Of a door, a corridor or another width; or the folder of its search.
        floor_plan: A ROS map's yaml, or a floor plan by name or file.
        start: Where the robot comes from (x, y), m; None: the roomiest place.
        out: A folder for a page with the map; None: none is written.

    Returns:
        The map with its widths and probabilities; printed, it is one sentence.

    Raises:
        ClearwayError: something that was given is wrong; one sentence says what and what would be right.
    """
    from clearway.reports.passable import passable as coloured
    from clearway.reports.requirement import Requirement, read_requirement
    from clearway.reports.requirement_page import write_page
    from clearway.scenarios.floorplan import load_floor_plan

    known = found if isinstance(found, Requirement) else read_requirement(Path(found))
    if (grid := load_floor_plan(str(floor_plan)).map) is None:
        raise ClearwayError("has no map that could be coloured", file=floor_plan)
    made = coloured(known, grid, start)
    if out is not None:
        write_page(known, Path(out), made)
    return made


def find_breaks(
    suite: str | Path | Suite | Scenario,
    *,
    robot: str | Robot | None = None,
    navigator: NavigatorLike = "move-base",
    guarantee: str | None = None,
    failure: str = "contact while moving",
    trials: int = 500,
    breaks: int = 3,
    method: str | None = None,
    shrink: bool = True,
    rarity: int = 0,
    batches: Iterable[str] = (),
    configurations: Iterable[str] = (),
    speeds: float | Iterable[float] = (),
    scenarios: Iterable[str] = (),
    seed: int = 0,
    localisation: str | None = None,
    tracking: str | None = None,
    workers: int | None = None,
    out: str | Path | None = None,
    progress: ProgressCallback | None = None,
) -> Breaks:
    """Search for the smallest scenarios in which a navigator fails, and write each as a file that `run` replays.

    Args:
        suite: A suite or a scenario; of a scenario's file with a table `[family]` what that says varies, of any other everything
            continuous: start, speeds, timings, sizes, people's routes, latency, disturbance within its bounds, noise.
        robot: Its name, preset or file, or a `Robot`; None: the suite's first.
        navigator: Its name or address, or its class.
        guarantee: Its mode, of one that has several (`passive`, `evasive`, `none`).
        failure: What counts as a break: `contact while moving`, `contact`, `timeout`, `livelock`, or an indicator beyond a limit
            as `MDO<0.1` and `CT>60`.
        trials: How many trials the search may take, without those of shrinking.
        breaks: How many different breaks are enough: of another outcome, with another party, on another leg or test, or 1 m apart.
        method: `screen` (what looks hardest before any trial), `gp` (a Gaussian process over margins), `random`; None: `screen` for a
            contact, `gp` for any other failure.
        shrink: Whether breaks are made smaller: fewer goals and bodies, fewer changed and rounder numbers.
        rarity: About how many trials more may tell how probable a break is among all members of the family, with an interval: by
            plain sampling, or by adaptive multilevel splitting where it is rare; 0: none. 10,000 suffice down to 1e-5.
        batches: Only these batches of the suite; empty: all.
        configurations: Only these configurations; empty: all.
        speeds: Only these set speeds, m/s; empty: all.
        scenarios: Only these scenarios, by name; empty: all.
        seed: Of the search.
        localisation: As for `run`.
        tracking: As for `run`.
        workers: How many processes; None: one a core. By `gp` what is tried at once depends on it, hence what is found.
        out: The folder for what is found; None: `results/break-SUITE`, numbered if that is taken.
        progress: Called with (done, total, note).

    Returns:
        The breaks, each with its file and a sentence; printed, it tells them.

    Raises:
        ClearwayError: something that was given is wrong; one sentence says what and what would be right.
    """
    named = names_of(suite, "suites")
    folder = free_directory([f"break-{Path(named[0].removeprefix(PREFIX)).stem}"]) if out is None else Path(out)
    robots = names_of(robot, "robots") if robot is not None else load_suite(named[0]).robots[:1]
    with pool(workers_of(workers, least=0), folder) as work:
        asked = () if guarantee is None else (guarantee,)
        patience = prepare_limit(10.0)
        chosen, given = variants(names_of(navigator, "navigators"), {}, (), asked, work=work, patience=patience)
    selection = selection_of(
        {"batches": batches, "configurations": configurations, "speeds": speeds, "scenarios": scenarios}
    )
    plan = CampaignPlan(
        suites=named, robots=robots, navigators=chosen, selection=selection, seed=seed, localisation=localisation,
        tracking=tracking, options=given,
    )  # fmt: skip
    return search_breaks(
        plan, folder, failure=failure, trials=trials, breaks=breaks, method=method, shrink=shrink, rare=rarity, workers=workers,
        progress=progress,
    )  # fmt: skip


def tune(
    task: str | Path,
    *,
    workers: int | None = None,
    out: str | Path | None = None,
    progress: ProgressCallback | None = None,
) -> Tuning:
    """Search for better parameters of a navigator, and compare them with what came in on held-out trials.

    Args:
        task: A TOML file: parameters and ranges, an objective, training and held-out trials.
        workers: How many processes; None: one a core.
        out: The folder for what is found; None: `results/tune-NAME`, numbered if that is taken.
        progress: Called with (done, total, note).

    Returns:
        What was found; printed, it tells it.

    Raises:
        ClearwayError: something in the task is wrong; one sentence says what and what would be right.
    """
    folder = free_directory([f"tune-{Path(task).stem}"]) if out is None else Path(out)
    return run_tuning(task, folder, workers=workers, progress=progress)


def check_parameters(path: str | Path, robot: str | None = None) -> ParameterTable:
    """What becomes of each parameter of a user's: read, ignored, missing here or unknown, as `clearway check` tells it.

    Args:
        path: A file of Nav2's (`nav2_params.yaml`); or the folder of a ROS 1 package with those of move_base.
        robot: Who would drive with them: by its name a file is chosen where a ROS 1 package has one for each of several, by its
            lidar the heights of Nav2's costmaps are judged.

    Raises:
        ClearwayError: it can't be read, or holds no such parameters, or there is no such robot.
    """
    from clearway.navigators.parameter_files import parameter_table

    found = parameter_table(path, robot)
    if found is None:
        raise ClearwayError(
            "holds no parameters of Nav2 (`ros__parameters`), nor is it a folder with files of move_base's", file=path
        )
    return found
