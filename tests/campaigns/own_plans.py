"""Campaigns of our own navigators, what has to be the same bytes of them, and their processes, as the tests of campaigns share them."""

from __future__ import annotations

import json
import re
import subprocess
import time
from importlib import resources
from pathlib import Path
from typing import Any

from clearway.campaigns import CampaignPlan
from clearway.scenarios.suites import Selection

OWN = Path(__file__).with_name("own_navigators.py")


def plan(*navigators: str, repetitions: int = 2, **options: Any) -> CampaignPlan:
    return CampaignPlan(
        suites=("hospital",),
        robots=("tiago",),
        navigators=tuple(f"{OWN}:{n}" for n in navigators or ("Drives",)),
        selection=Selection(batches=("NO",), speeds=(0.6,), repetitions=repetitions),
        localisation="truth",
        **options,
    )


def contents(path: Path) -> dict[str, bytes]:
    """All that must be the same bytes: everything but the wall clock and the machine."""
    found = {
        str(p.relative_to(path)): p.read_bytes()
        for p in sorted(path.rglob("*"))
        if p.is_file() and p.name not in ("timing.parquet", "thinking.parquet", "campaign.json")
    }
    campaign = json.loads((path / "campaign.json").read_text())
    return found | {"campaign.json": json.dumps({k: v for k, v in campaign.items() if k != "run"}).encode()}


LONE = """
name = "x"
floor_plan = "hall"
start = [-2.0, 0.0, 0.0]
speed = 0.5
[[legs]]
name = "forth"
goal = [2.0, 0.0, 0.0]
time_limit = 60.0
"""


def wait_for(process: subprocess.Popen[str], done: int) -> None:
    assert process.stdout is not None
    while int(process.stdout.readline()) < done:
        pass


def family(session: int) -> list[int]:
    """Processes of the session that are alive."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, _, sid = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if int(sid) == session and state != "Z":
                found.append(int(entry.name))
    return found


def left_over(session: int) -> list[int]:
    """Processes of the session that are still alive some seconds after its leader has ended."""
    for _ in range(80):
        if not family(session):
            break
        time.sleep(0.1)
    return family(session)


def robot_file(folder: Path, **changes: Any) -> Path:
    """The file of a robot of one's own: TIAGo's, with changes."""
    text = (resources.files("clearway.robots") / "tiago.toml").read_text()
    for name, value in changes.items():
        text, count = re.subn(rf"^{name} = .*$", f"{name} = {json.dumps(value)}", text, count=1, flags=re.MULTILINE)
        assert count == 1
    file = folder / "mine.toml"
    file.write_text(text)
    return file
