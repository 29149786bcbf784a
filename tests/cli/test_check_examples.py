"""Every TOML file among the examples is told what it is, and has nothing wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.campaigns.checks import check_file
from clearway.robots import load_robot

EXAMPLES = sorted(
    path for path in (Path(__file__).parents[2] / "examples").rglob("*.toml") if not path.name.startswith("tune_")
)  # what `clearway tune` reads is checked by itself, see tests/improving


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.name)
def test_it_has_nothing_wrong(path: Path) -> None:
    assert check_file(path, load_robot("tiago")) == []
