"""Many worlds in one kernel: each is what the environment of one is, whoever else is stepped beside it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import clearway.learning
from clearway.errors import ClearwayError
from clearway.learning.environment import Alone
from clearway.learning.vector import Lanes, Steps
from clearway.robots import Robot
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite

KINDS: dict[str, dict[str, Any]] = {
    "legs": {"suite": "hospital", "robot": "tiago", "batches": ("NO", "SO"), "speeds": (1.0,), "beams": 30, "latency": 0.0,
             "localisation": "odometry"},
    "rails": {"suite": "dynabarn", "beams": 24, "latency": 0.0, "localisation": "odometry"},
    "crowdnav": {"suite": "crowd", "batches": ("circle-visible", "square-invisible"), "obstacles": 6, "tracking": "difference",
                 "localisation": "truth"},
    "walkers": {"suite": "people", "robot": "turtlebot4", "configurations": ("passing", "group", "door", "crowd"), "beams": 40, "latency": 0.0,
                "localisation": "truth"},
}  # fmt: skip


def policy(seen: np.ndarray, k: int) -> np.ndarray:
    """At the goal, a little astray, and at last for good."""
    x, y = seen[..., 0], seen[..., 1]
    action = np.zeros((*seen.shape[:-1], k), np.float32)
    action[..., 0] = np.clip(x, -1.0, 1.0)
    action[..., -1] = np.clip(np.arctan2(y, x), -1.0, 1.0)
    if k == 3:
        action[..., 1], action[..., 2] = np.clip(y, -1.0, 1.0), 0.0
    return action


def alone(kind: str) -> Alone:
    return clearway.learning.make(flat=True, indicators=False, **KINDS[kind])


def several(kind: str, n: int, **more: Any) -> Lanes:
    return clearway.learning.make_vec(num_envs=n, flat=True, **KINDS[kind], **more)


@pytest.mark.parametrize(
    "kind", ["legs", "crowdnav", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("rails", "walkers"))]
)
def test_a_lane_is_the_environment_of_one(kind: str) -> None:
    one, lane = alone(kind), several(kind, 1)
    k = one.action_space.shape[0]
    (seen, info), (seen_too, info_too) = one.reset(seed=3), lane.reset(seed=3)
    ends: list[str] = []
    while len(ends) < 3:
        np.testing.assert_allclose(seen_too[0], seen, atol=2e-5)
        assert info_too["scenario"][0] == info["scenario"]
        action = policy(seen, k)
        seen, reward, terminated, truncated, told = one.step(action)
        seen_too, rewards, terminated_too, truncated_too, told_too = lane.step(action[None])
        assert rewards[0] == pytest.approx(reward, abs=1e-9)
        assert (terminated_too[0], truncated_too[0]) == (terminated, truncated)
        if terminated or truncated:
            np.testing.assert_allclose(told_too["final_obs"][0], seen, atol=2e-5)
            assert told_too["final_info"]["outcome"][0] == told["outcome"]
            ends.append(told["outcome"])
            seen, info = one.reset()
            info_too = told_too


def test_lanes_do_not_mind_each_other() -> None:
    three, twin = several("crowdnav", 3), several("crowdnav", 3)
    seen, _ = three.reset(seed=5)
    again, _ = twin.reset(seed=5)
    for _ in range(80):
        action = policy(seen, 3)
        other = action.copy()
        other[1] = 0.0  # there lane 1 does something else
        seen, *_ = three.step(action)
        again, *_ = twin.step(other)
        np.testing.assert_array_equal(seen[[0, 2]], again[[0, 2]])
    assert not np.array_equal(seen[1], again[1])


def test_the_dict_is_the_row_by_its_parts() -> None:
    flat = several("crowdnav", 2)
    parts = clearway.learning.make_vec(num_envs=2, **KINDS["crowdnav"])
    row, _ = flat.reset(seed=1)
    seen, _ = parts.reset(seed=1)
    assert parts.observation_space.contains(seen)
    assert flat.observation_space.contains(row)
    np.testing.assert_array_equal(row, np.concatenate([part.reshape(2, -1) for part in seen.values()], axis=1))


def test_a_reward_of_ones_own_is_asked() -> None:
    asked: list[Steps] = []

    def reward(steps: Steps) -> np.ndarray:
        asked.append(steps)
        return np.array([1.0, 2.0])

    lanes = several("crowdnav", 2, reward=reward)
    lanes.reset(seed=1)
    actions = np.zeros((2, 3), np.float32)
    _, rewards, *_ = lanes.step(actions)
    actions[:] = 1.0
    assert rewards.tolist() == [1.0, 2.0]
    assert not asked[0].action.any()  # nor is what was said another's to change
    assert asked[0].before.shape == (2,)
    assert asked[0].outcome == [None, None]
    before = asked[0].seen.copy()
    lanes.step(actions)
    assert np.array_equal(asked[0].seen, before)  # which is kept, also when more is seen
    assert not np.array_equal(asked[1].seen, before)


@pytest.mark.parametrize("given", [None, 1.0, np.zeros((2, 1)), [1.0, math.nan], [1.0, math.inf], "much", {}])
def test_rewards_that_are_none(given: Any) -> None:
    lanes = several("crowdnav", 2, reward=lambda steps: given)
    lanes.reset(seed=1)
    with pytest.raises(
        ClearwayError, match=r"^reward: what it gave .*; 2 finite numbers, an array of the shape \(2,\)"
    ):
        lanes.step(np.zeros((2, 3), np.float32))
    with pytest.raises(ResetNeeded):  # whose episodes were over have not begun anew
        lanes.step(np.zeros((2, 3), np.float32))


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"suite": "hospital", "robot": "tiago", "beams": 8, "latency": 0.0}, "localisation"),
        ({"suite": "hospital", "robot": "tiago", "beams": 8, "localisation": "truth"}, "latency"),
        ({"suite": "hospital", "robot": "tiago", "obstacles": 3, "latency": 0.0, "localisation": "truth"}, "obstacles"),
        ({"suite": "crowd", "obstacles": 3, "tracking": "kalman", "localisation": "truth"}, "obstacles"),
        ({"suite": "crowd", "num_envs": 0}, "num_envs"),
        ({"suite": "crowd", "num_envs": True}, "num_envs"),
        ({"suite": "crowd", "beans": 3}, "option"),
        ({"suite": "crowd", "reward": "x"}, "reward"),
        ({"suite": "crowd", "indicators": True}, "indicators"),
    ],
)
def test_what_takes_python_is_refused(options: dict[str, Any], field: str) -> None:
    with pytest.raises(ClearwayError) as error:
        clearway.learning.make_vec(**options)
    assert field in str(error.value) or error.value.field == field


def test_whole_numbers_of_numpy_are_taken() -> None:
    numbers: Any = np.array((2, 3))
    lanes = clearway.learning.make_vec("crowd", num_envs=numbers[0], obstacles=numbers[1])
    assert type(lanes.num_envs) is int
    assert lanes.observation_space["obstacles"].shape == (2, 3, 6)


EXACT: dict[str, Any] = {"latency": 0.0, "localisation": "truth", "tracking": "difference"}


@pytest.mark.parametrize(
    ("suite", "which", "select"),
    [
        ("people", "bed-r1", "configurations=('passing', 'crossing', "),
        ("hospital", "MO-passing-", "batches=('NO', 'SO')"),
        ("ward-day", "people-5-guide-", "batches=('people-0',)"),
    ],
)
def test_who_has_to_be_asked_is_named_before_anything_runs(suite: str, which: str, select: str) -> None:
    with pytest.raises(ClearwayError, match="takes Python at each step") as error:
        clearway.learning.make_vec(suite, **EXACT)
    assert which in str(error.value)
    assert f"select {select}" in str(error.value)


def test_scenarios_with_a_crowd_and_without_are_refused_together() -> None:
    people = load_suite("people")

    def made(robot: Robot, selection: Selection, seed: int) -> list[Scenario]:
        passing, crossing = (s for s in people.make(robot, selection, seed) if s.name in ("passing-r1", "crossing-r1"))
        return [passing, crossing.model_copy(update={"people": ()})]

    mixed = replace(people, name="mixed", make=made)
    with pytest.raises(ClearwayError, match=r"'crossing-r1',\) have no crowd.* select configurations=\('passing',\)"):
        clearway.learning.make_vec(mixed, "turtlebot4", **EXACT)
    for scenario in ("passing-r1", "crossing-r1"):
        clearway.learning.make_vec(mixed, "turtlebot4", scenarios=(scenario,), **EXACT).reset(seed=1)


def test_one_without_a_seed_goes_on_as_it_was() -> None:
    lanes, twin = several("crowdnav", 3), several("crowdnav", 3)
    lanes.reset(seed=[4, 5, 6])
    twin.reset(seed=5)
    seen, _ = lanes.reset(seed=[5, None, 7])
    again, _ = twin.reset(seed=[5, 6, 7])
    np.testing.assert_array_equal(seen[[0, 2]], again[[0, 2]])
    assert not np.array_equal(seen[1], again[1])
    twin.reset(seed=[None, 5, None])
    again, _ = twin.reset()
    np.testing.assert_array_equal(seen[1], again[1])
    for seeds in ([], [1], [1, 2, 3, 4]):
        with pytest.raises(ValueError, match=f"{len(seeds)} seeds for 3 environments"):
            lanes.reset(seed=seeds)


def test_actions_are_looked_at() -> None:
    lanes = several("crowdnav", 2)
    with pytest.raises(ResetNeeded):
        lanes.step(np.zeros((2, 3), np.float32))
    lanes.reset(seed=1)
    for bad in (np.zeros((2, 2)), np.zeros((3, 3)), np.full((2, 3), np.nan)):
        with pytest.raises(ValueError, match="finite numbers"):
            lanes.step(bad)
