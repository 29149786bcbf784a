"""The Python interface: run campaigns and open their results.

import clearway
results = clearway.run("hospital", robots=["tiago"], navigators=["move-base"], batches=["NO"])
results.trials                                   # an Arrow table; .to_pandas(), .to_polars() in one call
results.figure("trajectories", batch="NO")       # a matplotlib figure
"""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.campaigns import CampaignPlan, resume_campaign, run_campaign
from clearway.campaigns.objects import names_of, navigator_name
from clearway.campaigns.one_trial import one_trial
from clearway.campaigns.pilot import prepare_limit
from clearway.campaigns.plan_checks import ALL, able
from clearway.campaigns.pool import pool, workers_of
from clearway.campaigns.progress import ProgressCallback
from clearway.campaigns.rerun import Rerun
from clearway.campaigns.rerun import rerun as rerun_trial
from clearway.campaigns.shards import Shard, merge_shards, read_shard
from clearway.campaigns.variants import variants
from clearway.contract import Navigator
from clearway.errors import ClearwayError, shown
from clearway.given import PREFIX
from clearway.improving.tune import Tuning
from clearway.improving.tune import tune as run_tuning
from clearway.robots import Robot
from clearway.scenarios.replay import Replay
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection, Suite, seed_range
from clearway.scenarios.suites import load_suite, with_movers
from clearway.scenarios.teams import read_team
from clearway.searching.breaks import Breaks
from clearway.searching.breaks import find_breaks as search_breaks
from clearway.trials import Trial, store
from clearway.trials.keeping import Keep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from clearway.campaigns.watching import Round
    from clearway.navigators.common.parameter_table import ParameterTable
    from clearway.reports.requirement import Requirement
    from clearway.statistics import Comparison, ConfigurationComparison, Criteria, Outlook, Verdict

__all__ = [
    "Breaks", "Rerun", "Results", "Tuning", "accept", "acceptance_plan", "check_parameters", "compare", "find_breaks", "merge", "open_results", "recorded_people", "requirement", "rerun",
    "resume", "run", "score", "simulate", "tune", "watch",
]  # fmt: skip

NavigatorLike = str | Callable[..., Navigator]
"""A navigator's name or address, or its class, or a function that makes one."""


TAKES = {"trial": "trial=17", "clearance": "trial=17", "thought": "trial=17, at=12.0", "paths": 'scenario="..."'}
"""What a figure is of, where that is not any selection of columns."""


class Results(store.Results):
    """A finished results directory.

    Attributes:
        path: The directory.
        campaign: What campaign.json holds: what was asked, versions, seeds, machine.
        trials: A pyarrow.Table, one row a trial; a column's unit is in its field's metadata.
    """

    def to_pandas(self) -> Any:
        """The table of trials as a pandas.DataFrame."""
        return self.trials.to_pandas()

    def to_polars(self) -> Any:
        """The table of trials as a polars.DataFrame."""
        try:
            import polars
        except ImportError as error:
            raise ClearwayError("polars is not installed; pip install 'clearway[polars]'") from error
        return polars.from_arrow(self.trials)

    def trial(self, index: int) -> Trial:
        """Trial number `index` (the column `trial`) in full.

        Raises:
            ClearwayError: there is no such trial, or a file is damaged.
        """
        try:
            number = operator.index(index)  # NumPy's whole numbers too
        except TypeError:
            raise ClearwayError(
                f"{shown(index)} is no trial's number; 0 to {len(self) - 1} are (the column `trial`)", file=self.path
            ) from None
        return super().trial(number)

    def summary(self) -> Any:
        """A row a system, batch and speed, as a pyarrow.Table: success with its exact 95 % interval, the same by the robot's own
        estimate, and the mean of each of paper A's indicators with its bootstrap interval; `to_pandas()` makes a frame of it.
        """
        from clearway.statistics.summary import summary

        return summary(self.trials)

    def _repr_html_(self) -> str:
        """What a notebook shows: the headline numbers as a table."""
        from clearway.reports.notebook import as_html

        return as_html(self, self.summary())

    def figures(self) -> dict[str, str]:
        """The figures that `figure` draws: the name of each, and what it shows and takes."""
        from clearway.reports import FIGURES

        return {name: f"figure({name!r}, {TAKES.get(name, 'column=value, ...')}): {FIGURES[name]}" for name in FIGURES}

    def figure(self, name: str, **selection: Any) -> Figure:
        """A figure of the report, drawn anew.

        Args:
            name: Which one: `trajectories`, `bars`, ...
            **selection: What to narrow it to, as in `batch="CE"`.

        Raises:
            ClearwayError: no such figure, or a selection that selects nothing.
        """
        from clearway.reports import figure
        from clearway.reports.notebook import as_png

        drawn: Any = figure(self, name, **selection)
        drawn._repr_png_ = partial(as_png, drawn)  # which a notebook shows; a Figure alone it doesn't
        found: Figure = drawn
        return found

    def report(self, verdict: Verdict | None = None) -> Path:
        """Write the report (a self-contained page, figures, tables) into the directory; returns the page's path.

        Args:
            verdict: Of `clearway.accept`: with what the page begins.
        """
        from clearway.reports import write_report

        return Path(write_report(self.path, verdict))


