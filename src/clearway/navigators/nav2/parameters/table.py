"""What becomes of each parameter of a user's Nav2 file, told from the groups that read them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from pathlib import Path
from typing import Any, cast

from clearway.errors import ClearwayError, nearest, shown, unknown
from clearway.navigators.common.parameter_table import ParameterTable, Row, Status, as_written, did_you_mean
from clearway.navigators.nav2.behavior_tree import defaults
from clearway.navigators.nav2.behavior_tree.reader import Trees, asked
from clearway.navigators.nav2.parameters.branch import Branch, is_filled_in_at_launch, settle
from clearway.navigators.nav2.parameters.costmaps import Costmap
from clearway.navigators.nav2.parameters.file import PARAMETERS, Node, read_nodes
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.parameters.heights import with_heights
from clearway.navigators.nav2.parameters.ignored import AMCL, EVERYWHERE, NODES
from clearway.navigators.nav2.parameters.nav2_parameters import (
    ALL,
    ASKED,
    Parameters,
    namespace,
    read,
    reader_of,
    tables_of,
)
from clearway.navigators.nav2.parameters.servers import BtNavigator
from clearway.navigators.nav2.presets.preset import TABLE, own_tables
from clearway.navigators.nav2.route_server import read_routes
from clearway.robots import Robot

ABOUT = "defaults are those of Nav2's branch main (a3a97043), and where jazzy's differ they are shown"
_ORDER: tuple[Status, ...] = ("read", "default", "missing", "ignored", "unknown")


def table(path: Path, robot: Robot | None = None) -> ParameterTable:
    """What becomes of the parameters in a file of ROS 2 parameters.

    Args:
        path: The file.
        robot: Who would drive with it, by whose lidar the costmaps' heights are judged; None: nobody in particular.

    Raises:
        ClearwayError: it can't be read, or isn't what rcl takes for parameters.
    """
    nodes = read_nodes(path)
    space = namespace(nodes, path)
    rows: list[Row] = []
    problems: list[ClearwayError] = []
    shared: dict[str, Row] = {}
    known: list[str] = []
    renamed: dict[str, str] = {}
    tables = tables_of(nodes, path)
    unasked = ASKED.keys() - _asked(tables.get("bt_navigator", {}), path)
    tables |= {server: {} for server in ASKED if server not in unasked and server not in tables}
    for server, given in tables.items():
        if server in unasked:
            continue
        full = space + ALL[server][0]
        own = {name for node in nodes if not node.wild and node.matches(full) for name in node.values}
        before = len(problems)
        branch = settle(reader_of(server), given, server, path, problems)
        known += _names(branch)
        renamed |= _all(type(branch.group), "RENAMED")
        told = rows_of(branch, "")
        if isinstance(branch.group, Costmap):
            told = with_heights(told, branch, robot)
        for row in told:
            if any(name == row.name or name.startswith(f"{row.name}.") for name in own) or row.status == "default":
                rows.append(row._replace(name=f"{server}.{row.name}"))
            else:  # of a wildcard: what any server reads is read
                other = shared.get(row.name)
                if other is None or _ORDER.index(row.status) < _ORDER.index(other.status):
                    shared[row.name] = row
        if isinstance(branch.group, BtNavigator) and isinstance(error := _tree(branch.group, path), ClearwayError):
            problems.append(error)
            rows = [row for row in rows if row.name != f"{server}.default_nav_to_pose_bt_xml"]
        if server == "route_server" and len(problems) == before:
            problems += _wrong_routes(branch, path)
    for name in [name for name in shared if any(other.startswith(f"{name}.") for other in shared)]:
        del shared[name]  # what is inside it is read by another server
    for name, row in shared.items():
        if row.status == "unknown" and "." not in name:  # each server that doesn't read it knew its own names alone
            shared[name] = row._replace(note=_called(renamed[name]) if name in renamed else did_you_mean(name, known))
    rows += [row._replace(name=f"{_wild_name(nodes, row.name)}.{row.name}") for row in shared.values()]
    wrong = {problem.field for problem in problems}
    rows = [row for row in rows if row.name not in wrong]
    rows += [row for node in nodes for row in _of_other_node(node, space, unasked)]
    return ParameterTable(str(path), ABOUT, tuple(rows), tuple(problems))


def read_own(robot: Robot, *, mapped: bool) -> Parameters:
    """What Nav2 is given for `robot` by itself: its preset, with what the robot's file says otherwise, all of which must be read.

    Raises:
        ClearwayError: something in the robot's file is wrong, or nothing reads it.
    """
    file, where = f"robot {robot.name}", f"navigators.{TABLE}"
    own = own_tables(robot)
    for server, table in own.items():
        if server not in ALL:
            raise unknown("server of Nav2", server, ALL, file=file, field=f"{where}.{server}")
        if not isinstance(table, dict):
            raise ClearwayError(f"is {shown(table)}; must be a table", file=file, field=f"{where}.{server}")
    try:
        found = read(None, robot, mapped=mapped)
        tree = cast("BtNavigator", found.bt_navigator.group).default_nav_to_pose_bt_xml
        if tree.rpartition("/")[2].removesuffix(".xml") not in ("", *defaults.names()):
            raise ClearwayError(
                "a robot's file names none but trees that Nav2 ships; give one of its own to a file of parameters, for nav2[params=FILE]",
                field="bt_navigator.default_nav_to_pose_bt_xml",
            )
        found = found.for_tree(asked(defaults.named(tree, None)))
        if found.route_server is not None:
            raise ClearwayError(
                "it asks for routes, whose graph a file of parameters has to name, for nav2[params=FILE]",
                field="bt_navigator.default_nav_to_pose_bt_xml",
            )
    except ClearwayError as error:
        if not own:
            raise
        raise ClearwayError(error.problem, file=file, field=f"{where}.{error.field}") from error
    for server in own:
        if getattr(found, server) is None:
            problem = "nothing reads it: the behaviour tree doesn't ask for this server"
            raise ClearwayError(problem, file=file, field=f"{where}.{server}")
        for row in rows_of(getattr(found, server), f"{where}.{server}."):
            if row.status in ("missing", "unknown"):
                raise ClearwayError(f"nothing reads it: {row.note}", file=file, field=row.name)
    return found


def _tree(group: BtNavigator, path: Path) -> Trees | ClearwayError:
    """The behaviour tree that a file names, or what is wrong with it."""
    try:
        return defaults.named(group.default_nav_to_pose_bt_xml, path)
    except ClearwayError as error:
        return error


def _wrong_routes(branch: Branch, path: Path) -> list[ClearwayError]:
    """What is wrong with the graph of routes that a file names."""
    try:
        read_routes(branch, path)
    except ClearwayError as error:
        return [error]
    return []


def _asked(table: Mapping[str, Any], path: Path) -> frozenset[str]:
    """The servers for which the tree asks that `table`, the tree's parameters, names."""
    group = settle(BtNavigator, table, "bt_navigator", path, []).group
    tree = _tree(cast("BtNavigator", group), path)
    return frozenset() if isinstance(tree, ClearwayError) else asked(tree)


