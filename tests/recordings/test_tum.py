"""TUM trajectories: values, stamps, headings that weren't measured, and what is wrong in a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from text_captures import capture, damaged, nothing_but_clearway_errors

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats import tum
from clearway.recordings.recording import Track, Want


def file_of(folder: Path, text: str | bytes) -> Path:
    file = folder / "a.tum"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def track_of(folder: Path, text: str | bytes, want: Want | None = None) -> Track:
    return tum.read(file_of(folder, text), want or Want()).tracks["trajectory"]


LINES = "# stamps in s\n1.5 1 2 3 0 0 0 1\n2.5 2 2 3 0 0 0.6 0.8\n3.5 3 2 3 0 0 1 0\n"


def test_values(tmp_path: Path):
    track = track_of(tmp_path, LINES)
    assert track.t.tolist() == [1.5, 2.5, 3.5]
    assert track.position.tolist() == [[1, 2, 3], [2, 2, 3], [3, 2, 3]]
    assert track.orientation is not None
    np.testing.assert_allclose(track.orientation, [[0, 0, 0, 1], [0, 0, 0.6, 0.8], [0, 0, 1, 0]])
    assert track.kind == "pose"


@pytest.mark.parametrize("end", ["\n3.5 3 2 3 0 0", "\n3.5"])
def test_a_last_line_that_was_cut_off_is_told(tmp_path: Path, end: str):
    read = tum.read(file_of(tmp_path, LINES.rstrip("\n").rpartition("\n")[0] + end), Want())
    assert len(read.tracks["trajectory"].t) == 2
    assert any("taken as cut off" in note for note in read.notes)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("blank", [" ", "\t", "   "])
def test_blanks_and_line_ends(tmp_path: Path, blank: str, end: str):
    text = " " + LINES.replace(" ", blank).replace("\n", end) + end
    assert track_of(tmp_path, text).position.tolist() == [[1, 2, 3], [2, 2, 3], [3, 2, 3]]


def test_text_in_utf_16_and_with_a_mark(tmp_path: Path):
    for data in (
        LINES.encode("utf-16"),
        b"\xef\xbb\xbf" + LINES.encode(),
        "# Größe\n".encode("cp1252") + LINES.encode(),
    ):
        assert track_of(tmp_path, data).t.tolist() == [1.5, 2.5, 3.5]


def test_unix_stamps_become_an_epoch(tmp_path: Path):
    text = "1700000000.25 0 0 0 0 0 0 1\n1700000000.75 1 0 0 0 0 0.6 0.8\n"
    recording = tum.read(file_of(tmp_path, text), Want())
    assert recording.epoch == 1700000000.25
    assert recording.tracks["trajectory"].t.tolist() == [0.0, 0.5]


def test_nanoseconds_are_refused(tmp_path: Path):
    with pytest.raises(ClearwayError, match="is no UNIX time; in ns it is: say time = 'ns'"):
        track_of(tmp_path, "1700000000250000000 0 0 0 0 0 0 1\n1700000000350000000 0 0 0 0 0 0 1\n")


def test_a_span_is_cut_out(tmp_path: Path):
    assert track_of(tmp_path, LINES, Want(span=(2.0, 3.0))).t.tolist() == [2.5]
    contents = tum.FORMATS[0].look(file_of(tmp_path, LINES))
    assert (contents.start, contents.end, contents.entries[0].rate) == (1.5, 3.5, 1.0)


def test_a_heading_that_never_changes_was_not_measured(tmp_path: Path):
    recording = tum.read(file_of(tmp_path, "".join(f"{i} {i} 0 0 0 0 0 1\n" for i in range(9))), Want())
    assert recording.tracks["trajectory"].orientation is None
    assert any("not measured" in n for n in recording.notes)
    still = track_of(tmp_path, "".join(f"{i} 1 0 0 0 0 0 1\n" for i in range(9)))
    assert still.orientation is not None


def test_quaternions_of_zeros_are_unseen(tmp_path: Path):
    track = track_of(tmp_path, LINES.replace("0 0 0.6 0.8", "0 0 0 0"))
    assert track.orientation is not None
    assert np.isnan(track.orientation[1]).all()
    assert track_of(tmp_path, "1 0 0 0 0 0 0 0\n2 1 0 0 0 0 0 0\n").orientation is None


def test_nan_is_no_position(tmp_path: Path):
    track = track_of(tmp_path, LINES.replace("2.5 2", "2.5 nan"))
    assert np.isnan(track.position[1, 0])


def test_duplicated_stamps_are_dropped_and_said(tmp_path: Path):
    recording = tum.read(file_of(tmp_path, LINES + "3.5 9 9 9 0 0 0 1\n4.5 4 2 3 0 0 1 0\n"), Want())
    assert recording.tracks["trajectory"].position[:, 0].tolist() == [1, 2, 3, 4]
    assert any("1 samples had the stamp" in n for n in recording.notes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 0 0 0 0 0 0 1\n0.5 1 0 0 0 0 0 1\n", "time goes backwards from 1.000000 s to 0.500000 s"),
        ("1 0 0 0 0 0 0 1\n90000 1 0 0 0 0 0 1\n", "time leaps by 89999 s"),
        ("1 0 0 0 0 0 0 1\nnan 1 0 0 0 0 0 1\n", "the time of sample 1 is nan"),
        ("1 0 0 0 0 0 0 1\n2 1 0 0 0\n", r"8 numbers a line: t x y z qx qy qz qw"),
        ("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 zero 1\n", r"column '7'.*invalid value 'zero'"),
        ("1 0 0\n2 0 0\n", "TUM trajectory has 8 numbers a line"),
        ("1 0 0 0 0 0 0 1\n2 0 0 0 3 4 5 6\n3 0 0 0 3 4 5 6\n", "no unit quaternions"),
        ("1 0 0 0 0 0 0 1\n" * 5, "most of its 5 lines have the stamp of another one"),
        ("1 0 0 0 0 0 0 1\n\0\0\0\n", "no text"),
        ("# nothing\n", "no line"),
        ("", "is empty"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, message: str):
    file = file_of(tmp_path, text)
    for act in (lambda: tum.read(file, Want()), lambda: tum.FORMATS[0].look(file)):
        with pytest.raises(ClearwayError, match=message) as caught:
            act()
        assert caught.value.file == str(file)


def test_a_wrong_name_is_said(tmp_path: Path):
    with pytest.raises(ClearwayError, match="unknown track 'trajectori'; did you mean 'trajectory'"):
        track_of(tmp_path, LINES, Want(frozenset({"trajectori"})))


def test_a_line_without_an_end_holds_no_memory(tmp_path: Path):
    with pytest.raises(ClearwayError, match=r"no table|straddling|longer"):
        track_of(tmp_path, b"1 " * 3_000_000)


def test_what_is_written_comes_back(tmp_path: Path):
    made = capture()
    tum.write(tmp_path / "b.tum", made)
    recording = tum.read(tmp_path / "b.tum", Want())
    track, cart = recording.tracks["trajectory"], made.tracks["cart"]
    seen = np.isfinite(cart.position).all(axis=1)
    assert recording.epoch == pytest.approx(made.epoch)
    np.testing.assert_allclose(track.t, cart.t[seen], atol=3e-7)
    np.testing.assert_allclose(track.position, cart.position[seen], atol=1e-9)
    np.testing.assert_allclose(track.orientation, cart.orientation[seen], atol=1e-9)
    assert tum.sniff(tmp_path / "b.tum", (tmp_path / "b.tum").read_bytes())


def test_without_a_track_there_is_nothing_to_write(tmp_path: Path):
    with pytest.raises(ClearwayError, match="no track"):
        tum.write(tmp_path / "b.tum", replace(capture(), tracks={}))
    with pytest.raises(ClearwayError, match="cannot be written"):
        tum.write(tmp_path / "none" / "b.tum", capture())


@settings(max_examples=80, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_the_file_holds_nothing_but_our_own_error_comes_out(tmp_path: Path, data: st.DataObject):
    nothing_but_clearway_errors(tum.FORMATS[0], tmp_path / "f.tum", data.draw(damaged(LINES.encode() * 2)))


def test_what_nobody_can_have_measured_is_unseen(tmp_path: Path) -> None:
    rows = [f"{i / 100:.2f} {i / 200} 0 0 0 0 0 1" for i in range(300)]
    rows[100] = "1.00 1e200 0 0 0 0 0 1"
    rows[101] = "1.01 0.505 0 -3e9 0 0 0 1"
    (tmp_path / "a.tum").write_text("\n".join(rows) + "\n")
    found = formats.read(tmp_path / "a.tum")
    position = found.tracks["trajectory"].position
    assert np.flatnonzero(np.isnan(position).any(axis=1)).tolist() == [100, 101]
    assert "trajectory: 2 samples beyond 1e+09 m; taken as unseen" in found.notes