def run(
    *suites: str | Path | Suite | Scenario,
    robots: Iterable[str | Robot] = (),
    navigators: Iterable[NavigatorLike] = ("move-base",),
    batches: Iterable[str] = (),
    configurations: Iterable[str] = (),
    speeds: Iterable[float] = (),
    obstacle_speeds: Iterable[float] = (),
    sizes: Iterable[float] = (),
    gaps: Iterable[float] = (),
    worlds: Iterable[int] = (),
    scenarios: Iterable[str] = (),
    seeds: tuple[int, int] | str | None = None,
    repetitions: int | None = None,
    floor_plan: str | None = None,
    seed: int = 0,
    localisation: str | None = None,
    map: str | Path | None = None,
    tracking: str | None = None,
    setups: Iterable[str] = (),
    decision_limit: float | None = 10.0,
    without: Iterable[str] = (),
    guarantees: Iterable[str] = (),
    disturbance: float | None = None,
    latency: float | None = None,
    ideal: Iterable[str] = (),
    team: str | Iterable[str | Robot] = (),
    movers: str | None = None,
    people: Replay | None = None,
    options: Mapping[str, Mapping[str, Any]] | None = None,
    keep: Keep = "trajectories",
    shard: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    progress: ProgressCallback | None = None,
    told: Callable[[str], None] | None = None,
) -> Results:
    """Run suites with robots and navigators, and score every trial.

    Args:
        suites: Names (`hospital`, `barn`), paths of TOML files, or `Suite`s and `Scenario`s made in Python.
        robots: Names, presets (`hosbot:vendor`), files or `Robot`s; default: the suite's usual ones.
        navigators: Registered names, addresses such as `my_pkg:MyNavigator` or `path/to/file.py:MyNavigator`, or classes,
            those of a notebook too. What no other process can find by its name is recorded as `object:NAME`, and has to be handed
            over again to `rerun` or to go on with. By robot: `"tiago=hp-st,hosbot=orca"`, or `"orca,tiago=hp-st"`, which is `orca` for all
            others. `"all"`: every registered one that can drive there and isn't told the future.
        batches: Only these batches; empty: all.
        configurations: Only these configurations; empty: all.
        speeds: Only these set speeds, m/s; empty: all.
        obstacle_speeds: Only these speeds of the moving obstacle, m/s; empty: all.
        sizes: Only these edges of the static obstacles, m; empty: all.
        gaps: Only these gaps, in multiples of d_base; empty: all.
        worlds: Only these of BARN's or DynaBARN's worlds, by number; empty: all.
        scenarios: Only these scenarios, by name (the column `scenario` of a table of trials); empty: all.
        seeds: (A, B) or "A:B": instead of a suite's frozen scenarios those that its generator draws from the seeds
            A, A + 1, ..., B - 1 (`sar-case1` and its like).
        repetitions: How many of each configuration; None: as the suite has it.
        floor_plan: Another floor plan for the suite.
        seed: Of the whole campaign.
        localisation: `truth`, `odometry` or `amcl`; None: as each scenario says.
        map: The ROS map (yaml) that a robot built; None: the true one.
        tracking: How obstacles are followed, `difference` or `kalman`; None: as each scenario says.
        setups: How much a navigator may think per decision: `1`, `2` (paper B's), `0.15 s` (wall clock),
            `400 iterations`, or `real-time` (time passes while it thinks, and what it commands is followed as much later); several are run side by side; empty: no bound.
        decision_limit: Wall clock after which a decision counts as hung, s; None: never.
        without: Ingredients to leave out: beside each navigator that knows one, the variant without it is run too
            (`hp-st[without=reverse]`).
        guarantees: Modes (`passive`, `none`) in which to run the navigators that have them.
        disturbance: Factor on what disturbs the robot in each scenario; None: as each scenario says.
        latency: Factor on how late the robots sense and act; 0: at once; None: as their files say.
        ideal: Errors of the robots' sensors to leave out: `sweep`, `legs`, `mixed-pixels`, `lost-returns`, `bias`, `noise`,
            `odometry`, `all`; a robot and its navigator still know the sensors as its file has them.
        team: `"tiago*2+hosbot"`, or robots one by one: who takes part in scenarios of several robots, in their order, instead of
            `robots`.
        movers: `operator`: who drives a moving obstacle of the hospital protocol looks where it goes, as by default; `blind`:
            it runs as on rails (the suites `hospital-blind` and `hospital-held-out-blind`).
        people: Recorded people for the suite `replayed`, as `recorded_people` reads them; None: those that come with it.
        options: What a navigator's constructor is given, by the navigator's name.
        keep: What is kept of each trial beside its row in the table: `trajectories`, everything; `failures`, everything of trials
            that did not succeed; `table`, nothing.
        shard: `"3/40"`: only every fortieth simulation, from the third on; `merge` puts the forty together, wherever they were
            run; None: all.
        workers: How many processes; None: one a core. The results don't depend on it. 0: this one, for a debugger: a
            decision may take as long as it likes, and an error of a navigator is raised.
        scheduler: The address of a dask.distributed scheduler (`tcp://host:8786`), whose workers run the trials instead of
            processes here; None: processes here.
        out: The results directory; None: `results/SUITE`, numbered if that is taken.
        resume: Whether to go on with a campaign in `out` that was interrupted.
        progress: Called with (done, total, note).
        told: Called with a sentence for each registered navigator that `all` leaves out.

    Raises:
        ClearwayError: something that was given is wrong; one sentence says what and what would be right.
    """
    part = None if shard is None else read_shard(shard)
    selection = Selection(
        batches=_strings(batches, "batches"),
        configurations=_strings(configurations, "configurations"),
        speeds=tuple(float(v) for v in speeds),
        sizes=tuple(float(v) for v in sizes),
        gaps=tuple(float(v) for v in gaps),
        obstacle_speeds=tuple(float(v) for v in obstacle_speeds),
        repetitions=repetitions,
        worlds=tuple(worlds),
        scenarios=_strings(scenarios, "scenarios"),
        floor_plan=floor_plan,
        seeds=seed_range(seeds) if isinstance(seeds, str) else seeds,
        disturbance=disturbance,
        latency=latency,
        ideal=_strings(ideal, "ideal"),
        team=read_team(team) if isinstance(team, str) and team else names_of(team or (), "robots"),
        replay=people,
    )
    named, asked = with_movers(names_of(suites, "suites"), movers), names_of(navigators, "navigators")
    if ALL in asked:
        anybody = CampaignPlan(
            named, names_of(robots, "robots"), selection=selection, seed=seed, localisation=localisation,
            map=None if map is None else str(map), tracking=tracking,
        )  # fmt: skip
        can, why = able(anybody)
        asked = tuple(dict.fromkeys(n for name in asked for n in (can if name == ALL else (name,))))
        for name, reason in why.items():
            if told is not None:
                told(f"without {name}: {reason}")
    folder = free_directory(named, part) if out is None else Path(out)
    with pool(workers_of(workers, least=0), folder) as work:
        chosen, given = variants(
            asked,
            options or {},
            _strings(without, "without"),
            _strings(guarantees, "guarantees"),
            work=work,
            patience=prepare_limit(decision_limit),
        )
    campaign = CampaignPlan(
        suites=named,
        robots=names_of(robots, "robots"),
        navigators=chosen,
        selection=selection,
        seed=seed,
        localisation=localisation,
        map=None if map is None else str(map),
        tracking=tracking,
        setups=_strings(setups, "setups"),
        decision_limit=decision_limit,
        options=given,
        keep=keep,
    )
    done = run_campaign(campaign, folder, workers, resume, progress, part, scheduler)
    return Results(done.path, done.campaign)


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


