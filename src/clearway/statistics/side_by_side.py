"""Several results, every two of them side by side: test by test where they ran the same ones, else by configuration."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import pyarrow as pa

from clearway.errors import ClearwayError
from clearway.statistics.comparison import Comparison, compare
from clearway.statistics.configurations import ConfigurationComparison, compare_configurations, no_pairs


def compare_all(tables: Mapping[str, pa.Table], **options: Any) -> list[Comparison | ConfigurationComparison]:
    """Compare every two of several named results, the later one with the earlier one. Options as for `compare`.

    Simulated results are paired test by test; a simulation and a recording, or recordings of no known scenario, are
    matched by configuration.

    Raises:
        ClearwayError: fewer than two, or as for `compare` and `compare_configurations`.
    """
    if len(tables) < 2:
        raise ClearwayError(f"a comparison needs at least two results, got {len(tables)}")
    found: list[Comparison | ConfigurationComparison] = []
    for x, y in combinations(tables, 2):
        a, b = tables[x], tables[y]
        how = compare_configurations if no_pairs(a, b) else compare
        found.append(how(a, b, names=(x, y), **options))
    return found
