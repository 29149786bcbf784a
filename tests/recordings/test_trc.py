"""TRC by hand: counts in the header, rounded times, units, which axis is up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.recordings.formats import trc
from clearway.recordings.recording import Recording, Want

HEAD = """PathFileType\t4\t(X/Y/Z)\tC:\\lab\\walk.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
150.00\t150.00\t       4\t1\tmm\t150.00\t1\t       4
Frame#\tTime\tR.Heel\t\t\tV_Mid\t\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t
"""
ROWS = "1\t0.000\t1\t20\t300\t\t\t\n2\t0.007\t1\t21\t300\t\t\t\n3\t0.013\t\t\t\t7\t8\t9\n4\t0.020\t1\t22\t300\n"


def of(text: str, folder: Path, up: str = "z") -> Recording:
    path = folder / "walk.trc"
    path.write_text(text)
    return trc.FORMATS[up == "y"].read(path, Want())


@pytest.mark.parametrize("empty", ["", "\n", "\t\t\t\n"])
def test_markers_times_and_what_was_not_seen(empty: str, tmp_path: Path) -> None:
    found = of(HEAD + empty + ROWS, tmp_path)
    assert found.points is not None
    assert found.points.names == ("R.Heel", "V_Mid")
    assert found.points.t == pytest.approx(np.arange(4) / 150, abs=1e-12)  # 0.007 and 0.013 would be 8 % of speed
    assert found.points.xyz[0, 0] == pytest.approx([0.001, 0.02, 0.3])
    assert np.isnan(found.points.xyz[2, 0]).all()
    assert np.isnan(found.points.xyz[[0, 1, 3], 1]).all()
    assert found.points.xyz[2, 1] == pytest.approx([0.007, 0.008, 0.009])
    assert any("announces 1 markers, there are columns of 2" in note for note in found.notes)
    assert any("z taken as up" in note for note in found.notes)


def test_a_marker_at_zero_was_not_seen(tmp_path: Path) -> None:
    rows = ROWS.replace("\t7\t8\t9", "\t0\t8\t0").replace("1\t21\t300\t\t\t", "0.000\t-0.0\t0\t0\t0\t0")
    points = of(HEAD + rows, tmp_path).points
    assert points is not None
    assert np.isnan(points.xyz[1]).all()
    assert points.xyz[2, 1] == pytest.approx([0, 0.008, 0])
    seen = {e.name: e.count for e in trc.FORMATS[0].look(tmp_path / "walk.trc").entries}
    assert seen == {"R.Heel": 2, "V_Mid": 1}


def test_times_that_are_no_raster_stay_as_they_are(tmp_path: Path) -> None:
    points = of(HEAD + ROWS.replace("0.013", "0.0142"), tmp_path).points
    assert points is not None
    assert points.t == pytest.approx([0, 0.007, 0.0142, 0.02], abs=1e-12)


def test_y_up_is_turned(tmp_path: Path) -> None:
    points = of(HEAD + ROWS, tmp_path, up="y").points
    assert points is not None
    assert points.xyz[0, 0] == pytest.approx([0.001, -0.3, 0.02])


def test_separated_by_commas(tmp_path: Path) -> None:
    points = of((HEAD + "\n" + ROWS).replace("\t", ","), tmp_path).points
    assert points is not None
    assert points.xyz[0, 0] == pytest.approx([0.001, 0.02, 0.3])


UNNAMED = "\t".join(["7", "8", "9"])


@pytest.mark.parametrize(
    ("head", "rows", "names"),
    [
        # X, Y, Z of a marker without a name
        (HEAD.replace("\tV_Mid", "\t"), ROWS, ("R.Heel", "unlabeled 2")),
        # numbers behind all that is named, from the first line on
        (HEAD, f"1\t0.000\t1\t20\t300\t\t\t\t{UNNAMED}\n2\t0.007\t1\t21\t300\t\t\t\t{UNNAMED}\n",
         ("R.Heel", "V_Mid", "unlabeled 3")),
        # a name behind the last X, Y, Z: Cortex' virtual markers
        (HEAD.replace("V_Mid\t\t", "V_Mid\t\t\tV_Hip\t\t"), ROWS, ("R.Heel", "V_Mid", "V_Hip")),
    ],
)  # fmt: skip
def test_cortex_trailing_columns(head: str, rows: str, names: tuple[str, ...], tmp_path: Path) -> None:
    path = tmp_path / "walk.trc"
    path.write_text(head + "\n" + rows)
    assert tuple(e.name for e in trc.FORMATS[0].look(path).entries) == names
    found = trc.FORMATS[0].read(path, Want(names=frozenset(names))).points
    assert found is not None
    assert found.xyz[0, 0] == pytest.approx([0.001, 0.02, 0.3])
    labelled = trc.FORMATS[0].read(path, Want()).points
    assert labelled is not None
    assert labelled.names == tuple(n for n in names if not n.startswith("unlabeled"))


def test_unnamed_markers_that_come_later_are_passed_over(tmp_path: Path) -> None:
    found = of(
        HEAD + "\n" + ROWS.replace("2\t0.007\t1\t21\t300\t\t\t", f"2\t0.007\t1\t21\t300\t\t\t\t{UNNAMED}"), tmp_path
    )
    assert found.points is not None
    assert found.points.names == ("R.Heel", "V_Mid")
    assert found.points.xyz[1, 0] == pytest.approx([0.001, 0.021, 0.3])


def test_opensim_names_a_cell_beside_the_numbers(tmp_path: Path) -> None:
    """As OpenSim 4.0's adapter wrote them: three tabs before X1, two before the numbers, one between the names."""
    head = HEAD.replace("Frame#\tTime\tR.Heel\t\t\tV_Mid\t\t\t", "Frame#\tTime\t\tR.Heel\t\tV_Mid").replace(
        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t", "\t\t\tX1\tY1\tZ1\tX2\tY2\tZ2"
    )
    found = of(head + "\n" + "1\t0\t1\t20\t300\t4\t5\t6\n2\t0.007\t1\t21\t300\tNaN\tNaN\tNaN\n", tmp_path)
    assert found.points is not None
    assert found.points.names == ("R.Heel", "V_Mid")
    assert found.points.xyz[0] == pytest.approx(np.array([[0.001, 0.02, 0.3], [0.004, 0.005, 0.006]]))
    assert np.isnan(found.points.xyz[1, 1]).all()
    assert any("a cell beside the numbers" in note for note in found.notes)


