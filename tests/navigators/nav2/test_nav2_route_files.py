"""The file of a graph of routes: what is read of it, and what it may not hold."""

from __future__ import annotations

import copy
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from route_features import SQUARE, edge, node, written

from clearway.errors import ClearwayError
from clearway.navigators.nav2.routes import scorers
from clearway.navigators.nav2.routes.graph import read_graph


def test_a_graph_is_read_from_points_and_lines(tmp_path):
    graph = read_graph(written(tmp_path, SQUARE))
    assert graph.ids == (0, 1, 12)
    assert graph.places.tolist() == [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]
    assert [(e.start, e.end) for e in graph.edges] == [(0, 1), (1, 2), (2, 0), (0, 2)]
    assert [[e.number for e in leaving] for leaving in graph.leaving] == [[0, 3], [1], [2]]
    assert (graph.edges[1].cost, graph.edges[1].overridable) == (3.0, False)
    assert graph.edges[0].metadata == {"speed_limit": 0.5}
    assert graph.length(graph.edges[2]) == pytest.approx(math.sqrt(8.0))


@pytest.mark.parametrize(
    ("features", "said"),
    [
        ([], "features: has no node"),
        (SQUARE[:3], r"features: has no edge \(a LineString\)"),
        ([3], "features.0: is 3; it is to be an object with 'geometry'"),
        ([{"geometry": None}], "features.0.geometry: is None; it is to be an object"),
        ([{"type": "Feature"}], "features.0.geometry: is missing; it is to be an object"),
        ([{"geometry": {"type": 3}}], "features.0.geometry.type: is 3; it is to be a text"),
        ([{"geometry": {"type": "Point"}}], "features.0.properties: is missing"),
        ([node(-1, 0, 0)], "features.0.properties.id: is -1; it is to be a whole number from 0 to 4294967295"),
        ([node(True, 0, 0)], "features.0.properties.id: is True; it is to be a whole number"),
        ([node(1.5, 0, 0)], r"features.0.properties.id: is 1\.5; it is to be a whole number"),
        ([node(2**32, 0, 0)], "features.0.properties.id: is 4294967296"),
        ([node(7, 0, 0), node(7.0, 1, 1)], "features.1.properties.id: is 7, as that of another node"),
        ([node(7, "0", 0)], "features.0.geometry.coordinates.0: is '0'; it is to be a number of metres"),
        ([node(7, 0, 2e7)], "features.0.geometry.coordinates.1: is 20000000.0"),
        ([node(7, 0, math.nan)], "features.0.geometry.coordinates.1: is nan"),
        ([node(7, 0, 0, frame="odom")], "features.0.properties.frame: is 'odom'; nodes are given in 'map' here"),
        ([{**node(7, 0, 0), "geometry": {"type": "Point", "coordinates": [1]}}], r"is \[1\]; it is to be \[x, y\], m"),
        ([*SQUARE[:3], {**edge(1, 0, 1), "properties": {"id": 1, "endid": 1}}], "features.3.properties.startid: is missing"),
        ([*SQUARE[:3], edge(1, 0, 5)], "features.3.properties.endid: is 5; no node has that id"),
        ([*SQUARE[:3], edge(1, 0, 1, cost="a")], "features.3.properties.cost: is 'a'; it is to be a number"),
        ([*SQUARE[:3], edge(1, 0, 1, overridable=1)], "features.3.properties.overridable: is 1; it is to be true or false"),
        ([*SQUARE[:3], edge(1, 0, 1, metadata=[])], r"features.3.properties.metadata: is \[\]; it is to be an object"),
        ([node(k, k, 0) for k in range(10001)], "features: has more than 10,000 nodes"),
        ([node(0, 0, 0), *[edge(k, 0, 0) for k in range(50001)]], "features: has more than 50,000 edges"),
    ],
)  # fmt: skip
def test_a_broken_graph_is_one_clear_error(tmp_path, features, said):
    with pytest.raises(ClearwayError, match=said) as told:
        read_graph(written(tmp_path, features))
    assert str(tmp_path / "graph.geojson") in str(told.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is not JSON"),
        ("[]", "it is to be an object with 'features'"),
        ("{}", "features: is missing; it is to be a list"),
        ('{"features": {}}', "features: is {}; it is to be a list"),
        ("[" * 100, "nested deeper|is not JSON"),
    ],
)
def test_a_file_that_is_no_graph_is_one_clear_error(tmp_path, text, said):
    file = tmp_path / "graph.geojson"
    file.write_text(text)
    with pytest.raises(ClearwayError, match=said):
        read_graph(file)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text(max_size=5),
    lambda inside: st.lists(inside, max_size=3) | st.dictionaries(st.text(max_size=5), inside, max_size=3),
    max_leaves=6,
)


@settings(max_examples=300)
@given(data=st.data())
def test_whatever_stands_in_a_graph_it_is_read_or_one_clear_error(tmp_path_factory, data):
    table = {"type": "FeatureCollection", "features": copy.deepcopy(list(SQUARE))}
    here, key = table, "features"
    while data.draw(st.booleans()) and isinstance(here[key], dict | list) and here[key]:
        here = here[key]
        key = data.draw(st.sampled_from(sorted(here) if isinstance(here, dict) else range(len(here))))
    here[key] = data.draw(VALUES)
    file = tmp_path_factory.mktemp("graphs") / "graph.geojson"
    file.write_text(json.dumps(table))
    try:
        graph = read_graph(file)
        for group in (scorers.DistanceScorer(), scorers.PenaltyScorer(), scorers.TimeScorer()):
            scorers.make_scorer(group, graph)
    except ClearwayError as error:
        told = str(error)
    else:
        told = "graph.geojson"
        assert np.isfinite(graph.places).all()
        assert len(graph.edges) >= 1
    assert "graph.geojson" in told
