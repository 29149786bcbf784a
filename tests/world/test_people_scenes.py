"""The suite `people`: its scenes are sound, and people walk them as its words say."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from worlds import constant

from clearway.campaigns.pilot import compose
from clearway.errors import ClearwayError
from clearway.navigators.orca.navigator import Orca
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.people_scenes import PEOPLE, SCENES
from clearway.scenarios.suites import Selection
from clearway.trials import Outcome
from clearway.world import simulate, simulate_all
from clearway.world.drive import Driver

BUILT = {s.labels.configuration: s for s in PEOPLE.build(load_robot("tiago"), Selection(repetitions=1))}


@pytest.mark.parametrize("robot", PEOPLE.robots)
def test_every_scene_is_sound_and_says_what_is_expected(robot: str) -> None:
    ready = load_robot(robot)
    for scenario in PEOPLE.build(ready, Selection(repetitions=1)):
        assert [str(problem) for problem in check_scenario(scenario, ready)] == []
    assert all(scene.course.endswith(".") and "robot" in scene.course.lower() for scene in SCENES)


def test_there_is_no_other_floor_plan_for_them() -> None:
    with pytest.raises(ClearwayError, match="takes place in 'ward', not in 'hall'"):
        PEOPLE.build(load_robot("tiago"), Selection(floor_plan="hall"))


@pytest.mark.parametrize("name", [name for name, scene in BUILT.items() if not scene.robots])
def test_past_a_robot_that_stands_at_its_start_everybody_gets_where_they_want(name: str) -> None:
    scenario = BUILT[name].model_copy(update={"legs": (BUILT[name].legs[0].model_copy(update={"time_limit": 45.0}),)})
    trial = simulate(
        scenario, load_robot("tiago"), constant(0.0), navigator="stands", localisation="truth", map=None
    )  # fmt: skip
    assert trial.outcome is Outcome.TIMEOUT  # nobody has touched it
    m = trial.moving_obstacles
    people = range(m.shape[1] - len(scenario.people), m.shape[1])
    for k, person in zip(people, scenario.people, strict=True):
        assert np.hypot(*(m[-1, k, :2] - person.route[-1].at)) < 1.2, person.name  # a group stands as it likes
    for a, b in itertools.combinations(people, 2):
        assert np.hypot(*(m[:, a, :2] - m[:, b, :2]).T).min() > 0.3  # shoulders may touch, nobody walks through
    if name == "bed":
        assert np.isnan(m[-1, 0]).all()  # it has come out of the corridor


@pytest.mark.parametrize("name", [name for name, scene in BUILT.items() if scene.robots])
def test_robots_that_mind_each_other_all_get_across(name: str) -> None:
    """By ORCA and lidars that see all around: the scenes can be driven as their words say."""
    scenario, tiago = BUILT[name], load_robot("tiago")
    all_around = {"angle_min": -math.pi, "angle_max": math.pi * (1.0 - 2.0 / 720), "beams": 720}
    robot = tiago.model_copy(update={"lidar": tiago.lidar.model_copy(update=all_around)})
    floor = load_floor_plan(scenario.floor_plan).map
    drivers = []
    for _ in range(1 + len(scenario.robots)):
        pilot = compose(Orca(), make_localiser("truth", robot), tracker=make_tracker("kalman", robot))
        drivers.append(Driver(robot, pilot, map=floor, navigator="orca", localisation="truth"))
    trials = simulate_all(scenario, drivers, raise_errors=True)
    assert [trial.outcome for trial in trials] == [Outcome.REACHED] * len(drivers)
    met = np.hypot(*(trials[0].moving_obstacles[:, :, :2] - trials[0].pose[:, None, :2]).T).min()
    assert 0.4 < met < 2.5  # they do meet


def test_repetitions_differ_and_seeds_decide() -> None:
    robot = load_robot("tiago")
    some = Selection(configurations=("crossing",))
    one, two, _ = PEOPLE.build(robot, some)
    assert one.people[0].route[0].wait != two.people[0].route[0].wait
    assert abs(one.people[0].route[0].wait - 4.0) <= 0.5
    assert PEOPLE.build(robot, some)[0] == one
    assert PEOPLE.build(robot, some, 1)[0].people != one.people
