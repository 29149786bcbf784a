"""A robot's own ROS 1 files, found by their names: what they put on the parameter server below move_base.

    costmap_common_params.yaml                     into global_costmap and local_costmap
    local_costmap_params.yaml                      into local_costmap, unless it says so itself
    global_costmap_params.yaml                     into global_costmap, unless it says so itself
    move_base_params.yaml, dwa_local_planner_params.yaml and all others       as they are

as the usual launch files load them, the common ones first. Where files are variants of each other, such as
`costmap_common_params_waffle.yaml`, that of the robot by its name is taken. Nothing is executed: of what rosparam computes only
`deg(90)` and `rad(1.5)` are read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from clearway.errors import ClearwayError, shown
from clearway.reading import read_yaml
from clearway.reading.limits import ROS_PARAMETERS

_ROLES = {
    "common": re.compile(r"(costmap_common|common_costmap)(_params)?"),
    "local_costmap": re.compile(r"(costmap_local|local_costmap)(_params)?"),
    "global_costmap": re.compile(r"(costmap_global|global_costmap)(_params)?"),
}
_OTHERS = (
    "move_base",
    "base_local_planner",
    "local_planner",
    "dwa_",
    "global_planner",
    "navfn",
    "recovery_behaviors",
    "planner",
)
_COSTMAPS = ("global_costmap", "local_costmap")
_ANGLE = re.compile(r"(deg|rad)\(\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*\)")
_ARGUMENT = re.compile(r"\$\((?:arg|env|optenv|find)\s[^()]*\)")


class RosFiles(NamedTuple):
    """What files put on the parameter server.

    Attributes:
        files: Those that were read, in their order.
        tree: The parameters below move_base, namespaces as tables.
        skipped: Files that hold something else, each with what.
    """

    files: tuple[Path, ...]
    tree: dict[str, Any]
    skipped: dict[Path, str]


def is_ros_folder(place: str) -> bool:
    """Whether a text names folders or files, joined by +, among which is a costmap's or move_base's file."""
    parts = [Path(part) for part in place.split("+")]
    if not all(part.exists() for part in parts) or not (len(parts) > 1 or parts[0].is_dir()):
        return False
    return any(_role(f) is not None or f.stem.startswith(_OTHERS) for f in yaml_files(place))


def yaml_files(place: str) -> tuple[Path, ...]:
    """All YAML files of the folders that a text names, and the files, whatever they hold."""
    parts = [Path(part) for part in place.split("+")]
    return tuple(f for part in parts for f in (_yamls(part) if part.is_dir() else [part]))


def files_of(place: str, robot: str) -> tuple[Path, ...]:
    """The YAML files of a folder, those of other robots left out.

    Args:
        place: A folder, or several of folders and files joined by `+`.
        robot: The robot's name, by which a file is chosen among variants.

    Raises:
        ClearwayError: there is no such folder, it has no such file, or nothing says which of several is meant.
    """
    found: list[Path] = []
    for part in place.split("+"):
        path = Path(part)
        if path.is_file():
            found.append(path)
        elif path.is_dir():
            found += _chosen(_yamls(path), robot)
        else:
            raise ClearwayError("no such folder or file of ROS 1 parameters", file=path)
    if not found:
        inside = sorted({str(f.parent) for part in place.split("+") for f in Path(part).rglob("*.yaml")})[:12]
        hint = f"; there are some in {', '.join(inside)}" if inside else ""
        raise ClearwayError(
            f"holds no file of move_base's parameters, such as costmap_common_params.yaml{hint}; several folders and files can be "
            "joined by +",
            file=place,
        )
    return tuple(found)


def read_ros_files(place: str, robot: str) -> RosFiles:
    """What the files of a robot's package put on the parameter server.

    Args:
        place: As for `files_of`.
        robot: Likewise.

    Raises:
        ClearwayError: a file can't be read or isn't YAML, or two of a kind contradict each other.
    """
    files = files_of(place, robot)
    tree: dict[str, Any] = {}
    skipped: dict[Path, str] = {}
    said: dict[tuple[str, ...], Path] = {}
    for common in (True, False):
        for file in files:
            role = _role(file)
            if (role == "common") is not common:
                continue
            table = read_yaml(file, ROS_PARAMETERS)
            if table is None:
                continue
            if not isinstance(table, dict):
                raise ClearwayError(f"is {shown(table)}; a file of ROS parameters is a mapping", file=file)
            if (what := _something_else(table)) is not None:
                skipped[file] = what
                continue
            spaces = _COSTMAPS if common else (role,) if role is not None and role not in table else (None,)
            for space in spaces:
                _merge(tree, {space: table} if space else table, file, said, (), first=common)
    return RosFiles(tuple(f for f in files if f not in skipped), _plain(tree), skipped)


def _yamls(folder: Path) -> list[Path]:
    return sorted(f for f in folder.iterdir() if f.suffix in (".yaml", ".yml") and f.is_file())


def _role(file: Path) -> str | None:
    """Into which namespace a file goes by its name; None: as it is."""
    return next((role for role, name in _ROLES.items() if name.match(file.stem)), None)


def _chosen(files: list[Path], robot: str) -> list[Path]:
    """The files without those variants, told by what follows an underscore, that are of other robots."""
    words = re.split(r"[^a-z0-9]+", robot.lower())
    groups: dict[str, list[Path]] = {}
    for file in files:
        begun = [f for f in files if f != file and file.stem.startswith(f"{f.stem}_")]
        role = _role(file)
        name = _ROLES[role].match(file.stem) if role else re.match(r".*?_params(?=_|$)", file.stem)
        key = role or (name[0] if name else min((f.stem for f in begun), key=len, default=file.stem))
        groups.setdefault(key, []).append(file)
    found: list[Path] = []
    for group in groups.values():
        ends = {file: _variant(file) for file in group}
        own = [f for f in group if ends[f] and all(word in words for word in ends[f])]
        plain = [f for f in group if not ends[f]]
        took = own or plain or group
        if len(took) > 1:
            raise ClearwayError(
                f"has several files of a kind, {', '.join(f.name for f in took)}, and none is called after the robot {robot!r}; "
                f"name the one that is meant, and the others, as {took[0]}+OTHER.yaml",
                file=took[0].parent,
            )
        found += took
    return sorted(found)


def _variant(file: Path) -> list[str]:
    """The words behind what a file is of: those of a robot's name in `costmap_common_params_waffle_pi`."""
    role = _role(file)
    match = _ROLES[role].match(file.stem) if role else re.match(r".*?_params(?=_|$)", file.stem)
    return [] if match is None else [w for w in file.stem[match.end() :].lower().split("_") if w and w != "params"]


