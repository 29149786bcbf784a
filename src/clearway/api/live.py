"""Trials whose robot is driven by a stack that somebody has started."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from clearway.api.campaigns import run
from clearway.api.results import Results
from clearway.campaigns.progress import ProgressCallback


@dataclass(frozen=True, slots=True)
class Live:
    """What came of it.

    Attributes:
        results: Of the trials.
        real_time_factor: Seconds of simulated time in a second of wall clock, over all that was waited for, compiling too.
    """

    results: Results
    real_time_factor: float


def live_ros2(
    suite: str | Path,
    *,
    robot: str,
    scenarios: Iterable[str] = (),
    batches: Iterable[str] = (),
    repetitions: int | None = None,
    namespace: str = "",
    rmw: str = "cyclonedds",
    domain: int = 0,
    interface: str | None = None,
    router: str | None = None,
    stamped: bool = False,
    localised: bool = True,
    lockstep: bool = True,
    deadline: float = 0.5,
    watchdog: float = 0.5,
    patience: float = 30.0,
    fastest: float = 1000.0,
    out: str | Path | None = None,
    progress: ProgressCallback | None = None,
) -> Live:
    """Run a suite with a ROS 2 stack, one trial after another.

    Args:
        suite: Its name, or the path of its TOML file.
        robot: Who is driven.
        scenarios: Only these, by name; empty: all.
        batches: Only these; empty: all.
        repetitions: How many of each configuration; None: as the suite has it.
        namespace: Of the stack's topics and its action.
        rmw: How the stack speaks: `cyclonedds` or `zenoh`.
        domain: The number of its domain.
        interface: Of cyclonedds: the network interface; None: `lo`, nothing leaves this machine.
        router: Of zenoh: where its router listens; None: tcp/localhost:7447.
        stamped: Whether `/cmd_vel` holds TwistStamped; else Twist.
        localised: Whether the stack is given our pose; else it localises itself.
        lockstep: Whether `/clock` waits for the command of each period; else it keeps to the wall clock.
        deadline: How long it waits for one, s of wall clock.
        watchdog: How long the base keeps the last command, s of `/clock`.
        patience: How long the action, an accepted goal and a first command are waited for, s of wall clock.
        fastest: How many times as fast as the wall clock `/clock` goes at most, in lockstep.
        out: The results' directory; None: none is kept.
        progress: Is told of each trial that is done.

    Raises:
        ClearwayError: one of them is wrong.
    """
    way = {name: value for name, value in (("interface", interface), ("router", router)) if value is not None}
    options: dict[str, str | float | bool] = {
        "rmw": rmw, "domain": domain, **way, "stamped": stamped, "localised": localised, "lockstep": lockstep,
        "deadline": deadline, "watchdog": watchdog, "patience": patience, "fastest": fastest,
    }  # fmt: skip
    return _live(f"ros2:{namespace}", options, suite, robot, scenarios, batches, repetitions, out, progress)


def live_ros1(
    suite: str | Path,
    *,
    robot: str,
    scenarios: Iterable[str] = (),
    batches: Iterable[str] = (),
    repetitions: int | None = None,
    master: str = "",
    namespace: str = "",
    host: str = "127.0.0.1",
    localised: bool = True,
    lockstep: bool = True,
    deadline: float = 0.5,
    watchdog: float = 0.5,
    patience: float = 30.0,
    fastest: float = 1000.0,
    out: str | Path | None = None,
    progress: ProgressCallback | None = None,
) -> Live:
    """Run a suite with a ROS 1 stack, one trial after another.

    Args:
        suite: Its name, or the path of its TOML file.
        robot: Who is driven.
        scenarios: Only these, by name; empty: all.
        batches: Only these; empty: all.
        repetitions: How many of each configuration; None: as the suite has it.
        master: Where the stack's master listens, as in ROS_MASTER_URI; empty: http://127.0.0.1:11311.
        namespace: Of the stack's topics and its action.
        host: The address of this machine that the stack's nodes connect to; by default no other machine reaches it.
        localised: Whether the stack is given our pose; else it localises itself.
        lockstep: Whether `/clock` waits for the command of each period; else it keeps to the wall clock.
        deadline: How long it waits for one, s of wall clock.
        watchdog: How long the base keeps the last command, s of `/clock`.
        patience: How long the action, an accepted goal and a first command are waited for, s of wall clock.
        fastest: How many times as fast as the wall clock `/clock` goes at most, in lockstep.
        out: The results' directory; None: none is kept.
        progress: Is told of each trial that is done.

    Raises:
        ClearwayError: one of them is wrong.
    """
    options: dict[str, str | float | bool] = {
        **({"namespace": namespace} if namespace else {}), "host": host, "localised": localised, "lockstep": lockstep,
        "deadline": deadline, "watchdog": watchdog, "patience": patience, "fastest": fastest,
    }  # fmt: skip
    return _live(f"ros1:{master}", options, suite, robot, scenarios, batches, repetitions, out, progress)


def _live(
    address: str,
    options: Mapping[str, str | float | bool],
    suite: str | Path,
    robot: str,
    scenarios: Iterable[str],
    batches: Iterable[str],
    repetitions: int | None,
    out: str | Path | None,
    progress: ProgressCallback | None,
) -> Live:
    inside = ",".join(
        f"{name}={str(value).lower() if isinstance(value, bool) else value}" for name, value in options.items()
    )
    slowest = float(options["patience"]) + float(options["deadline"])
    began = time.monotonic()
    results = run(
        suite, robots=[robot], navigators=[f"{address}[{inside}]"], scenarios=scenarios, batches=batches,
        repetitions=repetitions, decision_limit=max(10.0, slowest + 2.0), workers=1, out=out,
        progress=progress,
    )  # fmt: skip
    took = time.monotonic() - began
    simulated = sum(float(results.trial(k).t[-1]) for k in range(len(results)))
    return Live(results, simulated / took)
