"""Single values in the text of a YAML file, changed where they stand: everything else of it, comments too, stays as it is."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from clearway.errors import ClearwayError, unknown
from clearway.navigators.nav2.parameters.file import PARAMETERS
from clearway.reading import ros_word
from clearway.reading.limits import ROS_PARAMETERS


def scalars(path: Path) -> dict[str, list[Any]]:
    """The plain values of a file by their dotted names, without ROS 2's `ros__parameters`; where one stands twice, both.

    Raises:
        ClearwayError: it can't be read, or is no YAML.
    """
    try:
        if path.stat().st_size > ROS_PARAMETERS:
            raise ClearwayError(f"is longer than the {ROS_PARAMETERS} bytes that are read", file=path)
        root = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise ClearwayError(f"no YAML that can be read: {' '.join(str(error).split())[:200]}", file=path) from error
    found: dict[str, list[Any]] = {}
    for name, node in _leaves(root, ()):
        found.setdefault(name, []).append(node)
    return found


def value_of(node: Any) -> Any:
    """What a plain value is in Python."""
    return ros_word(node.value) if node.style is None else node.value


def only(found: Mapping[str, list[Any]], name: str, file: object) -> Any:
    """The one value of that name.

    Raises:
        ClearwayError: there is none, or there are several.
    """
    if name not in found:
        raise unknown("parameter", name, found, file=file)
    if len(found[name]) > 1:
        raise ClearwayError("stands there more than once; which one is meant?", file=file, field=name)
    return found[name][0]


def changed(path: Path, values: Mapping[str, Any], head: str = "") -> str:
    """The text of a file with other values, under a first line `head`.

    Args:
        path: The file.
        values: By their dotted names.
        head: A comment; empty: none.

    Raises:
        ClearwayError: as for `scalars` and `only`.
    """
    text, found = path.read_text(encoding="utf-8"), scalars(path)
    places = [(only(found, name, path), value) for name, value in values.items()]
    for node, value in sorted(places, key=lambda place: -place[0].start_mark.index):
        text = f"{text[: node.start_mark.index]}{json.dumps(value)}{text[node.end_mark.index :]}"
    return f"{head}\n{text}" if head else text


def _leaves(node: Any, above: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    if isinstance(node, yaml.MappingNode) and len(above) < 64:
        for key, value in node.value:
            part = () if key.value == PARAMETERS else (str(key.value),)
            yield from _leaves(value, (*above, *part))
    elif isinstance(node, yaml.ScalarNode):
        yield ".".join(above).strip("/"), node
