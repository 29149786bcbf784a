"""Space that manoeuvring takes, to set beside paper A's rule of at least 10 % of the robot's characteristic size."""

from __future__ import annotations

import numpy as np

from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.indicators.column import Kind
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished, goal_of, positions, track
from clearway.trials import Trial


def half_width(footprint: Shape) -> float:
    """Half of the robot's width across its direction of travel (the farther side), m."""
    return footprint.radius if isinstance(footprint, Circle) else float(np.abs(footprint.array[:, 1]).max())


def reach(footprint: Shape, drive: DrivenLeg) -> float:
    """How far the footprint reached sideways from the leg's straight line from start to goal, m."""
    pose = drive.pose if isinstance(footprint, Circle) else track(drive)
    start, along = drive.leg.start[:2], goal_of(drive)[:2] - drive.leg.start[:2]
    if not np.isfinite(start).all():
        raise NotComputable(f"the start of leg {drive.leg.name} is unknown")
    distance = float(np.hypot(*along))
    if not distance > 0:
        raise NotComputable(f"leg {drive.leg.name} has no straight line from start to goal")
    normal = np.array([-along[1], along[0]]) / distance
    centre: FloatArray = (positions(drive) - start) @ normal
    if isinstance(footprint, Circle):
        return float(np.abs(centre).max()) + footprint.radius
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    x, y = footprint.array.T
    sideways = (cos * normal[0] + sin * normal[1])[:, None] * x + (cos * normal[1] - sin * normal[0])[:, None] * y
    return float(np.abs(centre[:, None] + sideways).max())


def _footprint(trial: Trial) -> Shape:
    if trial.attempt.footprint is None:
        raise NotComputable("the footprint is unknown")
    return trial.attempt.footprint


@measure
def space(trial: Trial) -> float:
    """How far the footprint reached beyond the strip that it would sweep on the straight line A-B, m, worst leg."""
    footprint = _footprint(trial)
    return max(reach(footprint, drive) for drive in finished(trial)) - half_width(footprint)


@measure
def relative_space(trial: Trial) -> float:
    """The same as a share of the robot's width, which is paper A's d_base for both of its robots."""
    footprint = _footprint(trial)
    farthest = max(reach(footprint, drive) for drive in finished(trial))
    return (farthest - half_width(footprint)) / (2 * half_width(footprint))


_RULE = "Clearway, after paper A's rule of 10 % of the robot's size"

ALL = (
    Indicator("space", "manoeuvring space", "m", _RULE, "lower", space),
    Indicator("space_rel", "manoeuvring space over the robot's width", "", _RULE, "lower", relative_space, Kind.SHARE),
)
