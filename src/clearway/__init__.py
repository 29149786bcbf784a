"""Clearway measures how well mobile robots find their way among people and obstacles.

    results = clearway.run("hospital", robots=["tiago"], navigators=["move-base"])
    results = clearway.open_results("results/hospital")

Importing this package is cheap: what the names below need is imported when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clearway.api import (
        Results,
        accept,
        acceptance_plan,
        check_parameters,
        compare,
        find_breaks,
        live_ros1,
        live_ros2,
        merge,
        open_results,
        passable,
        recorded_people,
        requirement,
        rerun,
        resume,
        run,
        score,
        simulate,
        tune,
    )
    from clearway.errors import ClearwayError

    __version__: str

__all__ = [
    "ClearwayError", "Results", "__version__", "accept", "acceptance_plan", "check_parameters", "compare", "find_breaks", "live_ros1", "live_ros2", "merge", "open_results", "passable", "recorded_people",
    "requirement", "rerun", "resume", "run", "score", "simulate", "tune",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in __all__ and name not in ("ClearwayError", "__version__"):
        from clearway import api

        return getattr(api, name)
    if name == "ClearwayError":
        from clearway.errors import ClearwayError

        return ClearwayError
    if name == "__version__":
        from importlib.metadata import version

        return version("clearway")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
