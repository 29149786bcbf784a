"""The policy that comes with Clearway: where it is from, whom it drives, and that it drives."""

from __future__ import annotations

import clearway
from clearway.navigators.learnt.ppo import FILE, Ppo
from clearway.scenarios.suite import LEARNING_DRAWS
from clearway.trials import Outcome

MOST_BYTES = 200_000


def test_it_says_what_it_was_trained_on() -> None:
    assert [one.draws for one in Ppo.tuned_on] == [range(*LEARNING_DRAWS)]


def test_it_is_small() -> None:
    assert FILE.stat().st_size <= MOST_BYTES


def test_it_gets_through_a_crowd_that_it_has_not_met() -> None:
    results = clearway.run("crowd", navigators=["ppo"], batches=["circle-invisible"], seeds=(0, 20))
    assert sum(trial.outcome == Outcome.REACHED for trial in results) >= 17
