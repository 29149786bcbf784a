"""Campaigns whose navigators are processes: one that fails spoils its own trial, and none outlives its campaign."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from wire_scenes import PLANNERS, address

from clearway.campaigns import CampaignPlan, run_campaign
from clearway.campaigns.rerun import rerun
from clearway.examples_place import examples_folder
from clearway.scenarios.suites import Selection

pytestmark = pytest.mark.slow

EXAMPLE = f"exec:{sys.executable} {examples_folder() / '08_wire' / 'planner.py'}"


def plan(*navigators: str, scenarios: tuple[str, ...] = ("NO-v0.6-r1", "NO-v0.6-r2")) -> CampaignPlan:
    return CampaignPlan(
        suites=("hospital",), robots=("tiago",), navigators=navigators, selection=Selection(scenarios=scenarios),
        localisation="truth", decision_limit=1.0,
    )  # fmt: skip


def processes(word: str) -> list[int]:
    """Those whose command line has a word."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and word in (entry / "cmdline").read_text().split("\0"):
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def left(word: str) -> list[int]:
    """Those of `processes` that are still there after five seconds: one may be about to end, and another test's have the same kind."""
    for _ in range(100):
        if not processes(word):
            break
        time.sleep(0.05)
    return processes(word)


def test_a_failure_is_its_trials_alone_and_the_bits_are_the_same_again(tmp_path: Path) -> None:
    navigators = (address("dies"), EXAMPLE, address("hangs"), address("nan"))
    one = run_campaign(plan(*navigators), tmp_path / "one", 1)
    two = run_campaign(plan(*navigators), tmp_path / "two", 2)
    rows = one.trials.to_pylist()
    assert [row["outcome"] for row in rows] == ["navigator_failed"] * 2 + ["reached"] * 2 + ["navigator_failed"] * 4
    for row, says in zip(
        rows, ("upside down'",) * 2 + ("",) * 2 + ("thinking hard'",) * 2 + ("not finite",) * 2, strict=True
    ):
        assert says in row["reason"]
    assert one.trials.equals(two.trials)
    assert [one.trial(k).pose.tobytes() for k in range(8)] == [two.trial(k).pose.tobytes() for k in range(8)]
    assert "the same bits again" in str(rerun(one, 2))
    for kind in ("dies", "hangs", "nan"):
        assert left(kind) == []


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to look for processes")
@pytest.mark.parametrize("whom", ["worker", "campaign"])
def test_no_process_outlives_its_worker_or_its_campaign(tmp_path: Path, whom: str) -> None:
    mark = f"good-{tmp_path.name}"  # of an unknown kind: it drives on
    name = f"exec:{sys.executable} {PLANNERS} {mark}"
    code = (
        "import sys\nsys.path[:0] = [" + repr(str(Path(__file__).parent)) + "]\n"
        "from test_wire_campaign import plan\nfrom clearway.campaigns import run_campaign\n"
        f"run_campaign(plan({name!r}, scenarios=('NO-v0.6-r1',)), __import__('pathlib').Path({str(tmp_path / 'out')!r}), 1)\n"
    )
    campaign = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL, process_group=0)
    try:
        seen: list[int] = []
        for _ in range(1200):
            if seen := processes(mark):
                break
            time.sleep(0.05)
        assert len(seen) == 1
        parent = int(Path(f"/proc/{seen[0]}/stat").read_text().rpartition(")")[2].split()[1])
        assert parent != campaign.pid
        os.kill(parent if whom == "worker" else campaign.pid, signal.SIGKILL)
        for _ in range(100):
            if seen[0] not in processes(mark):
                break
            time.sleep(0.05)
        assert seen[0] not in processes(mark)
    finally:
        campaign.kill()
        campaign.wait()
    assert left(mark) == []
