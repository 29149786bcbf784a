"""Where a navigator's parameters stand, and what a candidate's are written as: the robot's file, a file of Nav2's or of ROS 1, options.

A candidate is written in the format that came in. A robot's file is kept as it is, and has a preset `tuned` behind it that says what
changes; in YAML the values are changed where they stand; options stand behind the navigator's name.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from pydantic import BaseModel

from clearway.campaigns.tuning import TUNED_ON_COMMENT, declaration
from clearway.errors import ClearwayError, noted, refuse
from clearway.given import PREFIX
from clearway.improving.task import Setting, Variable
from clearway.improving.yaml_text import changed, only, scalars, value_of
from clearway.navigators.move_base.ros import is_ros_folder
from clearway.navigators.move_base.ros.files import files_of
from clearway.navigators.registry import check_parameters, make_navigator, split_options
from clearway.reading import read_toml
from clearway.recordings.protocol.toml_text import toml_key, toml_value
from clearway.robots import RobotTable, load_robot
from clearway.tuning import TunedOn


class Written(NamedTuple):
    """Parameters as a campaign takes them.

    Attributes:
        robot: The robot.
        navigator: The navigator.
        files: What was written for them.
    """

    robot: str
    navigator: str
    files: tuple[Path, ...] = ()


class Settings(Protocol):
    """Where parameters stand."""

    def before(self, names: Sequence[str]) -> dict[str, Any]:
        """The values that came in; None where none is known.

        Raises:
            ClearwayError: a parameter of that name isn't known there.
        """
        ...

    def write(
        self, values: Mapping[str, Setting], folder: Path, name: str, tuned_on: Sequence[TunedOn] = ()
    ) -> Written:
        """Write other values into `folder`, in a file called after `name`, with what they were tuned on."""
        ...


class InOptions:
    """Options of the navigator's constructor.

    Args:
        robot: The robot.
        navigator: The navigator, with the options that came in.
    """

    def __init__(self, robot: str, navigator: str) -> None:
        self._robot, self._navigator = robot, navigator

    def before(self, names: Sequence[str]) -> dict[str, Any]:
        """See `Settings`."""
        _, given = split_options(self._navigator)
        read = check_parameters(self._navigator, make_navigator(self._navigator), load_robot(self._robot))
        return {name: given.get(name, _plain(_attribute(read, name))) for name in names}

    def write(
        self, values: Mapping[str, Setting], folder: Path, name: str, tuned_on: Sequence[TunedOn] = ()
    ) -> Written:
        """See `Settings`."""
        return Written(self._robot, with_options(self._navigator, values))


class InRobotFile:
    """The navigator's table in the robot's file.

    Args:
        robot: The robot.
        navigator: The navigator.

    Raises:
        ClearwayError: the robot has no file, or the navigator reads no table of it.
    """

    def __init__(self, robot: str, navigator: str) -> None:
        self._navigator = navigator
        if robot.startswith(PREFIX):
            raise ClearwayError(
                "parameters in a robot's file are tuned, and this one has none; write it", field="robot"
            )
        self._robot = load_robot(robot)
        name, _, preset = (robot, "", "") if robot.endswith(".toml") else robot.rpartition(":")
        name, preset = (name, preset) if name else (preset, "")
        shipped = resources.files("clearway.robots") / f"{name}.toml"
        self._file, self._preset = Path(name) if name.endswith(".toml") else Path(str(shipped)), preset
        if not self._file.is_file():
            raise ClearwayError(f"{robot!r} has no file of its own; bring a robot's file", field="robot")
        self._read = check_parameters(navigator, make_navigator(navigator), self._robot)
        if not isinstance(self._read, RobotTable):
            raise ClearwayError(
                f"navigator {navigator!r} reads no table of a robot's file; name its options under [options]",
                field="parameters",
            )

    def before(self, names: Sequence[str]) -> dict[str, Any]:
        """See `Settings`."""
        table = self._robot.navigators.get(self._read.TABLE.partition(".")[2], {})
        found: dict[str, Any] = {}
        for name in names:
            written: Any = table
            for part in name.split("."):
                written = written.get(part) if isinstance(written, dict) else None
            found[name] = _plain(_attribute(self._read, name) if written is None else written)
        return found

    def write(
        self, values: Mapping[str, Setting], folder: Path, name: str, tuned_on: Sequence[TunedOn] = ()
    ) -> Written:
        """See `Settings`."""
        presets = read_toml(self._file).get("presets", {})
        preset = next(p for k in range(len(presets) + 1) if (p := f"tuned-{k + 1}" if k else "tuned") not in presets)
        place, before = tuple(self._read.TABLE.split(".")), self.before(list(values))
        new = {(*place, *key.split(".")): key for key in values}
        kept = _leaves(presets.get(self._preset, {}))
        lines = [_line(path, value) for path, value in kept if path not in new]
        for path, key in new.items():
            was = before[key]
            lines.append(_line(path, values[key]) + ("" if was is None else f"  # was {toml_value(was)}"))
        if tuned_on:
            lines.append(_line((*place, "tuned_on"), [declaration(one) for one in tuned_on]))
        file = folder / f"{name}.toml"
        text = self._file.read_text(encoding="utf-8")
        file.write_text(f"{text.rstrip()}\n\n[presets.{preset}]\n" + "\n".join(lines) + "\n", encoding="utf-8")
        return Written(f"{file}:{preset}", self._navigator, (file,))


class InYaml:
    """A file of Nav2's parameters, or the files of a robot's ROS 1 package.

    Args:
        robot: The robot.
        navigator: The navigator, with an option `params`.

    Raises:
        ClearwayError: what `params` names is no file of the user's.
    """

    def __init__(self, robot: str, navigator: str) -> None:
        self._robot, self._navigator = robot, navigator
        self._place = str(split_options(navigator)[1]["params"])
        if is_ros_folder(self._place):
            self._files = files_of(self._place, load_robot(robot).name)
        elif Path(self._place).is_file():
            self._files = (Path(self._place),)
        else:
            raise ClearwayError(
                f"{self._place!r} is no file; what comes with Clearway can't be changed: write it as a file of your own first",
                field="navigator",
            )

    def before(self, names: Sequence[str]) -> dict[str, Any]:
        """See `Settings`."""
        return {name: value_of(only(scalars(file), name, file)) for name, file in self._in(names).items()}

    def write(
        self, values: Mapping[str, Setting], folder: Path, name: str, tuned_on: Sequence[TunedOn] = ()
    ) -> Written:
        """See `Settings`."""
        place, where = [], self._in(list(values))
        for k, part in enumerate(Path(p) for p in self._place.split("+")):
            to = folder / (f"{name}-{k}" if k else name)
            to = to.with_name(f"{to.name}{part.suffix}") if part.is_file() else to
            if part.is_file():
                shutil.copyfile(part, to)
            else:
                shutil.copytree(part, to, dirs_exist_ok=True)
            place.append((part, to))
        written = []
        head = f"{TUNED_ON_COMMENT}{json.dumps([declaration(one) for one in tuned_on])}" if tuned_on else ""
        for file in dict.fromkeys(where.values()):
            part, to = next((p, t) for p, t in place if file == p or p in file.parents)
            target = to / file.relative_to(part) if file != part else to
            target.write_text(
                changed(file, {n: v for n, v in values.items() if where[n] == file}, head), encoding="utf-8"
            )
            written.append(target)
        params = "+".join(str(to) for _, to in place)
        return Written(self._robot, with_options(self._navigator, {"params": params}), tuple(written))

    def _in(self, names: Sequence[str]) -> dict[str, Path]:
        """Which file each parameter stands in."""
        found = {file: scalars(file) for file in self._files}
        every = {name: nodes for file in found.values() for name, nodes in file.items()}
        where: dict[str, Path] = {}
        wrong: list[ClearwayError] = []
        for name in names:
            with noted(wrong):
                only(every, name, self._place)
                having = [file for file in found if name in found[file]]
                if len(having) > 1:
                    raise ClearwayError(f"stands in {having[0]} and in {having[1]}; which one is meant?", field=name)
                where[name] = having[0]
        refuse(wrong)
        return where


class Together:
    """Parameters in a file and options behind the name, both tuned.

    Args:
        robot: The robot.
        navigator: The navigator.
        variables: What is tuned.

    Raises:
        ClearwayError: the navigator's parameters stand in no file that could be written.
    """

    def __init__(self, robot: str, navigator: str, variables: Sequence[Variable]) -> None:
        self._options = {v.name for v in variables if v.option}
        in_file = any(not v.option for v in variables)
        kind = InYaml if "params" in split_options(navigator)[1] else InRobotFile
        self._file: Settings = kind(robot, navigator) if in_file else InOptions(robot, navigator)
        self._named: Settings = InOptions(robot, navigator)

    def before(self, names: Sequence[str]) -> dict[str, Any]:
        """See `Settings`."""
        inside = self._file.before([n for n in names if n not in self._options])
        return inside | self._named.before([n for n in names if n in self._options])

    def write(
        self, values: Mapping[str, Setting], folder: Path, name: str, tuned_on: Sequence[TunedOn] = ()
    ) -> Written:
        """See `Settings`."""
        inside = {n: v for n, v in values.items() if n not in self._options}
        written = self._file.write(inside, folder, name, tuned_on)
        outside = {n: v for n, v in values.items() if n in self._options}
        return written._replace(navigator=with_options(written.navigator, outside))


def with_options(navigator: str, values: Mapping[str, Any]) -> str:
    """The navigator's name with these options, in place of those that it has of that name."""
    plain, given = split_options(navigator)
    every = given | dict(values)
    text = ",".join(f"{name}={value if isinstance(value, str) else json.dumps(value)}" for name, value in every.items())
    return f"{plain}[{text}]" if every else plain


def _attribute(read: object, name: str) -> Any:
    for part in name.split("."):
        read = read.get(part) if isinstance(read, dict) else getattr(read, part, None)
    return read


def _plain(value: Any) -> Any:
    return None if isinstance(value, BaseModel | dict) else value


def _leaves(table: Mapping[str, Any], above: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], Any]]:
    found: list[tuple[tuple[str, ...], Any]] = []
    for key, value in table.items():
        found += _leaves(value, (*above, key)) if isinstance(value, dict) else [((*above, key), value)]
    return found


def _line(path: Sequence[str], value: Any) -> str:
    return f"{'.'.join(map(toml_key, path))} = {toml_value(value)}"
