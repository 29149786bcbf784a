"""Every TOML file among the examples is told what it is, and has nothing wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Shell

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.toml"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.name)
def test_it_has_nothing_wrong(clearway: Shell, path: Path) -> None:
    said = clearway("check", path)
    assert (said.code, said.err) == (0, "")
    assert said.out.splitlines()[-1] == f"{path}: nothing wrong"
