"""`clearway run`: run suites and report on them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.cli import _options
from clearway.cli._options import Json, numbers, tell

if TYPE_CHECKING:
    from clearway.scenarios.replay import Replay


def run(
    context: typer.Context,
    suites: Annotated[
        list[str] | None,
        typer.Argument(help="Suites: names, or TOML files of your own.", autocompletion=_options.suites_beginning),
    ] = None,
    robots: Annotated[
        list[str] | None,
        typer.Option("--robot", "-r", help="Robot; repeat for several.", autocompletion=_options.robots_beginning),
    ] = None,
    team: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOTS",
            help="Who takes part in scenarios of several robots, instead of --robot: tiago*2+hosbot are two TIAGos and a"
            " HOSBOT. Only scenarios for so many are run.",
        ),
    ] = None,
    navigators: Annotated[
        list[str] | None,
        typer.Option(
            "--navigator",
            "-n",
            help="Navigator: name, name[option=value,...], my_pkg:MyNavigator, exec:COMMAND or tcp://127.0.0.1:PORT; by robot:"
            " tiago=hp-st,hosbot=orca or"
            " orca,tiago=hp-st (orca for all others); all: every registered one that can drive there; repeatable.",
            autocompletion=_options.navigators_beginning,
        ),
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without",
            metavar="INGREDIENT",
            help="Beside each navigator that has this ingredient, run it without; repeatable.",
        ),
    ] = None,
    guarantees: Annotated[
        list[str] | None,
        typer.Option(
            "--guarantee",
            help="Mode of the navigators that have several: passive, evasive, none; repeat to run them apart.",
        ),
    ] = None,
    batches: _options.Batches = None,
    configurations: _options.Configurations = None,
    speeds: _options.Speeds = None,
    obstacle_speeds: _options.ObstacleSpeeds = None,
    sizes: _options.Sizes = None,
    gaps: _options.Gaps = None,
    worlds: Annotated[list[int] | None, typer.Option("--worlds", help="Only these worlds (barn, dynabarn).")] = None,
    scenarios: Annotated[
        list[str] | None,
        typer.Option("--scenario", help="Only these scenarios, by name (the column scenario of trials.csv)."),
    ] = None,
    official: Annotated[
        bool, typer.Option("--official", help="BARN's official set: 50 worlds, ten runs each.")
    ] = False,
    seeds: Annotated[
        str | None,
        typer.Option(
            metavar="A:B", help="Scenarios drawn from the seeds A to B - 1 instead of the frozen ones (crowd, sar-...)."
        ),
    ] = None,
    repetitions: _options.Repetitions = None,
    seed: Annotated[int, typer.Option(min=0, max=2**62 - 1, help="Of the whole campaign.")] = 0,
    disturbance: Annotated[
        float | None, typer.Option(metavar="FACTOR", help="Times what disturbs the robot in each scenario, as in 2.")
    ] = None,
    latency: Annotated[
        float | None,
        typer.Option(
            metavar="FACTOR",
            help="Times how late the robot senses and acts; 0: at once, but for motors that lag (--ideal lag).",
        ),
    ] = None,
    ideal: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ERROR",
            help="Leave out this error of the robot: sweep, legs, mixed-pixels, lost-returns, bias, noise, odometry, lag, slip,"
            " all; repeatable.",
        ),
    ] = None,
    movers: Annotated[
        str | None,
        typer.Option(help="hospital: operator (who drives them looks, the default) or blind (as on rails, harder)."),
    ] = None,
    people: Annotated[
        Path | None,
        typer.Option(
            help="replayed: a recording of people, in any format that `clearway import` reads, with --start, --goal."
        ),
    ] = None,
    bodies: Annotated[
        list[str] | None,
        typer.Option("--body", help="Only these of --people, as `clearway import --body` names them; repeatable."),
    ] = None,
    start: Annotated[
        str | None, typer.Option(metavar="X,Y,THETA", help="Where the robot starts among --people: m, m, rad.")
    ] = None,
    goal: Annotated[
        str | None, typer.Option(metavar="X,Y[,THETA]", help="Where it goes; without THETA its heading there is free.")
    ] = None,
    at: Annotated[
        list[float] | None,
        typer.Option(
            "--at", metavar="T", help="When it starts, s on the recording's clock; repeatable. Default: ten times."
        ),
    ] = None,
    floor_plan: _options.FloorPlanName = None,
    localisation: Annotated[str | None, typer.Option(help="truth, odometry or amcl; default: the scenario's.")] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", help="A map that the robot built (map.yaml) instead of the true one.")
    ] = None,
    tracking: Annotated[
        str | None, typer.Option(help="How obstacles are followed: difference or kalman; default: the scenario's.")
    ] = None,
    setups: Annotated[
        list[str] | None,
        typer.Option(
            "--setup",
            help="Thinking per decision: 1 (0.15 s) or 2 (no bound) as in paper B, 0.1s, 400iterations, real-time.",
        ),
    ] = None,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Time passes while a navigator thinks: as --setup real-time.")
    ] = False,
    budget: Annotated[float | None, typer.Option(help="Seconds of wall clock a decision; as --setup SECONDSs.")] = None,
    decision_limit: Annotated[
        float, typer.Option(help="Seconds of wall clock after which a navigator's decision counts as hung.")
    ] = 10.0,
    keep: Annotated[
        str,
        typer.Option(
            metavar="WHAT",
            help="What is kept of each trial beside its row in the table: trajectories (everything, for replays and reruns),"
            " failures (everything of those that did not succeed) or table (nothing).",
        ),
    ] = "trajectories",
    shard: Annotated[
        str | None,
        typer.Option(
            metavar="K/N",
            help="Only the K-th of N parts, for `clearway merge` to put together: 1/40 to 40/40 on forty machines. No page.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=0, max=1024, help="Processes; default: one a core. 0: this one, for a debugger: errors are raised."
        ),
    ] = None,
    engine: Annotated[
        str, typer.Option(help="Who runs the trials: workers (processes here) or dask (those of a scheduler).")
    ] = "workers",
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="With --engine dask: the scheduler, as in tcp://host:8786."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Results directory; default: results/NAME.")] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Complete the campaign in this directory, which was interrupted.")
    ] = None,
    no_report: Annotated[bool, typer.Option("--no-report", help="Only the results, no page.")] = False,
    as_json: Json = False,
) -> None:
    """Run suites with robots and navigators, score every trial, and write the report."""
    from clearway import api
    from clearway.cli._progress import Progress, stoppable, written
    from clearway.errors import ClearwayError
    from clearway.reports.last_lines import for_machines, why_trials_failed
    from clearway.reports.text import beside_published, decision_times, headline
    from clearway.scenarios.suites import load_suite
    from clearway.scenarios.teams import read_team
    from clearway.trials import BROKEN

    if official:
        for suite in suites or ():
            if "official" not in load_suite(suite).batches:
                raise ClearwayError(f"the suite {suite!r} has no official set; barn has", field="--official")
        batches = ["official"]
    if resume and out:
        raise ClearwayError("--resume DIR names the results directory already; leave out --out", field="--out")
    _check_engine(engine, scheduler)
    if resume and not suites:
        _refuse_beside_resume(context)
    with stoppable("nothing was run yet; the same command begins again"), Progress("trials") as progress:
        if resume and not suites:
            results = api.resume(resume, workers=workers, scheduler=scheduler, progress=progress)
        else:
            if not suites:
                raise ClearwayError("say which suite to run; `clearway list suites` shows them")
            recorded = _recorded(people, start, goal, at or (), bodies or ())
            results = api.run(
                *suites,
                robots=robots or (),
                navigators=navigators or ("move-base",),
                batches=batches or (),
                configurations=configurations or (),
                speeds=speeds or (),
                obstacle_speeds=obstacle_speeds or (),
                sizes=sizes or (),
                gaps=gaps or (),
                worlds=worlds or (),
                scenarios=scenarios or (),
                seeds=seeds,
                repetitions=repetitions,
                floor_plan=floor_plan,
                seed=seed,
                localisation=localisation,
                map=map_,
                tracking=tracking,
                setups=[
                    *(setups or ()),
                    *([f"{budget!r}s"] if budget is not None else []),
                    *(["real-time"] if real_time else []),
                ],
                decision_limit=decision_limit,
                without=without or (),
                guarantees=guarantees or (),
                disturbance=disturbance,
                latency=latency,
                ideal=ideal or (),
                team=read_team(team) if team is not None else (),
                movers=movers,
                people=recorded,
                keep=keep,  # type: ignore[arg-type]  # the plan refuses what is none
                shard=shard,
                workers=workers,
                scheduler=scheduler,
                out=resume or out,
                resume=resume is not None,
                progress=progress,
                told=progress.say,
            )
    page = None if no_report or "shard" in results.campaign else written(results)
    failed = sum(outcome in BROKEN for outcome in results.trials["outcome"].to_pylist())
    if as_json:
        about = {"results": str(results.path), "report": page and str(page), "trials": len(results), "failed": failed}
        tell(about | for_machines(results))
    else:
        typer.echo(headline(results.trials))
        if published := beside_published(results):
            typer.echo(f"\n{published}")
        if took := decision_times(results):
            typer.echo(f"\n{took}\n")
        if why := why_trials_failed(results):
            typer.echo(f"{why}\n")
        typer.echo(f"results: {results.path}" if page is None else f"report: {page}")
    if failed:
        typer.echo(
            f"in {failed} of {len(results)} trials the navigator itself, or a behaviour of the scenario's people, failed; see their reason",
            err=True,
        )
        raise typer.Exit(1)


def _check_engine(engine: str, scheduler: str | None) -> None:
    from clearway.errors import ClearwayError, unknown

    if engine not in ("workers", "dask"):
        raise unknown("engine", engine, ("workers", "dask"), field="--engine")
    if engine == "dask" and scheduler is None:
        raise ClearwayError(
            "dask needs --scheduler ADDRESS; `dask scheduler` starts one and prints it", field="--engine"
        )
    if engine != "dask" and scheduler is not None:
        raise ClearwayError("has no effect without --engine dask", field="--scheduler")


def _recorded(
    people: Path | None, start: str | None, goal: str | None, at: Sequence[float], bodies: Sequence[str]
) -> Replay | None:
    """The people of --people with the task among them; what was noticed of them is printed."""
    from clearway import api
    from clearway.errors import ClearwayError

    given = {"--start": start, "--goal": goal, "--at": at, "--body": bodies}
    if people is None:
        if useless := next((name for name, value in given.items() if value not in (None, ())), None):
            raise ClearwayError("has no effect without --people FILE", field=useless)
        return None
    if start is None or goal is None:
        lacking = "--start" if start is None else "--goal"
        raise ClearwayError("recorded people need --start X,Y,THETA and --goal X,Y[,THETA]", field=lacking)
    found = api.recorded_people(
        people, numbers(start, "--start", (3,), angle=2), numbers(goal, "--goal", (2, 3), angle=2), at=at, bodies=bodies
    )
    for note in found.notes:
        typer.echo(f"{people}: {note}", err=True)
    return found


_WITH_RESUME = {"suites", "resume", "out", "workers", "engine", "scheduler", "no_report", "as_json"}


def _refuse_beside_resume(context: typer.Context) -> None:
    """Refuse what would not be heeded: the plan of an interrupted campaign stands in its directory."""
    from clearway.errors import ClearwayError

    for parameter in context.command.params:
        source = context.get_parameter_source(str(parameter.name))
        if parameter.name not in _WITH_RESUME and source is not None and source.name == "COMMANDLINE":
            option = parameter.opts[0]
            raise ClearwayError(
                f"{option} has no effect beside --resume DIR, which goes on by the plan that stands there; leave it out, or"
                " name the suites too",
                field="--resume",
            )
