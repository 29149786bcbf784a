"""QTM's JSON by hand: parts, frames, what wasn't seen, and matrices of which nobody says how they stand."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from text_captures import damaged, nothing_but_clearway_errors

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats import qualisys_json
from clearway.recordings.recording import Recording, Want

CORNERS = {"cart - 1": (200.0, 0.0, 10.0), "cart - 2": (-150.0, 120.0, 10.0), "cart - 3": (-150.0, -80.0, 40.0)}


def capture(columns: bool, turns: float = 0.05, markers: bool = True, n: int = 40) -> dict[str, Any]:
    """A cart that drives and turns by `turns` [rad] a frame from a heading of 0.4; unseen in its frames 10 to 14, the first being 1."""
    poses, seen = [], {name: [] for name in CORNERS}
    for i in range(n):
        c, s = math.cos(0.4 + turns * i), math.sin(0.4 + turns * i)
        x, y, z = 1000.0 + 10 * i, -500.0, 250.0
        matrix = [c, s, 0, -s, c, 0, 0, 0, 1] if columns else [c, -s, 0, s, c, 0, 0, 0, 1]
        poses.append([[x, y, z, 0.3], matrix])
        for name, (a, b, h) in CORNERS.items():
            seen[name].append([x + c * a - s * b, y + s * a + c * b, z + h, 0.2])

    def parts(values: list[Any]) -> list[dict[str, Any]]:
        return [
            {"Range": {"Start": 1, "End": 9}, "Type": "measured", "Values": values[:9]},
            {"Range": {"Start": 15, "End": n}, "Type": "measured", "Values": values[14:]},
        ]

    return {
        "Timebase": {"Frequency": 100, "Range": {"Start": 1, "End": n}},
        "Markers": [{"Name": name, "Parts": parts(v)} for name, v in seen.items()] if markers else [],
        "RigidBodies": [{"Name": "cart", "Parts": parts(poses)}],
    }


def of(told: Any, folder: Path, want: Want | None = None) -> Recording:
    path = folder / "run.json"
    path.write_text(json.dumps(told))
    return formats.read(path, want)


@pytest.mark.parametrize("columns", [True, False])
def test_the_bodys_markers_say_how_its_matrix_stands(columns: bool, tmp_path: Path) -> None:
    found = of(capture(columns), tmp_path)
    assert found.format == "qualisys-json"
    track = found.tracks["cart"]
    assert track.t == pytest.approx(np.arange(40) / 100)
    assert track.position[20] == pytest.approx([1.2, -0.5, 0.25])
    assert np.isnan(track.position[9:14]).all()
    assert track.orientation is not None
    assert np.isnan(track.orientation[9:14]).all()
    half = (0.4 + 0.05 * 20) / 2
    assert track.orientation[20] == pytest.approx([0, 0, math.sin(half), math.cos(half)])
    assert any(("column by column" if columns else "row by row") in n for n in found.notes)
    assert found.points is not None
    assert found.points.names == tuple(CORNERS)
    assert found.points.xyz[0, 0] == pytest.approx([1 + 0.2 * math.cos(0.4), -0.5 + 0.2 * math.sin(0.4), 0.26])


@pytest.mark.parametrize("told", [capture(True, markers=False), capture(True, turns=0.0)])
def test_where_nothing_tells_there_is_no_heading(told: Any, tmp_path: Path) -> None:
    """Without markers, and where it never turned: both readings have the markers stay where they are."""
    found = of(told, tmp_path)
    assert found.tracks["cart"].orientation is None
    assert any("cart: no heading" in n for n in found.notes)


def test_spans_and_names(tmp_path: Path) -> None:
    found = of(capture(True), tmp_path, Want(frozenset({"cart - 2"}), (0.2, 0.3)))
    assert not found.tracks
    assert found.points is not None
    assert found.points.names == ("cart - 2",)
    assert found.points.t == pytest.approx(np.arange(20, 31) / 100)
    with pytest.raises(ClearwayError, match="did you mean 'cart - 2'"):
        of(capture(True), tmp_path, Want(frozenset({"cart 2"})))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"Timebase": {}}, "Timebase.Frequency: is missing"),
        ({"Timebase": {"Frequency": "EXT"}}, "'EXT' is no sampling rate"),
        ({"Markers": [{"Name": "a", "Parts": [{"Values": [[1, 2, 3]]}]}]}, "Markers, a: a part doesn't say its Range.Start"),
        ({"Markers": [{"Name": "a", "Parts": [{"Range": {"Start": 1}, "Values": [[1, 2]]}]}]}, "not all \\[x, y, z, residual"),
        ({"Markers": [{"Name": "a", "Parts": [{"Range": {"Start": 2_000_000_000}, "Values": [[1, 2, 3]]}]}]}, "more than are read"),
        ({"Markers": [], "RigidBodies": []}, "neither markers nor rigid bodies"),
        ({"Markers": 5}, "no list of things"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(change: dict[str, Any], problem: str, tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    path.write_text(json.dumps(capture(True) | change))
    with pytest.raises(ClearwayError, match=problem):
        qualisys_json.read(path, Want())


def test_other_json_is_none_of_qtm(tmp_path: Path) -> None:
    assert not qualisys_json.sniff(tmp_path / "a.json", b'{"schema": 6}')
    with pytest.raises(ClearwayError, match="none of QTM"):
        of([1, 2], tmp_path)


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_the_file_holds_nothing_but_our_own_error_comes_out(tmp_path: Path, data: st.DataObject) -> None:
    valid = json.dumps(capture(True, n=16), indent=1).encode()
    nothing_but_clearway_errors(qualisys_json.FORMATS[0], tmp_path / "f.json", data.draw(damaged(valid)))
