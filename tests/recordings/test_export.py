"""Exports: what stands in the files, read back by something else than what wrote them where there is such a thing."""

from __future__ import annotations

import contextlib
import csv
import json
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from driven_trials import forth_and_back

from clearway.contract import PLACED
from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.recordings import formats
from clearway.recordings.exports.export import (
    CAPTURES,
    TARGETS,
    columns,
    export,
    export_trials,
    settings,
    telling_name,
)
from clearway.recordings.exports.synthetic import System
from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.lab.lab import Lab
from clearway.trials.keeping import outline


@pytest.fixture(scope="module")
def trial():
    return forth_and_back()


class Shelf:
    """Trials by their number."""

    def __init__(self, *trials):
        self.trials = trials

    def __len__(self):
        return len(self.trials)

    def trial(self, index):
        return self.trials[index]

    remains = trial


def test_csv_has_every_number_in_full_with_its_unit(trial, tmp_path):
    files = export(trial, "csv", tmp_path / "trial.csv")
    with open(files[0], newline="") as f:
        header, *rows = csv.reader(f)
    assert header[:6] == [
        "t [s]",
        "robot x [m]",
        "robot y [m]",
        "robot theta [rad]",
        "robot v [m/s]",
        "robot omega [rad/s]",
    ]
    assert header[-6:] == [
        f"{who} {c}" for who in ("square_300", "person_500") for c in ("x [m]", "y [m]", "theta [rad]")
    ]
    table = np.array([[float(v) if v else math.nan for v in row] for row in rows])
    expected = np.column_stack(list(columns(trial).values()))
    np.testing.assert_array_equal(table, expected)
    np.testing.assert_array_equal(table[:, 1:4], trial.pose)


def test_bodies_of_one_name_are_numbered(trial, tmp_path):
    """What a file can hold of two names may be the same, or they are: none is lost."""
    square, person = (body for body in trial.attempt.bodies if body.kind in PLACED)
    twins = replace(
        trial,
        attempt=replace(trial.attempt, bodies=(square, replace(square, pose=square.pose + 1.0), person, person)),
        moving_obstacles=np.concatenate([trial.moving_obstacles, trial.moving_obstacles + 1.0], axis=1),
    )
    named = ["square_300", "square_300_2", "person_500", "person_500_2"]
    csv_file, *_ = export(twins, "csv", tmp_path / "trial.csv")
    assert list(formats.read(csv_file).tracks)[2:] == named
    capture, plan, *_ = export(twins, "trc", tmp_path / "trial.trc")
    assert {name.split(":")[0] for name in formats.read(capture).points.names} == {"robot", *named}
    assert all(f"[bodies.{name}]" in plan.read_text() for name in named)


def test_csv_is_read_again_by_what_stands_beside_it(trial, tmp_path):
    file, _ = export(trial, "csv", tmp_path / "trial.csv")
    tracks = formats.read(file).tracks
    assert list(tracks) == ["robot", "estimate", "square_300", "person_500"]
    np.testing.assert_allclose(tracks["robot"].position[:, :2], trial.pose[:, :2], atol=1e-12)
    np.testing.assert_array_equal(tracks["robot"].twist, trial.velocity)
    assert np.isnan(tracks["person_500"].position[:, 0]).sum() == np.isnan(trial.moving_obstacles[:, 0, 0]).sum()


def test_tum_true_and_estimate_apart(trial, tmp_path):
    true, estimate = export(trial, "tum", tmp_path / "trial.tum")
    assert (true.name, estimate.name) == ("trial.true.tum", "trial.estimate.tum")
    rows = np.loadtxt(true)
    np.testing.assert_allclose(rows[:, :3], np.column_stack([trial.t, trial.pose[:, :2]]), atol=1e-8)
    np.testing.assert_allclose(2 * np.arctan2(rows[:, 6], rows[:, 7]), trial.pose[:, 2], atol=1e-9)
    np.testing.assert_allclose(np.loadtxt(estimate)[:, 1], trial.pose[:, 0] + 0.01, atol=1e-8)
    assert [f.name for f in export(trial, "tum", tmp_path / "one.tum", which="estimate")] == ["one.tum"]


def test_tum_without_an_estimate(trial, tmp_path):
    unknowing = replace(trial, estimate=None)
    assert [f.name for f in export(unknowing, "tum", tmp_path / "a.tum")] == ["a.tum"]
    with pytest.raises(ClearwayError, match="estimate"):
        export(unknowing, "tum", tmp_path / "b.tum", which="estimate")


