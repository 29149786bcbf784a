"""The environments for learners: what they show is what a navigator is told, and their trials are those of a campaign."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given
from hypothesis import strategies as st
from pettingzoo.test import parallel_api_test, parallel_seed_test

import clearway
import clearway.learning
from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import CampaignPlan, granted_map
from clearway.contract import Command, Goal, Need, Observation, Scan, Task
from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.learning.episode import Episode
from clearway.learning.rewards import Step, default_reward
from clearway.learning.scenes import Scenes
from clearway.navigators.learnt.encoding import Acting, Seeing, axes, bounds
from clearway.perception import make_localiser, make_tracker
from clearway.robots import DriveKind, Robot, load_robot
from clearway.scenarios.scenario import LabelSpec
from clearway.scenarios.suite import LEARNING_DRAWS, LEARNING_SEEDS, Selection
from clearway.scenarios.suites import load_suite, suite_names
from clearway.trials import Outcome, Trial
from clearway.world import simulate_all
from clearway.world.drive import Driver
from perceived import exact

CROWD: dict[str, Any] = {"batches": ("circle-invisible",), "obstacles": 5}


class Straight:
    """Drives at its goal, with no eye for anything."""

    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional"})

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self._speed, self._robot = task.speed_limit, robot

    def step(self, observation: Observation) -> Command:
        seen = Seeing(obstacles=5).parts(observation)
        return Acting().command(straight(seen), self._robot, self._speed)


def straight(seen: dict[str, Any]) -> np.ndarray:
    x, y, *_ = seen["goal"]
    action = np.zeros(len(seen["velocity"]), np.float32)
    action[-1] = np.clip(math.atan2(y, x), -1.0, 1.0)
    action[0] = np.clip(x, 0.0, 1.0)
    return action


def driven(env: Any, seed: int | None = None, policy: Any = straight) -> tuple[Any, dict[str, Any]]:
    """The last step of an episode, and what `info` held at its beginning."""
    seen, began = env.reset(seed=seed)
    while True:
        step = env.step(policy(seen))
        seen = step[0]
        if step[2] or step[3]:
            return step, began


def same(one: Any, other: Any) -> bool:
    """Whether two trials are the same bits."""
    names = ("t", "pose", "velocity", "estimate", "command", "leg", "moving_obstacles")
    return all(np.array_equal(getattr(one, n), getattr(other, n), equal_nan=True) for n in names) and (
        (one.outcome, one.reason) == (other.outcome, other.reason)
    )


def navigated(episode: Episode) -> list[Trial]:
    """The trials of an episode's scenario, driven by `Straight` as a navigator."""
    drivers, scenario = [], episode.scenario
    for robot in episode.robots:
        localiser, tracker = make_localiser(scenario.localisation, robot), make_tracker(scenario.tracking, robot)
        pilot = compose(Straight(), localiser, tracker=tracker)
        drivers.append(Driver(robot, pilot, "straight", scenario.localisation, map=granted_map(None, scenario)))
    return simulate_all(scenario, drivers)


@pytest.mark.parametrize("suite", ["crowd", "people"])
def test_an_episode_is_the_trial_that_a_navigator_would_have_given(suite: str) -> None:
    env = clearway.learning.make(suite, obstacles=5, indicators=False)
    for seed in range(3):
        driven(env, seed)
        assert same(*navigated(env.episode), *env.episode.trials())


def test_an_episode_of_a_team_is_the_trials_of_its_robots() -> None:
    env = clearway.learning.make_team("sar-team", obstacles=5, indicators=False)
    seen, _ = env.reset(seed=4)
    while env.agents:
        seen, *_ = env.step({name: straight(seen[name]) for name in env.agents})
    trials = env.episode.trials()
    assert len(trials) > 1
    assert all(same(a, b) for a, b in zip(navigated(env.episode), trials, strict=True))


def test_each_robot_of_a_team_has_its_indicators_when_all_are_over() -> None:
    env = clearway.learning.make_team("sar-team", obstacles=5)
    seen, _ = env.reset(seed=4)
    everybody, last, infos = set(env.agents), set(), {}
    while env.agents:
        last = set(env.agents)
        seen, *_, infos = env.step({name: straight(seen[name]) for name in last})
        assert all(infos[name]["outcome"] for name in last - set(env.agents))
    assert last < everybody == infos.keys()  # one was over before
    for info, trial in zip((infos[name] for name in env.episode.scenario.names()), env.episode.trials(), strict=True):
        assert info["outcome"] == str(trial.outcome)
        assert info["indicators"]["success"] == (trial.outcome == Outcome.REACHED)
        assert info["indicators"] == {k: v for k, v in score_row(trial).items() if v is not None}


