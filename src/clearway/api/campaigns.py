"""Trials in simulation: a campaign, one that goes on, shards put together, one trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from clearway.api.arguments import NavigatorLike, free_directory, options_of
from clearway.api.results import Results, open_results
from clearway.campaigns import CampaignPlan, resume_campaign, run_campaign
from clearway.campaigns.objects import names_of, navigator_name, team_of
from clearway.campaigns.one_trial import one_trial
from clearway.campaigns.pilot import prepare_limit
from clearway.campaigns.plan_checks import ALL, able
from clearway.campaigns.pool import pool, workers_of
from clearway.campaigns.progress import ProgressCallback
from clearway.campaigns.rerun import Rerun
from clearway.campaigns.rerun import rerun as rerun_trial
from clearway.campaigns.shards import merge_shards, read_shard
from clearway.campaigns.variants import variants
from clearway.errors import ClearwayError
from clearway.robots import Robot
from clearway.scenarios.replay import Replay
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.selecting import number, numbers, selection_of, strings
from clearway.scenarios.suite import Suite
from clearway.scenarios.suites import with_movers
from clearway.trials import Trial, store
from clearway.trials.keeping import Keep


def run(
    *suites: str | Path | Suite | Scenario,
    robots: Iterable[str | Robot] = (),
    navigators: Iterable[NavigatorLike] = ("move-base",),
    batches: Iterable[str] = (),
    configurations: Iterable[str] = (),
    speeds: float | Iterable[float] = (),
    obstacle_speeds: float | Iterable[float] = (),
    sizes: float | Iterable[float] = (),
    gaps: float | Iterable[float] = (),
    worlds: int | Iterable[int] = (),
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
        guarantees: Modes (`passive`, `evasive`, `none`) in which to run the navigators that have them.
        disturbance: Factor on what disturbs the robot in each scenario; None: as each scenario says.
        latency: Factor on how late the robots sense and act; 0: at once, but for motors that lag; None: as their files say.
        ideal: Errors of the robots to leave out: `sweep`, `legs`, `mixed-pixels`, `lost-returns`, `bias`, `noise`, `odometry`,
            `lag`, `slip`, `all`; a robot and its navigator still know the sensors as its file has them.
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
        told: Called before the first trial with a sentence for each registered navigator that `all` leaves out, and for each robot
            that can't drive the set speed of some of its tests.

    Raises:
        ClearwayError: something that was given is wrong; one sentence says what and what would be right.
    """
    part = None if shard is None else read_shard(shard)
    selection = selection_of({
        "batches": batches, "configurations": configurations, "speeds": speeds, "sizes": sizes, "gaps": gaps,
        "obstacle_speeds": obstacle_speeds, "repetitions": repetitions, "worlds": worlds, "scenarios": scenarios,
        "floor_plan": floor_plan, "seeds": seeds, "disturbance": disturbance, "latency": latency, "ideal": ideal,
        "team": team_of(team), "replay": people,
    })  # fmt: skip
    limit = number(decision_limit, "decision_limit")
    named, asked = with_movers(names_of(suites, "suites"), movers), names_of(navigators, "navigators")
    if ALL in asked:
        anybody = CampaignPlan(
            named, names_of(robots, "robots"), selection=selection, seed=seed, localisation=localisation,
            map=None if map is None else str(map), tracking=tracking,
        )  # fmt: skip
        can, why = able(anybody)
        if not can:
            raise ClearwayError(f"no navigator can drive there; {next(iter(why.values()))}", field="navigators")
        asked = tuple(dict.fromkeys(n for name in asked for n in (can if name == ALL else (name,))))
        for name, reason in why.items():
            if told is not None:
                told(f"without {name}: {reason}")
    folder = free_directory(named, part) if out is None else Path(out)
    with pool(workers_of(workers, least=0), folder) as work:
        chosen, given = variants(
            asked,
            options_of(options),
            strings(without, "without"),
            strings(guarantees, "guarantees"),
            work=work,
            patience=prepare_limit(limit),
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
        setups=strings(setups, "setups"),
        decision_limit=limit,
        options=given,
        keep=keep,
    )
    done = run_campaign(campaign, folder, workers, resume, progress, part, scheduler, told)
    return Results(done.path, done.campaign)


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


def recorded_people(
    file: str | Path,
    start: Iterable[float],
    goal: Iterable[float],
    *,
    at: float | Iterable[float] = (),
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

    from_, to, times = numbers(start, "start"), numbers(goal, "goal"), numbers(at, "at")
    return replay_of(file, from_, to, times, bodies=strings(bodies, "bodies"), format=format)
