"""What decides: the registry; a folder or a file a method."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clearway.navigators.hp_tmpc import HpTmpc

__all__ = ["HpTmpc"]


def __getattr__(name: str) -> Any:  # a library's user gets it here; nobody else loads its kernels
    if name == "HpTmpc":
        from clearway.navigators.hp_tmpc import HpTmpc

        return HpTmpc
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