@pytest.mark.parametrize(
    "options",
    [
        {"suite": "hospital", "robot": "tiago", "beams": 36},
        {**CROWD, "suite": "crowd", "flat": True},
        {"suite": "ward-day", "beams": 9, "obstacles": 2, "normalised": False},
    ],
)
@pytest.mark.filterwarnings("ignore:.*observation space m:UserWarning", "ignore:.*symmetric and normalized:UserWarning")
def test_gymnasiums_own_check(options: dict[str, Any]) -> None:
    check_env(clearway.learning.make(**options), skip_render_check=True)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_pettingzoos_own_check() -> None:
    parallel_api_test(clearway.learning.make_team("sar-team", obstacles=3), num_cycles=60)
    parallel_seed_test(lambda: clearway.learning.make_team("sar-team", obstacles=3), num_cycles=20)


@pytest.mark.parametrize("suite", suite_names())
def test_every_suite_that_gymnasium_could_make_is_registered_and_no_other(suite: str) -> None:
    if clearway.learning.environment_id(suite) in gymnasium.registry:
        assert clearway.learning.make(suite).action_space is not None
    else:
        with pytest.raises(ClearwayError, match="make_team"):
            clearway.learning.make(suite)
        assert len(clearway.learning.make_team(suite).possible_agents) > 1


def test_a_suite_by_its_registered_name() -> None:
    env = gymnasium.make("clearway/Hospital-v0", robot="tiago", beams=180, batches=("NO",))
    assert env.observation_space["lidar"].shape == (180,)  # type: ignore[index]
    seen, info = env.reset(seed=1)
    assert seen in env.observation_space
    assert info["scenario"].startswith("NO-")


def test_vectors_of_environments_are_gymnasiums() -> None:
    envs = gymnasium.make_vec("clearway/Crowd-v0", 2, "sync", flat=True, indicators=False, **CROWD)
    seen, _ = envs.reset(seed=3)
    assert seen.shape == (2, 7 + 5 * 6)
    assert not np.array_equal(seen[0], seen[1])
    for _ in range(40):
        seen, *_ = envs.step(np.zeros((2, 3), np.float32))
    assert np.isfinite(seen).all()


def test_the_end_says_how_and_what_it_was_worth() -> None:
    alone = clearway.learning.make("hospital", "tiago", batches=("NO",), speeds=(0.6,))
    ends = [driven(env, seed) for env in (clearway.learning.make("crowd", **CROWD), alone) for seed in range(3)]
    for (_, reward, terminated, truncated, info), began in ends:
        assert terminated != truncated
        assert began["scenario"]
        assert info["indicators"]["success"] == (info["outcome"] == "reached")
        assert (reward > 9.0) == (info["outcome"] == "reached")
    assert len({info["outcome"] for (*_, info), _ in ends}) > 1


def test_the_time_limit_truncates() -> None:
    (_, _, terminated, truncated, info), _ = driven(
        clearway.learning.make("crowd", **CROWD), 1, lambda seen: np.zeros(3, np.float32)
    )
    assert (terminated, truncated, info["outcome"]) == (False, True, "timeout") or info["outcome"] == "collision"


def test_a_reward_of_ones_own() -> None:
    told: list[Step] = []

    def reward(step: Step) -> float:
        told.append(step)
        return 7.0

    env = clearway.learning.make("crowd", reward=reward, **CROWD)
    env.reset(seed=0)
    for _ in range(3):
        assert env.step(np.ones(3, np.float32))[1] == 7.0
    assert np.array_equal(told[0].after, told[1].before)
    assert not np.array_equal(told[1].before, told[1].after)
    assert told[0].command == Command(1.0, bounds(load_robot("crowdnav-disc"))[1][2], v_y=1.0)


@pytest.mark.parametrize("given", [None, math.nan, math.inf, np.zeros(1), "much"])
def test_a_reward_that_is_none(given: Any) -> None:
    env = clearway.learning.make("crowd", reward=lambda step: given, **CROWD)
    env.reset(seed=0)
    with pytest.raises(
        ClearwayError, match=r"^reward: what it gave for a control period is .*; a finite number is expected"
    ):
        env.step(np.ones(3, np.float32))


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_what_is_wrong_in_another_process_is_told_in_this_one() -> None:
    envs = gymnasium.make_vec("clearway/Crowd-v0", 1, "async", reward=lambda step: math.nan, **CROWD)
    try:
        envs.reset(seed=0)
        with pytest.raises(ClearwayError, match=r"^reward: what it gave .* is nan; a finite number is expected"):
            envs.step(np.zeros((1, 3), np.float32))
    finally:
        envs.close()


