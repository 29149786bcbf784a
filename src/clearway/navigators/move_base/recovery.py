"""Recovery behaviours (rotate_recovery and clear_costmap_recovery of ros-planning/navigation)."""

from __future__ import annotations

import math

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.costmap import Costmap
from clearway.navigators.common.costmaps.footprint import Scene, footprint_cost, make_scene
from clearway.navigators.move_base.parameters import (
    ClearCostmapRecovery,
    MoveBaseGroup,
    Parameters,
    RecoveryBehavior,
    RotateRecovery,
)

CIRCUMSCRIBED = 0.46
"""move_base's own default of `local_costmap/circumscribed_radius`, m: it never asks the costmap for it."""

_YAW_TOLERANCE = 0.10


def recovery_behaviors(parameters: MoveBaseGroup) -> tuple[RecoveryBehavior, ...]:
    """The behaviours in their order: the file's, or move_base's defaults."""
    if parameters.recovery_behaviors is not None:
        return parameters.recovery_behaviors
    clear = "clear_costmap_recovery/ClearCostmapRecovery"
    conservative = ClearCostmapRecovery(
        type=clear, name="conservative_reset", reset_distance=parameters.conservative_reset_dist
    )
    aggressive = ClearCostmapRecovery(type=clear, name="aggressive_reset", reset_distance=4 * CIRCUMSCRIBED)
    if not parameters.clearing_rotation_allowed:
        return conservative, aggressive
    rotate = RotateRecovery(type="rotate_recovery/RotateRecovery", name="rotate_recovery")
    return conservative, rotate, aggressive, rotate


def clear_costmap(behavior: ClearCostmapRecovery, costmap: Costmap, x: float, y: float) -> bool:
    """Clear the costmap's obstacle layer if the behaviour names it, around the robot at (x, y); whether it did."""
    layer = costmap.parameters.obstacle_layer
    if layer is None or layer.name not in behavior.layer_names:
        return False
    costmap.forget(x, y, behavior.reset_distance, behavior.invert_area_to_clear)
    return True


class Rotation:
    """One turn in place, in the making: first to the heading opposite to the start's, then back to the start's."""

    def __init__(self, behavior: RotateRecovery, parameters: Parameters, yaw: float) -> None:
        speeds = parameters.TrajectoryPlannerROS
        self._granularity = behavior.sim_granularity
        self._acceleration = speeds.acc_lim_theta
        self._slowest, self._fastest = speeds.least_goal_turn, speeds.max_vel_theta
        given = "yaw_goal_tolerance" in speeds.model_fields_set
        self._tolerance = speeds.yaw_goal_tolerance if given else _YAW_TOLERANCE
        self._start = self._yaw = yaw
        self._half = False

    def step(self, pose: FloatArray, costmap: Costmap) -> float | None:
        """The next yaw rate [rad/s], or None: it is done, or the way around is not free.

        Args:
            pose: (3,) in the frame of the local `costmap`.
        """
        if self._half and abs(wrap(self._start - self._yaw)) <= self._tolerance:
            return None
        self._yaw = float(pose[2])
        if not self._half:
            to_half = abs(wrap(self._start + math.pi - self._yaw))
            left = math.pi + to_half
            self._half = to_half < self._tolerance
        else:
            left = abs(wrap(self._start - self._yaw))
        scene = make_scene(costmap.cost, costmap.origin, costmap.resolution, costmap.footprint)
        if not _free_turn(scene, pose, left, self._granularity):
            return None
        return min(max(math.sqrt(2 * self._acceleration * left), self._slowest), self._fastest)


@kernel
def _free_turn(scene: Scene, pose: FloatArray, turn: float, step: float) -> bool:
    """Whether the outline stays off obstacles while it turns left by `turn` radians, checked every `step`."""
    angle = 0.0
    while angle < turn:
        cosine, sine = math.cos(pose[2] + angle), math.sin(pose[2] + angle)
        if footprint_cost(scene.cost, scene.frame, scene.polygon, pose[0], pose[1], cosine, sine, 1.0) < 0:
            return False
        angle += step
    return True
