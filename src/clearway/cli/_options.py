"""Options that several verbs share."""

from __future__ import annotations

import atexit
import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer


def suites_beginning(incomplete: str) -> list[str]:
    """Suites for the shell to complete."""
    from clearway.scenarios.suites import suite_names

    return [name for name in suite_names() if name.startswith(incomplete)]


def robots_beginning(incomplete: str) -> list[str]:
    """Robots for the shell to complete."""
    from clearway.robots import robot_names

    return [name for name in robot_names() if name.startswith(incomplete)]


def navigators_beginning(incomplete: str) -> list[str]:
    """Navigators for the shell to complete."""
    from clearway.navigators.registry import navigator_names

    return [name for name in navigator_names() if name.startswith(incomplete)]


def numbers(text: str, option: str, counts: tuple[int, ...], angle: int) -> list[float]:
    """The numbers of an option, separated by commas.

    Args:
        text: What was typed.
        option: The option, for the error.
        counts: How many there may be.
        angle: Which of them, by its index, is an angle: radians, or degrees as `90 deg`.

    Raises:
        ClearwayError: others, none, or too many; or an angle beyond a full turn.
    """
    from pydantic import TypeAdapter, ValidationError

    from clearway.errors import ClearwayError, shown
    from clearway.quantities import Angle, Finite

    found = []
    for k, part in enumerate(text.split(",")):
        try:
            number: float | str = float(part)
        except ValueError:
            number = part
        try:
            found.append(TypeAdapter(Angle if k == angle else Finite).validate_python(number))
        except ValidationError as error:
            said = error.errors()[0]
            why = said["msg"].removeprefix("Value error, ") if said["type"] == "value_error" else "is no number"
            raise ClearwayError(f"{shown(part.strip())}: {why}", field=option) from None
    if len(found) not in counts:
        many = " or ".join(map(str, counts))
        raise ClearwayError(f"{shown(text)} is not {many} numbers, separated by commas", field=option)
    return found


Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
ResultsDirectory = Annotated[Path, typer.Argument(help="A results directory, as `run` writes it.", show_default=False)]
RobotName = Annotated[
    str,
    typer.Option(
        "--robot",
        "-r",
        help="A robot's name or TOML file; NAME:PRESET for one of its presets.",
        autocompletion=robots_beginning,
    ),
]
Batches = Annotated[list[str] | None, typer.Option("--batch", help="Only these batches.")]
Configurations = Annotated[list[str] | None, typer.Option("--configuration", help="Only these configurations.")]
Speeds = Annotated[list[float] | None, typer.Option("--speed", help="Only these set speeds, m/s.")]
ObstacleSpeeds = Annotated[
    list[float] | None, typer.Option("--obstacle-speed", help="Only these speeds of the moving obstacle, m/s.")
]
Sizes = Annotated[list[float] | None, typer.Option("--size", help="Only these obstacle edges, m.")]
Gaps = Annotated[list[float] | None, typer.Option("--gap", help="Only these gaps, in multiples of d_base.")]
Repetitions = Annotated[int | None, typer.Option(min=1, help="Repetitions of each configuration.")]
FloorPlanName = Annotated[str | None, typer.Option(help="Another floor plan for the suite, such as ward.")]


_told: list[str] = []
"""What `tell` was given and `alone` has yet to print."""


def tell(answer: Any, *, indent: int | None = None) -> None:
    """Print what a verb answers with --json, once it is done. JSON knows no infinity and no NaN: they become null."""
    _told.append(json.dumps(_finite(answer), indent=indent, allow_nan=False))


def alone(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb, of which with --json standard output has what it told and nothing else: whatever navigators, formats and
    other foreign code print, also from compiled code, from workers or when the process ends, goes to the errors."""

    @wraps(verb)
    def run(*arguments: Any, **options: Any) -> None:
        if not options.get("as_json"):
            return verb(*arguments, **options)
        _told.clear()
        try:
            with _apart():
                verb(*arguments, **options)
        finally:
            for text in _told:
                typer.echo(text)
            atexit.register(
                os.dup2, 2, 1
            )  # before whoever registered earlier, and before C libraries empty their buffers

    return run


@contextmanager
def _apart() -> Iterator[None]:
    """What is printed goes to the errors."""
    try:
        sys.stdout.flush()
        kept = os.dup(1)
    except (OSError, AttributeError, ValueError):  # there is no standard output
        yield
        return
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(inside) for key, inside in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inside) for inside in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
