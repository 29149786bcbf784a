"""A navigator that doesn't drive a robot's base says so before anything runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.plan_checks import check_plan
from clearway.errors import ClearwayError
from clearway.navigators.registry import drives_of
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection

CAR = """
name = "car"
title = "Car"
d_base = 0.5
period = 0.1
footprint = {kind = "circle", radius = 0.25}
tolerances = {xy = 0.2, yaw = 0.2}
odometry = {translation_per_metre = 0.0, rotation_per_metre = 0.0, rotation_per_radian = 0.0}

[drive]
kind = "ackermann"
v_max = 1.0
v_min = -1.0
acceleration = 1.0
deceleration = 1.0
wheelbase = 0.4
steering_max = 0.5
steering_rate = 1.0
"""


@pytest.fixture
def car(tmp_path: Path) -> Path:
    file = tmp_path / "car.toml"
    file.write_text(CAR)
    return file


def test_a_base_that_a_navigator_does_not_drive(car: Path) -> None:
    plan = CampaignPlan(
        ("hospital",), (str(car),), ("hl-rrt",), Selection(batches=("NO",), repetitions=1), localisation="truth"
    )
    with pytest.raises(
        ClearwayError, match="'hl-rrt' drives differential bases, and that of the robot 'car' is ackermann"
    ):
        check_plan(plan, plan.specs())


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            'kind = "ackermann"',
            'kind = "tracked"',
            "drive.kind: unknown kind 'tracked'; .*known: ackermann, differential, omnidirectional",
        ),
        ("wheelbase = 0.4\n", "", "drive.wheelbase: is missing"),
        ("steering_max = 0.5", "steering_max = 1.6", "drive.steering_max: 1.6 is wrong"),
        ("steering_max = 0.5", "omega_max = 0.5", "drive.omega_max: unknown key"),
        ('kind = "ackermann"\n', "", "drive.wheelbase: unknown key"),
    ],
)
def test_a_wrong_drive_is_told(car: Path, old: str, new: str, told: str) -> None:
    car.write_text(CAR.replace(old, new))
    with pytest.raises(ClearwayError, match=told):
        load_robot(str(car))


def test_a_wheel_that_slips_along_its_direction_would_not_drive(car: Path) -> None:
    drive = """kind = "omnidirectional"
v_y_max = 1.0
omega_max = 1.0
angular_acceleration = 1.0
angular_deceleration = 1.0
lateral_acceleration = 1.0
lateral_deceleration = 1.0
wheels = [{x = 0.1, y = 0.1, slip = 0.0, speed = 1.0}]
"""
    car.write_text(CAR.partition("wheelbase")[0].replace('kind = "ackermann"\n', drive))
    with pytest.raises(ClearwayError, match=r"slip 0 must lie across direction 0"):
        load_robot(str(car))


@pytest.mark.parametrize("said", [["differential"], frozenset({"legged"}), frozenset(), 3])
def test_a_navigator_that_says_nonsense_of_what_it_drives(said: Any) -> None:
    class Strange:
        drives = said

    with pytest.raises(
        ClearwayError, match="`drives` is a frozenset of some of differential, omnidirectional, ackermann"
    ):
        drives_of("strange", Strange())
    assert drives_of("silent", object()) == {"differential"}
