"""Nav2's SmacPlannerHybrid: Hybrid-A* for bases that turn in circles."""

from clearway.navigators.nav2.planners.smac_hybrid.planner import SmacHybrid

__all__ = ["SmacHybrid"]
