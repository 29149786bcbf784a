"""`clearway live`: a stack that somebody has started drives our robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import _options
from clearway.cli._options import Json, tell

if TYPE_CHECKING:
    from clearway.api import Live


def live(
    stack: Annotated[str, typer.Argument(metavar="STACK", help="What drives: ros1 or ros2.")],
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
    master: Annotated[
        str | None, typer.Option(help="ros1: its master, as in ROS_MASTER_URI.", show_default="http://127.0.0.1:11311")
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(
            help="ros1: this machine's address that the stack connects to; by default no other machine reaches it.",
            show_default="127.0.0.1",
        ),
    ] = None,
    rmw: Annotated[
        str | None,
        typer.Option(
            help="ros2: its middleware, cyclonedds or zenoh, as in RMW_IMPLEMENTATION.", show_default="cyclonedds"
        ),
    ] = None,
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="ros2: its domain, as in ROS_DOMAIN_ID.", show_default="0")
    ] = None,
    interface: Annotated[
        str | None,
        typer.Option(
            help="ros2, cyclonedds: network interface; by default nothing leaves this machine.", show_default="lo"
        ),
    ] = None,
    router: Annotated[
        str | None, typer.Option(help="ros2, zenoh: where its router listens.", show_default="tcp/localhost:7447")
    ] = None,
    stamped: Annotated[
        bool | None, typer.Option("--stamped", help="ros2: /cmd_vel holds TwistStamped, not Twist.")
    ] = None,
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
    fastest: Annotated[
        float, typer.Option(help="How many times as fast as the wall clock /clock goes at most, in lockstep.")
    ] = 1000.0,
    out: Annotated[Path | None, typer.Option(help="Results directory; default: results/NAME.")] = None,
    as_json: Json = False,
) -> None:
    """Run a suite with a stack that somebody has started, score every trial, and write the report.

    What is interrupted goes on with `clearway run --resume DIR --workers 1`.
    """
    from clearway import api
    from clearway.cli._progress import Progress, stoppable, written
    from clearway.errors import ClearwayError, unknown
    from clearway.reports.last_lines import for_machines, why_trials_failed
    from clearway.reports.text import headline
    from clearway.trials import BROKEN

    drive: dict[str, Callable[..., Live]] = {"ros1": api.live_ros1, "ros2": api.live_ros2}
    only: dict[str, dict[str, Any]] = {
        "ros1": {"master": master, "host": host},
        "ros2": {"rmw": rmw, "domain": domain, "interface": interface, "router": router, "stamped": stamped},
    }
    if stack not in drive:
        raise unknown("stack", stack, drive)
    for one, options in only.items():
        for name, value in options.items():
            if one != stack and value is not None:
                raise ClearwayError(f"--{name} is an option of {one}, and what drives is {stack}")
    given = {name: value for name, value in only[stack].items() if value is not None}
    with stoppable("nothing was run yet; the same command begins again"), Progress("trials") as progress:
        found = drive[stack](
            suite, robot=robot, scenarios=scenarios or (), batches=batches or (), repetitions=repetitions,
            namespace=namespace, localised=not own_localisation, lockstep=not real_time, deadline=deadline,
            watchdog=watchdog, patience=patience, fastest=fastest, out=out, progress=progress, **given,
        )  # fmt: skip
    results = found.results
    page = written(results)
    failed = sum(outcome in BROKEN for outcome in results.trials["outcome"].to_pylist())
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
