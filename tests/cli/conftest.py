from __future__ import annotations

import pytest
from command_line import Shell


@pytest.fixture
def clearway(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Shell:
    return Shell(monkeypatch, capsys)
