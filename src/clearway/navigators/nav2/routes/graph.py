"""The graph of a route server: places and the ways between them, from a GeoJSON file.

A feature with a Point is a node, one with a LineString or MultiLineString an edge from one node to another; its line is only drawn.
Behaviour read from ros-navigation/navigation2: nav2_route/src/plugins/graph_file_loaders/geojson_graph_file_loader.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.errors import ClearwayError, shown
from clearway.geometry.shapes import FloatArray
from clearway.reading import limits, read_json

_MOST = 2**32
_LINES = ("LineString", "MultiLineString")


class NoNode(Exception):
    """The graph has no node of that name."""


class Edge(NamedTuple):
    """A way from one node to another.

    Attributes:
        number: Its place among the edges of the file.
        start: Index of the node where it begins.
        end: Index of the node where it ends.
        cost: That of the file; 0 without one.
        overridable: Whether scorers say its cost, if there are any.
        metadata: What the file tells of it.
        field: Where it stands in the file.
    """

    number: int
    start: int
    end: int
    cost: float
    overridable: bool
    metadata: Mapping[str, Any]
    field: str


class Graph(NamedTuple):
    """Places and ways.

    Attributes:
        ids: Of each node, its name in the file.
        places: (n, 2) of the nodes in the map, m.
        edges: In the file's order.
        leaving: Of each node, the edges that begin there.
        file: Where it was read.
    """

    ids: tuple[int, ...]
    places: FloatArray
    edges: tuple[Edge, ...]
    leaving: tuple[tuple[Edge, ...], ...]
    file: Path

    def node(self, id: int) -> int:
        """Index of the node that the file calls so.

        Raises:
            NoNode: There is none.
        """
        if id not in self.ids:
            raise NoNode(f"the graph has no node {id}")
        return self.ids.index(id)

    def length(self, edge: Edge) -> float:
        """Of an edge from node to node, m."""
        (ax, ay), (bx, by) = self.places[edge.start], self.places[edge.end]
        return math.hypot(bx - ax, by - ay)


def read_graph(path: Path) -> Graph:
    """The graph in a GeoJSON file.

    Raises:
        ClearwayError: It can't be read, or is no such graph.
    """
    with suppress(OSError):
        found = path.stat()
        return _read(path, found.st_mtime_ns, found.st_size)
    return _read(path, 0, 0)


@lru_cache(maxsize=2)  # a large one takes seconds, and each trial asks for it
def _read(path: Path, changed: int, size: int) -> Graph:
    features = _inside(_Place(read_json(path), path, ""), "features", list)
    index: dict[int, int] = {}
    places: list[tuple[float, float]] = []
    lines: list[_Place] = []
    for n, value in enumerate(features.value):
        feature = _Place(value, path, f"features.{n}")
        kind = _inside(_inside(feature, "geometry", dict), "type", str).value
        if kind in _LINES:
            lines.append(feature)
        elif kind == "Point":
            properties = _inside(feature, "properties", dict)
            name = _id(properties, "id")
            if name in index:
                raise properties.at("id").error(f"is {name}, as that of another node; each has its own")
            if len(places) == limits.ROUTE_NODES:
                raise features.error(f"has more than {limits.ROUTE_NODES:,} nodes, the most that are read")
            index[name] = len(places)
            places.append(_place(feature, properties))
    if not places or not lines:
        raise features.error("has no node (a Point)" if not places else "has no edge (a LineString)")
    if len(lines) > limits.ROUTE_EDGES:
        raise features.error(f"has more than {limits.ROUTE_EDGES:,} edges, the most that are read")
    edges = tuple(_edge(n, line, index) for n, line in enumerate(lines))
    leaving: list[list[Edge]] = [[] for _ in places]
    for edge in edges:
        leaving[edge.start].append(edge)
    return Graph(tuple(index), np.array(places), edges, tuple(map(tuple, leaving)), path)


class _Place(NamedTuple):
    """A value with where it stands."""

    value: Any
    file: Path
    field: str

    def at(self, name: str | int) -> _Place:
        inside = self.value[name] if isinstance(name, int) else self.value.get(name)
        return _Place(inside, self.file, f"{self.field}.{name}" if self.field else str(name))

    def error(self, problem: str) -> ClearwayError:
        return ClearwayError(problem, file=self.file, field=self.field or None)


_KINDS = {dict: "an object", list: "a list", str: "a text", bool: "true or false"}


def _inside(place: _Place, name: str, kind: type) -> _Place:
    """What stands under a name in an object, and is of a kind."""
    if not isinstance(place.value, dict):
        raise place.error(f"is {shown(place.value)}; it is to be an object with {name!r}")
    found = place.at(name)
    if name not in place.value:
        raise found.error(f"is missing; it is to be {_KINDS[kind]}")
    if not isinstance(found.value, kind):
        raise found.error(f"is {shown(found.value)}; it is to be {_KINDS[kind]}")
    return found


def _id(properties: _Place, name: str) -> int:
    found = properties.at(name)
    value = found.value
    whole = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and value % 1 == 0
    if not whole or not 0 <= value < _MOST:
        what = f"is {shown(value)}" if name in properties.value else "is missing"
        raise found.error(f"{what}; it is to be a whole number from 0 to {_MOST - 1}")
    return int(value)


def _number(place: _Place, most: float, words: str) -> float:
    value = place.value
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= most:
        raise place.error(f"is {shown(value)}; it is to be {words}")
    return float(value)


def _place(feature: _Place, properties: _Place) -> tuple[float, float]:
    frame = properties.value.get("frame", "map")
    if frame not in ("", "map"):
        raise properties.at("frame").error(f"is {shown(frame)}; nodes are given in 'map' here")
    found = _inside(feature.at("geometry"), "coordinates", list)
    if len(found.value) < 2:
        raise found.error(f"is {shown(found.value)}; it is to be [x, y], m")
    words = f"a number of metres, no further from 0 than {limits.COORDINATE:g}"
    return _number(found.at(0), limits.COORDINATE, words), _number(found.at(1), limits.COORDINATE, words)


def _edge(n: int, feature: _Place, index: Mapping[int, int]) -> Edge:
    properties = _inside(feature, "properties", dict)
    ends = []
    _id(properties, "id")
    for which in ("startid", "endid"):
        node = _id(properties, which)
        if node not in index:
            raise properties.at(which).error(f"is {node}; no node has that id")
        ends.append(index[node])
    cost, overridable, metadata = 0.0, True, {}
    if "cost" in properties.value:
        cost = _number(properties.at("cost"), limits.NUMBER, "a number")
    if "overridable" in properties.value:
        overridable = _inside(properties, "overridable", bool).value
    if properties.value.get("metadata") is not None:
        metadata = _inside(properties, "metadata", dict).value
    return Edge(n, ends[0], ends[1], cost, overridable, metadata, properties.field)
