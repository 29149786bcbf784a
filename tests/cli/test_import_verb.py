"""`clearway import`: what a recording holds, and its motion, before anything was configured."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Shell

from clearway.recordings import formats
from clearway.recordings.recording import Points, Recording

BODY = np.array([[0.2, 0.1, 0.3], [-0.2, 0.15, 0.4], [0.1, -0.25, 0.5], [-0.1, -0.1, 0.9]])


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """10 s at 100 Hz: a robot drives 5 m along y; one of its markers is unseen from 2 to 3 s."""
    t = np.arange(1001) / 100
    xyz = np.column_stack([np.ones(len(t)), 0.5 * t, np.zeros(len(t))])[:, None] + BODY
    xyz[200:300, 3] = np.nan
    path = tmp_path / "drive.csv"
    write = formats.formats()["vicon"].write
    assert write is not None
    write(path, Recording(path, "vicon", Points(tuple(f"tiago:{i}" for i in range(4)), t, xyz)))
    return path


def test_list_shows_names_rates_and_gaps(clearway: Shell, drive: Path):
    said = clearway("import", drive, "--list")
    assert said.code == 0
    assert "Vicon Nexus CSV, 10.000 s" in said.out
    (row,) = [line.split() for line in said.out.splitlines() if line.startswith("tiago:3")]
    assert row == ["tiago:3", "marker", "901", "100", "90.0", "%", "1.010", "0.000", "10.000"]
    assert sum("tiago:" in line for line in said.out.splitlines()) == 4


def test_what_comes_now_and_then_lacks_nothing(clearway: Shell):
    path = Path(__file__).parents[2] / "examples" / "06_score_recordings" / "trial_1.mcap"
    rows = {line.split()[0]: line.split() for line in clearway("import", path, "--list").out.splitlines()}
    (bag,) = json.loads(clearway("import", path, "--list", "--json").out)
    goals = [e["name"] for e in bag["entries"] if e["kind"] == "goal"]
    assert goals
    assert all("%" not in rows[name] for name in goals)
    assert "%" in rows["/amcl_pose"]


def test_a_table_that_nobody_described_was_not_seen_at_all(clearway: Shell, tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("time_ms,x_mm,y_mm\n0,1500,2\n10,1510,2\n")
    said = clearway("import", path, "--list").out
    assert "%" not in said
    assert "0.000" not in said
    assert 'units = "mm"' in said


@pytest.mark.parametrize("name", [".", "/", ".."])
def test_a_folder_is_no_recording(clearway: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str):
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path / "in")
    for words in ((), ("--list",), ("--list", "--format", "table"), ("--list", "--format", "bag")):
        said = clearway.complaint("import", name, *words)
        assert "ValueError" not in said


def test_list_as_json(clearway: Shell, drive: Path):
    (held,) = json.loads(clearway("import", drive, "--list", "--json").out)
    assert held["format"] == "vicon"
    assert held["duration"] == pytest.approx(10.0)
    assert held["entries"][3]["missing"] == pytest.approx(100 / 1001)
    assert held["entries"][3]["longest_gap"] == pytest.approx(1.01)


def test_motion_of_everything(clearway: Shell, drive: Path, tmp_path: Path):
    out = tmp_path / "motions"
    said = clearway("import", drive, "--out", out)
    assert said.code == 0
    assert "1 of 1 bodies" in said.out
    rows = list(csv.DictReader((out / "drive-tiago.csv").read_text().splitlines()))
    assert len(rows) == 1001
    assert float(rows[-1]["y"]) - float(rows[0]["y"]) == pytest.approx(5.0, abs=5e-3)
    assert float(rows[500]["v"]) == pytest.approx(0.5, abs=0.02)
    assert "there already" in clearway.complaint("import", drive, "--out", out)


def test_summary_as_json(clearway: Shell, drive: Path, tmp_path: Path):
    said = clearway("import", drive, "--body", "tiago:", "--cutoff", 6, "--out", tmp_path / "m", "--json")
    (row,) = json.loads(said.out)
    assert row["body"] == "tiago:"
    assert row["cutoff"] == 6.0
    assert row["residual"] < 1e-5
    assert row["length"] == pytest.approx(5.0, abs=0.01)
    assert Path(row["csv"]).is_file()


def test_several_files_are_told_apart(clearway: Shell, drive: Path, tmp_path: Path):
    other = tmp_path / "again.csv"
    other.write_bytes(drive.read_bytes())
    said = clearway("import", drive, other, "--out", tmp_path / "m")
    assert sum(line.startswith(("drive.csv  tiago:", "again.csv  tiago:")) for line in said.out.splitlines()) == 2
    assert {p.name for p in (tmp_path / "m").iterdir()} == {"drive-tiago.csv", "again-tiago.csv"}
    assert clearway("import", drive, other, "--list").out.count("10.000 s") == 2


@pytest.mark.parametrize(
    ("words", "right"),
    [
        (("--body", "tiga:"), "'tiago:'"),
        (("--format", "vico"), "'vicon'"),
        (("--format", "vico", "--list"), "'vicon'"),
        (("--format", "trc", "--list"), "drive.csv"),
        (("--cutoff", "-3"), "Hz"),
    ],
)
def test_wrong_words(clearway: Shell, drive: Path, words: tuple[str, ...], right: str):
    assert right in clearway.complaint("import", drive, *words)


@pytest.mark.parametrize(
    ("content", "problem"),
    [(None, "no such file"), (b"", "is empty"), (b"\x00\x01\x02 nothing that anybody knows", "format")],
)
def test_wrong_files(clearway: Shell, tmp_path: Path, content: bytes | None, problem: str):
    path = tmp_path / "x.bin"
    if content is not None:
        path.write_bytes(content)
    for words in ((), ("--list",)):
        said = clearway.complaint("import", path, *words)
        assert problem in said
        assert "x.bin" in said


def test_a_folder_that_cannot_be_made(clearway: Shell, drive: Path):
    assert "cannot be made" in clearway.complaint("import", drive, "--out", drive / "m")


def test_formats_are_listed(clearway: Shell):
    said = clearway("list", "formats", "--json")
    assert set(json.loads(said.out)["formats"]) == set(formats.formats())
