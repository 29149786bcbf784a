"""The robot of Nav2's tests, and the costmap of its servers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.navigators.nav2.costmaps.costmap import Costmap
from clearway.navigators.nav2.parameters import read
from clearway.robots import Robot, load_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("hosbot")


@pytest.fixture(scope="module")
def costmap(robot: Robot) -> Costmap:
    parameters = read(Path(__file__).with_name("nav2_pursuit.yaml"), robot)
    made = Costmap("local_costmap", parameters.local_costmap, robot, None)
    made.update(np.zeros(3), np.zeros(3))
    return made
