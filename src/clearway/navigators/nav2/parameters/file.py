"""A user's file of ROS 2 parameters, by ROS's rules: which parameters each node is given.

A mapping named `ros__parameters` holds those of the node whose name is the path to it, which may have the wildcards `*` (one name)
and `**` (any number). Of several that match a node, the later in the file wins. `a: {b: 1}` and `a.b: 1` are one parameter. A list
holds words of one type. Read from ros2/rcl, rcl_yaml_param_parser/src/parse.c, and rclcpp/src/rclcpp/parameter_map.cpp.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from clearway.errors import ClearwayError, nearest, shown
from clearway.reading import read_ros_yaml

PARAMETERS = "ros__parameters"
_MEANT = re.compile(rb"\bros_+par\w*:")
"""`ros__parameters:` or a word that is likely to mean it."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_STAND_IN = re.compile(r"<[A-Za-z_]+>")
"""What nav2_bringup's ReplaceString puts a robot's namespace in place of, such as `<robot_namespace>`."""

Value = bool | int | float | str | tuple[bool | int | float | str, ...]


class Node(NamedTuple):
    """Parameters that a file gives to the nodes of a name.

    Attributes:
        name: With its namespace, from the root, as `/local_costmap/local_costmap`; it may have wildcards.
        values: Dotted name of a parameter -> its value; lists as tuples.
    """

    name: str
    values: dict[str, Value]

    @property
    def wild(self) -> bool:
        """Whether the name has wildcards."""
        return "*" in self.name

    def matches(self, node: str) -> bool:
        """Whether a node of the full name `node` is given these."""
        pattern = re.escape(self.name).replace(r"/\*\*", r"(?:/\w+)*").replace(r"/\*", r"/\w+")
        return re.fullmatch(pattern, node) is not None


def is_ros_parameters(path: Path) -> bool:
    """Whether a file, by its name a YAML, holds ROS 2 parameters, or is meant to where it can't be read."""
    try:
        return any(True for _ in _nodes(read_ros_yaml(path), path, ()))
    except ClearwayError:
        return path.is_file() and _MEANT.search(path.read_bytes()[: 1 << 20]) is not None


def read_nodes(path: Path) -> tuple[Node, ...]:
    """The nodes in a file, in its order.

    Raises:
        ClearwayError: it can't be read, isn't YAML, or isn't what rcl takes for parameters.
    """
    found = tuple(_nodes(read_ros_yaml(path), path, ()))
    if not found:
        raise ClearwayError(
            f"holds no ROS 2 parameters: no node has {PARAMETERS!r}, as in `controller_server: {PARAMETERS}: ...`",
            file=path,
        )
    return found


def merged(nodes: tuple[Node, ...], name: str) -> dict[str, Value]:
    """The parameters that the node of the full name `name` is given, by their dotted names."""
    return {key: value for node in nodes if node.matches(name) for key, value in node.values.items()}


def nested(values: dict[str, Value], file: Path | None = None) -> dict[str, Any]:
    """Dotted names as tables within each other.

    Raises:
        ClearwayError: a name is that of a value and of a namespace.
    """
    table: dict[str, Any] = {}
    for name, value in values.items():
        *spaces, last = name.split(".")
        here = table
        for k, space in enumerate(spaces):
            here = here.setdefault(space, {})
            if not isinstance(here, dict):
                raise _both(".".join(spaces[: k + 1]), file)
        if isinstance(here.get(last), dict):
            raise _both(name, file)
        here[last] = value
    return table


def _both(name: str, file: Path | None) -> ClearwayError:
    return ClearwayError("is a value and a namespace of others; one of the two is meant", file=file, field=name)


def _nodes(found: Any, file: Path, above: tuple[str, ...]) -> Iterator[Node]:
    """The nodes in a mapping that stands at `above`."""
    if not isinstance(found, dict):
        where = ".".join(above) or None
        raise ClearwayError(f"is {shown(found)}; a mapping of nodes to {PARAMETERS!r} is read", file=file, field=where)
    for key, value in found.items():
        if key == PARAMETERS:
            yield Node(_full_name(above, file), dict(_values(value or {}, file, above, ())))
        elif isinstance(value, dict) and PARAMETERS not in value and nearest(key, [PARAMETERS], 0.8):
            raise ClearwayError(
                f"ROS 2 has no such name; a node's parameters stand below `{PARAMETERS}:`, with two underscores",
                file=file,
                field=".".join((*above, key)),
            )
        elif isinstance(value, dict):
            yield from _nodes(value, file, (*above, key))
        else:
            raise ClearwayError(
                f"is {shown(value)} before {PARAMETERS!r}; a node's parameters stand below `{PARAMETERS}:`",
                file=file,
                field=".".join((*above, key)),
            )


def _full_name(above: tuple[str, ...], file: Path) -> str:
    parts = [part for part in "/".join(above).split("/") if part and not _STAND_IN.fullmatch(part)]
    if not parts:
        raise ClearwayError(f"stands outside of any node; write `controller_server: {PARAMETERS}: ...`", file=file)
    for part in parts:
        if part not in ("*", "**") and not _NAME.fullmatch(part):
            raise ClearwayError(
                f"{part!r} is no name of a node or namespace: letters, digits and _, or one of the wildcards * and **",
                file=file,
                field=".".join(above),
            )
    return "/" + "/".join(parts)


def _values(table: Any, file: Path, node: tuple[str, ...], above: tuple[str, ...]) -> Iterator[tuple[str, Value]]:
    where = (*node, *above)
    if not isinstance(table, dict):
        raise ClearwayError(f"is {shown(table)}, not parameters", file=file, field=".".join((*where, PARAMETERS)))
    for key, value in table.items():
        name = ".".join((*above, key))
        field = ".".join((*where, key))
        if isinstance(value, dict):
            yield from _values(value, file, node, (*above, key))
        elif value is None:
            raise ClearwayError("has no value; ROS refuses that", file=file, field=field)
        elif isinstance(value, list):
            yield name, _list(value, file, field)
        else:
            yield name, value


def _list(value: list[Any], file: Path, field: str) -> tuple[bool | int | float | str, ...]:
    for n, item in enumerate(value):
        if not isinstance(item, bool | int | float | str):
            raise ClearwayError(
                f"is {shown(item)}; ROS's lists hold words and numbers only (points stand in a text: "
                '"[[0.1, 0.1], [0.1, -0.1], ...]")',
                file=file,
                field=f"{field}.{n}",
            )
        if type(item) is not type(value[0]):
            raise ClearwayError(
                f"{shown(value)} mixes {_kind(value[0])} with {_kind(item)}, which ROS refuses: "
                + (
                    "write each number with a point, as 0.0"
                    if {type(item), type(value[0])} == {int, float}
                    else "use one type"
                ),
                file=file,
                field=field,
            )
    return tuple(value)


def _kind(value: object) -> str:
    return KINDS[type(value)]


KINDS = {bool: "a bool", int: "an integer", float: "a double", str: "a string", tuple: "a list"}
"""ROS's types, in words."""
