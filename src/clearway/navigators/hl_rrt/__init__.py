"""The navigator `hl-rrt`: horizon-based lazy RRT* with online learning, paper B's first rival."""

from __future__ import annotations

from clearway.navigators.hl_rrt.navigator import HlRrt

__all__ = ["HlRrt"]