def find_breaks(
    suite: str | Path | Suite | Scenario,
    *,
    robot: str | Robot | None = None,
    navigator: NavigatorLike = "move-base",
    guarantee: str | None = None,
    failure: str = "contact while moving",
    trials: int = 500,
    breaks: int = 3,
    method: str = "cma",
    shrink: bool = True,
    batches: Iterable[str] = (),
    configurations: Iterable[str] = (),
    speeds: Iterable[float] = (),
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
        guarantee: Its mode, of one that has several (`passive`, `none`).
        failure: What counts as a break: `contact while moving`, `contact`, `timeout`, `livelock`, or an indicator beyond a limit
            as `MDO<0.1` and `CT>60`.
        trials: How many trials the search may take, without those of shrinking.
        breaks: How many different breaks are enough: of another outcome, with another party, on another leg or test, or 1 m apart.
        method: `cma` (CMA-ES), `qd` (quality diversity), `random`; the first two need `clearway[search]`.
        shrink: Whether breaks are made smaller: fewer goals and bodies, fewer changed and rounder numbers.
        batches: Only these batches of the suite; empty: all.
        configurations: Only these configurations; empty: all.
        speeds: Only these set speeds, m/s; empty: all.
        scenarios: Only these scenarios, by name; empty: all.
        seed: Of the search.
        localisation: As for `run`.
        tracking: As for `run`.
        workers: How many processes; None: one a core. What a generation tries at once depends on it, hence what is found.
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
    selection = Selection(
        batches=_strings(batches, "batches"),
        configurations=_strings(configurations, "configurations"),
        speeds=tuple(float(v) for v in speeds),
        scenarios=_strings(scenarios, "scenarios"),
    )
    plan = CampaignPlan(
        suites=named, robots=robots, navigators=chosen, selection=selection, seed=seed, localisation=localisation,
        tracking=tracking, options=given,
    )  # fmt: skip
    return search_breaks(
        plan, folder, failure=failure, trials=trials, breaks=breaks, method=method, shrink=shrink, workers=workers,
        progress=progress,
    )  # fmt: skip


def recorded_people(
    file: str | Path,
    start: Iterable[float],
    goal: Iterable[float],
    *,
    at: Iterable[float] = (),
    bodies: Iterable[str] = (),
    format: str | None = None,
) -> Replay:
    """The people of a recording, and a robot's task among them: what `run` takes as `people`.

    Args:
        file: The recording; x and y are on the floor, in metres.
        start: Where the robot starts, in the recording's frame: x, y [m], theta [rad].
        goal: Where it goes: x, y [m], and theta [rad] unless its heading there is free.
        at: When it starts, s on the recording's clock; empty: at ten times.
        bodies: Who of the recording, as `clearway import --body` names them; empty: everything that moves.
        format: As what to read it (`clearway list formats`); None: as it looks.

    Raises:
        ClearwayError: the file can't be read, nobody walks in it, somebody moves as nobody can, or a pose is none.
    """
    from clearway.campaigns.replaying import replay_of

    return replay_of(file, tuple(start), tuple(goal), tuple(at), bodies=_strings(bodies, "bodies"), format=format)


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
        workers: How many processes, as for `run`.
        out: A folder for tests, results, curve and numbers, in which an earlier search of the same goes on; None:
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
        confidence=confidence, between=between, step=step, trials=trials, workers=workers, progress=progress,
    )  # fmt: skip