def _wild_name(nodes: tuple[Node, ...], name: str) -> str:
    return next(
        (n.name for n in reversed(nodes) if n.wild and any(v == name or v.startswith(f"{name}.") for v in n.values)),
        "/**",
    )


def rows_of(branch: Branch, above: str) -> Iterator[Row]:
    """The rows of a namespace and of those inside it.

    Args:
        branch: The namespace.
        above: What stands before their names, with the dot.
    """
    for name, value in branch.table.items():
        yield from _of_name(branch, name, value, above)
    yield from _of_jazzy(branch, above)


def _of_name(branch: Branch, name: str, value: Any, above: str, also: Iterable[str] = ()) -> Iterator[Row]:
    """The rows of one name in a namespace, or of all that is inside it.

    Args:
        branch: The namespace.
        name: In its table.
        value: It has there.
        above: What stands before the name, with the dot.
        also: Names of the namespace among whose parameters these stand, to be meant by a misspelt one.
    """
    kind, here = type(branch.group), f"{above}{name}"
    ignored, missing, renamed = (_all(kind, what) for what in ("IGNORED", "MISSING", "RENAMED"))
    if name == branch.beside:
        yield Row("read", here, as_written(value), note="as up to kilted: its own parameters stand beside it")
    elif name in branch.children:
        yield from rows_of(branch.children[name], f"{here}.")
    elif name in kind.model_fields:
        yield from _of_field(branch, name, here, missing)
    elif name == "plugin":
        yield Row("read", here, as_written(value))
    elif name in EVERYWHERE or name in ignored:
        yield Row("ignored", here, _short(value), note=ignored.get(name) or EVERYWHERE[name])
    elif name in missing:
        yield Row("missing", here, _short(value), note=_closest(missing[name]))
    elif name in renamed:
        yield Row("unknown", here, _short(value), note=_called(renamed[name]))
    elif branch.neighbour is not None:
        yield from _of_name(branch.neighbour, name, value, above, _names(branch))
    elif name in branch.unread or branch.beside in branch.unread or (isinstance(value, dict) and not branch.told):
        yield Row("missing", here, _short(value), note="what would read it is not there: see the problem of that")
    else:
        yield _unknown(branch, name, value, here, also)


def _of_jazzy(branch: Branch, above: str) -> Iterator[Row]:
    """The rows of what is not in the file and has another default in jazzy."""
    kind = type(branch.group)
    for name, value in _all(kind, "JAZZY").items():
        if _at(branch.table, name) is None and name in kind.model_fields:
            default = as_written(kind.model_fields[name].get_default(call_default_factory=True))
            yield Row("default", f"{above}{name}", default, note=f"jazzy has {as_written(value)}")
        elif name.endswith(".plugin") and _at(branch.table, name) is None and name.partition(".")[0] in branch.children:
            yield Row("default", f"{above}{name}", note=f"main's own holds; jazzy has {value}")
    if branch.neighbour is not None:
        yield from _of_jazzy(branch.neighbour, above)


