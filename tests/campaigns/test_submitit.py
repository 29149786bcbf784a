"""The example that runs a campaign's shards as jobs of submitit."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from campaigns.test_shards import ALONE
from clearway.trials.store import open_results

EXAMPLE = Path(__file__).parents[2] / "examples" / "09_submitit.py"
SUITE = 'title = "two"\nname = "two"\nfiles = ["alone.toml", "far.toml"]\n'


@pytest.mark.slow
def test_jobs_of_submitit_run_the_shards(tmp_path: Path) -> None:
    alone = ALONE.replace('"arena"', '"hall"').replace(" 7.0,", " 1.0,")  # which has a map
    (tmp_path / "alone.toml").write_text(alone)
    (tmp_path / "far.toml").write_text(alone.replace('"alone"', '"far"').replace("[3.5,", "[4.0,"))
    (tmp_path / "two.toml").write_text(SUITE)
    runpy.run_path(str(EXAMPLE))["main"](tmp_path / "two.toml", tmp_path)
    whole = open_results(tmp_path / "whole")
    assert [row["scenario"] for row in whole.trials.to_pylist()] == ["alone-v0.8-r1", "far-v0.8-r1"]
    assert [len(open_results(tmp_path / f"part-{number}")) for number in (1, 2)] == [1, 1]
