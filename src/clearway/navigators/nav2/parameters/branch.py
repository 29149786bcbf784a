"""A namespace of parameters with its values: what a server or plug-in is given."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import ValidationError

from clearway.errors import ClearwayError, shown
from clearway.navigators.nav2.parameters.file import KINDS
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.parameters.outline import WrittenAs
from clearway.validation import first_problem

_SUBSTITUTION = re.compile(r"\$\(.*\)|<[A-Za-z_]+>")
_PLACEHOLDER = re.compile(r"[A-Z][A-Z0-9]*(_[A-Z0-9]+)+")


@dataclass(frozen=True, slots=True)
class Branch:
    """A namespace and those inside it.

    Attributes:
        group: Its values.
        children: The namespaces inside it by their names, in the order of the lists that name them.
        table: Its parameters as they were given, as tables within each other.
        unread: The namespaces inside it that are asked for and that nothing reads; what is wrong with them was collected.
        told: Whether it could be told which namespaces are asked for: no list or text among its values was wrong.
        beside: The namespace inside it whose parameters stand among its own.
    """

    group: Group
    children: Mapping[str, Branch]
    table: Mapping[str, Any]
    unread: frozenset[str] = frozenset()
    told: bool = True
    beside: str | None = None

    @property
    def neighbour(self) -> Branch | None:
        """The branch of `beside`; None: there is none, or nothing reads it."""
        return None if self.beside is None else self.children.get(self.beside)


def settle(
    kind: type[Group],
    table: Mapping[str, Any],
    where: str,
    file: Path | None,
    faults: list[ClearwayError] | None = None,
) -> Branch:
    """The values of a namespace, and of those inside it.

    Args:
        kind: What reads it.
        table: Its parameters.
        where: Its dotted name, for messages.
        file: They stand in, likewise.
        faults: Is given all that is wrong, each value of which is left at its default; None: the first of it is raised.

    Raises:
        ClearwayError: a value is of another type than ROS has, or out of bounds, or a plug-in is not there.
    """

    def fault(problem: str, name: str | None, cause: Exception | None = None) -> None:
        error = ClearwayError(problem, file=file, field=f"{where}.{name}" if name else where)
        if faults is None:
            raise error from cause
        if str(error) not in map(str, faults):  # two may read one value
            faults.append(error)

    given: dict[str, Any] = {}
    wrong: set[str] = set()
    for name, field in kind.model_fields.items():
        if name not in table or is_filled_in_at_launch(kind, name, table[name]):
            continue
        value, allowed = table[name], _kinds(field.annotation, field.metadata)
        inside = _group_in(field.annotation)
        if isinstance(value, dict) and inside is not None:
            given[name] = settle(inside, value, f"{where}.{name}", file, faults).group
        elif isinstance(value, dict):
            wrong.add(name)
            fault("is a value, and the file has a namespace of that name", name)
        elif allowed and type(value) not in allowed:
            wrong.add(name)
            fault(_wrong_type(value, allowed), name)
        else:
            given[name] = value
    group = kind.model_construct()
    while True:
        try:
            group = kind.model_validate(given)
        except ValidationError as error:
            problem = first_problem(error, kind)
            first = (problem.field or "").partition(".")[0]
            if first not in wrong:  # else it is only missing since
                fault(problem.problem, problem.field, error)
            if first in given:
                wrong.add(first)
                del given[first]
                continue
        break
    right = {name: value for name, value in table.items() if name not in wrong}
    children, beside = kind.children(right), kind.beside(right)
    spaces = {}
    for name, what in children.items():
        space = table.get(name, {})
        if isinstance(what, ClearwayError):
            fault(what.problem, what.field)
        elif name == beside:
            spaces[name] = settle(what, {k: v for k, v in table.items() if k != name}, where, file, faults)
        elif isinstance(space, dict):
            spaces[name] = settle(what, space, f"{where}.{name}", file, faults)
        else:
            fault(f"is {shown(space)}, and the parameters of a plug-in stand there", name)
    listing = {
        name for name in wrong if _kinds((field := kind.model_fields[name]).annotation, field.metadata) & {tuple, str}
    }
    return Branch(group, spaces, table, frozenset(children) - frozenset(spaces), told=not listing, beside=beside)


def is_filled_in_at_launch(kind: type[Group], name: str, value: object) -> bool:
    """Whether a text stands where a launch file puts something else: `$(var x)`, `<robot_namespace>`, `KEEPOUT_ZONE_ENABLED`.

    A text that is to be a text, such as the path of a tree, is none: who reads it knows what to do with it.
    """
    field = kind.model_fields[name]
    allowed = _kinds(field.annotation, field.metadata)
    if not isinstance(value, str) or str in allowed:
        return False
    return _SUBSTITUTION.search(value) is not None or _PLACEHOLDER.fullmatch(value) is not None


def _wrong_type(value: object, allowed: frozenset[type]) -> str:
    wanted = " or ".join(sorted(KINDS[kind] for kind in allowed))
    right = f"; write {float(value)!r}" if type(value) is int and allowed == {float} else ""
    return f"is {shown(value)}, {KINDS[type(value)]}; ROS takes {wanted} here and nothing else{right}"


def _group_in(annotation: Any) -> type[Group] | None:
    found = [a for a in (annotation, *get_args(annotation)) if isinstance(a, type) and issubclass(a, Group)]
    return found[0] if found else None


def _kinds(annotation: Any, metadata: list[Any] | tuple[Any, ...] = ()) -> frozenset[type]:
    """The types that ROS's file may have for a field; empty: any."""
    return frozenset(_each_kind(annotation, metadata))


def _each_kind(annotation: Any, metadata: Any) -> Iterator[type]:
    written = [m.kind for m in metadata if isinstance(m, WrittenAs)]
    origin = get_origin(annotation)
    if written:
        yield written[0]
    elif origin is Annotated:
        inner, *notes = get_args(annotation)
        yield from _each_kind(inner, notes)
    elif origin in (Union, UnionType):
        for part in get_args(annotation):
            yield from _each_kind(part, ())
    elif origin is Literal:
        yield from (type(value) for value in get_args(annotation))
    elif origin in (tuple, list) or annotation in (tuple, list):
        yield tuple
    elif annotation in (bool, int, float, str):
        yield annotation
    elif isinstance(annotation, type) and issubclass(annotation, str):
        yield str
    elif annotation is not NoneType and not (isinstance(annotation, type) and issubclass(annotation, Group)):
        return