def _of_field(branch: Branch, name: str, here: str, missing: Mapping[str, str]) -> Iterator[Row]:
    kind, value = type(branch.group), branch.table[name]
    field = kind.model_fields[name]
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    held = getattr(branch.group, name, value)  # what must be given has no value where something else is wrong
    if isinstance(value, dict) and isinstance(held, Group):
        yield from rows_of(Branch(held, {}, value), f"{here}.")
    elif is_filled_in_at_launch(kind, name, value):
        yield Row(
            "ignored",
            here,
            as_written(value),
            note=f"a launch file puts a value in its place; {as_written(default)} holds",
        )
    elif of := [v for v in (value if isinstance(value, tuple) else (value,)) if isinstance(v, str) and v in missing]:
        yield Row("missing", here, as_written(value), note=f"{of[0]} is not built; {_closest(missing[of[0]])}")
    else:
        usual = "" if held == default or default in ((), None, "") else as_written(default)
        yield Row("read", here, as_written(value), usual, _all(kind, "NOTES").get(name, ""))


def _names(branch: Branch) -> list[str]:
    """What a misspelt name may mean."""
    kind = type(branch.group)
    return [*kind.model_fields, *branch.children, *branch.unread, *_all(kind, "IGNORED")]


def _unknown(branch: Branch, name: str, value: Any, here: str, also: Iterable[str]) -> Row:
    """A name that nothing reads: a namespace that no list names, or one that is misspelt."""
    kind, asked = type(branch.group), [*branch.children, *branch.unread]
    known = [*_names(branch), *also]
    if isinstance(value, dict):
        ignored = _all(kind, "IGNORED")
        for other, listed in branch.table.items():
            if other in ignored and isinstance(listed, tuple) and name in listed:
                return Row("ignored", here, _short(value), note=ignored[other])
        for other in branch.unread:
            if name in kind.OFFERED and nearest(other, kind.OFFERED) == name:
                note = f"the list has {other!r} in its place: see the problem of that"
                return Row("missing", here, _short(value), note=note)
        absent = [child for child in asked if child not in branch.table and name not in kind.OFFERED]
        if not nearest(name, absent, 0.75):
            return Row(
                "ignored",
                here,
                _short(value),
                note="nothing names it: it stands in no list of plug-ins, sources or the like",
            )
        known = absent
    return Row("unknown", here, _short(value), note=did_you_mean(name, known))


def _of_other_node(node: Node, space: str, unasked: Set[str]) -> Iterator[Row]:
    """The rows of a node that is none of those that are started, or of a wildcard that matches none of them."""
    started = (full for server, (full, _) in ALL.items() if server not in unasked)
    built = {full.rsplit("/", 1)[-1]: space + full for full in started}
    if any(node.matches(full) for full in built.values()):
        return
    name = node.name.rsplit("/", 1)[-1]
    count = f"{len(node.values)} parameter{'s' if len(node.values) != 1 else ''}"
    shown = node.name if node.wild else node.name.removeprefix(space).lstrip("/").replace("/", ".")
    known = [*built, *NODES]
    close = name if name in known else nearest(name, known, 0.8)
    if node.wild and (close or "*" in name) and not (name in NODES and node.matches(f"{space}/{name}")):
        meant = f"/**/{close}" if close else "/**"
        yield Row("unknown", shown, count, note=f"matches no node; did you mean {meant!r}?")
    elif name in NODES:
        if name != "amcl":
            yield Row("ignored", shown, count, note=NODES[name])
            return
        for key, value in node.values.items():
            where = f"; the robot's file says it: [localisation.amcl] {AMCL[key]}" if key in AMCL else ""
            yield Row("ignored", f"{shown}.{key}", as_written(value), note=f"{NODES[name]}{where}")
    elif close:
        full = built.get(close, close).removeprefix(space).lstrip("/").replace("/", ".")
        if full == f"{shown}.{shown}":
            meant = f"its node is {full!r}: write the name twice, `{shown}: {shown}: {PARAMETERS}: ...`"
        else:
            meant = f"no node of Nav2 has that name; did you mean {full!r}?"
        yield Row("unknown", shown, count, note=meant)
    else:
        yield Row("ignored", shown, count, note="no node of Nav2's navigation")


def _all(kind: type[Group], what: str) -> dict[str, Any]:
    """A class variable of a group with those of the groups that it is made from."""
    found: dict[str, Any] = {}
    for base in reversed(kind.__mro__):
        found |= vars(base).get(what, {})
    return found


def _called(now: str) -> str:
    return f"is called {now!r} now; the old name does nothing"


def _closest(what: str) -> str:
    """What is closest, which may be a name or a sentence."""
    return what if " " in what else f"closest is {what}"


def _at(table: Mapping[str, Any], name: str) -> Any:
    here: Any = table
    for step in name.split("."):
        here = here.get(step) if isinstance(here, Mapping) else None
    return here


def _short(value: Any) -> str:
    if isinstance(value, dict):
        count = len(_leaves(value))
        return f"{count} parameter{'s' if count != 1 else ''}"
    return as_written(value)


def _leaves(value: dict[str, Any]) -> list[Any]:
    return [leaf for inside in value.values() for leaf in (_leaves(inside) if isinstance(inside, dict) else [inside])]
