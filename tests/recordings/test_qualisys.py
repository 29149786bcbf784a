"""QTM's TSV by hand: headers with and without columns, what wasn't seen, matrices."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.recordings.formats import qualisys
from clearway.recordings.recording import Recording, Want

KEYS = """NO_OF_FRAMES\t3
NO_OF_CAMERAS\t8
NO_OF_MARKERS\t2
FREQUENCY\t150
NO_OF_ANALOG\t0
ANALOG_FREQUENCY\t0
DESCRIPTION\t--
TIME_STAMP\t2022-06-02, 15:49:44.620\t25975.44751328
DATA_INCLUDED\t3D
EVENT\tstart\t1\t0.00000
MARKER_NAMES\trobot 1\trobot 2
TRAJECTORY_TYPES\tMeasured\tGap-filled
"""
TITLES = "Frame\tTime\trobot 1 X\trobot 1 Y\trobot 1 Z\trobot 2 X\trobot 2 Y\trobot 2 Z\n"
BODIES = """NO_OF_FRAMES\t3
NO_OF_CAMERAS\t4
NO_OF_BODIES\t1
FREQUENCY\t100
DATA_INCLUDED\t6D
BODY_NAMES\tcart
Frame\tTime\tcart X\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]\tRot[4]\tRot[5]\tRot[6]\tRot[7]\tRot[8]\t
"""


def of(text: str, folder: Path, bodies: bool = False) -> Recording:
    path = folder / "run.tsv"
    path.write_text(text)
    return qualisys.FORMATS[bodies].read(path, Want())


@pytest.mark.parametrize("tab", ["", "\t"])
@pytest.mark.parametrize("unseen", ["0.000\t0.000\t0.000", "\t\t", "NULL\tNULL\tNULL"])
def test_frames_times_and_what_was_not_seen(unseen: str, tab: str, tmp_path: Path) -> None:
    rows = f"1\t0.00000\t1000\t-500\t20\t1\t2\t3{tab}\n2\t0.00667\t1000\t0\t20\t{unseen}{tab}\n3\t0.01333\t1000\t500\t20\t1\t2\t3{tab}\n"
    found = of(KEYS + TITLES + rows, tmp_path)
    assert found.points is not None
    assert found.points.names == ("robot 1", "robot 2")
    assert found.points.t == pytest.approx([0, 1 / 150, 2 / 150], abs=1e-12)
    assert found.points.xyz[:, 0] == pytest.approx(np.array([[1, -0.5, 0.02], [1, 0, 0.02], [1, 0.5, 0.02]]))
    assert np.isnan(found.points.xyz[1, 1]).all()
    assert found.points.xyz[2, 1] == pytest.approx([0.001, 0.002, 0.003])
    assert found.epoch == 1_654_184_984.62
    assert any("filled or calculated by QTM: robot 2" in note for note in found.notes)


@pytest.mark.parametrize("tab", ["", "\t"])
def test_numbers_alone_are_counted_by_the_frequency(tab: str, tmp_path: Path) -> None:
    rows = f"1000\t-500\t20\t1\t2\t3{tab}\n\t\t\t\t\t{tab}\n1000\t500\t20\t1\t2\t3{tab}\n"
    points = of(KEYS + rows, tmp_path).points
    assert points is not None
    assert points.t == pytest.approx([0, 1 / 150, 2 / 150])
    assert np.isnan(points.xyz[1]).all()  # an empty line is a frame in which nothing was seen
    assert points.xyz[2, 0] == pytest.approx([1, 0.5, 0.02])


def test_frame_and_time_without_titles(tmp_path: Path) -> None:
    points = of(KEYS.replace("150", "EXT") + "7\t0.5\t1\t2\t3\t4\t5\t6\n8\t0.7\t1\t2\t3\t4\t5\t6\n", tmp_path).points
    assert points is not None
    assert points.t == pytest.approx([0.5, 0.7])


def test_a_matrix_stands_column_by_column(tmp_path: Path) -> None:
    """A turn of 30 degrees about z takes x to (cos, sin, 0), which is the matrix's first column."""
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    row = f"1000\t2000\t300\t0\t0\t30\t0.5\t{c}\t{s}\t0\t{-s}\t{c}\t0\t0\t0\t1"
    nothing = "\t".join(["0.000"] * 16)
    bad = f"1000\t2000\t300\t0\t0\t30\t0.5\t{c}\t{s}\t0\t{-s}\t5\t0\t0\t0\t1"
    text = BODIES + f"1\t0.00000\t{row}\t\n2\t0.01000\t{nothing}\t\n3\t0.02000\t{bad}\t\n"
    track = of(text, tmp_path, bodies=True).tracks["cart"]
    assert track.position[0] == pytest.approx([1, 2, 0.3])
    assert track.orientation is not None
    assert track.orientation[0] == pytest.approx([0, 0, math.sin(math.radians(15)), math.cos(math.radians(15))])
    assert np.isnan(track.position[1]).all()
    assert np.isnan(track.orientation[1:]).all()  # not seen; and no rotation
    assert np.isfinite(track.position[2]).all()


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("MARKER_NAMES\trobot 1\trobot 2\n", "", "has no MARKER_NAMES"),
        ("MARKER_NAMES\trobot 1\trobot 2", "MARKER_NAMES", "MARKER_NAMES: names nothing"),
        ("\trobot 2\n", "\trobot 2\tghost\n", "the header promises 9"),
        ("1\t0.00000\t", "", "line 14 has 6 columns; the header has 8"),
        ("0.00000\t1000", "later\t1000", "line 14, column 2: 'later' is no number"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, problem: str, tmp_path: Path) -> None:
    text = KEYS.replace("EVENT\tstart\t1\t0.00000\n", "") + TITLES + "1\t0.00000\t1000\t-500\t20\t1\t2\t3\n"
    with pytest.raises(ClearwayError) as error:
        of(text.replace(old, new), tmp_path)
    assert problem.replace("line 14", "line 13") in str(error.value)


