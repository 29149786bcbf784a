"""What all tests share."""

from __future__ import annotations

import pytest
from hypothesis import settings

# A kernel compiles at its first call, which no deadline should count; the same examples every time.
settings.register_profile("clearway", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("clearway")

_COMPILE_LONG = ("hp_st", "hp_tmpc")


@pytest.hookimpl(tryfirst=True)  # before the groups are read
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the tests of one file in one process, and those of a navigator that compiles for long: else both compile it."""
    for item in items:
        place = str(item.path)
        group = next((name for name in _COMPILE_LONG if name in place), place)
        item.add_marker(pytest.mark.xdist_group(group))