def rerun(
    results: str | Path | store.Results,
    trial: int,
    *,
    navigator: NavigatorLike | None = None,
    out: str | Path | None = None,
    raise_errors: bool = False,
) -> Rerun:
    """Run one trial of a results directory again, alone and in this process, and compare it with the stored one.

    A decision may take as long as it likes, so that a debugger may stop it.

    Args:
        results: A finished results directory, or its path.
        trial: The trial's number in its table.
        navigator: Who is to drive on the very same scenario; None: who drove before, and the bits are compared.
        out: A results directory to make for this one trial; None: none.
        raise_errors: Whether an error of the navigator is raised, for a debugger, instead of ending the trial.

    Returns:
        Both trials, and where they first differ; printed, it says so in one sentence.

    Raises:
        ClearwayError: there is no such trial, it was recorded, or the robot, the scenario or its floor plan have changed.
    """
    found = results if isinstance(results, store.Results) else open_results(results)
    again = rerun_trial(
        found,
        trial,
        navigator=None if navigator is None else navigator_name(navigator),
        out=None if out is None else Path(out),
        raise_errors=raise_errors,
    )
    done = again.results
    return again if done is None else replace(again, results=Results(done.path, done.campaign))


def simulate(
    scenario: str | Path | Scenario,
    robot: str | Robot,
    navigator: NavigatorLike = "move-base",
    *,
    name: str | None = None,
    localisation: str | None = None,
    tracking: str | None = None,
    map: str | Path | None = None,
    setup: str | None = None,
    seed: int = 0,
) -> Trial:
    """Run one trial in this process, which a debugger can step through; nothing is written.

    It has the bits of the same trial in a campaign; of a scenario with several robots it is the first one's. Errors of the
    navigator are raised, and a decision may take as long as it likes.

    Args:
        scenario: A `Scenario`, a scenario's file, or a suite by name.
        robot: Its name or file, or a `Robot`.
        navigator: Its name or address, or its class.
        name: Which scenario of a suite; None: it has but one.
        localisation: As for `run`.
        tracking: As for `run`.
        map: As for `run`.
        setup: One of `run`'s `setups`.
        seed: Of the campaign that it might be of.

    Raises:
        ClearwayError: something that was given is wrong; one sentence says what and what would be right.
    """
    return one_trial(
        scenario, robot, navigator, name=name, localisation=localisation, tracking=tracking, seed=seed,
        map=None if map is None else str(map), setups=() if setup is None else (setup,),
    )  # fmt: skip