@pytest.mark.parametrize("policy", [straight, lambda seen: np.zeros(3, np.float32)])
def test_at_the_end_nothing_more_is_seen_and_but_for_a_contact_driven(policy: Any) -> None:
    told: list[Step] = []
    env = clearway.learning.make("crowd", reward=lambda step: told.append(step) or 0.0, indicators=False, **CROWD)
    for seed in range(3):
        driven(env, seed, policy)
        assert told[-1].observation is told[-2].observation
        contact = told[-1].outcome == Outcome.COLLISION
        assert np.array_equal(told[-1].after, told[-1].before) != (contact and policy is straight)


def test_the_default_reward_is_what_its_words_say() -> None:
    at = np.zeros(3)
    near = Step(
        before=at, after=np.array((0.5, 0.0, 0.0)), goal=Goal(np.array((2.0, 0.0, 0.0)), 0.1, 9.0), command=Command(1.0, 0.0),
        observation=None, period=0.5, leg_reached=False, outcome=None,  # type: ignore[arg-type]
    )  # fmt: skip
    assert default_reward(near) == pytest.approx(0.5 - 0.05)
    assert default_reward(replace(near, outcome=Outcome.REACHED)) == pytest.approx(10.45)
    assert default_reward(replace(near, leg_reached=True)) == pytest.approx(10.45)
    assert default_reward(replace(near, outcome=Outcome.COLLISION)) == pytest.approx(-9.55)
    assert default_reward(replace(near, outcome=Outcome.TIMEOUT)) == pytest.approx(0.45)


def test_what_comes_depends_on_the_seed_alone() -> None:
    one, other = (clearway.learning.make("ward-day", beams=12) for _ in range(2))
    first = [one.reset(seed=5), one.reset(), one.reset()]
    other.reset(seed=1)
    second = [other.reset(seed=5), other.reset(), other.reset()]
    for (a, said), (b, again) in zip(first, second, strict=True):
        assert said == again
        assert all(np.array_equal(a[k], b[k]) for k in a)
    assert len({info["scenario"] for _, info in first}) == 3


@pytest.mark.parametrize("suite", ["hospital", "crowd", "ward-day", "sar-stress", "dynabarn", "replayed"])
def test_no_campaign_meets_what_a_learner_meets(suite: str) -> None:
    scenes = Scenes(suite, None, {})
    scenes.seed(0)
    met = [scenes.draw() for _ in range(5)]
    told = {s.name for s in met}
    for scenario in met:
        draw = [int(p) for p in scenario.name.split("-") if p.isdecimal() and len(p) > 5]
        assert all(LEARNING_DRAWS[0] <= d < LEARNING_DRAWS[1] for d in draw)
    assert len(told) == 5
    with pytest.raises(ClearwayError, match=r"2\^62 - 1"):
        CampaignPlan(suites=(suite,), seed=LEARNING_SEEDS[0])
    with pytest.raises(ClearwayError, match="that learners meet"):
        CampaignPlan(suites=(suite,), selection=Selection(seeds=(LEARNING_DRAWS[0] - 1, LEARNING_DRAWS[0] + 1)))
    CampaignPlan(suites=(suite,), seed=LEARNING_SEEDS[0] - 1)


@pytest.mark.parametrize("suite", [name for name in suite_names() if load_suite(name).generator is not None])
def test_no_learner_meets_a_test_that_it_names(suite: str) -> None:
    whole = load_suite(suite)
    test = whole.build(load_robot(whole.robots[0]), Selection(), outlines=True)[0]
    several = bool(test.robots)
    with pytest.raises(ClearwayError, match=r"scenarios: .*tests that a campaign runs"):
        Scenes(suite, None, {"scenarios": [test.name]}, several=several)
    with pytest.raises(ClearwayError, match=rf"suite: .*is a test of the suite '{suite}'"):
        Scenes(test, whole.robots[0], {}, several=several)


