"""Several results, every two of them side by side: test by test where they ran the same ones, else by configuration."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import pyarrow as pa

from clearway.errors import ClearwayError
from clearway.statistics.comparison import Comparison, NoCommonTest, compare
from clearway.statistics.configurations import ConfigurationComparison, compare_configurations, no_pairs


def compare_all(tables: Mapping[str, pa.Table], **options: Any) -> list[Comparison | ConfigurationComparison]:
    """Compare every two of several named results, the later one with the earlier one. Options as for `compare`.

    Simulated results are paired test by test; a simulation and a recording, or recordings of no known scenario, are
    matched by configuration. Two without a test in common, as robots that met each other in one scenario, are left out.

    Raises:
        ClearwayError: fewer than two, no two with a test in common, or as for `compare` and `compare_configurations`.
    """
    if len(tables) < 2:
        raise ClearwayError(f"a comparison needs at least two results, got {len(tables)}")
    found, apart = list[Comparison | ConfigurationComparison](), list[NoCommonTest]()
    for x, y in combinations(tables, 2):
        a, b = tables[x], tables[y]
        how = compare_configurations if no_pairs(a, b) else compare
        try:
            found.append(how(a, b, names=(x, y), **options))
        except NoCommonTest as error:
            apart.append(error)
    if not found:
        raise apart[0]
    return found
