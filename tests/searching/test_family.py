"""What a family is: ranges by the paths of a scenario's fields, and the one that any scenario has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.robots import load_robot
from clearway.scenarios.check import check_file
from clearway.scenarios.family import family_of, load_families
from clearway.scenarios.files import load_scenario, load_suite_file
from clearway.scenarios.perturbing import perturbed
from clearway.scenarios.suites import load_suite

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_family.toml"


def test_a_file_with_a_family_is_the_scenario_itself_for_everybody_else():
    scenario = load_scenario(EXAMPLE)
    assert load_suite_file(EXAMPLE).name == "my_family"
    assert check_file(EXAMPLE, load_robot("rescue")) == []
    (family,) = load_families(EXAMPLE)
    assert family.base == scenario
    assert load_families(EXAMPLE.with_name("my_corridor.toml")) == []


def test_values_go_where_their_paths_lead():
    (family,) = load_families(EXAMPLE)
    names = [v.name for v in family.variables]
    assert names[:3] == ["speed", "start.y", "obstacles.cart.runs.0.speed"]
    made = family.scenario([0.4, 6.6, 0.7, 1.5, 0.8, 6.0])
    assert (made.speed, made.start) == (0.4, (3.0, 6.6, 0.0))
    assert [(o.runs[0].speed, o.runs[0].delay) for o in made.obstacles[:2]] == [(0.7, 1.5), (0.8, 6.0)]
    assert made.obstacles[2] == family.base.obstacles[2]
    assert family.scenario([v.nominal for v in family.variables]) == family.base
    assert family.values(family.nominal) == pytest.approx([v.nominal for v in family.variables])


@pytest.mark.parametrize(
    ("ranges", "field", "said"),
    [
        ({"speed": [1.0, 0.2]}, "family.speed", "upside down"),
        ({"speed": [0.5, 0.5]}, "family.speed", "leaves no room"),
        ({"speed": [0.2, 0.5, 1.0]}, "family.speed", "is no range"),
        ({"speed": [0.2, float("inf")]}, "family.speed", "is no range"),
        ({"speed": [float("nan"), 1.0]}, "family.speed", "is no range"),
        ({"speed": ["0.2", "1.0"]}, "family.speed", "is no range"),
        ({"speed": [False, True]}, "family.speed", "is no range"),
        ({"speed": 0.5}, "family.speed", "is no range"),
        ({"speed": [0.2, 1e9]}, "family.speed", "cannot be: 1000000000.0 is wrong: input should be less than or equal to 100"),
        ({"start": {"theta": [-100.0, 100.0]}}, "family.start.theta", "angles are in radians"),
        ({"obstacles": [0, 3]}, "family.obstacles", "name a number in it"),
        ({"obstacles": {"cart": {"runs": {"-1": {"delay": [0, 1]}}}}}, "family.obstacles.cart.runs.-1.delay", "leads nowhere"),
        ({"obstacles": {"cart": {"shape": {"radius": [0.0, 0.5]}}}}, "family.obstacles.cart.shape.radius", "cannot be"),
        ({"livelock": [0, 1]}, "family.livelock", "continuous"),
        ({"start": {}}, "family", "nothing varies"),
        ({"speed": [-1.0, 0.5]}, "family.speed", "cannot be"),
        ({"sped": [0.2, 1.0]}, "family.sped", "did you mean 'speed'"),
        ({"start": [0.2, 1.0]}, "family.start", "name a number in it"),
        ({"start": {"w": [0.2, 1.0]}}, "family.start.w", "known: x, y, theta"),
        ({"obstacles": {"cort": {"pose": {"x": [0.0, 1.0]}}}}, "family.obstacles.cort.pose.x", "did you mean 'cart'"),
        ({"obstacles": {"cart": {"pose": {"x": [0.0, 1.0]}}}}, "family.obstacles.cart.pose.x", "not set"),
        ({"speed": {"x": [0.0, 1.0]}}, "family.speed.x", "nothing below"),
        ({"seed": [0, 10]}, "family.seed", "continuous"),
        ({"placement_xy": [0.0, 0.1], "obstacles": {"cart": {"runs": {"0": {"delay": [0, 1]}}}, "0": {"runs": {"0": {"delay": [0, 1]}}}}},
         "family.obstacles.0.runs.0.delay", "twice"),
        ({}, "family", "nothing varies"),
    ],
)  # fmt: skip
def test_a_range_that_is_none_is_told_in_one_sentence(ranges, field, said):
    with pytest.raises(ClearwayError) as caught:
        family_of(load_scenario(EXAMPLE), ranges, EXAMPLE)
    assert (caught.value.file, caught.value.field) == (str(EXAMPLE), field)
    assert said in caught.value.problem


def test_a_range_is_refused_where_neither_end_makes_sense(tmp_path):
    file = tmp_path / "far.toml"
    file.write_text(
        EXAMPLE.read_text().partition("\n[family]")[0] + "\n[family]\nstart.x = [-1e7, 1e7]\nspeed = [0.1, 1.0]\n"
    )
    (found,) = check_file(file, load_robot("rescue"))  # too slow for the time limit at one end alone
    assert found.field == "family.start.x"
    assert "neither end of the range [-1e+07, 1e+07] makes sense: the start (-1e+07, 7) is outside" in found.problem


@pytest.mark.parametrize(
    ("suite", "some"),
    [
        ("hospital", {"start.x", "speed", "latency"}),
        ("crowd", {"people.person 1.start.x", "people.person 1.route.0.at.y", "people.person 1.speed"}),
        ("sar-stress", {"obstacles.moving-1.oscillation.velocity.x", "obstacles.static-1.shape.radius", "start.theta"}),
        ("dynabarn", {"start.x", "obstacles.easylibobs_51.motion.offset"}),
        ("meeting-points", {"robots.robot 2.start.y"}),
    ],
)
def test_every_suite_has_a_family_by_what_its_scenarios_have(suite, some):
    found = load_suite(suite)
    scenario = found.build(load_robot(found.robots[0]))[0]
    family = perturbed(scenario)
    assert some <= {v.name for v in family.variables}
    assert family.scenario([v.nominal for v in family.variables]) == family.base
    assert all(v.low <= v.nominal <= v.high for v in family.variables)
    point = np.random.default_rng(0).random(len(family.variables))
    assert family.scenario(family.values(point)) != family.base


def test_a_disturbance_stays_within_its_bounds_and_what_does_not_move_so_has_no_room():
    found = load_suite("sar-case1")
    base = found.build(load_robot("rescue"))[0]
    by_name = {v.name: v for v in perturbed(base).variables}
    bounds = {n: v.high for n, v in by_name.items() if n.startswith("disturbance")}
    assert base.disturbance is not None
    assert bounds == {
        f"disturbance.{n.rpartition('.')[2]}": getattr(base.disturbance, n.rpartition(".")[2]) for n in bounds
    }
    assert bounds
    crowd = load_suite("crowd")
    assert not any(
        n.name.endswith(("wait", "reaction")) for n in perturbed(crowd.build(load_robot("crowdnav-disc"))[0]).variables
    )
