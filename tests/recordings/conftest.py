"""A fixture that several tests of recordings use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_plans import PLAN, Score, drive, write

from clearway.recordings.lab.assemble import assemble
from clearway.recordings.lab.lab import Lab
from clearway.recordings.protocol.toml_text import toml
from clearway.trials import Trial


@pytest.fixture
def score(tmp_path: Path) -> Score:
    def scored(trial: dict[str, Any], rows: np.ndarray | None = None, **changed: Any) -> Trial:
        write(tmp_path, "one.csv", drive() if rows is None else rows)
        content = PLAN | changed | {"trial": [{"file": "one.csv", "speed": 0.5} | trial]}
        (tmp_path / "plan.toml").write_text(toml(content), encoding="utf-8")
        return assemble(Lab(tmp_path / "plan.toml"), 0)

    return scored
