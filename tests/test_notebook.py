"""The notebook among the examples: its cells run one after the other, as they stand; CI's smoke run executes it in Jupyter too."""

from __future__ import annotations

import json
import sys
import types
from pathlib import Path

import pytest

import clearway
from clearway import given

pytestmark = pytest.mark.slow

NOTEBOOK = Path(__file__).parents[1] / "examples" / "07_notebook.ipynb"


def test_every_cell_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(given, "_GIVEN", {})
    monkeypatch.setattr(given, "_packed", None)
    main = types.ModuleType("__main__")
    monkeypatch.setitem(sys.modules, "__main__", main)  # as a kernel's: its classes are found in no file
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [], "no output is kept in the file"
            exec(compile("".join(cell["source"]), cell["id"], "exec"), vars(main))
    results: clearway.Results = vars(main)["results"]
    assert results.trials["navigator"].to_pylist() == ["object:Straight", "move-base"]
    assert results.trials["success"].to_pylist() == [True, True]
    assert results.figure("trial", trial=0)._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    assert vars(main)["trial"].outcome.value == "reached"
