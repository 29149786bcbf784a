"""What the readers of text captures have in common: round trips, wants, bad input, bounded memory."""

from __future__ import annotations

import importlib
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from text_captures import capture, damaged, nothing_but_clearway_errors

from clearway.errors import ClearwayError
from clearway.recordings.formats.format import Format
from clearway.recordings.recording import Points, Want


def _formats() -> dict[str, Format]:
    modules = [
        importlib.import_module(f"clearway.recordings.formats.{m}") for m in ("vicon", "motive", "qualisys", "trc")
    ]
    return {f.name: f for m in modules for f in m.FORMATS}


FORMATS = _formats()
MARKERS = [n for n in FORMATS if n != "qualisys-6d"]
BODIES = ["motive", "motive-z-up", "qualisys-6d"]
SNIFFED = ["vicon", "motive", "qualisys", "qualisys-6d", "trc"]


def written(name: str, folder: Path) -> Path:
    path = folder / f"capture.{name}"
    FORMATS[name].write(path, capture())
    return path


@pytest.mark.parametrize("name", MARKERS)
def test_markers_come_back_as_they_went(name: str, tmp_path: Path) -> None:
    made, back = capture().points, FORMATS[name].read(written(name, tmp_path), Want()).points
    assert made is not None
    assert back is not None
    assert back.names == made.names
    assert np.allclose(back.t, made.t, atol=1e-9)
    assert np.allclose(back.xyz, made.xyz, atol=1e-6, equal_nan=True)
    assert np.isnan(back.xyz[5:9, 1]).all()


@pytest.mark.parametrize("name", BODIES)
def test_bodies_come_back_as_they_went(name: str, tmp_path: Path) -> None:
    made, back = capture().tracks, FORMATS[name].read(written(name, tmp_path), Want()).tracks
    assert list(back) == list(made)
    for body, track in made.items():
        assert np.allclose(back[body].t, track.t, atol=1e-9)
        assert np.allclose(back[body].position, track.position, atol=1e-6, equal_nan=True)
        there, was = back[body].orientation, track.orientation
        assert there is not None
        assert was is not None
        sign = np.sign((there * was).sum(axis=1, keepdims=True))
        assert np.allclose(there * sign, was, atol=1e-6, equal_nan=True)


@pytest.mark.parametrize("name", ["motive", "qualisys", "qualisys-6d"])
def test_the_date_comes_back(name: str, tmp_path: Path) -> None:
    assert FORMATS[name].read(written(name, tmp_path), Want()).epoch == pytest.approx(1_700_000_000.25, abs=1e-3)


