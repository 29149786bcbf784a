"""Behaviour trees from XML: what a file of BehaviorTree.CPP's format holds, checked, as plain descriptions.

Nothing in the file is executed: scripts and pre- or postconditions are not read but refused.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from clearway.errors import ClearwayError, unknown
from clearway.navigators.nav2.behavior_tree.actions import ACTIONS
from clearway.navigators.nav2.behavior_tree.conditions import CONDITIONS
from clearway.navigators.nav2.behavior_tree.flow import FLOW, SubTree
from clearway.navigators.nav2.behavior_tree.nav2_flow import NAV2_FLOW
from clearway.navigators.nav2.behavior_tree.nodes import Blackboard, Control, Decorator, Key, Node, TreeError
from clearway.navigators.nav2.behavior_tree.poses import POSES
from clearway.navigators.nav2.behavior_tree.routes import ROUTES
from clearway.navigators.nav2.behavior_tree.servers import Servers
from clearway.reading import limits
from clearway.reading.bounded import read_bytes

KINDS: dict[str, type[Node]] = (
    FLOW | NAV2_FLOW | CONDITIONS | ACTIONS | POSES | ROUTES | {"IsPathValid": ACTIONS["ValidatePath"]}
)
"""Types of nodes by their names in XML; IsPathValid is jazzy's name."""

MISSING: dict[str, str] = {
    "NavigateToPose": "ComputePathToPose and FollowPath",
    "NavigateThroughPoses": "ComputePathToPose and FollowPath",
    "RemoveInCollisionGoals": "nothing: a leg has one goal",
    "CheckPoseOccupancy": "ValidatePath",
    "CheckStopStatus": "Wait",
    "ClearCostmapAroundPose": "ClearCostmapAroundRobot",
    "PauseResumeController": "nothing: take its child, nobody pauses the robot",
    "FollowObject": "FollowPath",
    "CancelFollowObject": "CancelControl",
    "DockRobot": "nothing: there are no docks",
    "UndockRobot": "nothing: there are no docks",
    "AssistedTeleop": "Wait",
    "CancelAssistedTeleop": "CancelWait",
    "Parallel": "NonblockingSequence",
    "ParallelAll": "NonblockingSequence",
    "AsyncSequence": "Sequence",
    "AsyncFallback": "Fallback",
    "SequenceStar": "SequenceWithMemory",
    "SubTreePlus": "SubTree with _autoremap",
    "IsStuck": "the progress checker of the controller server",
    "IsBatteryLow": "AlwaysFailure",
    "IsBatteryCharging": "AlwaysFailure",
    "InitialPoseReceived": "AlwaysSuccess",
    "TransformAvailable": "AlwaysSuccess",
    "Script": "nothing: scripts are not run",
    "ScriptCondition": "nothing: scripts are not run",
    "Timeout": "time_allowance of the behaviours",
    "Delay": "Wait",
    "ComputeAndTrackRoute": "ComputeRoute",
    "CancelComputeAndTrackRoute": "CancelControl",
    "PersistentSequence": "SequenceWithMemory",
    "ToggleCollisionMonitor": "AlwaysSuccess",
    "ReinitializeGlobalLocalization": "AlwaysSuccess",
}
"""Types of nodes of Nav2 or of BehaviorTree.CPP that are not built, and what is closest."""

_WRITTEN = frozenset({"Action", "Condition", "Control", "Decorator"})
_SCRIPTS = frozenset(
    {"_skipIf", "_failureIf", "_successIf", "_while", "_onSuccess", "_onFailure", "_onHalted", "_post"}
)


class Spec(NamedTuple):
    """A node as it is written.

    Attributes:
        kind: Its type.
        ports: Its attributes but for its name.
        children: Those below it.
        name: By which messages call it.
    """

    kind: str
    ports: dict[str, str]
    children: tuple[Spec, ...]
    name: str = ""


class Trees(NamedTuple):
    """Trees that go together.

    Attributes:
        main: Which of them is run.
        trees: By their IDs.
        source: Where they stand, for messages.
    """

    main: str
    trees: dict[str, Spec]
    source: str


def node(kind: str, *children: Spec, **ports: str) -> Spec:
    """A node, written in Python."""
    return Spec(kind, ports, children, kind)


