"""People of a recording are read as `clearway import` reads them, or refused in one sentence."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import clearway
from clearway.campaigns.plan import CampaignPlan
from clearway.cli import app
from clearway.errors import ClearwayError
from clearway.scenarios.replayed import made
from clearway.scenarios.suite import Selection

START, GOAL = (-5.0, 0.0, 0.0), (5.0, 0.0)


def written(path: Path, rows: list[tuple[float, int, float, float]], head: str = "t,id,x,y") -> Path:
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n", "utf-8")
    return path


def test_the_recording_that_comes_with_it_is_read_alike() -> None:
    file = Path(str(resources.files("clearway.scenarios"))) / "replayed_people" / "crossing.csv"
    read = clearway.recorded_people(file, START, GOAL)
    assert {w.name: w.track for w in read.walks} == {w.name: w.track for w in made().walks}


def test_a_track_of_many_samples_is_thinned_and_a_gap_makes_two_walks(tmp_path: Path) -> None:
    times = [k / 50 for k in range(500) if not 200 < k < 300]
    file = written(tmp_path / "dense.csv", [(t, 7, round(0.8 * t, 4), 1.0) for t in times])
    walks = clearway.recorded_people(file, START, GOAL).walks
    assert [w.name for w in walks] == ["7, 1", "7, 2"]
    for walk, (begin, end) in zip(walks, ((0.0, 4.0), (6.0, 9.98)), strict=True):
        t, x, _ = np.array(walk.track).T
        assert (t[0], t[-1]) == (begin, end)
        assert np.diff(t).min() >= 0.1 - 1e-6
        assert x == pytest.approx(0.8 * t, abs=1e-3)


def test_a_plan_holds_the_people_so_that_it_can_be_run_again(tmp_path: Path) -> None:
    replay = clearway.recorded_people(
        written(tmp_path / "a.csv", [(k / 2, 1, k / 2, 0.0) for k in range(20)]), START, GOAL
    )
    plan = CampaignPlan(suites=("replayed",), selection=Selection(replay=replay))
    again = CampaignPlan.from_json(plan.to_json())
    assert again.selection.replay == replay
    assert [s.scenario for s in again.specs()] == [s.scenario for s in plan.specs()]


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ([(k / 2, 1, 30.0 * k, 200.0) for k in range(20)], "faster than 60 m/s"),
        ([(k / 2, 1, k / 2 + 9.0 * (k > 17), 0.0) for k in range(20)], "'1' goes at 19.0 m/s at 8.5 s"),
        ([(1.0, k, float(k), 0.5) for k in range(20)], "moves by itself"),
    ],
)
def test_recordings_that_are_none_of_people_are_refused(
    tmp_path: Path, rows: list[tuple[float, int, float, float]], says: str
) -> None:
    with pytest.raises(ClearwayError) as refused:
        clearway.recorded_people(written(tmp_path / "bad.csv", rows), START, GOAL)
    assert says in str(refused.value)
    assert "bad.csv" in str(refused.value)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--people", "no.csv", "--start", "0,0,0", "--goal", "1,1"], "no.csv"),
        (["--people", "a.csv", "--goal", "1,1"], "--start"),
        (["--people", "a.csv", "--start", "0,0,0", "--goal", "1;1"], "--goal: '1;1': is no number"),
        (["--people", "a.csv", "--start", "0,0", "--goal", "1,1"], "--start: '0,0' is not 3 numbers"),
        (
            ["--people", "a.csv", "--start", "0,0,180", "--goal", "1,1"],
            "angles are in radians: 180 degrees are 3.14159",
        ),
        (["--start", ""], "--start: has no effect without --people FILE"),
        (["--start", "0,0,0"], "--start: has no effect without --people FILE"),
        (["--people", "a.csv", "--start", "2,0,0", "--goal", "1,1", "--at", "2"], "person '1' is where"),
    ],
)
def test_bad_input_is_told_before_the_first_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], says: str
) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "a.csv", [(k / 2, 1, k / 2, 0.0) for k in range(20)])
    done = CliRunner().invoke(app, ["run", "replayed", "--navigator", "orca", "--workers", "1", *arguments])
    assert done.exit_code != 0
    assert says in f"{done.output} {done.exception}"
    assert not (tmp_path / "results").exists()
