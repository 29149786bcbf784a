"""The trials of a campaign of many seeds, made a block at a time: the same trials, and the same bytes."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from clearway.campaigns import trial_list
from clearway.campaigns.campaign import resume_campaign, run_campaign
from clearway.campaigns.interruption import CampaignInterrupted
from clearway.campaigns.plan import CampaignPlan, TrialList
from clearway.campaigns.rerun import rerun
from clearway.campaigns.shards import Shard, merge_shards
from clearway.errors import ClearwayError
from clearway.robots import Robot
from clearway.scenarios.scenario import LabelSpec, LegSpec, RobotSpec, Scenario
from clearway.scenarios.suite import Selection, Suite, scenario_seed, without_drawing
from clearway.trials.store_results import Results, read_campaign

HERE = Path(__file__).resolve()


def build(robot: Robot, selection: Selection, seed: int) -> list[Scenario]:
    """From each seed a step straight on, and at every third one another robot that makes it too."""
    leg = LegSpec(name="way", goal=(6.6, 7.0, 0.0), yaw_tolerance=math.inf, time_limit=10.0)
    other = RobotSpec(name="other", start=(8.0, 9.0, 0.0), legs=(leg.model_copy(update={"goal": (8.1, 9.0, 0.0)}),))
    return [
        Scenario(
            name=(name := f"step-{number}"),
            floor_plan="arena",
            start=(6.5, 7.0, 0.0),
            legs=(leg,),
            robots=(other,) if number % 3 == 2 else (),
            speed=0.5,
            labels=LabelSpec(suite="", batch="step", configuration=f"seed-{number}", repetition=1),
            localisation="truth",
            tracking="difference",
            seed=scenario_seed(seed, name),
        )
        for number in range(*(selection.seeds or (0, 1)))
    ]


SUITE = Suite("steps", "Steps", "a step", ("step",), (), build, robots=("rescue",), generator=without_drawing(build))
PLAN = CampaignPlan(
    (f"{HERE}:SUITE",), ("rescue",), ("colregs-apf", "move-base"), Selection(seeds=(0, 7)), decision_limit=None
)


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial_list, "SEEDS", 2)
    monkeypatch.setattr(trial_list, "LISTED", 2)


def test_blocks_give_the_trials_of_the_whole(small_blocks: None, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = PLAN.trials()
    assert blocks.sizes == [[[2, 1]], [[1, 2], [1, 1]], [[1, 1], [1, 2]], [[1, 1]]] * 2
    assert [spec.index for spec in blocks] == list(range(len(blocks))) == list(range(18))
    assert [spec.scenario.name for spec in blocks.listed()] == [spec.scenario.name for spec in blocks[:5]] * 2
    assert blocks.abridged
    with monkeypatch.context() as patch:
        patch.setattr(trial_list, "SEEDS", 250)
        whole = PLAN.trials()
        assert list(blocks) == list(whole) == PLAN.specs() == whole.listed()
        assert not whole.abridged
    assert blocks[-1] == whole[17]
    with pytest.raises(IndexError):
        blocks[18]
    runs = list(blocks.simulations([1, 2, 3, 4, 16]))
    assert [[spec.index for spec in run] for run in runs] == [[1], [2, 3], [4], [16]]


def test_what_was_counted_is_not_counted_again(small_blocks: None, monkeypatch: pytest.MonkeyPatch) -> None:
    first = PLAN.trials()
    sizes = json.loads(json.dumps(first.sizes))
    for damaged in ([], "x", [[1]], [[[1, 1]]], [[[10**13, 1]]] * 8, [[[-1, 1]]] * 8, [[["1", 1]]] * 8, {"a": 1}):
        assert PLAN.trials(damaged).sizes == sizes
    monkeypatch.setattr(TrialList, "_counted", lambda trials: pytest.fail("counted"))
    assert list(PLAN.trials(sizes)) == list(first)
    with pytest.raises(ClearwayError, match="has other trials than when the campaign was begun"):
        list(PLAN.trials([[[3, 1]], *sizes[1:]]))


def test_a_shard_has_every_nth_simulation() -> None:
    runs = np.array([1, 2, 1, 3, 1, 1])
    trials = [(run, trial) for run, size in enumerate(runs) for trial in range(size)]
    for of in range(1, 7):
        for number in range(1, of + 1):
            part = [trials[i] for i in Shard(number, of).part(runs).tolist()]
            assert part == [one for one in trials if one[0] % of == number - 1]


def test_one_trial_twice_is_told(small_blocks: None) -> None:
    twice = dataclasses.replace(
        PLAN, suites=(PLAN.suites[0], f"{HERE.parent / '..' / HERE.parent.name / HERE.name}:SUITE")
    )
    with pytest.raises(ClearwayError, match="are one and the same, and would count as two"):
        twice.trials()


def contents(path: Path) -> dict[str, bytes]:
    return {
        str(p.relative_to(path)): p.read_bytes()
        for p in sorted(path.rglob("*.parquet"))
        if p.name not in ("timing.parquet", "thinking.parquet")
    }


@pytest.mark.slow
def test_a_long_campaign_is_stopped_gone_on_with_sharded_and_rerun(small_blocks: None, tmp_path: Path) -> None:
    """In campaign.json stand the first seeds alone; all else is as in a short one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trial_list, "SEEDS", 250)
        run_campaign(PLAN, tmp_path / "short", 0)
    steps = itertools.count()

    def stop(done: int, total: int, note: str = "") -> None:
        if next(steps) == 6:
            raise KeyboardInterrupt

    with pytest.raises(CampaignInterrupted, match="of 18 trials"):
        run_campaign(PLAN, tmp_path / "long", 0, progress=stop)
    results: Results = resume_campaign(tmp_path / "long", 0)
    assert contents(tmp_path / "long") == contents(tmp_path / "short")
    short, long = read_campaign(tmp_path / "short"), read_campaign(tmp_path / "long")
    assert list(long["tasks"].items()) == list(short["tasks"].items())[:4]
    assert {n for n in {*short, *long} - {"run"} if short.get(n) != long.get(n)} == {"tasks", "simulations"}
    parts = [tmp_path / str(number) for number in (1, 2, 3)]
    for number, part in enumerate(parts, 1):
        run_campaign(PLAN, part, 0, shard=Shard(number, 3))
    merge_shards(parts, tmp_path / "merged")
    assert contents(tmp_path / "merged") == contents(tmp_path / "short")
    again = rerun(results, 17)
    assert again.difference is None
    assert not again.remarks


def test_differences_are_of_what_a_camera_tells_unless_a_run_says_otherwise() -> None:
    plan = CampaignPlan(
        suites=("sar-case1",), robots=("rescue", "rescue:lidar"), selection=Selection(configurations=("scenario-1",))
    )
    asked = dataclasses.replace(plan, tracking="difference")
    assert {spec.robot: spec.tracking for spec in TrialList(plan)} == {"rescue": "difference", "rescue:lidar": "kalman"}
    assert {spec.tracking for spec in TrialList(asked)} == {"difference"}