def _something_else(table: Mapping[str, Any]) -> str | None:
    """What a file holds that is none of move_base's; None: one of them."""
    if {"image", "resolution", "origin"} <= set(table):
        return "a map"
    if {"odom_model_type", "min_particles", "laser_model_type"} & set(table):
        return "parameters of amcl; those of the localiser stand in the robot's file, under [localisation.amcl]"
    if {"maxUrange", "particles", "linearUpdate"} & set(table):
        return "parameters of gmapping; those of the mapper stand in the robot's file, under [mapping]"
    return None


def _merge(
    tree: dict[str, Any],
    table: Mapping[Any, Any],
    file: Path,
    said: dict[tuple[str, ...], Path],
    above: tuple[str, ...],
    first: bool,
) -> None:
    """Put a file's parameters into the tree; what a common file says may be said again, by others it may not otherwise."""
    for key, value in table.items():
        name, at = str(key), (*above, str(key))
        if isinstance(value, dict) and isinstance(tree.get(name), dict):
            _merge(tree[name], value, file, said, at, first)
            continue
        before = said.get(at)
        if before is not None and before != file and tree.get(name) != value:
            raise ClearwayError(
                f"is {shown(value)}, and {tree[name]!r:.100} in {before}; name the files that the launch file loads, joined by +",
                file=file,
                field=".".join(at),
            )
        if not first:
            said[at] = file
        if isinstance(value, dict):
            tree[name] = {}
            _merge(tree[name], value, file, said, at, first)
        else:
            tree[name] = value


def _plain(value: Any) -> Any:
    """With the angles that rosparam computes, and without what a launch file puts into names."""
    if isinstance(value, dict):
        return {key: _plain(inside) for key, inside in value.items()}
    if isinstance(value, list):
        return [_plain(inside) for inside in value]
    if not isinstance(value, str):
        return value
    if (angle := _ANGLE.fullmatch(value[:100])) is not None:
        return math.radians(float(angle[2])) if angle[1] == "deg" else float(angle[2])
    return _ARGUMENT.sub("", value)
