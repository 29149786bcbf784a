"""The navigator `mpc-cbf`: model predictive control with discrete-time control barrier functions (Zeng, Zhang, Sreenath 2021)."""

from __future__ import annotations

from clearway.navigators.mpc_cbf.navigator import MpcCbf

__all__ = ["MpcCbf"]