def resume(
    out: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: ProgressCallback | None = None,
) -> Results:
    """Complete a campaign by the plan that its results directory holds; a finished one is opened as it is.

    Args:
        out: The results directory.
        workers: How many processes, as for `run`.
        scheduler: Of dask, as for `run`.
        progress: Called with (done, total, note).

    Raises:
        ClearwayError: `out` holds no campaign, or its suite, robots or versions have changed since.
    """
    done = resume_campaign(Path(out), workers, progress, scheduler)
    return Results(done.path, done.campaign)


def check_parameters(path: str | Path, robot: str | None = None) -> ParameterTable:
    """What becomes of each parameter of a user's: read, ignored, missing here or unknown, as `clearway check` tells it.

    Args:
        path: A file of Nav2's (`nav2_params.yaml`); or the folder of a ROS 1 package with those of move_base.
        robot: The robot's name, by which a file is chosen where a ROS 1 package has one for each of several.

    Raises:
        ClearwayError: it can't be read, or holds no such parameters.
    """
    from clearway.navigators.parameter_files import parameter_table

    found = parameter_table(path, robot)
    if found is None:
        raise ClearwayError(
            "holds no parameters of Nav2 (`ros__parameters`), nor is it a folder with files of move_base's", file=path
        )
    return found


def merge(*shards: str | Path, out: str | Path, progress: ProgressCallback | None = None) -> Results:
    """Put the shards of a campaign together: the same bytes as if it had been run in one piece.

    Args:
        shards: The results directories of all of them, in any order, as `run` with `shard` writes them.
        out: The results directory of the whole.
        progress: Called with (done, total, note).

    Raises:
        ClearwayError: a shard is missing, there twice, unfinished, damaged or of another campaign, or `out` is taken.
    """
    done = merge_shards([Path(shard) for shard in shards], Path(out), progress)
    return Results(done.path, done.campaign)


def score(
    test_plan: str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: ProgressCallback | None = None,
) -> Results:
    """Import and score the recordings of a real robot by a test plan (TOML).

    Args:
        test_plan: Its file; `clearway protocol` writes a skeleton of one.
        out: The results directory; None: `results/NAME-OF-THE-PLAN`, numbered if that is taken.
        workers: How many processes; None: one a core.
        resume: Whether to go on with a scoring in `out` that was interrupted, or whose plan has grown since: trials are scored
            that are new, or of which the plan or a file now says something else.
        progress: Called with (done, total, note).

    Raises:
        ClearwayError: something in the test plan or in a file is wrong; one sentence says what and what would be right.
    """
    from clearway.campaigns.scoring import score_plan

    folder = free_directory([str(test_plan)]) if out is None else Path(out)
    done = score_plan(Path(test_plan), folder, workers=workers, resume=resume, progress=progress)
    return Results(done.path, done.campaign)


