"""`clearway rerun`: what the terminal shows, the exit code, and the debugger where a navigator raised."""

from __future__ import annotations

import json
import pdb
import shutil
import traceback
from pathlib import Path
from types import TracebackType

import pytest
from command_line import Shell

OWN = Path(__file__).parents[1] / "campaigns" / "own_navigators.py"


@pytest.fixture
def own(tmp_path: Path) -> Path:
    return Path(shutil.copy(OWN, tmp_path / "own.py"))


@pytest.fixture
def results(clearway: Shell, own: Path, tmp_path: Path) -> Path:
    out = tmp_path / "out"
    said = clearway(
        "run", "hospital", "--robot", "tiago", "--scenario", "NO-v1-r1", "--localisation", "truth", "--workers", "1",
        "-n", f"{own}:Drives", "-n", f"{own}:Raises", "--no-report", "--out", out,
    )  # fmt: skip
    assert said.code == 1, said.err
    return out


@pytest.mark.slow
def test_rerun(clearway: Shell, own: Path, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = clearway("rerun", results, "--trial", "0", "--out", tmp_path / "one")
    assert (said.code, said.err) == (0, "")
    assert f"trial 0 (hospital/NO-v1-r1/tiago/{own}:Drives): the same bits again; reached after" in said.out
    assert f"report: {tmp_path / 'one' / 'report' / 'index.html'}" in said.out
    assert (tmp_path / "one" / "report" / "trial-00000.html").is_file()
    other = clearway("rerun", results, "--trial", "0", "-n", f"{own}:Raises")
    assert other.code == 0
    assert "  outcome" in other.out
    assert " reached -> navigator_failed" in other.out
    assert "RuntimeError: lost" in other.err
    about = json.loads(clearway("rerun", results, "--trial", "1", "--json").out)
    assert (about["same_bits"], about["outcome"], about["changed"]) == (True, "navigator_failed", {})

    stopped: list[TracebackType] = []
    monkeypatch.setattr(pdb, "post_mortem", stopped.append)
    said = clearway("rerun", results, "--trial", "1", "--pdb")
    assert said.code == 1
    assert "raise RuntimeError" in str(traceback.extract_tb(stopped[0])[-1].line)

    own.write_text(own.read_text().replace("return Command(v,", "return Command(0.5 * v,"))
    said = clearway("rerun", results, "--trial", "0")
    assert said.code == 1
    assert "not the same bits. The first difference is cmd_v at " in said.out
    assert "  CT [s] " in said.out
    assert "there is no trial 2; it holds 0 to 1" in clearway.complaint("rerun", results, "--trial", "2")