def test_a_scenario_of_ones_own_is_met_as_it_is() -> None:
    tests = load_suite("crowd").build(load_robot("crowdnav-disc"), Selection(batches=("circle-invisible",)))
    own = tests[0].model_copy(update={"name": "own", "labels": LabelSpec()})
    met = Scenes(own, "crowdnav-disc", {}).draw()
    assert (met.obstacles, met.start) == (own.obstacles, own.start)
    named = Scenes("hospital", "tiago", {"scenarios": ("NO-v0.2-r1",)})
    assert [scenario.name for scenario in named.outlines()] == ["NO-v0.2-r1"]


def test_every_scenario_comes_once_a_round() -> None:
    scenes = Scenes("hospital", "tiago", {"batches": ("SO",), "speeds": (0.6,)})
    scenes.seed(1)
    every = [scenes.draw() for _ in range(len(scenes.outlines()))]
    assert len({s.name for s in every}) == len(every) > 10
    assert not {s.seed for s in every} & {scenes.draw().seed for _ in range(len(every))}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"suite": "nowhere"}, "unknown suite 'nowhere'"),
        ({"suite": "hospital", "robot": "tago"}, "tiago"),
        ({"suite": "hospital", "robot": "tiago", "beams": -1}, "no number of beams"),
        ({"suite": "hospital", "robot": "tiago", "beams": 9000}, "more than the"),
        ({"suite": "crowd", "beams": 3}, "has no lidar"),
        ({"suite": "hospital", "obstacles": 1.5}, "no number of obstacles"),
        ({"suite": "crowd", "seeds": (0, 3)}, "no campaign takes"),
        ({"suite": "crowd", "batches": ("square",)}, "unknown batch 'square'"),
        ({"suite": "crowd", "bathces": ("x",)}, "bathces"),
        ({"suite": "sar-team"}, "make_team"),
        ({"suite": "hospital", "localisation": "gps"}, "unknown localisation 'gps'"),
        ({"suite": "hospital", "localisation": 3}, "localisation: 3 is not a name"),
        ({"suite": "hospital", "tracking": "kalmann"}, "unknown tracking 'kalmann'; did you mean 'kalman'"),
        ({"suite": "hospital", "reward": "x"}, "reward: 'x' is no function"),
        ({"suite": "hospital", "normalised": "false"}, "normalised: 'false' is none; True or False is"),
        ({"suite": "hospital", "flat": "no"}, "flat: 'no' is none"),
        ({"suite": "hospital", "indicators": 0}, "indicators: 0 is none"),
        ({"suite": "hospital", "speeds": "x"}, "speeds: 'x' is not a number"),
        ({"suite": "hospital", "render_mode": "human"}, "render_mode"),
        ({"suite": ["hospital", "crowd"]}, r"suite: \['hospital', 'crowd'\] are 2; an environment takes one"),
        ({"suite": "hospital", "robot": ["tiago", "hosbot"]}, "robot: .* are 2; an environment takes one"),
        ({"suite": "replayed", "people": "obsmat.txt"}, "people: 'obsmat.txt' is no `Replay`"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(options: dict[str, Any], said: str) -> None:
    with pytest.raises(ClearwayError, match=said):
        clearway.learning.make(**options)


def test_what_is_registered_can_be_written_down() -> None:
    env = gymnasium.make("clearway/Crowd-v0", obstacles=1)
    assert env.spec is not None
    assert json.loads(env.spec.to_json())["kwargs"] == {"suite": "crowd", "obstacles": 1}


def test_whole_numbers_of_numpy_are_taken() -> None:
    beams: Any = np.int64(8)
    env = gymnasium.make("clearway/Hospital-v0", robot="tiago", beams=beams)
    assert isinstance(env.observation_space, gymnasium.spaces.Dict)
    assert env.observation_space["lidar"].shape == (8,)
    assert type(Seeing(beams).beams) is int  # so that it can be written into a policy's file


def test_one_batch_and_one_speed_stand_for_themselves() -> None:
    env = clearway.learning.make("hospital", "tiago", batches="NO", speeds=0.6)
    _, info = env.reset(seed=1)
    assert info["scenario"].startswith("NO-")
    assert env.episode is not None
    assert env.episode.scenario.speed == 0.6


def test_a_team_takes_a_suite_of_teams() -> None:
    with pytest.raises(ClearwayError, match=r"learning\.make$"):
        clearway.learning.make_team("crowd")


@pytest.mark.parametrize("given", ["hosbot+tiago", ["hosbot", "tiago"]])
def test_a_team_is_driven_as_it_was_selected(given: Any) -> None:
    env = clearway.learning.make_team("meeting-points", team=given)
    env.reset(seed=1)
    assert [robot.name for robot in env.episode.robots] == ["hosbot", "tiago"]
    with pytest.raises(ClearwayError, match="robot: a team says who drives; leave out 'jackal'"):
        clearway.learning.make_team("meeting-points", "jackal", team=given)


def test_people_of_ones_own_are_met_at_times_that_are_drawn(tmp_path: Path) -> None:
    table = tmp_path / "people.csv"
    rows = [f"{t / 10},anna,{t / 10 - 8},5" for t in range(300)]
    table.write_text("\n".join(["t,id,x,y", *rows]), encoding="utf-8")
    people = clearway.recorded_people(table, start=(0.0, 0.0, 1.57), goal=(0.0, 11.0))
    env = clearway.learning.make("replayed", people=people, obstacles=1)
    env.reset(seed=1)
    assert env.episode is not None
    assert [person.name for person in env.episode.scenario.people] == ["person anna"]


@pytest.mark.parametrize("action", [np.zeros(2), np.array((np.nan, 0.0, 0.0)), np.array((np.inf, 0.0, 0.0))])
def test_an_action_that_is_none(action: np.ndarray) -> None:
    env = clearway.learning.make("crowd", **CROWD)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(3, np.float32))
    env.reset(seed=0)
    with pytest.raises(ValueError, match="3 finite numbers: v, v_y, omega"):
        env.step(action)


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=2),
    st.floats(0.05, 1.0),
)
def test_a_share_is_of_what_the_base_can(action: list[float], speed: float) -> None:
    robot = load_robot("tiago")
    low, high = bounds(robot, speed)
    command = Acting().command(action, robot, speed)
    assert low[0] <= command.v <= high[0]
    assert abs(command.omega) <= high[1]
    assert math.copysign(1.0, command.omega) == math.copysign(1.0, action[1]) or command.omega == 0.0
    units = Acting(normalised=False).command((command.v, command.omega), robot, speed)
    assert (units.v, units.omega) == (command.v, command.omega)
    assert axes(robot) == ("v", "omega")


