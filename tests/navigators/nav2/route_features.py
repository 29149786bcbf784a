"""Graphs of routes as files of GeoJSON have them."""

from __future__ import annotations

import json


def node(id, x, y, **more):
    return {
        "type": "Feature",
        "properties": {"id": id, **more},
        "geometry": {"type": "Point", "coordinates": [x, y]},
    }


def edge(id, start, end, kind="LineString", **more):
    return {
        "type": "Feature",
        "properties": {"id": id, "startid": start, "endid": end, **more},
        "geometry": {"type": kind, "coordinates": []},
    }


SQUARE = (
    node(0, 0.0, 0.0, frame="map"),
    node(1, 2, 0.0, frame="", operations={"stop": {"type": "stop", "trigger": "NODE"}}),
    node(12.0, 2.0, 2.0, metadata={"region": {"x_values": [1.0]}}),
    edge(20, 0, 1, metadata={"speed_limit": 0.5}),
    edge(21, 1, 12, kind="MultiLineString", cost=3, overridable=False),
    edge(22, 12, 0),
    edge(22, 0, 12),
    {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": []}},
)


def written(folder, features, name="graph.geojson"):
    file = folder / name
    file.write_text(json.dumps({"type": "FeatureCollection", "features": list(features)}))
    return file
