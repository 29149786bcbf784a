"""Parameters of Nav2's route server, those of its edge scorers apart (nav2_route)."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.plugins import named
from clearway.quantities import Finite, NonNegative, Positive, Whole

_UNTRACKED = "a route is not tracked: no tree that ships with Nav2 asks for it"

LOADER = {"GeoJsonGraphFileLoader": "nav2_route::GeoJsonGraphFileLoader"}
SCORERS = {"DistanceScorer": "nav2_route::DistanceScorer", "DynamicEdgesScorer": "nav2_route::DynamicEdgesScorer"}


class GeoJsonGraphFileLoader(Group):
    """`nav2_route::GeoJsonGraphFileLoader`."""


class RouteServer(Group):
    """`route_server` (nav2_route/src/route_server.cpp and what it is made of)."""

    graph_filepath: str = Field(default="", description="the GeoJSON file of the graph, beside that of the parameters")
    graph_file_loader: str = Field(default=next(iter(LOADER)), min_length=1, description="what reads it")
    edge_cost_functions: tuple[str, ...] = Field(default=tuple(SCORERS), description="names of edge scorers")
    max_iterations: Whole = Field(default=0, description="of the search for a route; 0 or less: any number")
    enable_nn_search: bool = Field(
        default=True, description="whether a node that can't be seen from start or goal may be left for another"
    )
    num_nearest_nodes: Whole = Field(default=5, ge=1, description="among how many")
    max_nn_search_iterations: Whole = Field(default=10000, ge=0, description="cells that this looks at from the start")
    prune_goal: bool = Field(default=True, description="whether the last edge is left out where the goal lies along it")
    max_prune_dist_from_edge: Finite = Field(default=8.0, description="distance from an edge up to which it is, m")
    min_prune_dist_from_start: Finite = Field(
        default=0.1, description="distance of the start from the first node above which its edge is, m"
    )
    min_prune_dist_from_goal: Finite = Field(default=0.15, description="likewise of the goal from the last node, m")
    path_density: Positive = Field(default=0.05, ge=1e-6, description="between poses of a route's path at most, m")
    smooth_corners: bool = Field(default=False, description="whether its corners are made round")
    smoothing_radius: Positive = Field(default=1.0, description="of corners, m")
    smoothing_angle_threshold: NonNegative = Field(
        default=2.9, description="angle between two edges from which on their corner stays as it is, rad"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "route_frame": "graphs are given in the map",
        "base_frame": "the robot has one frame",
        "costmap_topic": "the global costmap is looked at",
        "max_planning_time": "only warns when planning takes longer",
        "graph_file_saver": "no graph is saved",
        "GeoJsonGraphFileSaver": "no graph is saved",
        "operations": _UNTRACKED,
        "radius_to_achieve_node": _UNTRACKED,
        "boundary_radius_to_achieve_node": _UNTRACKED,
        "tracker_update_rate": _UNTRACKED,
        "aggregate_blocked_ids": _UNTRACKED,
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """What reads the graph, and its edge scorers."""
        loader = (table.get("graph_file_loader", next(iter(LOADER))),)
        scorers = table.get("edge_cost_functions", tuple(SCORERS))
        return named("graph file loader", table, loader, "graph_file_loader", LOADER) | named(
            "edge scorer", table, scorers, "edge_cost_functions", SCORERS
        )
