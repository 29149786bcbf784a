"""CrowdNav's even test cases as its own code ran them."""

from __future__ import annotations

import gzip
import json
from functools import cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("crowdnav") / "orca_even_cases.jsonl.gz"


@cache
def recorded() -> dict[tuple[str, int], dict[str, Any]]:
    """By batch of the suite `crowd` and number of the case."""
    with gzip.open(FILE, "rt", encoding="utf-8") as lines:
        rows = [json.loads(line) for line in lines]
    return {(f"{row['rule'].partition('_')[0]}-{row['robot']}", row["case"]): row for row in rows}
