"""What a navigator is told is checked, and typed for kernels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clearway.contract import Task
from clearway.navigators.common.inputs import area_of, finite, perception_radius
from clearway.robots import load_robot


def test_a_pose_comes_back_as_a_copy_of_floats() -> None:
    given = np.array((1, 2, 3))
    given.setflags(write=False)
    found = finite("pose", given)
    assert found.dtype == np.float64
    assert found.flags.writeable
    assert found.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("values", [(1.0, math.nan, 0.0), (1.0, 2.0, -math.inf), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0)])
def test_a_pose_that_is_none_is_named(values: Any) -> None:
    with pytest.raises(ValueError, match=r"the observation's goal\.pose is \[1\.0.*\]; 3 finite numbers are needed"):
        finite("goal.pose", values)


def test_a_camera_sees_before_a_lidar() -> None:
    rescue, tiago = load_robot("rescue"), load_robot("tiago")
    assert rescue.camera is not None
    assert perception_radius(rescue, 1.0) == rescue.camera.range
    assert perception_radius(tiago, 4.0) == 4.0
    assert perception_radius(tiago, 99.0) == 25.0
    assert perception_radius(tiago.model_copy(update={"lidar": None}), 4.0) == math.inf


def test_without_an_area_it_may_go_anywhere() -> None:
    assert area_of(Task(0.1, 1.0, np.zeros(3))).tolist() == [-math.inf, -math.inf, math.inf, math.inf]
    assert area_of(Task(0.1, 1.0, np.zeros(3), area=(0, 0, 14, 14))).tolist() == [0.0, 0.0, 14.0, 14.0]
