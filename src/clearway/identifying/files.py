"""From a bag of commands and odometry to lines of a robot's file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.identifying.fit import LAG, RATE, Answered, Estimate, Identified, identify
from clearway.identifying.response import Response
from clearway.recordings import formats
from clearway.recordings.protocol.toml_text import toml_value
from clearway.recordings.recording import Want
from clearway.robots import Robot, load_robot

_RATES = {"v": ("acceleration", "deceleration"), "omega": ("angular_acceleration", "angular_deceleration")}
_UNITS = {"v": "m/s", "omega": "rad/s"}


@dataclass(frozen=True, slots=True)
class Findings:
    """What a recording tells of a robot's base.

    Attributes:
        recording: The file.
        command: Topic of its commands.
        odometry: Topic of its measured velocities.
        robot: The robot's file that was judged beside, by its name; empty: none.
        identified: How the base answers.
        notes: What the reader had to do or noticed, in sentences.
    """

    recording: Path
    command: str
    odometry: str
    robot: str
    identified: Identified
    notes: tuple[str, ...]

    def __str__(self) -> str:
        found = self.identified
        lines = [
            f"{self.recording}: how {self.odometry} answers {self.command}, by {found.blocks} stretches in which it moves; 95 % intervals"
        ]
        lag = "none shows" if found.lag is None else f"{found.lag} s"
        lines += [f"latency of a command: {found.latency} s, by the stamps", f"lag of the motors: {lag}"]
        for a in found.answers:
            unit = _UNITS[a.velocity]
            bounds = [
                f"{name.replace('_', ' ')} {'none shows' if x is None else f'{x} {unit}^2'}" for name, x in _rates(a)
            ]
            lines.append(f"{a.velocity}: bounds of {', '.join(bounds)}")
            own = "" if a.error_of_robot is None else f", as {self.robot}'s file has it {a.error_of_robot:.3g}"
            lines.append(
                f"  errs by {a.error:.3g} {unit} (rms) where it wasn't fitted; had it followed at once, by {a.error_at_once:.3g}{own}"
            )
            lines += [
                f"  told ({v:g} m/s, {omega:g} rad/s) it comes to {level:.3g} {unit}"
                for v, omega, level in a.reached
                if abs(level - (v if a.velocity == "v" else omega)) > 0.05 * abs(v if a.velocity == "v" else omega)
            ]
        return "\n".join([*lines, *self.notes])

    def toml(self) -> str:
        """The lines of a robot's file that follow from it."""
        found = self.identified
        drive = {"lag": found.lag} | {name: x for a in found.answers for name, x in _rates(a)}
        shown = {f"drive.{name}": x for name, x in drive.items() if x is not None}
        if found.latency.value >= 0.0:
            shown["latency.command"] = found.latency
        lines: list[str] = []
        for table in ("drive", "latency"):
            rows = [
                f"{name.partition('.')[2]} = {x.value:.3g}" for name, x in shown.items() if name.startswith(f"{table}.")
            ]
            lines += [f"[{table}]", *rows, ""] if rows else []
        of = f"{self.recording.name}: fitted to {self.odometry} and {self.command}"
        sources = [
            f"{toml_value(name)} = {toml_value(f'{of}; 95 %: {x.low:.3g} to {x.high:.3g}')}"
            for name, x in shown.items()
        ]
        return "\n".join([*lines, "[sources]", *sources])


def identify_recording(
    recording: str | Path, *, command: str | None = None, odometry: str | None = None, robot: str | None = None
) -> Findings:
    """How a robot's base answers its commands, by a recording of both.

    Args:
        recording: A bag with commands (Twist or TwistStamped) and odometry whose twist is measured.
        command: Topic of the commands; None: the only one.
        odometry: Topic of the odometry; None: the only one.
        robot: A robot's name or file, to be judged beside; of a car only the speed is looked at. None: none.

    Raises:
        ClearwayError: The file can't be read, lacks what is needed, or the robot moves too little in it.
    """
    path = Path(recording)
    beside = None if robot is None else load_robot(robot)
    held = formats.look(path)
    command, odometry = held.only("command", command), held.only("odometry", odometry)
    read = formats.read(path, Want(frozenset({command, odometry})))
    track, told = read.tracks[odometry], read.commands[command]
    if track.twist is None:
        raise ClearwayError("its messages have no measured velocities (twist)", file=path, field=odometry)
    count = 1 if beside is not None and beside.drive.kind == "ackermann" else 2  # a car turns as it drives
    try:
        found = identify(
            told.t,
            np.ascontiguousarray(told.velocity[:, [0, 2][:count]]),
            track.t,
            np.ascontiguousarray(track.twist[:, :count]),
            () if beside is None else _responses(beside)[:count],
        )
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=path, field=command) from error
    return Findings(path, command, odometry, "" if beside is None else beside.name, found, read.notes)


def _rates(a: Answered) -> list[tuple[str, Estimate | None]]:
    return list(zip(_RATES[a.velocity], (a.acceleration, a.deceleration), strict=True))


def _responses(robot: Robot) -> tuple[Response, Response]:
    """How v and omega answer by a robot's file."""
    limits, late, lag = robot.drive.limits(), robot.latency.command, max(robot.drive.lag, LAG[0])
    most = 1e3 * RATE[1]  # where a file knows of no bound
    return (
        Response(late, lag, min(limits.acceleration, most), min(limits.deceleration, most)),
        Response(late, lag, min(limits.angular_acceleration, most), min(limits.angular_deceleration, most)),
    )
