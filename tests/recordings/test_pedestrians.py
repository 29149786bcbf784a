"""Pedestrian sets: their layouts, the convention where a rate is missing, and what nobody walks like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from text_captures import damaged, nothing_but_clearway_errors

from clearway.errors import ClearwayError
from clearway.recordings.formats import pedestrians
from clearway.recordings.recording import Recording, Want

READ = pedestrians.FORMATS[0].read


def walkers(step: int = 10, speed: float = 1.2, people: int = 3, samples: int = 20) -> np.ndarray:
    """(n, 4) frame, id, x, y, as they are annotated every 0.4 s, sorted by frame."""
    rows = [
        (step * k, i + 1, 0.1 + speed * 0.4 * k, (0.0, 1.05, 3.4)[i] + 0.003 * k)
        for k in range(samples)
        for i in range(people)
    ]
    return np.array(rows)


def read(folder: Path, text: str, want: Want | None = None, toml: str | None = None) -> Recording:
    file = folder / "people.txt"
    file.write_text(text)
    beside = folder / "people.txt.toml"
    beside.unlink(missing_ok=True)
    if toml is not None:
        beside.write_text(toml)
    assert pedestrians.sniff(file, text.encode()[:65536])
    return READ(file, want or Want())


def lines(rows: np.ndarray, blank: str = "\t", form: str = "{:g}") -> str:
    return "".join(blank.join(form.format(v) for v in row) + "\n" for row in rows)


@pytest.mark.parametrize("form", ["{:g}", "{:.1f}", "{:.7e}"])
@pytest.mark.parametrize("blank", [" ", "\t", ",", "   "])
def test_frame_id_x_y(tmp_path: Path, blank: str, form: str):
    rows = walkers()
    recording = read(tmp_path, lines(rows, blank, form))
    assert list(recording.tracks) == ["1", "2", "3"]
    track = recording.tracks["2"]
    assert track.kind == "person"
    assert track.orientation is None
    np.testing.assert_allclose(track.t, np.arange(20) * 0.4)
    np.testing.assert_allclose(track.position[:, :2], rows[rows[:, 1] == 2, 2:], atol=0.051)
    assert (track.position[:, 2] == 0).all()


def test_the_convention_is_taken_and_said(tmp_path: Path):
    notes = " ".join(read(tmp_path, lines(walkers(step=6))).notes)
    assert "0.4 s" in notes
    assert "6 frame numbers apart (15 a second)" in notes
    assert "taken as metres" in notes


def test_a_rate_beside_the_file_counts(tmp_path: Path):
    recording = read(tmp_path, lines(walkers()), toml='rate = 20\nunits = "m"')
    np.testing.assert_allclose(recording.tracks["1"].t[:3], [0, 0.5, 1.0])
    assert not any("convention" in n or "metres" in n for n in recording.notes)


@pytest.mark.parametrize(("speed", "told"), [(8.0, "8 m/s"), (0.05, "0.05")])
def test_what_nobody_walks_like_is_refused(tmp_path: Path, speed: float, told: str):
    with pytest.raises(ClearwayError, match=rf"faster than .*{told}.*people\.txt\.toml.*rate = 25") as caught:
        read(tmp_path, lines(walkers(speed=speed)))
    assert caught.value.field == "rate"
    assert read(tmp_path, lines(walkers(speed=speed)), toml='rate = 25\nunits = "m"').tracks


def test_people_are_listed_before_the_rate_is_known(tmp_path: Path):
    (tmp_path / "people.txt").write_text(lines(walkers(step=1, speed=0.05)))
    contents = pedestrians.look(tmp_path / "people.txt")
    assert [(e.name, e.count, e.detail) for e in contents.entries] == [(n, 20, "frames 0 to 19") for n in "123"]
    assert contents.start is None
    assert "rate = 25" in contents.notes[0]


def test_a_run_is_remarked_on(tmp_path: Path):
    assert any("check the rate" in n for n in read(tmp_path, lines(walkers(speed=2.8))).notes)


def test_a_jam_that_is_timed_may_stand(tmp_path: Path):
    assert read(tmp_path, lines(walkers(speed=0.01)), toml="rate = 25").tracks


def test_eths_own_files_have_the_ground_in_x_and_z(tmp_path: Path):
    rows = walkers(step=6)
    wide = np.column_stack((rows[:, :3], np.zeros(len(rows)), rows[:, 3], np.ones(len(rows)), np.zeros((len(rows), 2))))
    track = read(tmp_path, lines(wide, "   ", "{:.7e}")).tracks["3"]
    np.testing.assert_allclose(track.position[:, :2], rows[rows[:, 1] == 3, 2:], atol=1e-6)


@pytest.mark.parametrize(
    "header",
    [
        "frame,id,x,y",
        "frame_id,pedestrian_id,pos_x,pos_y",
        "Frame, ID, X, Y",
        "fr,ped_id,x [m],y [m]",
        "frame,agent_id,x/m,y/m",
    ],
)
def test_headers(tmp_path: Path, header: str):
    track = read(tmp_path, header + "\n" + lines(walkers(), ",")).tracks["1"]
    np.testing.assert_allclose(track.t[:2], [0, 0.4])


def test_a_header_says_units_and_order(tmp_path: Path):
    rows = walkers()
    text = "id;x/cm;y/cm;frame;kind\n" + "".join(f"{i:g};{100 * x:g};{100 * y:g};{f:g};adult\n" for f, i, x, y in rows)
    recording = read(tmp_path, text)
    np.testing.assert_allclose(recording.tracks["2"].position[:, :2], rows[rows[:, 1] == 2, 2:], atol=1e-4)
    assert not any("metres" in n for n in recording.notes)


def test_time_instead_of_frames_and_names_instead_of_numbers(tmp_path: Path):
    text = "time,person,x,y\n" + "".join(f"{1.7e9 + 0.5 * k},anna {i},{k / 2},{i}\n" for k in range(9) for i in (1, 2))
    recording = read(tmp_path, text)
    assert list(recording.tracks) == ["anna 1", "anna 2"]
    assert recording.epoch == 1.7e9
    np.testing.assert_allclose(recording.tracks["anna 1"].t, np.arange(9) / 2)


def test_a_comment_names_columns_and_rate(tmp_path: Path):
    rows = walkers(step=1, speed=1.2 / 0.4 / 16)
    text = "# description: a\n#framerate: 16\n# ID\tFR\tX\tY\tZ\n" + "".join(
        f"{i:g}\t{f:g}\t{x}\t{y}\t1.7\n" for f, i, x, y in rows[np.argsort(rows[:, 1], kind="stable")]
    )
    recording = read(tmp_path, text)
    np.testing.assert_allclose(recording.tracks["1"].t[:3], [0, 1 / 16, 2 / 16])
    assert any("16 frame numbers a second, as stated" in n for n in recording.notes)


def test_id_before_frame_is_told_by_people_not_leaping(tmp_path: Path):
    rows = walkers()
    by_person = rows[np.argsort(rows[:, 1], kind="stable")][:, [1, 0, 2, 3]]
    recording = read(tmp_path, lines(by_person, " "))
    assert list(recording.tracks) == ["1", "2", "3"]
    np.testing.assert_allclose(recording.tracks["2"].position[:, 0], rows[rows[:, 1] == 2, 2], atol=1e-5)
    assert any("leap" in n for n in recording.notes)
    again = read(tmp_path, lines(rows[np.argsort(rows[:, 1], kind="stable")], " "))
    np.testing.assert_allclose(again.tracks["2"].position[:, 0], rows[rows[:, 1] == 2, 2], atol=1e-5)


def test_one_person_under_three_spellings(tmp_path: Path):
    text = "0 7 0 0.5\n10 7.0 0.4 0.5\n20 7.0e+00 0.8 0.5\n30 7 1.2 0.5\n"
    assert len(read(tmp_path, text).tracks["7"].t) == 4


def test_lines_in_any_order_and_twice(tmp_path: Path):
    rows = walkers()
    shuffled = np.random.default_rng(1).permutation(np.concatenate((rows[:30], rows[30:], rows[:1])))
    text = "frame,id,x,y\n" + lines(shuffled, ",")
    recording = read(tmp_path, text)
    assert all((np.diff(t.t) > 0).all() for t in recording.tracks.values())
    assert any("1 lines had the time of another" in n for n in recording.notes)


def test_only_who_and_when_is_wanted(tmp_path: Path):
    recording = read(tmp_path, lines(walkers()), Want(frozenset({"2"}), (0.4, 1.2)))
    assert list(recording.tracks) == ["2"]
    np.testing.assert_allclose(recording.tracks["2"].t, [0.4, 0.8, 1.2])
    with pytest.raises(ClearwayError, match="unknown person '9'; known: 1, 2, 3"):
        read(tmp_path, lines(walkers()), Want(frozenset({"9"})))


def test_a_gap_is_nan_and_listed(tmp_path: Path):
    rows = walkers(people=1)
    text = "frame,id,x,y\n" + lines(rows, ",").replace(lines(rows[5:6], ","), f"{rows[5, 0]:g},1,nan,\n")
    track = read(tmp_path, text).tracks["1"]
    assert np.isnan(track.position[5]).all()
    assert pedestrians.look(tmp_path / "people.txt").entries[0].missing == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello\nworld\n", "none of the known pedestrian texts"),
        ("1 2\n3 4\n", "none of the known pedestrian texts"),
        ("frame,id,x,y\n0,1,0.5,0.5\n,1,0.9,0.5\n", "line 2 of its data has no frame"),
        ("frame,id,x,y\n0,1,0.5,0.5\n10,,0.9,0.5\n", "line 2 of its data has no id"),
        ("frame,id,x,y\n" + "0,1,0.5,0.5\n" * 500 + "10,1,0.9\n", "4 columns"),
        ("frame id x y\n" + "0 1 0.5 0.5\n10 1 0.9 0.5\n" * 300 + "20 1 x 0.5\n", "column 'x'.*'x'"),
        ("", "is empty"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, message: str):
    file = tmp_path / "people.txt"
    file.write_text(text)
    for act in (lambda: READ(file, Want()), lambda: pedestrians.look(file)):
        with pytest.raises(ClearwayError, match=message):
            act()


def test_one_line_gives_no_time(tmp_path: Path):
    with pytest.raises(ClearwayError, match="nobody is in two frames"):
        read(tmp_path, "frame,id,x,y\n0,1,0.5,0.5\n")


def test_a_wrong_hint_is_said(tmp_path: Path):
    with pytest.raises(ClearwayError, match="did you mean 'rate'") as caught:
        read(tmp_path, lines(walkers()), toml="rates = 25")
    assert str(caught.value.file).endswith("people.txt.toml")


@settings(max_examples=80, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_the_file_holds_nothing_but_our_own_error_comes_out(tmp_path: Path, data: st.DataObject):
    files = [lines(walkers()).encode(), ("#framerate: 16\n# ID FR X Y\n" + lines(walkers(), " ")).encode()]
    files.append(("time,id,x [cm],y [cm]\n" + lines(walkers(), ",")).encode())
    content = data.draw(st.one_of(*(damaged(f) for f in files)))
    nothing_but_clearway_errors(pedestrians.FORMATS[0], tmp_path / "f.txt", content)