def test_a_line_of_values_spread_over_more_tabs(tmp_path: Path) -> None:
    values = "150.00\t150.00\t       4\t1\tmm\t150.00\t1\t       4"
    found = of(HEAD.replace(values, "  150.0\t\t  150.0\t\t 4\t\t 1\t\t mm\t 150.0\t 1\t 4") + ROWS, tmp_path)
    assert found.points is not None
    assert found.points.xyz[0, 0] == pytest.approx([0.001, 0.02, 0.3])
    assert found.points.t[1] == pytest.approx(1 / 150)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("\tmm\t", "\t\t", "Units: the unit of length is missing"),
        ("\tmm\t", "\tpx\t", "Units: 'px' is no unit of length"),
        ("150.00\t150.00\t", "none\t150.00\t", "DataRate: 'none' is no sampling rate"),
        ("R.Heel\t\t\tV_Mid", "R.Heel\tV_Mid\tV", "there are 3 marker names, but X, Y and Z of 2"),
        ("Frame#", "Bild", "the columns should be Frame#, Time and markers"),
        ("PathFileType", "FileType", "doesn't begin with 'PathFileType'"),
        ("       4\t1", "4000000000\t1", "announces 4000000000 frames, more than it can hold; it has 4"),
        ("2\t0.007\t1\t21\t300", "2\t0.007\t1\t21\tx", "line 7, column 5: 'x' is no number"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, problem: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError) as error:
        of((HEAD + ROWS).replace(old, new), tmp_path)
    assert problem in str(error.value)
