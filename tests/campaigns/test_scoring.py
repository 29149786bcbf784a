"""Scoring a test plan as a campaign: workers, interruption, what is left behind when a recording is wrong."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from clearway.campaigns.scoring import score_plan
from clearway.errors import ClearwayError

EXAMPLE = Path(__file__).parents[2] / "examples" / "06_score_recordings"
SAME = ("trials.parquet", "trials.csv", "trajectories/robot.parquet", "trajectories/attempts.parquet")


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    shutil.copytree(EXAMPLE, tmp_path / "lab")
    return tmp_path / "lab" / "plan.toml"


@pytest.mark.slow
def test_the_same_bytes_whatever_the_workers(lab: Path, tmp_path: Path) -> None:
    one, two = (score_plan(lab, tmp_path / str(n), workers=n) for n in (1, 2))
    for name in SAME:
        assert (one.path / name).read_bytes() == (two.path / name).read_bytes(), name
    assert one.trials["outcome"].to_pylist() == ["reached", "reached", "reached", "aborted"]


def test_a_recording_that_cannot_be_used_leaves_nothing_behind(lab: Path, tmp_path: Path) -> None:
    text = lab.read_text(encoding="utf-8")
    wrong = text.replace('"robot:m2" = [-0.1185, 0.1692, 0.14]', '"robot:m2" = [-0.6185, 0.1692, 0.14]')
    assert wrong != text
    lab.write_text(wrong, encoding="utf-8")
    out = tmp_path / "out"
    with pytest.raises(ClearwayError, match="robot:m2"):
        score_plan(lab, out, workers=1)
    assert not out.exists() or not any(out.iterdir())
    lab.write_text(text, encoding="utf-8")
    assert len(score_plan(lab, out, workers=1)) == 4


def test_results_are_not_written_over_and_a_trial_of_which_the_plan_says_more_is_scored_again(
    lab: Path, tmp_path: Path
) -> None:
    before = score_plan(lab, tmp_path / "out", workers=1).trials["outcome"].to_pylist()
    with pytest.raises(ClearwayError, match="already holds the results"):
        score_plan(lab, tmp_path / "out", workers=1)
    text = lab.read_text(encoding="utf-8").replace('file = "trial_3.csv"', 'file = "trial_3.csv"\ncontact = true')
    lab.write_text(text, encoding="utf-8")
    after = score_plan(lab, tmp_path / "out", workers=1, resume=True).trials["outcome"].to_pylist()
    assert before == ["reached", "reached", "reached", "aborted"]
    assert after == ["reached", "reached", "collision", "aborted"]