@pytest.mark.parametrize("to", CAPTURES)
def test_capture_layouts_come_back_as_they_went(trial, tmp_path, to):
    """Exact, without noise: every marker or body to the last digit that the layout prints, at 100 Hz, in metres and z-up."""
    file, _ = export(trial, to, tmp_path / f"trial{TARGETS[to]}")
    found = formats.read(file)
    assert found.format == to
    if to == "qualisys-6d":
        robot = found.tracks["robot"]
        t, at = robot.t, robot.position[:, :2]
        np.testing.assert_allclose(at[::10], trial.pose[:, :2], atol=2e-6)
    else:
        points = found.points
        t = points.t
        middle = points.xyz[::10, :8, :2].mean(axis=1)
        c, s = np.cos(trial.pose[:, 2]), np.sin(trial.pose[:, 2])
        a, b = np.array(list(_robot(trial).values()))[:, :2].mean(axis=0)
        expected = trial.pose[:, :2] + np.column_stack([c * a - s * b, s * a + c * b])
        np.testing.assert_allclose(middle, expected, atol=2e-6)
    np.testing.assert_allclose(np.diff(t), 0.01, atol=1e-6)


def _robot(trial):
    from clearway.recordings.exports.synthetic import marker_sets

    return marker_sets(trial)["robot"]


@pytest.mark.parametrize("to", ["csv", "tum", "vicon", "c3d"])
def test_nothing_is_overwritten(trial, tmp_path, to):
    path = tmp_path / f"trial{TARGETS[to]}"
    files = export(trial, to, path, which="true")
    before = [f.read_bytes() for f in files]
    with pytest.raises(ClearwayError, match="there already"):
        export(forth_and_back(moving_obstacle=False), to, path, which="true")
    assert [f.read_bytes() for f in files] == before


def test_same_seed_same_file(trial, tmp_path):
    noisy = System(noise=0.0005, gaps=0.02, seed=7)
    one, other = (export(trial, "vicon", tmp_path / f"{i}.csv", system=noisy)[0].read_bytes() for i in (1, 2))
    assert one == other


def test_several_go_into_a_folder_under_telling_names(trial, tmp_path):
    files, _ = export_trials(Shelf(trial, forth_and_back(moving_obstacle=False)), (0, 1), "csv", tmp_path / "out")
    assert [f.name for f in files if f.suffix == ".csv"] == [
        "0000-CE-complex-v0.6-o0.4-s0.3-r1.csv", "0001-CE-complex-v0.6-o0.4-s0.3-r1.csv"
    ]  # fmt: skip
    named = replace(trial, attempt=replace(trial.attempt, scenario="../odd name"))
    assert telling_name(named, 3, "mcap") == "0003-.._odd_name.mcap"


def test_of_all_those_that_were_not_recorded_are_left_out(trial, tmp_path):
    unrecorded = replace(trial, pose=np.full_like(trial.pose, np.nan))
    files, left_out = export_trials(
        Shelf(unrecorded, trial, unrecorded, trial), None, "tum", tmp_path / "out", which="true"
    )
    assert ([f.name[:4] for f in files], left_out) == (["0001", "0003"], (0, 2))
    with pytest.raises(ClearwayError, match="was not recorded"):
        export_trials(Shelf(unrecorded, trial), (0, 1), "tum", tmp_path / "other")
    with pytest.raises(ClearwayError, match="no trial was recorded"):
        export_trials(Shelf(unrecorded), None, "tum", tmp_path / "none")


def test_all_is_looked_at_before_anything_is_written(trial, tmp_path):
    files, left_out = export_trials(Shelf(outline(trial, "table"), trial), None, "csv", tmp_path / "out")
    assert ({f.name[:4] for f in files}, left_out) == ({"0001"}, (0,))
    with pytest.raises(ClearwayError, match=r"0001-.*: is there already"):
        export_trials(Shelf(trial, trial), None, "csv", tmp_path / "out")
    assert not list((tmp_path / "out").glob("0000-*"))
    with pytest.raises(ClearwayError, match="0 is named twice"):
        export_trials(Shelf(trial), (0, 0), "csv", tmp_path / "twice")
    assert not (tmp_path / "twice").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ({"to": "vicom"}, "did you mean 'vicon'"),
        ({"wanted": ()}, "--trial"),
        ({"which": "treu"}, "did you mean 'true'"),
    ],
)
def test_what_is_asked_wrongly_is_told(trial, tmp_path, words, told):
    asked = {"to": "tum", "wanted": (0,), "which": "both"} | words
    with pytest.raises(ClearwayError, match=told):
        export_trials(Shelf(trial), asked["wanted"], asked["to"], tmp_path / "x", which=asked["which"])