@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_what_is_seen_is_in_the_robots_frame(theta: float, x: float, y: float) -> None:
    pose = np.array((x, y, theta))
    c, s = math.cos(theta), math.sin(theta)
    ahead = np.array(((x + 2.0 * c, y + 2.0 * s), (x - 3.0 * s, y + 3.0 * c)))  # 2 m ahead, 3 m to the left
    obstacles = exact(ahead[::-1], ((c, s), (-s, c)), (0.5, 0.25))
    ranges = np.array((math.inf, 4.0, 3.0, 9.0, 1.0, 2.0))
    scan = Scan(ranges, -1.0, 0.4, 0.05, 8.0, np.zeros(3))
    goal = Goal(np.array((*ahead[0], theta + 0.5)), 0.1, 0.2)
    seen = Seeing(beams=3, obstacles=3).parts(Observation(0.0, pose, np.array((0.3, 0.1)), pose, goal, scan, obstacles))
    assert seen["goal"] == pytest.approx((2.0, 0.0, math.cos(0.5), math.sin(0.5)), abs=1e-5)
    assert seen["velocity"] == pytest.approx((0.3, 0.1))
    assert seen["lidar"].tolist() == [4.0, 3.0, 1.0]
    expected = [[2.0, 0.0, 0.0, 1.0, 0.25, 1.0], [0.0, 3.0, 1.0, 0.0, 0.5, 1.0], [0.0] * 6]
    assert seen["obstacles"] == pytest.approx(np.array(expected), abs=1e-5)
    none = Seeing(obstacles=1).parts(
        Observation(0.0, pose, np.zeros(2), pose, replace(goal, yaw_tolerance=math.inf), None, replace(obstacles))
    )
    assert none["goal"][2:].tolist() == [0.0, 0.0]


def test_the_longest_range_stands_for_no_return() -> None:
    scan = Scan(np.full(4, math.inf), -1.0, 0.4, 0.05, 8.0, np.zeros(3))
    goal = Goal(np.zeros(3), 0.1, 0.2)
    seen = Seeing(beams=2).parts(Observation(0.0, np.zeros(3), np.zeros(2), np.zeros(3), goal, scan))
    assert seen["lidar"].tolist() == [8.0, 8.0]


def test_stable_baselines_learns_here() -> None:
    library = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    env = clearway.learning.make("crowd", flat=True, indicators=False, **CROWD)
    model = library.PPO("MlpPolicy", env, n_steps=64, batch_size=32, seed=1)
    model.learn(128)
    assert model.num_timesteps == 128
