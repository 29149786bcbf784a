"""What a robot sees and says, as Gymnasium's spaces."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from clearway.contract import Observation
from clearway.navigators.learnt.encoding import OBSTACLE, Acting, Numbers, Seeing, axes, bounds
from clearway.robots import Robot


def observation_space(seeing: Seeing, robot: Robot, *, flat: bool) -> spaces.Space[Any]:
    """What `seeing` gives of `robot`: a `Dict` of `Box`es, or one `Box` of all in a row."""
    sizes = seeing.sizes(robot)
    if flat:
        return _box(sum(sizes.values()))
    parts: dict[str, spaces.Space[Any]] = {name: _box(size) for name, size in sizes.items()}
    if "obstacles" in parts:
        parts["obstacles"] = _box(seeing.obstacles, OBSTACLE)
    if "lidar" in parts:
        assert robot.lidar is not None
        parts["lidar"] = spaces.Box(0.0, robot.lidar.range_max, (seeing.beams,), np.float32)
    return spaces.Dict(parts)


def seen(seeing: Seeing, observation: Observation, *, flat: bool) -> dict[str, Numbers] | Numbers:
    """What `seeing` gives of `observation`, as an element of that space."""
    return seeing.flat(observation) if flat else seeing.parts(observation)


def action_space(acting: Acting, robot: Robot) -> spaces.Box:
    """What `robot` can be told."""
    if acting.normalised:
        return spaces.Box(-1.0, 1.0, (len(axes(robot)),), np.float32)
    low, high = bounds(robot)
    return spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def _box(*shape: int) -> spaces.Box:
    return spaces.Box(-np.inf, np.inf, shape, np.float32)
