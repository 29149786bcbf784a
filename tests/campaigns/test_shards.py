"""A campaign that was run in shards is, once merged, the same bytes as one that was run in one piece."""

from __future__ import annotations

import errno
import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

import clearway
from campaigns.own_plans import contents
from campaigns.test_fleet import FLEET, OWN
from clearway.campaigns import CampaignPlan, resume_campaign, run_campaign
from clearway.campaigns.shards import Shard, merge_shards, read_shard
from clearway.errors import ClearwayError
from clearway.trials.store_results import open_results, read_campaign, seal

ALONE = """
name = "alone"
floor_plan = "arena"
start = [2.0, 7.0, 0.0]
speed = 0.8
localisation = "odometry"
[[legs]]
name = "there"
goal = [3.5, 7.0, 0.0]
time_limit = 20.0
"""


def plan(folder: Path, **options: Any) -> CampaignPlan:
    """Four simulations, two of them of two tested robots: six trials."""
    (folder / "three.toml").write_text(FLEET)
    (folder / "alone.toml").write_text(ALONE)
    names = tuple(str(folder / name) for name in ("three.toml", "alone.toml"))
    return CampaignPlan(names, ("tiago",), (f"{OWN}:Drives", f"{OWN}:Raises"), **options)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the whole campaign, and with its three shards."""
    folder = tmp_path_factory.mktemp("sharded")
    run_campaign(plan(folder), folder / "whole", 1)
    for number in (1, 2, 3):
        run_campaign(plan(folder), folder / str(number), 1, shard=Shard(number, 3))
    return folder


def shards(folder: Path, *numbers: int) -> list[Path]:
    return [folder / str(number) for number in numbers]


def test_merged_it_is_what_it_would_have_been_in_one_piece(folder: Path, tmp_path: Path) -> None:
    assert [len(open_results(shard)) for shard in shards(folder, 1, 2, 3)] == [3, 2, 1]  # of two simulations, one, one
    told: list[int] = []
    merged = clearway.merge(
        *shards(folder, 3, 1, 2), out=tmp_path / "merged", progress=lambda done, *_: told.append(done)
    )
    assert told == [1, 2, 3, 4, 5, 6]
    assert contents(tmp_path / "merged") == contents(folder / "whole")
    whole = open_results(folder / "whole")
    unclocked = [
        n for n in whole.campaign["run"]["sha256"] if n not in ("timing.parquet", "thinking.parquet", "campaign.json")
    ]
    assert len(unclocked) == 9
    assert all(merged.campaign["run"]["sha256"][n] == whole.campaign["run"]["sha256"][n] for n in unclocked)
    assert merged.timing["trial"].unique().to_pylist() == list(range(6))
    assert [run["cores"] for run in merged.campaign["run"]["shards"]] == [os.cpu_count()] * 3
    assert "shard 2 of 3, of 6 trials" in clearway.open_results(folder / "2").report().read_text()
    assert clearway.rerun(folder / "1", 2).difference is None


def edited(folder: Path, to: Path, **said: Any) -> Path:
    """A shard whose campaign.json says something else, sealed anew as if it had been run so."""
    shutil.copytree(folder, to)
    campaign = read_campaign(to) | said
    campaign["run"]["sha256"]["campaign.json"] = seal(campaign)
    (to / "campaign.json").write_text(json.dumps(campaign))
    return to


def test_what_does_not_belong_together_is_refused(folder: Path, tmp_path: Path) -> None:
    def refused(*found: Path) -> str:
        with pytest.raises(ClearwayError) as caught:
            merge_shards(found, tmp_path / "out")
        assert not (tmp_path / "out").exists()
        return str(caught.value)

    one, two, three = shards(folder, 1, 2, 3)
    assert "shard 2 of 3 is missing; run it with --shard 2/3" in refused(one, three)
    assert "shards 1, 3 of 3 are missing" in refused(two)
    assert f"{one}: shard 1/3 is there twice: it is in {tmp_path / 'copy'} too" in refused(
        Path(shutil.copytree(one, tmp_path / "copy")), one, two, three
    )
    assert "holds a whole campaign" in refused(one, folder / "whole")
    assert "no such directory" in refused(one, two, folder / "4")
    other = edited(three, tmp_path / "other", shard={"number": 3, "of": 3, "total": 7})
    assert "they differ in shard.total, which is 7 here and 6 there" in refused(one, two, other)
    tasks = read_campaign(three)["tasks"]
    code = edited(three, tmp_path / "code", tasks=tasks | {next(iter(tasks)): "0123456789abcdef"})
    assert f"{code}: is no shard of the campaign that {one} is one of: they differ in tasks." in refused(one, two, code)
    seed = tmp_path / "seed"
    run_campaign(plan(folder, seed=1), seed, 1, shard=Shard(2, 3))
    assert "they differ in plan.seed, which is 1 here and 0 there" in refused(one, seed, three)
    damaged = Path(shutil.copytree(two, tmp_path / "damaged"))
    (damaged / "trials.parquet").write_bytes((damaged / "trials.parquet").read_bytes()[:-1])
    assert "is damaged" in refused(one, damaged, three)
    few = edited(three, tmp_path / "few", shard=read_campaign(one)["shard"])
    assert "hold 4 trials and their campaign has 6" in refused(few, two, three)


@pytest.mark.slow
def test_an_unfinished_shard_is_refused_and_can_be_gone_on_with(folder: Path, tmp_path: Path) -> None:
    class Stopped(Exception):
        pass

    def stop(done: int, *_: Any) -> None:
        if done == 1:
            raise Stopped

    with pytest.raises(Stopped):
        run_campaign(plan(folder), tmp_path / "1", 1, shard=Shard(1, 3), progress=stop)
    with pytest.raises(ClearwayError, match=r"unfinished: 2 of 3 .*complete it with `clearway run --resume .*/1`"):
        merge_shards([tmp_path / "1", *shards(folder, 2, 3)], tmp_path / "out")
    with pytest.raises(ClearwayError, match=r"differs in shard\.of: it has 3, now 4"):
        run_campaign(plan(folder), tmp_path / "1", 1, shard=Shard(1, 4), resume=True)
    resume_campaign(tmp_path / "1", 1)
    merge_shards([tmp_path / "1", *shards(folder, 2, 3)], tmp_path / "out")
    assert contents(tmp_path / "out") == contents(folder / "whole")


def test_a_merge_that_was_stopped_leaves_nothing_or_begins_again(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr("clearway.trials.store.assemble", full)
        with pytest.raises(ClearwayError, match=r"No space left on device; the shards are as they were$"):
            merge_shards(shards(folder, 1, 2, 3), out)
    assert not out.exists()
    with monkeypatch.context() as patch:  # killed: nobody takes away what was begun
        patch.setattr("clearway.trials.store.assemble", full)
        patch.setattr("clearway.trials.store.TrialStore.withdraw", lambda store: None)
        with pytest.raises(ClearwayError):
            merge_shards(shards(folder, 1, 2, 3), out)
    with pytest.raises(ClearwayError, match=r"complete it with `clearway merge SHARD\.\.\. --out "):
        open_results(out)
    merge_shards(shards(folder, 1, 2, 3), out)
    assert contents(out) == contents(folder / "whole")
    with pytest.raises(ClearwayError, match="already holds the results of a campaign; choose another"):
        merge_shards(shards(folder, 1, 2, 3), out)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("3", "'3' is no shard; 3/40 is the third of forty"),
        ("0/3", "0/3 is no shard: 1/3 to 3/3 are"),
        ("4/3", "4/3 is no shard: 1/3 to 3/3 are"),
        ("1/0", "a campaign has 1 to 100000 of them"),
        ("-1/3", "is no shard"),
        ("١/٣", "is no shard"),
    ],
)
def test_what_is_no_shard_is_said(text: str, says: str) -> None:
    with pytest.raises(ClearwayError, match="shard: ") as caught:
        read_shard(text)
    assert says in str(caught.value)


def test_more_shards_than_simulations_are_refused_before_anything_runs(tmp_path: Path) -> None:
    assert read_shard(" 3/40 ") == Shard(3, 40)
    with pytest.raises(ClearwayError, match="the shard 5/5 has no trial: the campaign has 4 simulations, so at most 4"):
        run_campaign(plan(tmp_path), tmp_path / "out", 1, shard=Shard(5, 5))
    assert not (tmp_path / "out").exists()
