"""Inputs on which nav2_mppi_controller itself was run (`recordings/README.md`), and where what it made of them is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.geometry.shapes import Circle, rectangle
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.common.mppi.noise import draw_noise
from clearway.navigators.nav2.controllers.mppi.parameters import MPPIParameters
from clearway.navigators.nav2.seams import CostView

FOLDER = Path(__file__).parent / "recordings"
STEPS, BATCH, DECISIONS = 40, 48, 3

USUAL: dict[str, Any] = {
    "time_steps": STEPS,
    "batch_size": BATCH,
    "motion_model": "base",
    "base": {"plugin": "mppi::DiffDriveMotionModel"},
    "critics": (
        "ConstraintCritic", "CostCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic", "PathFollowCritic",
        "PathAngleCritic", "PreferForwardCritic",
    ),
    "PathAlignCritic": {"offset_from_furthest": 3},
}  # fmt: skip
OMNI = {"base": {"plugin": "mppi::OmniMotionModel"}}
CAR = {"base": {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.4}}


class Case(NamedTuple):
    """One recording.

    Attributes:
        own: Parameters that differ from `USUAL`.
        frequency: Of the controller, Hz.
        outline: A rectangle's length and width, m; None: a circle of 0.2 m.
        unknown: Whether the costmap tells unknown cells from free ones.
        limit: Of the speed, per cent; 0: none.
        length: Of the path, m.
    """

    own: dict[str, Any]
    frequency: float = 20.0
    outline: tuple[float, float] | None = None
    unknown: bool = True
    limit: float = 0.0
    length: float = 2.0


CASES: dict[str, Case] = {
    "usual": Case({}),
    "near the goal": Case({"GoalAngleCritic": {"symmetric_yaw_tolerance": True}}, length=0.48),
    "slower than its model": Case({"iteration_count": 2, "sgf_order": 1}, frequency=30.0, unknown=False),
    "omnidirectional": Case(
        OMNI | {"critics": (*USUAL["critics"], "TwirlingCritic", "VelocityDeadbandCritic"),
                "VelocityDeadbandCritic": {"deadband_velocities": (0.1, 0.05, 0.2)}, "vy_max": 0.3, "clamp_raw_controls": True}
    ),
    "car": Case(CAR | {"PathAngleCritic": {"mode": 2, "max_angle_to_furthest": 0.3}, "vx_std": 0.4}, limit=70.0),
    "outlined": Case({"CostCritic": {"consider_footprint": True}}, outline=(0.5, 0.36)),
    "obstacles": Case({"critics": ("ObstaclesCritic", "PathFollowCritic", "PathAngleCritic"), "PathAngleCritic": {"mode": 1}}),
    "obstacles, outlined": Case(
        {"critics": ("ObstaclesCritic", "PathFollowCritic"), "ObstaclesCritic": {"consider_footprint": True, "cost_power": 2}},
        outline=(0.5, 0.36),
    ),
    "powers": Case(
        {"ConstraintCritic": {"cost_power": 2}, "CostCritic": {"cost_power": 2, "trajectory_point_step": 3},
         "PathFollowCritic": {"cost_power": 3}, "PreferForwardCritic": {"cost_power": 2}, "vx_std": 0.5,
         "PathAlignCritic": {"offset_from_furthest": 2, "trajectory_point_step": 2, "use_path_orientations": True}}
    ),
    "late": Case({"model_delay_vx": 0.1, "model_delay_wz": 0.2, "open_loop": True}),
}  # fmt: skip


def table_of(case: Case) -> dict[str, Any]:
    """The parameters of a case."""
    return USUAL | case.own


def spaces_of(case: Case) -> dict[str, Any]:
    """What reads each namespace, with its values."""
    table = table_of(case)
    return {name: kind.model_validate(table.get(name, {})) for name, kind in MPPIParameters.children(table).items()}


def noise_of(case: Case) -> tuple[Any, Any, Any]:
    """(T, B) of vx, vy, wz."""
    p = MPPIParameters.model_validate(table_of(case))
    vx, vy, wz, spare = (np.zeros((STEPS, BATCH), np.float32) for _ in range(4))
    draw_noise(vx, wz, np.uint64(16), 0, p.vx_std, p.wz_std)
    draw_noise(vy, spare, np.uint64(16), 1, p.vy_std, 0.0)
    return vx, vy, wz


def view_of(case: Case) -> CostView:
    """A local costmap with three obstacles, some unknown cells, and inflation."""
    shape = Circle(0.2) if case.outline is None else rectangle(*case.outline)
    inscribed, circumscribed = (
        (0.2, 0.2) if case.outline is None else (case.outline[1] / 2, math.hypot(*case.outline) / 2)
    )
    cells, resolution, origin = 60, 0.05, np.array((-1.03, -1.52))
    rows, columns = np.mgrid[:cells, :cells]
    x, y = origin[0] + (columns + 0.5) * resolution, origin[1] + (rows + 0.5) * resolution
    away = np.min(
        [np.maximum(np.hypot(x - a, y - b) - 0.1, 0.0) for a, b in ((0.6, 0.45), (0.9, -0.5), (-0.2, -0.75))], axis=0
    )
    cost = np.where(away <= inscribed, 253.0, np.floor(252.0 * np.exp(-3.0 * (away - inscribed)) * (away < 0.7)))
    cost = np.where(away == 0.0, 254.0, np.where((rows + 3 * columns) % 97 == 0, 255.0, cost)).astype(np.uint8)
    return CostView(cost, origin, resolution, outline(shape), inscribed, circumscribed, 3.0, 0.7, case.unknown)


def decisions_of(case: Case) -> list[tuple[Any, Any, Any]]:
    """Pose, velocity and path of each decision: a robot that drives on, turned away from the path at first."""
    found = []
    for k in range(DECISIONS):
        pose = np.array((0.02 * k, 0.03 - 0.01 * k, 1.2 - 0.3 * k))
        velocity = np.array((0.1 + 0.1 * k, 0.02 * k, -0.3 * k))
        along = np.arange(0.02 * k, case.length, 0.05)
        path = np.column_stack((along, 0.1 * np.sin(2.0 * along), np.arctan(0.2 * np.cos(2.0 * along))))
        found.append((pose, velocity, path))
    return found
