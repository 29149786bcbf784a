"""What all tests share."""

from __future__ import annotations

import os
from typing import Any

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

# Both cores have a process of tests already. Before anything loads NumPy; the processes of xdist inherit it.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

# A kernel compiles at its first call, which no deadline should count; the same examples every time.
settings.register_profile("clearway", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("clearway")


class _ByFile(LoadScopeScheduling):  # type: ignore[misc]
    """The tests of one file run in one process, and so do all those of a navigator that compiles for long: else both
    processes compile it, at the same time."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return next((name for name in ("hp_st", "hp_tmpc") if name in file), file)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    return _ByFile(config, log)
