"""The navigator `move-base`: ROS 1's navigation stack, re-implemented, with its own parameters."""

from __future__ import annotations

from clearway.navigators.move_base.navigator import MoveBase

__all__ = ["MoveBase"]
