"""Clearway's own: a heuristic plan through space and time, tracked by a tube MPC, with a certificate before each step."""

from __future__ import annotations

from clearway.navigators.hp_st.navigator import HpSt, HpStForesight

__all__ = ["HpSt", "HpStForesight"]
