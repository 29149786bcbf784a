"""Stamps in another unit than seconds are refused with the unit that makes sense of them, and read once it is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_plans import drive

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.recording import Want
from clearway.recordings.times import SECONDS, must_be

UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}
TABLE = 'time = { column = "t"%s }\n[bodies.robot]\nx = "x"\ny = "y"\n'


def tum(path: Path, t: np.ndarray, rows: np.ndarray) -> None:
    zero = np.zeros(len(t))
    lines = np.column_stack([t, rows[:, 1:3], zero, zero, zero, np.sin(rows[:, 3] / 2), np.cos(rows[:, 3] / 2)])
    np.savetxt(path, lines, fmt=["%.3f"] + ["%.9f"] * 7)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("epoch", [0.0, 1.7e9])
def test_a_trajectory_in_another_unit(tmp_path: Path, unit: str, epoch: float) -> None:
    rows, path = drive(), tmp_path / "one.tum"
    tum(path, (rows[:, 0] + epoch) * UNITS[unit], rows)
    with pytest.raises(ClearwayError, match=rf"time = '{unit}' in the test plan's source or in a TOML beside the file"):
        formats.read(path)
    found = formats.read(path, Want(time=unit))
    assert found.tracks["trajectory"].t - found.tracks["trajectory"].t[0] == pytest.approx(rows[:, 0], abs=1e-3)
    assert found.epoch == (pytest.approx(epoch, abs=1e-3) if epoch else None)
    path.with_name("one.tum.toml").write_text(f'time = "{unit}"\n', encoding="utf-8")
    assert formats.look(path).duration == pytest.approx(rows[-1, 0], abs=1e-3)


def test_27_hours_of_milliseconds(tmp_path: Path) -> None:
    t = np.arange(0.0, 97.0, 0.01)
    rows = np.column_stack([t, 0.5 * t, 0 * t, 0 * t])
    tum(tmp_path / "one.tum", t * 1e3, rows)
    with pytest.raises(ClearwayError) as told:
        formats.read(tmp_path / "one.tum")
    assert (
        "read in s it lasts 26.9 h with a sample every 10 s, and moves at 0.0005 m/s; in ms it lasts 97 s, at 100 Hz"
        in str(told.value)
    )
    assert formats.read(tmp_path / "one.tum", Want(time="s")).tracks["trajectory"].t[-1] == pytest.approx(96990.0)


def test_a_fast_capture_in_milliseconds_is_seen_by_its_creeping(tmp_path: Path) -> None:
    """1000 Hz for 30 s would be 1 Hz for 8 hours, but nothing moves at half a millimetre a second."""
    t = np.arange(0.0, 30.0, 0.001)
    tum(tmp_path / "one.tum", t * 1e3, np.column_stack([t, 0.5 * t, 0 * t, 0 * t]))
    with pytest.raises(ClearwayError, match="time = 'ms'"):
        formats.read(tmp_path / "one.tum")


def test_what_is_slow_but_can_be_is_read(tmp_path: Path) -> None:
    """A localisation once in two seconds over an hour; a robot that stood for a day, of which ms would make no sense."""
    t = np.arange(0.0, 3600.0, 2.0)
    tum(tmp_path / "one.tum", t, np.column_stack([t, 0.3 * t, 0 * t, 0 * t]))
    assert formats.read(tmp_path / "one.tum").tracks["trajectory"].t[-1] == pytest.approx(3598.0)
    must_be(
        "s", np.arange(0.0, 300.0, 10.0), None, "", file=None, field="t", said=False
    )  # in ms it would be over in 0.3 s


def test_a_table_says_its_unit_in_its_own_words(tmp_path: Path) -> None:
    rows, path = drive(), tmp_path / "one.csv"
    np.savetxt(path, np.column_stack([rows[:, 0] * 1e3, rows[:, 1:3]]), delimiter=",", header="t,x,y", comments="")
    (tmp_path / "one.csv.toml").write_text(TABLE % "", encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"time of robot: read in s .* say unit = 'ms' in its \[time\]"):
        formats.read(path)
    (tmp_path / "one.csv.toml").write_text(TABLE % ', unit = "ms"', encoding="utf-8")
    assert formats.read(path).tracks["robot"].t == pytest.approx(rows[:, 0], abs=1e-6)
    (tmp_path / "one.csv.toml").write_text(TABLE % ', unit = "us"', encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"read in us it lasts 0\.0192 s .* say unit = 'ms'"):
        formats.read(path)


def test_only_formats_without_a_unit_take_one(tmp_path: Path) -> None:
    rows, path = drive(), tmp_path / "one.csv"
    np.savetxt(path, rows[:, :3], delimiter=",", header="t,x,y", comments="")
    (tmp_path / "one.csv.toml").write_text(TABLE % "", encoding="utf-8")
    with pytest.raises(ClearwayError, match="a file of format 'table' says its times itself"):
        formats.read(path, Want(time="ms"))
    assert set(SECONDS) == {"s", *UNITS}


def test_seconds_that_were_said_to_be_milliseconds_race(tmp_path: Path) -> None:
    """At 10 Hz ten thousand samples a second could be, but nothing drives at 500 m/s."""
    t = np.arange(0.0, 12.0, 0.1)
    np.savetxt(tmp_path / "one.csv", np.column_stack([t, 0.5 * t, 0 * t]), delimiter=",", header="t,x,y", comments="")
    (tmp_path / "one.csv.toml").write_text(TABLE % ', unit = "ms"', encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"moves at 5e\+02 m/s; in s it lasts 11.9 s, at 10 Hz: say unit = 's'"):
        formats.read(tmp_path / "one.csv")


def test_more_samples_a_second_than_anybody_takes() -> None:
    with pytest.raises(ClearwayError, match=r"a sample every 1e-08 s, 1e\+08 Hz: nobody takes so many"):
        must_be("s", np.arange(1000) * 1e-8, None, "", file="one.csv", field="frames", said=False)