@pytest.mark.parametrize("name", SNIFFED)
def test_a_file_is_recognised_by_its_own_format_only(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    head = path.read_bytes()[:65536]
    assert [n for n in FORMATS if FORMATS[n].sniff(path, head)] == [name]
    assert [n for n in FORMATS if FORMATS[n].sniff(path, head.decode().encode("utf-16"))] == [name]


@pytest.mark.parametrize("name", MARKERS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"])
def test_any_encoding_and_line_end_reads_alike(name: str, encoding: str, tmp_path: Path) -> None:
    made = capture()
    assert made.points is not None
    named = replace(made, points=Points(("chariot:à", "chariot:é", "c"), made.points.t, made.points.xyz))
    path = tmp_path / "a.txt"
    FORMATS[name].write(path, named)
    path.write_bytes(path.read_bytes().decode().replace("\r\n", "\n").encode(encoding))
    back = FORMATS[name].read(path, Want()).points
    assert back is not None
    assert back.names == ("chariot:à", "chariot:é", "c")
    assert np.allclose(back.xyz, made.points.xyz, atol=1e-6, equal_nan=True)


@pytest.mark.parametrize("name", ["vicon", "motive", "trc"])
def test_semicolons_and_decimal_commas_read_alike(name: str, tmp_path: Path) -> None:
    plain = written(name, tmp_path)
    german = tmp_path / "german.csv"
    separator = b"\t" if name == "trc" else b","
    german.write_bytes(plain.read_bytes().replace(separator, b";").replace(b".", b","))
    points = FORMATS[name].read(german, Want()).points
    assert points is not None
    assert np.allclose(points.xyz, capture().points.xyz, atol=1e-6, equal_nan=True)


@pytest.mark.parametrize("name", MARKERS)
def test_only_what_is_wanted_is_read(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    part = FORMATS[name].read(path, Want(names=frozenset({"cart:c"}), span=(0.05, 0.2)))
    assert part.points is not None
    assert part.points.names == ("cart:c",)
    assert not part.tracks
    assert part.points.t[[0, -1]] == pytest.approx([0.05, 0.2])
    assert np.allclose(part.points.xyz[:, 0], capture().points.xyz[5:21, 2], atol=1e-6)


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_name_that_is_not_there_brings_the_closest(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    with pytest.raises(ClearwayError, match=r"unknown marker or body 'crat.*did you mean '(cart|cart:a)'"):
        FORMATS[name].read(path, Want(names=frozenset({"crat" if name == "qualisys-6d" else "crat:a"})))


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_span_beside_the_file_says_what_there_is(name: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=r"nothing between 5 and 6 s; it runs from 0 to 0\.39 s"):
        FORMATS[name].read(written(name, tmp_path), Want(span=(5.0, 6.0)))


@pytest.mark.parametrize("name", list(FORMATS))
def test_look_tells_what_read_would_give(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    seen, whole = FORMATS[name].look(path), FORMATS[name].read(path, Want())
    by_name = {e.name: e for e in seen.entries}
    markers = whole.points.names if whole.points is not None else ()
    assert set(by_name) == {*markers, *whole.tracks}
    assert (seen.start, seen.end, seen.epoch) == (0.0, pytest.approx(0.39), whole.epoch)
    if "cart:b" in by_name:
        assert (by_name["cart:b"].kind, by_name["cart:b"].count) == ("marker", 36)
        assert by_name["cart:b"].longest_gap == pytest.approx(0.05)
        assert by_name["cart:b"].rate == pytest.approx(100)
    if "cart" in by_name:
        assert (by_name["cart"].kind, by_name["cart"].count) == ("body", 38)


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_file_that_was_cut_off_is_read_up_to_there(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    path.write_bytes(path.read_bytes()[:-40])
    back = FORMATS[name].read(path, Want())
    t = back.points.t if back.points is not None else back.tracks["cart"].t
    assert len(t) == 39
    assert any("taken as cut off" in note for note in back.notes)
    if name != "vicon":  # Nexus doesn't say how many frames there should be
        assert any("announces 40 frames, there are 39" in note for note in back.notes)


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_last_line_without_an_end_counts(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    whole = FORMATS[name].read(path, Want())
    path.write_bytes(path.read_bytes().rstrip(b"\r\n"))
    back = FORMATS[name].read(path, Want())
    if whole.points is not None:
        assert back.points is not None
        np.testing.assert_array_equal(back.points.xyz, whole.points.xyz)
    for track, other in zip(back.tracks.values(), whole.tracks.values(), strict=True):
        np.testing.assert_array_equal(track.position, other.position)
    assert back.notes == whole.notes
    path.write_bytes(path.read_bytes() + b"-")  # half a number is none
    assert any("taken as cut off" in note for note in FORMATS[name].read(path, Want()).notes)


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_header_alone_is_said_to_have_no_frames(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    lines = path.read_bytes().split(b"\r\n")
    first = next(
        i
        for i, line in enumerate(lines)
        if line[:2] in (b"1,", b"0,", b"1\t", b"0\t") and i > 2 and line.count(line[1:2]) > 8
    )
    path.write_bytes(b"\r\n".join(lines[:first]) + b"\r\n")
    with pytest.raises(ClearwayError, match="no frames"):
        FORMATS[name].read(path, Want())


@pytest.mark.parametrize("name", list(FORMATS))
@pytest.mark.parametrize(
    ("cell", "problem"), [(b"abc", "'abc' is no number"), (b"1.2.3", "is no number"), (b"0x1f", "is no number")]
)
def test_a_cell_that_is_no_number_is_named(name: str, cell: bytes, problem: str, tmp_path: Path) -> None:
    path, line = _spoiled(name, tmp_path, cell)
    with pytest.raises(ClearwayError, match=rf"line {line}, column \d+: .*{problem}" if cell != b"abc" else problem):
        FORMATS[name].read(path, Want())


@pytest.mark.parametrize("name", list(FORMATS))
@pytest.mark.parametrize("cell", [b"NaN", b"nan", b"inf", b"-inf", b"NULL", b"1e999", b" ", b"-nan(ind)"])
def test_a_cell_that_says_nothing_is_unseen(name: str, cell: bytes, tmp_path: Path) -> None:
    path, _ = _spoiled(name, tmp_path, cell)
    back = FORMATS[name].read(path, Want())
    if back.points is not None:
        assert np.isnan(back.points.xyz[20, 2]).all()
    else:
        box = back.tracks["box"].orientation
        assert box is not None
        assert np.isnan(box[20]).all()


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_line_that_is_too_long_is_named(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    separator = b"," if name in ("vicon", "motive", "motive-z-up") else b"\t"
    lines = path.read_bytes().split(b"\r\n")
    lines[-10] += separator + b"7" + separator + b"8"
    path.write_bytes(b"\r\n".join(lines))
    with pytest.raises(ClearwayError, match=rf"line {len(lines) - 9} has \d+ columns"):
        FORMATS[name].read(path, Want())


@pytest.mark.parametrize("name", list(FORMATS))
def test_frames_that_go_back_or_come_twice(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    lines = path.read_bytes().split(b"\r\n")
    path.write_bytes(b"\r\n".join([*lines[:-10], lines[-11], *lines[-10:]]))
    twice = FORMATS[name].read(path, Want())
    assert len((twice.points or twice.tracks["cart"]).t) == 40
    assert any("had the stamp of the one before" in note for note in twice.notes)
    lines[-10], lines[-5] = lines[-5], lines[-10]
    path.write_bytes(b"\r\n".join(lines))
    with pytest.raises(ClearwayError, match="time goes backwards"):
        FORMATS[name].read(path, Want())


@pytest.mark.parametrize("name", ["motive", "motive-z-up", "qualisys", "qualisys-6d", "trc"])
def test_an_absurd_number_of_frames_is_refused(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    text = path.read_text()
    for key in ("Total Exported Frames,40", "NO_OF_FRAMES\t40", "100\t100\t40"):
        text = text.replace(key, key + "0000000000000")
    path.write_text(text)
    with pytest.raises(ClearwayError, match="more than it can hold"):
        FORMATS[name].read(path, Want())


@pytest.mark.parametrize("name", MARKERS)
def test_the_same_name_twice_and_trajectories_without_one(name: str, tmp_path: Path) -> None:
    made = capture()
    assert made.points is not None
    path = tmp_path / "a.txt"
    FORMATS[name].write(
        path, replace(made, points=Points(("a", "a", "*12"), made.points.t, made.points.xyz), tracks={})
    )
    back = FORMATS[name].read(path, Want())
    assert back.points is not None
    assert back.points.names == ("a", "a (2)")
    assert any("called 'a'" in note for note in back.notes)
    assert any("1 unlabelled" in note for note in back.notes)
    asked = FORMATS[name].read(path, Want(names=frozenset({"*12"}))).points
    assert asked is not None
    assert np.allclose(asked.xyz[:, 0], made.points.xyz[:, 2], atol=1e-6)
    assert {e.name: e.detail for e in FORMATS[name].look(path).entries}["*12"] == "unlabelled"


@pytest.mark.parametrize("name", ["vicon", "trc", "trc-y-up", "motive", "motive-z-up", "qualisys"])
def test_a_wrong_axis_up_is_refused_rather_than_flattened(name: str, tmp_path: Path) -> None:
    made = capture(n=200)
    assert made.points is not None
    t = made.points.t
    drive = np.stack((1.0 * t, 0.6 * t, np.full_like(t, 0.3)), axis=1)[:, None] + np.array(
        [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
    )
    level = replace(made, points=Points(made.points.names, t, drive), tracks={})
    path = tmp_path / "a.txt"
    FORMATS[name].write(path, level)
    assert FORMATS[name].read(path, Want()).points is not None
    climbing = np.stack((drive[..., 0], drive[..., 2], -drive[..., 1]), axis=-1)
    FORMATS[name].write(path, replace(level, points=Points(made.points.names, t, climbing)))
    with pytest.raises(ClearwayError, match="another axis seems to be up"):
        FORMATS[name].read(path, Want())


@pytest.mark.parametrize("name", list(FORMATS))
def test_what_a_file_cannot_hold_is_not_written(name: str, tmp_path: Path) -> None:
    made = capture()
    with pytest.raises(ClearwayError, match=r"has (no|neither)"):
        FORMATS[name].write(tmp_path / "a", replace(made, points=None, tracks={}))
    uneven = made.points.t + np.linspace(0, 0.1, 40) ** 2 * 3
    jumpy = replace(
        made,
        points=Points(made.points.names, uneven, made.points.xyz),
        tracks={k: replace(v, t=uneven) for k, v in made.tracks.items()},
    )
    with pytest.raises(ClearwayError, match="a second throughout"):
        FORMATS[name].write(tmp_path / "a", jumpy)


def test_a_large_file_is_read_within_what_is_wanted(tmp_path: Path) -> None:
    made = capture(n=20_000)
    assert made.points is not None
    many = Points(tuple(f"m{i}" for i in range(60)), made.points.t, np.tile(made.points.xyz, (1, 20, 1)))
    path = tmp_path / "large.csv"
    FORMATS["vicon"].write(path, replace(made, points=many, tracks={}))
    size = path.stat().st_size
    assert size > 25e6
    tracemalloc.start()
    part = FORMATS["vicon"].read(path, Want(names=frozenset({"m3"})))
    peak = tracemalloc.get_traced_memory()[1]
    time.sleep(
        0.2
    )  # Arrow reads ahead in threads, and CPython 3.11 crashes where one of them allocates as tracing ends
    tracemalloc.stop()
    assert part.points is not None
    assert part.points.xyz.shape == (20_000, 1, 3)
    assert peak < 20e6


def test_a_million_lines_that_promise_columns_are_not_made_into_them(tmp_path: Path) -> None:
    path = tmp_path / "bomb.csv"
    m = 5000
    head = f"Trajectories\n100\n,,{',,'.join(f'm{i},' for i in range(m))}\nFrame,Sub Frame{',X,Y,Z' * m}\n,{',mm' * 3 * m}\n"
    path.write_text(head + "1,0\n" * 100_000)
    with pytest.raises(ClearwayError, match=r"most lines up to line \d+ lack columns; each needs 15002"):
        FORMATS["vicon"].read(path, Want())


@pytest.mark.parametrize("name", list(FORMATS))
@given(data=st.data())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True)
def test_a_damaged_file_brings_nothing_but_clearway_errors(name: str, tmp_path: Path, data: st.DataObject) -> None:
    valid = tmp_path / "valid"
    if not valid.exists():
        FORMATS[name].write(valid, capture(n=30))
    nothing_but_clearway_errors(FORMATS[name], tmp_path / "damaged", data.draw(damaged(valid.read_bytes())))


def _spoiled(name: str, folder: Path, cell: bytes) -> tuple[Path, int]:
    """A file whose frame 20 has another last number (of the last marker or body), and that line's number."""
    path = written(name, folder)
    separator = b"," if name in ("vicon", "motive", "motive-z-up") else b"\t"
    lines = path.read_bytes().split(b"\r\n")
    at = len(lines) - 21
    parts = lines[at].split(separator)
    parts[-1] = cell
    lines[at] = separator.join(parts)
    path.write_bytes(b"\r\n".join(lines))
    return path, at + 1
