"""The policy that comes with Clearway: where it is from, whom it drives, and that it drives."""

from __future__ import annotations

from pathlib import Path

import pytest

import clearway
from clearway.errors import ClearwayError
from clearway.navigators.learnt.ppo import DISCS, LIDAR, Ppo
from clearway.scenarios.suite import LEARNING_DRAWS
from clearway.trials import Outcome

MOST_BYTES = 200_000


def test_it_says_what_it_was_trained_on() -> None:
    (crowd,) = Ppo.tuned_on  # its halls belong to no suite of ours
    assert (crowd.suite, crowd.draws) == ("crowd", range(*LEARNING_DRAWS))


def test_it_is_small() -> None:
    assert all(file.stat().st_size <= MOST_BYTES for file in (DISCS, LIDAR))


@pytest.mark.slow
def test_it_gets_through_a_crowd_that_it_has_not_met() -> None:
    results = clearway.run("crowd", navigators=["ppo"], batches=["circle-invisible"], seeds=(0, 20))
    assert sum(trial.outcome == Outcome.REACHED for trial in results) >= 17


@pytest.mark.slow
def test_it_drives_tiago_through_the_hospital_the_same_way_each_time() -> None:
    runs = [
        clearway.run("hospital", robots=["tiago"], navigators=["ppo"], batches=["NO"], speeds=[1.0], repetitions=1)
        for _ in range(2)
    ]
    (first,), (again,) = runs
    assert first.outcome == Outcome.REACHED
    assert (first.pose == again.pose).all()


@pytest.mark.parametrize("robot", ["hosbot", "rescue"])
def test_who_has_no_policy_is_told_before_the_campaign(robot: str) -> None:
    with pytest.raises(ClearwayError, match=f"ppo has no policy for the robot '{robot}'.*train_ppo"):
        clearway.run("hospital" if robot == "hosbot" else "people", robots=[robot], navigators=["ppo"])


def test_a_policy_for_another_task_is_none_for_tiago() -> None:
    with pytest.raises(ClearwayError, match="holds no policy for tiago: one sees"):
        Ppo(policy=str(DISCS))
    assert Ppo.files(policy="some.npz") == (DISCS, Path("some.npz"))