def read_trees(path: str | Path) -> Trees:
    """The trees of an XML file.

    Raises:
        ClearwayError: It can't be read, is not such a file, or asks for a node that is not there.
    """
    raw = read_bytes(Path(path), limits.YAML)
    try:
        return parse_trees(raw.decode("utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        raise ClearwayError(f"not UTF-8 at byte {error.start}", file=path) from error


def parse_trees(text: str, source: str) -> Trees:
    """The trees of a text of XML; `source` is what messages call it.

    Raises:
        ClearwayError: It is not such a text, or asks for a node that is not there.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ClearwayError("a behaviour tree has no document type and no entities; take <!...> out", file=source)
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ClearwayError(f"not XML: {error}", file=source) from error
    if root.tag != "root":
        raise ClearwayError(f"its outermost element is <{root.tag}>; a behaviour tree has <root>", file=source)
    trees: dict[str, Spec] = {}
    for element in root:
        if element.tag == "include":
            raise ClearwayError("<include> is not followed; write the tree into this file", file=source)
        if element.tag != "BehaviorTree":
            continue
        name = element.get("ID", "")
        if name in trees:
            raise ClearwayError(f"two trees have the ID {name!r}", file=source)
        if len(element) != 1:
            raise ClearwayError(f"the tree {name!r} has {len(element)} outermost nodes; it has one", file=source)
        trees[name] = _read(element[0], source, 1)
    main = root.get("main_tree_to_execute") or (next(iter(trees)) if len(trees) == 1 else None)
    if main is None:
        raise ClearwayError(
            f"has {len(trees)} trees and no main_tree_to_execute" if trees else "has no <BehaviorTree>", file=source
        )
    if main not in trees:
        raise unknown("tree", main, trees, file=source, field="main_tree_to_execute")
    found = Trees(main, trees, source)
    for tree in trees.values():
        check(tree, found)
    _bounded(found)
    return found


def _too_deep(source: str) -> ClearwayError:
    """The error that tells of more levels than are taken."""
    return ClearwayError(f"nodes stand deeper in each other than {limits.NESTING}", file=source)


def _read(element: ElementTree.Element, source: str, depth: int) -> Spec:
    if depth > limits.NESTING:
        raise _too_deep(source)
    kind, ports = element.tag, dict(element.attrib)
    if kind in _WRITTEN:  # the explicit notation: <Action ID="Spin"/>
        kind = ports.pop("ID", "")
    children = tuple(_read(child, source, depth + 1) for child in element)
    return Spec(kind, ports, children, ports.pop("name", kind))


def check(spec: Spec, trees: Trees) -> None:
    """See that a node and those below it can be built.

    Raises:
        ClearwayError: They can't.
    """
    for attribute in spec.ports:
        if attribute in _SCRIPTS:
            raise ClearwayError(
                f"{attribute}={spec.ports[attribute]!r} of {spec.kind} {spec.name!r} is a script; none is run",
                file=trees.source,
            )
    if spec.kind == "SubTree":
        if spec.ports.get("ID", "") not in trees.trees:
            raise unknown("tree", spec.ports.get("ID", ""), trees.trees, file=trees.source, field="SubTree")
        return
    if spec.kind not in KINDS:
        if spec.kind in MISSING:
            raise ClearwayError(
                f"the node type {spec.kind!r} (of {spec.name!r}) is not built here; closest: {MISSING[spec.kind]}",
                file=trees.source,
            )
        raise unknown("node type", spec.kind, KINDS, file=trees.source)
    kind = KINDS[spec.kind]
    least = 1 if issubclass(kind, Control) else 0
    most = len(spec.children) if issubclass(kind, Control) and not issubclass(kind, Decorator) else least
    if spec.kind == "RecoveryNode":
        least = most = 2
    if not least <= len(spec.children) <= most:
        raise ClearwayError(
            f"{spec.kind} {spec.name!r} has {len(spec.children)} children; it takes {least or 'none'}",
            file=trees.source,
        )
    _ports(spec, kind, trees.source)
    for child in spec.children:
        check(child, trees)


def _ports(spec: Spec, kind: type[Node], source: str) -> dict[str, Any]:
    """The attributes of a node, read."""
    given: dict[str, Any] = {}
    for attribute, text in spec.ports.items():
        if attribute.startswith("_"):
            continue
        if attribute not in kind.PORTS:
            raise unknown("attribute", attribute, kind.PORTS, file=source, field=f"{spec.kind} {spec.name!r}")
        port = kind.PORTS[attribute]
        if text.startswith("{") and text.endswith("}"):
            name = text[1:-1].strip()
            given[attribute] = Key(attribute if name == "=" else name)
            continue
        if port.kind is None:
            if text:  # an empty attribute is none
                raise ClearwayError(
                    f"is {text!r}; it takes a name of the blackboard, such as {{{attribute}}}",
                    file=source,
                    field=f"{spec.kind} {spec.name!r}: {attribute}",
                )
            continue
        read, words = port.kind
        try:
            given[attribute] = read(text)
        except (ValueError, KeyError) as error:
            raise ClearwayError(
                f"is {text!r}; it is to be {words}", file=source, field=f"{spec.kind} {spec.name!r}: {attribute}"
            ) from error
    if problem := kind.wrong(given):
        raise ClearwayError(problem, file=source, field=f"{spec.kind} {spec.name!r}")
    return given


def _bounded(trees: Trees) -> None:
    """See that the main tree can be built: no tree stands in itself, and what subtrees are written out to stays small.

    Raises:
        ClearwayError: It doesn't.
    """
    known: dict[str, tuple[int, int]] = {}  # of each tree how many nodes it has, and how deep they stand

    def measured(name: str, above: tuple[str, ...]) -> tuple[int, int]:
        if name in above:
            raise ClearwayError(f"the tree {name!r} stands in itself ({' > '.join((*above, name))})", file=trees.source)
        if len(above) >= limits.NESTING:
            raise _too_deep(trees.source)
        if name not in known:
            known[name] = inside(trees.trees[name], (*above, name))
        return known[name]

    def inside(spec: Spec, above: tuple[str, ...]) -> tuple[int, int]:
        if spec.kind == "SubTree":
            below = [measured(spec.ports["ID"], above)]
        else:
            below = [inside(child, above) for child in spec.children]
        return 1 + sum(nodes for nodes, _ in below), 1 + max((depth for _, depth in below), default=0)

    nodes, depth = measured(trees.main, ())
    if depth > limits.NESTING:
        raise _too_deep(trees.source)
    if nodes > limits.TREE_NODES:
        raise ClearwayError(
            f"has {nodes:,} nodes once its subtrees are written out; at most {limits.TREE_NODES:,} are taken",
            file=trees.source,
        )


def asked(trees: Trees) -> frozenset[str]:
    """The servers that the main tree asks, of those that are started only for such a tree."""
    found: set[str] = set()
    seen, left = {trees.main}, [trees.trees[trees.main]]
    while left:
        spec = left.pop()
        left += spec.children
        if spec.kind != "SubTree":
            found.add(KINDS[spec.kind].SERVER)
        elif (name := spec.ports["ID"]) not in seen:
            seen.add(name)
            left.append(trees.trees[name])
    return frozenset(found - {""})


def build(trees: Trees, board: Blackboard, servers: Servers, *, wrap_around: bool = False) -> Node:
    """The main tree, ready to be ticked.

    Args:
        trees: What is built.
        board: The main tree's blackboard.
        servers: What its leaves ask.
        wrap_around: What a RoundRobin does that doesn't say: begin anew behind its last child, as up to `jazzy`.
    """

    def made(spec: Spec, board: Blackboard) -> Node:
        if spec.kind == "SubTree":
            remapped = {key: text[1:-1] for key, text in spec.ports.items() if text.startswith("{")}
            below = Blackboard(board, remapped, autoremap=spec.ports.get("_autoremap", "").lower() in ("true", "1"))
            for key, text in spec.ports.items():
                if key not in remapped and key not in ("ID", "_autoremap"):
                    below.set(key, text)
            tree = made(trees.trees[spec.ports["ID"]], below)
            return SubTree(spec.name, {}, board, servers, (tree,))
        kind = KINDS[spec.kind]
        given = _ports(spec, kind, trees.source)
        if spec.kind == "RoundRobin":
            given.setdefault("wrap_around", wrap_around)
        return kind(spec.name, given, board, servers, [made(child, board) for child in spec.children])

    return made(trees.trees[trees.main], board)


__all__ = ["KINDS", "MISSING", "Spec", "TreeError", "Trees", "asked", "build", "node", "parse_trees", "read_trees"]
