"""What is kept of a trial is a choice, and what was not kept is said wherever somebody looks for it."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from campaigns.test_shards import ALONE, OWN
from clearway.campaigns import CampaignPlan, run_campaign
from clearway.campaigns.rerun import rerun
from clearway.campaigns.shards import Shard, merge_shards
from clearway.errors import ClearwayError
from clearway.reports import write_report
from clearway.trials.keeping import Keep
from clearway.trials.store import Results, open_results


def plan(folder: Path, keep: Keep) -> CampaignPlan:
    """A trial that succeeds and one that fails."""
    (folder / "alone.toml").write_text(ALONE)
    return CampaignPlan((str(folder / "alone.toml"),), ("tiago",), (f"{OWN}:Drives", f"{OWN}:Raises"), keep=keep)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kept")
    for keep in ("trajectories", "failures", "table"):
        run_campaign(plan(folder, keep), folder / keep, 1)  # type: ignore[arg-type]
    return folder


def samples(results: Results) -> list[int]:
    """How many samples there are of each trial."""
    numbers = pq.read_table(results.path / "trajectories/robot.parquet")["trial"].to_pylist()
    return [numbers.count(i) for i in range(len(results))]


def test_the_table_is_the_same_whatever_is_kept(folder: Path) -> None:
    whole, failures, table = (open_results(folder / keep) for keep in ("trajectories", "failures", "table"))
    assert whole.trials["success"].to_pylist() == [True, False]
    assert whole.trials["duration"][0].as_py() > 1.0
    assert whole.trials == failures.trials == table.trials
    long = samples(whole)
    assert min(long) > 10
    assert samples(failures) == [1, long[1]]
    assert samples(table) == [1, 1]
    assert [[r.kept(row) for row in r.trials.to_pylist()] for r in (whole, failures, table)] == [
        [True, True], [False, True], [False, False],
    ]  # fmt: skip
    assert failures.trial(1).pose.tolist() == whole.trial(1).pose.tolist()
    assert [leg.goal.tolist() for leg in table.remains(0).attempt.legs] == [[3.5, 7.0, 0.0]]


def test_who_asks_for_what_was_not_kept_is_told_how_to_have_it(folder: Path, tmp_path: Path) -> None:
    failures = open_results(folder / "failures")
    with pytest.raises(
        ClearwayError, match=r"of trial 0 only the row .*\(--keep failures\); `clearway rerun .*--trial 0 --out"
    ):
        failures.trial(0)
    again = rerun(failures, 0, out=tmp_path / "again")
    assert "its row in the table is the same again; the rest was not kept" in str(again)
    assert again.difference is None
    assert again.results is not None
    whole = open_results(folder / "trajectories")
    assert again.results.trial(0).pose.tolist() == whole.trial(0).pose.tolist()
    assert "the same bits again" in str(rerun(failures, 1))


def test_a_rerun_that_went_otherwise_is_noticed_by_its_row(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from clearway.campaigns import rerun as module

    scored = module.score_row
    monkeypatch.setattr(module, "score_row", lambda trial: scored(trial) | {"CT": 1.5})
    again = rerun(open_results(folder / "table"), 0)
    assert "not the same bits. The first difference is the column CT:" in str(again)
    assert list(again.changed) == ["CT"]


def test_the_report_says_what_was_not_kept(folder: Path) -> None:
    pages = {keep: write_report(folder / keep).read_text() for keep in ("trajectories", "failures", "table")}
    assert "Of 1 of 2 trials only the row in the table was kept (--keep failures)" in pages["failures"]
    assert "Of 2 of 2 trials only the row in the table was kept (--keep table)" in pages["table"]
    assert "everything of trials that did not succeed; of the others their rows in the table" in pages["failures"]
    assert "only the row in the table was kept" not in pages["trajectories"]


def test_shards_keep_what_was_asked_for(folder: Path, tmp_path: Path) -> None:
    for number in (1, 2):
        run_campaign(plan(folder, "failures"), tmp_path / str(number), 1, shard=Shard(number, 2))
    merged = merge_shards([tmp_path / "1", tmp_path / "2"], tmp_path / "merged")
    assert samples(merged) == samples(open_results(folder / "failures"))
    run_campaign(plan(folder, "table"), tmp_path / "other", 1, shard=Shard(2, 2))
    with pytest.raises(ClearwayError, match=r"differ in plan\.keep, which is 'table' here and 'failures' there"):
        merge_shards([tmp_path / "1", tmp_path / "other"], tmp_path / "none")


def test_what_cannot_be_kept_is_refused(folder: Path) -> None:
    with pytest.raises(ClearwayError, match="keep: unknown what is to be kept 'failure'; did you mean 'failures'"):
        plan(folder, "failure")  # type: ignore[arg-type]
