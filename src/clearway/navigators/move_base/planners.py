"""Chooses the global and the local planner that a robot's file names."""

from __future__ import annotations

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.potentials.global_planner import GlobalPlanner, Navfn, PotentialPlanner
from clearway.navigators.move_base.local_planners.dwa import DWAPlanner
from clearway.navigators.move_base.local_planners.interface import LocalPlanner
from clearway.navigators.move_base.local_planners.rollout import TrajectoryPlanner
from clearway.navigators.move_base.parameters import Parameters


def make_global_planner(parameters: Parameters) -> GlobalPlanner:
    """The global planner that `move_base.base_global_planner` names."""
    if parameters.move_base.base_global_planner == "navfn/NavfnROS":
        return Navfn(parameters.global_planner)
    return PotentialPlanner(parameters.global_planner)


def make_local_planner(
    parameters: Parameters, polygon: FloatArray, base_local_planner: str | None = None, sideways: bool = False
) -> LocalPlanner:
    """The local planner of `parameters.move_base.base_local_planner`, or the one named here instead.

    Args:
        polygon: (m, 2) padded outline in base_link, m, as the local costmap has it.
        base_local_planner: `dwa_local_planner/DWAPlannerROS` or `base_local_planner/TrajectoryPlannerROS`.
        sideways: Whether the base moves to its sides as well, which only the former makes use of.
    """
    rate = parameters.move_base.controller_frequency
    if (base_local_planner or parameters.move_base.base_local_planner) == "dwa_local_planner/DWAPlannerROS":
        dwa = parameters.DWAPlannerROS
        latch = parameters.move_base.latch_xy_goal_tolerance
        return DWAPlanner(dwa, polygon, 1.0 / (dwa.controller_frequency or rate), sideways, latch)
    trajectory = parameters.TrajectoryPlannerROS
    return TrajectoryPlanner(trajectory, polygon, 1.0 / (trajectory.controller_frequency or rate))
