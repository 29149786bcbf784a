"""What is packed comes out again: a second reader, written from the format's description, gets the same numbers."""

from __future__ import annotations

import base64
import itertools
import json
import math
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.geometry.distance import clearance
from clearway.geometry.shapes import Polygon
from clearway.reports.replay_encoding import LONGEST, Packer, Shelf, clearance_over_time, pack_columns, simplify
from clearway.trials.store import Results


def unpack(block: dict[str, Any]) -> dict[str, np.ndarray]:
    raw = zlib.decompress(base64.b64decode(block["data"]))
    kind, gap = ("<i4", -(2**31)) if block["wide"] else ("<i2", -(2**15))
    steps = np.frombuffer(raw, kind).reshape(len(block["columns"]), block["n"]).astype(np.int64)
    out = {}
    for (name, first, unit), row in zip(block["columns"], steps, strict=True):
        values, whole = [], first
        for step in row:
            whole += 0 if step == gap else int(step)
            values.append(math.nan if step == gap else whole * unit)
        out[name] = np.array(values)
    return out


number = st.floats(-1e5, 1e5) | st.just(math.nan)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(number, number), min_size=1, max_size=40))
def test_columns_come_back_within_half_a_unit(rows: list[tuple[float, float]]) -> None:
    a, b = np.array(rows).T
    back = unpack(pack_columns({"a": (a, 1e-3), "b": (b, 0.5)}))
    np.testing.assert_allclose(back["a"], a, atol=0.5e-3 + 1e-9)
    np.testing.assert_allclose(back["b"], b, atol=0.25 + 1e-9)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=2, max_size=30), st.floats(0.001, 2.0))
def test_a_simplified_line_stays_near_every_point(points: list[tuple[float, float]], tolerance: float) -> None:
    line = np.array(points)
    short = simplify(line, tolerance)
    assert (short[0] == line[0]).all()
    assert (short[-1] == line[-1]).all()
    origin = np.zeros(3)
    for point in line:
        near = min(
            clearance(Polygon((tuple(point), tuple(point))), origin, Polygon((tuple(a), tuple(b))), origin)
            for a, b in itertools.pairwise(short)
        )
        assert near <= tolerance + 1e-9


def test_a_straight_line_needs_two_points() -> None:
    assert len(simplify(np.c_[np.linspace(0, 5, 100), np.linspace(0, 2, 100)])) == 2


def test_a_trial_comes_back(results: Results) -> None:
    index = next(r["trial"] for r in results.trials.to_pylist() if r["configuration"] == "crossing")
    trial = results.trial(index)
    packer = Packer()
    packed = packer.pack(trial, index, {})
    json.dumps(packed, allow_nan=False)
    back = unpack(packed["samples"])
    np.testing.assert_allclose(np.c_[back["x"], back["y"]], trial.pose[:, :2], atol=6e-4)
    np.testing.assert_allclose(np.remainder(back["a"] - trial.pose[:, 2] + 1, 2 * np.pi), 1, atol=1e-4)
    np.testing.assert_allclose(np.c_[back["m0x"], back["m0y"]], trial.moving_obstacles[:, 0, :2], atol=6e-4)
    np.testing.assert_array_equal(back["leg"], trial.leg)
    thoughts = json.loads(zlib.decompress(base64.b64decode(packed["thoughts"])))
    assert [t["t"] for t in thoughts] == [round(s.t, 3) for s in trial.snapshots]
    assert len(packer.floors.things) == 1
    packer.pack(results.trial(index + 1), index + 1, {})
    assert len(packer.floors.things) == 1  # the same hall


def test_the_chart_shows_the_clearance_of_the_kernel(results: Results) -> None:
    row = next(r for r in results.trials.to_pylist() if r["configuration"] == "single")
    trial = results.trial(row["trial"])
    values = clearance_over_time(trial)
    assert values is not None
    square = next(b for b in trial.attempt.bodies if b.kind == "obstacle")
    assert trial.attempt.footprint is not None
    assert square.pose is not None
    middle = len(trial.t) // 4
    apart = clearance(trial.attempt.footprint, trial.pose[middle], square.shape, square.pose)
    assert values[middle] <= apart + 1e-12
    assert min(row["MDO"], 30.0) >= np.nanmin(values) - 2e-3


def test_a_long_trial_is_thinned_but_ends_where_it_ended(results: Results) -> None:
    trial = results.trial(0)
    n = 3 * LONGEST
    at = np.linspace(0, len(trial.t) - 1, n).astype(int)
    long = replace(
        trial, t=np.arange(n) * 0.01, pose=trial.pose[at], velocity=None, estimate=None, command=None,
        leg=trial.leg[at], moving_obstacles=trial.moving_obstacles[at],
    )  # fmt: skip
    packed = Packer().pack(long, 0, {})["samples"]
    assert packed["n"] <= LONGEST + 1
    assert abs(unpack(packed)["t"][-1] - long.t[-1]) < 6e-4


def test_a_shelf_gives_the_same_place_to_the_same_thing() -> None:
    shelf = Shelf()
    assert [shelf.place(x) for x in ([1], [2], [1], {"a": 1})] == [0, 1, 0, 2]