@pytest.mark.parametrize("to", ["vicon", "qualisys-6d"])
def test_a_capture_is_scored_by_the_markers_beside_it_and_rests_before_and_after(trial, tmp_path, to):
    """Nothing but what was written, and where the robot was to go: MDO is the formula's, 0.38 m."""
    file = tmp_path / f"trial{TARGETS[to]}"
    files, _ = export_trials(Shelf(trial), (0,), to, file, **settings(to, {"noise": 0.0005}))
    assert [f.name for f in files] == [file.name, f"{file.name}.markers.toml"]
    said = files[1].read_text()
    assert "begins at 2 s" in said
    obstacles = ", ".join(f'{{ body = "{name}" }}' for name in tomllib.loads(said)["bodies"])
    (tmp_path / "plan.toml").write_text(
        'legs = [{ name = "forth", start = [-2.5, 1, 0], goal = [2.5, 1, 0] }, { name = "turn", goal = [2.5, 1, 3.14159], scored = '
        'false }, { name = "back", goal = [-2.5, 1, 3.14159] }]\n[test]\nrobot = "tiago"\n[sources.capture]\n'
        f'format = "{to}"\nframe = {{ same = true }}\n{said}\n[[trial]]\nfile = "{file.name}"\nobstacles = [{obstacles}]\n'
    )
    assert problems_of(tmp_path / "plan.toml") == []
    found = assemble(Lab(tmp_path / "plan.toml"), 0)
    assert score_row(found)["MDO"] == pytest.approx(0.38, abs=0.005)
    assert found.t[-1] == pytest.approx(trial.t[-1] + 4.0, abs=0.02)
    for rest in (found.t < 1.9, found.t > found.t[-1] - 1.9):
        assert np.ptp(found.pose[rest, :2], axis=0).max() < 0.005


@pytest.mark.parametrize(
    ("to", "said", "told"),
    [
        ("mcap", {"noise": 0.001}, "--noise: means nothing for mcap, only for vicon"),
        ("csv", {"lead": 2.0}, "--lead: means nothing for csv"),
        ("vicon", {"which": "true"}, "--which: means nothing for vicon, only for tum"),
        ("tum", {"scans": False}, "--scans: means nothing for tum, only for mcap"),
        ("vicom", {}, "did you mean 'vicon'"),
        ("vicon", {"lead": -1.0}, "lead: -1.0 is wrong"),
    ],
)
def test_what_means_nothing_for_a_format_is_refused(to, said, told):
    with pytest.raises(ClearwayError) as caught:
        settings(to, said)
    assert told in str(caught.value)


def test_what_was_not_said_is_as_it_was():
    assert settings("mcap", {"noise": None, "scans": None, "which": None}) == {}
    assert settings("vicon", {"rate": 50.0})["system"] == System(rate=50.0, lead=2.0, tail=2.0)
    assert settings("c3d", {"lead": 0.0})["system"] == System()


def test_an_attempt_that_was_not_recorded_has_nothing_to_export(trial, tmp_path):
    empty = replace(trial, t=np.zeros(1), pose=np.full((1, 3), np.nan), velocity=None, estimate=None,
                    moving_obstacles=np.full((1, 1, 3), np.nan), leg=np.zeros(1, dtype=int), spans=())  # fmt: skip
    with pytest.raises(ClearwayError, match="not recorded"):
        export(empty, "csv", tmp_path / "x.csv")


def said(monkeypatch, capsys, *words):
    from clearway.cli import main

    monkeypatch.setattr("sys.argv", ["clearway", "export", *map(str, words), "--json"])
    with contextlib.suppress(SystemExit):
        main()
    return json.loads(capsys.readouterr().out)["files"]


def test_command_line(trial, tmp_path, monkeypatch, capsys):
    from clearway.indicators import row_schema, score_row
    from clearway.trials.store import TrialStore, write_partial

    with TrialStore(tmp_path / "results", {"plan": {}}, 2, row_schema()) as store:
        for i in range(2):
            write_partial(store.partial, store.key, i, trial, {"id": str(i)} | score_row(trial))
        store.finish()
    results, out = tmp_path / "results", tmp_path / "out"
    files = said(monkeypatch, capsys, results, "--all", "--to", "tum", "--which", "true", "--out", out)
    assert len(files) == 2
    np.testing.assert_allclose(np.loadtxt(files[1])[:, 1], trial.pose[:, 0], atol=1e-8)
    for to in TARGETS:
        assert said(monkeypatch, capsys, results, "--trial", 0, "--to", to, "--out", tmp_path / f"as-{to}")