def test_a_file_of_bodies_says_how_to_read_it(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="has no MARKER_NAMES, but BODY_NAMES: read it as qualisys-6d"):
        of(BODIES + "1\t0\n", tmp_path)


PARTS = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9))]


def old(bodies: list[str], gap: bool, lead: str = "", rotations: bool = True) -> str:
    """An export as QTM 2 wrote it: the bodies' columns without frame and time before them."""
    parts = PARTS if rotations else PARTS[:7]
    titles, row = [], []
    for k, body in enumerate(bodies):
        turn = math.radians(30 + 10 * k)
        c, s = math.cos(turn), math.sin(turn)
        values = [1000 + k, 2000, 300, 0, 0, math.degrees(turn), 0.5, c, s, 0, -s, c, 0, 0, 0, 1][: len(parts)]
        titles += [*([""] if gap and k else []), f"{body} {parts[0]}", *parts[1:]]
        row += [*([""] if gap and k else []), *map(str, values)]
    names = "\t".join(bodies)
    head = f"NO_OF_FRAMES\t2\nNO_OF_CAMERAS\t8\nNO_OF_BODIES\t{len(bodies)}\nFREQUENCY\t60\nDATA_INCLUDED\t6D\nBODY_NAMES\t{names}\n"
    return head + lead + "\t".join(titles) + "\n" + 2 * ("\t".join(row) + "\n")


@pytest.mark.parametrize("gap", [False, True])
@pytest.mark.parametrize("bodies", [["cart"], ["cart", "box 2"]])
def test_older_bodies_stand_where_their_titles_say(bodies: list[str], gap: bool, tmp_path: Path) -> None:
    found = of(old(bodies, gap), tmp_path, bodies=True)
    assert list(found.tracks) == bodies
    for k, track in enumerate(found.tracks.values()):
        assert track.t == pytest.approx([0, 1 / 60])
        assert track.position[1] == pytest.approx([1 + k / 1000, 2, 0.3])
        assert track.orientation is not None
        half = math.radians(30 + 10 * k) / 2
        assert track.orientation[1] == pytest.approx([0, 0, math.sin(half), math.cos(half)])


def test_a_body_without_a_matrix_has_no_heading(tmp_path: Path) -> None:
    found = of(old(["cart"], False, rotations=False), tmp_path, bodies=True)
    assert found.tracks["cart"].orientation is None
    assert any("no rotation matrix, and so no heading: cart" in note for note in found.notes)


def test_titles_of_other_columns_than_the_numbers_are_not_believed(tmp_path: Path) -> None:
    text = old(["cart"], False).replace("cart X\t", "cart\tX\t")  # the name in a cell of its own
    track = of(text, tmp_path, bodies=True).tracks["cart"]
    assert track.position[0] == pytest.approx([1, 2, 0.3])
