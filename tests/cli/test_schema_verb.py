"""Every kind of file has a schema."""

from __future__ import annotations

import json

import pytest
from command_line import Shell

from clearway.cli.schema import Kind


@pytest.mark.parametrize("kind", Kind)
def test_it_has_properties(clearway: Shell, kind: Kind) -> None:
    assert json.loads(clearway("schema", kind).out)["properties"]
