"""The navigator `orca`: optimal reciprocal collision avoidance for a base that is not holonomic."""

from __future__ import annotations

from clearway.navigators.orca.navigator import Orca

__all__ = ["Orca"]
