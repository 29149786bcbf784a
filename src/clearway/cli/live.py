"""`clearway live`: a stack that somebody has started drives our robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli import _options
from clearway.cli._options import Json, tell


def live(
    stack: Annotated[str, typer.Argument(metavar="STACK", help="What drives: ros2.")],
    suite: Annotated[
        str,
        typer.Option("--suite", "-s", help="A suite's name, or a TOML file.", autocompletion=_options.suites_beginning),
    ],
    robot: Annotated[
        str, typer.Option("--robot", "-r", help="Who is driven.", autocompletion=_options.robots_beginning)
    ],
    scenarios: Annotated[list[str] | None, typer.Option("--scenario", help="Only these scenarios, by name.")] = None,
    batches: _options.Batches = None,
    repetitions: _options.Repetitions = None,
    namespace: Annotated[str, typer.Option(help="Of the stack's topics and its action.")] = "",
    domain: Annotated[int, typer.Option(min=0, max=232, help="DDS domain, as in ROS_DOMAIN_ID.")] = 0,
    interface: Annotated[str, typer.Option(help="Network interface; by default nothing leaves this machine.")] = "lo",
    stamped: Annotated[bool, typer.Option("--stamped", help="/cmd_vel holds TwistStamped, not Twist.")] = False,
    own_localisation: Annotated[
        bool, typer.Option("--own-localisation", help="The stack localises itself, from the initial pose on.")
    ] = False,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="/clock keeps to the wall clock, and waits for no command.")
    ] = False,
    deadline: Annotated[
        float, typer.Option(help="Seconds of wall clock that /clock waits for a period's command.")
    ] = 0.5,
    watchdog: Annotated[float, typer.Option(help="Seconds of /clock that the base keeps the last command.")] = 0.5,
    patience: Annotated[
        float, typer.Option(help="Seconds of wall clock to wait for the action, an accepted goal, a first command.")
    ] = 30.0,
    out: Annotated[Path | None, typer.Option(help="Results directory; default: results/NAME.")] = None,
    as_json: Json = False,
) -> None:
    """Run a suite with a stack that somebody has started, score every trial, and write the report.

    What is interrupted goes on with `clearway run --resume DIR --workers 1`.
    """
    from clearway import api
    from clearway.cli._progress import Progress, stoppable, written
    from clearway.errors import unknown
    from clearway.reports.last_lines import for_machines, why_trials_failed
    from clearway.reports.text import headline

    if stack != "ros2":
        raise unknown("stack", stack, ("ros2",))
    with stoppable("nothing was run yet; the same command begins again"), Progress("trials") as progress:
        found = api.live_ros2(
            suite, robot=robot, scenarios=scenarios or (), batches=batches or (), repetitions=repetitions,
            namespace=namespace, domain=domain, interface=interface, stamped=stamped, localised=not own_localisation,
            lockstep=not real_time, deadline=deadline, watchdog=watchdog, patience=patience, out=out, progress=progress,
        )  # fmt: skip
    results = found.results
    page = written(results)
    failed = sum(outcome == "navigator_failed" for outcome in results.trials["outcome"].to_pylist())
    if as_json:
        about = {"results": str(results.path), "report": str(page), "trials": len(results), "failed": failed}
        tell(about | {"real_time_factor": found.real_time_factor} | for_machines(results))
    else:
        typer.echo(headline(results.trials))
        if why := why_trials_failed(results):
            typer.echo(f"{why}\n")
        typer.echo(f"real-time factor, with what was waited for: {found.real_time_factor:.2g}\nreport: {page}")
    if failed:
        raise typer.Exit(1)
