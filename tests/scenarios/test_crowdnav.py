"""The suite `crowd`: its cases are CrowdNav's, and an ORCA robot fares in them as CrowdNav's own did."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from crowdnav_cases import recorded

from clearway.campaigns.pilot import compose
from clearway.errors import ClearwayError
from clearway.navigators.orca import Orca
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.crowdnav import BATCHES, CASES, DENSER, TIME_LIMIT, crossings
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Trial
from clearway.world import simulate

ROBOT = load_robot("crowdnav-disc")


def build(suite: str = "crowd", **selection: Any) -> list[Scenario]:
    return load_suite(suite).build(ROBOT, Selection(**selection))


def drive(scenario: Scenario, **options: Any) -> Trial:
    pilot = compose(
        Orca(**options), make_localiser("truth", ROBOT), tracker=make_tracker("difference", ROBOT)
    )  # fmt: skip
    return simulate(scenario, ROBOT, pilot, navigator="orca", localisation="truth")


def test_the_even_cases_are_crowdnavs() -> None:
    for (batch, case), row in recorded().items():
        rule = batch.partition("-")[0]
        assert np.abs(np.array(crossings(rule, 1000 + case)) - row["humans"]).max() < 1e-6
    assert len(recorded()) == len(BATCHES) * CASES // 2


def test_a_scenario_asks_for_what_crowdnav_asks() -> None:
    seen, unseen = (build(batches=(f"square-{how}",), configurations=("case-7",)) for how in ("visible", "invisible"))
    (one,), (other,) = seen, unseen
    assert [p.sees_robots for p in one.people] == [True] * 5
    assert [p.sees_robots for p in other.people] == [False] * 5
    assert [p.start for p in one.people] == [p.start for p in other.people]
    assert (one.start, one.legs[0].goal[:2]) == ((0.0, -4.0, math.pi / 2), (0.0, 4.0))
    assert (one.legs[0].xy_tolerance, one.legs[0].time_limit, one.legs[0].arrival) == (0.3, TIME_LIMIT, "measured")
    assert (ROBOT.period, ROBOT.latency.sensing, ROBOT.latency.command, ROBOT.lidar) == (0.25, 0.0, 0.0, None)


def test_every_case_has_a_name_and_can_be_run() -> None:
    for suite in ("crowd", "crowd-held-out"):
        every = build(suite)
        assert len({s.name for s in every}) == len(every) == len(BATCHES) * CASES
        for scenario in every[::400]:
            assert [str(problem) for problem in check_scenario(scenario, ROBOT)] == []


def test_held_out_cases_are_of_another_density() -> None:
    (one,) = build("crowd-held-out", batches=("circle-visible",), configurations=("case-3",))
    assert len(one.people) == DENSER.people == 8
    assert one.reference_length == 10.0
    for a, b in itertools.combinations([(0.0, -5.0), *(p.start for p in one.people)], 2):
        assert math.dist(a, b) >= 0.8  # as CrowdNav keeps them


def test_other_draws_are_none_of_the_test_cases() -> None:
    drawn = build(seeds=(0, 3), batches=("circle-visible",))
    assert [s.labels.configuration for s in drawn] == ["seed-0", "seed-1", "seed-2"]
    ends = {tuple(p.start for p in s.people) for s in build(batches=("circle-visible",))}
    assert all(tuple(p.start for p in s.people) not in ends for s in drawn)
    (again,) = build(seeds=(0, 10**6), scenarios=("circle-visible-seed-2-v1-r1",))
    assert again == drawn[2]


@pytest.mark.parametrize("batch", [batch.name for batch in BATCHES])
def test_orca_fares_as_crowdnavs_orca_did(batch: str) -> None:
    """Outcome, time and place after every step; CrowdNav computes velocities in 32 bits."""
    for case in range(0, 20, 2):
        row = recorded()[batch, case]
        (scenario,) = build(batches=(batch,), configurations=(f"case-{case}",))
        trial = drive(scenario)
        assert trial.outcome.value == row["outcome"]
        # It tells contact by where people went in the step before, at the end of a step; here it is when it is.
        assert abs(trial.t[-1] - row["time"]) <= (0.5 if row["outcome"] == "collision" else 1e-9)
        n = min(len(trial.t), len(row["path"]) + 1) - 1
        assert np.abs(trial.pose[1:n, :2] - np.array(row["path"])[: n - 1]).max() < 1e-3


def test_without_crowdnavs_manner_of_arriving_orca_is_sooner_there() -> None:
    (scenario,) = build(batches=("circle-visible",), configurations=("case-0",))
    assert drive(scenario, arrival_time=0.0).t[-1] < drive(scenario).t[-1] - 0.2


def test_people_see_the_robot_only_where_they_are_to() -> None:
    """One who walks straight at a robot that stands gives way to it, or runs into it."""
    person = {
        "name": "person 1", "start": (0.0, 3.0), "route": [{"at": (0.1, -6.0)}], "speed": 1.0, "radius": 0.3, "behaviour": "crowdnav",
    }  # fmt: skip
    (scenario,) = build(batches=("circle-visible",), configurations=("case-0",))
    ends = []
    for sees in (True, False):
        alone = scenario.model_copy(update={"people": (PersonSpec.model_validate(person | {"sees_robots": sees}),)})
        stands = alone.model_copy(
            update={"legs": (alone.legs[0].model_copy(update={"time_limit": 10.0}),), "speed": 1e-3}
        )
        ends.append(drive(stands).outcome.value)
    assert ends == ["timeout", "collision"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"route": []}, "needs a 'route' of one place"),
        ({"route": [{"at": (0.0, 0.0)}, {"at": (1.0, 0.0)}]}, "needs a 'route' of one place"),
        ({"route": [{"at": (0.0, 0.0), "wait": 1.0}]}, "needs a 'route' of one place"),
        ({"reaction": 0.1}, "'reaction' means nothing to somebody whose behaviour is 'crowdnav'"),
        ({"loop": True}, "'loop' means nothing to somebody whose behaviour is 'crowdnav'"),
    ],
)
def test_bad_people(change: dict[str, Any], message: str) -> None:
    person = {"name": "p", "start": (0.0, 3.0), "route": [{"at": (0.0, -3.0)}], "behaviour": "crowdnav"}
    with pytest.raises(ValueError, match=message):
        PersonSpec.model_validate(person | change)


@pytest.mark.parametrize(
    ("selection", "message"),
    [
        ({"floor_plan": "ward"}, "takes place in 'crowd-floor', not in 'ward'"),
        ({"speeds": (1.5,)}, "1.5 m/s is out of reach for 'crowdnav-disc', at most 1"),
        ({"configurations": ("case-500",)}, "unknown configuration 'case-500'"),
        ({"batches": ("circle",)}, "unknown batch 'circle'"),
        ({"seeds": (2**32 - 10, 2**32)}, "draws from seeds below 4,294,965,296"),
    ],
)
def test_bad_selections(selection: dict[str, Any], message: str) -> None:
    with pytest.raises(ClearwayError, match=message):
        build(**selection)


def test_its_robot_goes_straight_over_a_period_though_it_could_turn() -> None:
    (scenario,) = build(batches=("circle-visible",), configurations=("case-2",))
    assert np.ptp(drive(scenario).pose[:, 2]) == 0.0
    assert np.ptp(drive(scenario, turns=True).pose[:, 2]) > 0.1


@pytest.mark.parametrize("option", [{"arrival_time": -1.0}, {"turns": 1.5}])
def test_bad_options(option: dict[str, Any]) -> None:
    with pytest.raises(ClearwayError, match=next(iter(option))):
        Orca(**option)
