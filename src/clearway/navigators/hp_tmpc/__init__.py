"""The navigator `hp-tmpc`: heuristic planner and robust tube-based MPC (Rado, Baglioni, Jamshidnejad 2025: paper B)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clearway.navigators.hp_tmpc.navigator import HpTmpc

__all__ = ["HpTmpc"]


def __getattr__(name: str) -> Any:  # only who asks for the navigator loads its kernels
    if name == "HpTmpc":
        from clearway.navigators.hp_tmpc.navigator import HpTmpc

        return HpTmpc
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
