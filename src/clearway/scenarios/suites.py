"""The suites that come with Clearway, and reading one by name or from a file."""

from __future__ import annotations

from clearway.errors import unknown
from clearway.scenarios.barn import BARN, BARN_2022
from clearway.scenarios.files import load_suite_file
from clearway.scenarios.hospital import HOSPITAL
from clearway.scenarios.sar import SUITES as SAR
from clearway.scenarios.suite import Selection, Suite, scenario_seed

__all__ = ["Selection", "Suite", "load_suite", "scenario_seed", "suite_names"]

_SUITES = {s.name: s for s in (HOSPITAL, BARN, BARN_2022, *SAR)}


def suite_names() -> list[str]:
    """Names of the suites that come with Clearway."""
    return sorted(_SUITES)


def load_suite(which: str) -> Suite:
    """A suite by its name or by the path of its TOML file.

    Raises:
        ClearwayError: no such suite, or a field of its file that is wrong.
    """
    if which in _SUITES:
        return _SUITES[which]
    if which.endswith(".toml"):
        return load_suite_file(which)
    raise unknown("suite", which, suite_names())