def watch(
    test_plan: str | Path,
    captures: str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Iterator[Round]:
    """Score recordings as they come in, until every trial of the plan was driven and can be used.

    Args:
        test_plan: Its file.
        captures: The folder into which recordings come; which of them is which trial's, the plan's `files` say.
        out: The results directory, gone on with if it holds results of this plan; None: `results/NAME-OF-THE-PLAN`.
        workers: How many processes; None: one a core.
        progress: Called with (done, total, note).

    Yields:
        Where the day stands: the results so far, the next trial, what has to be repeated.

    Raises:
        ClearwayError: there is no such folder.
    """
    from clearway.campaigns.watching import watch

    folder = Path("results") / Path(test_plan).stem if out is None else Path(out)
    yield from watch(Path(test_plan), Path(captures), folder, workers=workers, progress=progress)


def compare(
    *results: str | Path | store.Results,
    between: Iterable[str] = (),
    indicators: Iterable[str] | None = None,
    confidence: float = 0.95,
    out: str | Path | None = None,
) -> list[Comparison | ConfigurationComparison]:
    """Compare every two of several results, or of the systems of one: success and indicators on the same tests.

    Args:
        results: Results directories or their paths; of a single one its robots, navigators and set-ups are compared.
        between: Of a single one, only the systems of these robots, navigators or set-ups.
        indicators: Only these; None: paper A's.
        confidence: Of the intervals, in (0, 1).
        out: A folder for a page with figures, and a CSV table; None: none is written.

    Returns:
        A comparison a pair, the later against the earlier.

    Raises:
        ClearwayError: nothing to compare, results without a test in common, or `out` can't be used.
    """
    from clearway.reports.comparison_page import write_comparison
    from clearway.reports.side_by_side import tables_of
    from clearway.statistics import compare_all

    opened = [one if isinstance(one, store.Results) else open_results(one) for one in results]
    chosen = None if indicators is None else _strings(indicators, "indicators")
    found = compare_all(tables_of(opened, _strings(between, "between")), indicators=chosen, confidence=confidence)
    if out is not None:
        write_comparison(found, Path(out))
    return found


def accept(
    criteria: str | Path | Criteria,
    *results: str | Path | store.Results,
    test_plan: str | Path | None = None,
    junit: str | Path | None = None,
) -> Verdict:
    """Is the robot accepted? Criteria held against all trials of results directories, one after the other.

    A verdict is valid however often it is asked for while trials come in: each of its two errors keeps to its probability.

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
            robots or navigators, or trials that are not independent.
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
    planned = None if test_plan is None else labels_in(load_test_plan(test_plan))
    try:
        if planned is not None:
            refuse_strange_groups(asked, planned)
        found = judge([one.trials for one in opened], asked, complete=planned is None)
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=error.file or file, field=error.field) from None
    if junit is not None:
        write_junit(found, Path(junit))
    return found


def acceptance_plan(criteria: str | Path | Criteria, rates: Iterable[float] = ()) -> list[Outlook]:
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
    return outlooks(asked, tuple(float(rate) for rate in rates))


def open_results(path: str | Path) -> Results:
    """Open a finished results directory.

    Raises:
        ClearwayError: not a results directory, unfinished, damaged, or written by a newer version of Clearway.
    """
    found = store.open_results(path)
    return Results(found.path, found.campaign)


def free_directory(suites: Iterable[str], shard: Shard | None = None) -> Path:
    """Where results go when nobody says: `results/SUITE`, or `results/SUITE-2` and so on if that is taken; of a shard
    `results/SUITE-3-of-40`."""
    name = "-".join(Path(s.removeprefix(PREFIX)).stem for s in suites)
    if shard is not None:
        name += f"-{shard.number}-of-{shard.of}"
    number, path = 1, Path("results") / name
    while os.path.exists(path):
        number += 1
        path = Path("results") / f"{name}-{number}"
    return path


def _strings(values: Iterable[str], field: str) -> tuple[str, ...]:
    if isinstance(values, str):  # a lone name is meant as a list of one, not of its letters
        return (values,)
    found = tuple(values)
    for value in found:
        if not isinstance(value, str):
            raise ClearwayError(f"{value!r} is not a name", field=field)
    return found
