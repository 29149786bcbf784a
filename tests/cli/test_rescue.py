"""`clearway run sar-...`: drawn scenarios, the same bits whoever works, and what is wrong with `--seeds`."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from command_line import Shell

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("suite", "seeds", "said"),
    [
        ("sar-case1", "4", "seeds: '4' is no range of seeds; 0:200 are the seeds 0 to 199"),
        ("sar-case1", "7:7", "seeds: '7:7' is no range of seeds; 0:200 are the seeds 0 to 199"),
        ("hospital", "0:2", "seeds: the suite 'hospital' has no generator that could draw from seeds"),
    ],
)
def test_wrong_seeds(clearway: Shell, tmp_path: Path, suite: str, seeds: str, said: str) -> None:
    assert clearway.complaint("run", suite, "--seeds", seeds, "--out", tmp_path / "r") == f"clearway: {said}"


def test_move_base_without_a_map_on_drawn_scenarios(clearway: Shell, tmp_path: Path) -> None:
    ran = clearway(
        "run", "sar-case2", "--seeds", "3:5", "--no-report", "--workers", "1", "--json", "--out", tmp_path / "r"
    )
    assert json.loads(ran.out)["trials"] == 2
    campaign = (tmp_path / "r" / "campaign.json").read_text()
    json.loads(
        campaign, parse_constant=lambda word: pytest.fail(f"{word} is no JSON")
    )  # this robot's limits are infinite
    rows = pq.read_table(tmp_path / "r" / "trials.parquet").to_pylist()
    assert [(r["robot"], r["batch"], r["configuration"]) for r in rows] == [
        ("rescue", "case 2", "seed-3"),
        ("rescue", "case 2", "seed-4"),
    ]
    assert {r["outcome"] for r in rows} <= {"reached", "collision", "livelock", "timeout"}
    again = clearway("run", "sar-case2", "--seeds", "4:5", "--no-report", "--workers", "1", "--out", tmp_path / "again")
    assert again.code == 0
    other = pq.read_table(tmp_path / "again" / "trials.parquet").to_pylist()
    assert {k: v for k, v in other[0].items() if k != "trial"} == {k: v for k, v in rows[1].items() if k != "trial"}
