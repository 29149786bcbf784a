"""A campaign killed in every way, at every stage, and gone on with: it has to end in the same bytes, with nothing left running.

Killed are the process, its group, and one of its workers, by TERM, KILL, INT and HUP: while it starts, while it compiles
(with an empty cache), while trials run, while the results are put together, and while the report is written. How long the
last process lived on is told with each.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from clearway.trials.journal import count
from fault_sections import Count
from fault_sections.navigators import FILE, session

SECONDS = 5.0
"""Within which the last process has to be gone, the time in which it only waited for a core left out."""
SIGNALS = (signal.SIGTERM, signal.SIGKILL, signal.SIGINT, signal.SIGHUP)
WHOM = ("parent", "group", "worker")

CLEARWAY = [sys.executable, "-c", "from clearway.cli import main; main()"]
CAMPAIGN = ["run", "hospital", "--robot", "tiago", "--batch", "NO", "--speed", "0.6", "--repetitions", "4", "--localisation",
            "truth", "--navigator", f"{FILE}:Drives", "--workers", "2"]  # fmt: skip

STAGES: dict[str, Callable[[Path, int], bool]] = {
    "starting": lambda out, leader: len(session(leader)) > 1,
    "running": lambda out, leader: count(out / ".partial") >= 2,
    "finishing": lambda out, leader: (out / ".partial/final").exists(),
    "reporting": lambda out, leader: bool(list(out.glob(".report-*"))),
    "compiling": lambda out, leader: bool(list((out.parent / "cache").rglob("*.nbc"))),
}


def kills(smoke: bool, every: int = 1) -> list[tuple[str, str, signal.Signals]]:
    """At which stage who is killed by what: all, each of `every`, or in a smoke run one."""
    found = [
        (stage, whom, number)
        for stage in STAGES
        for whom in WHOM
        for number in SIGNALS
        if (stage, whom) != ("reporting", "worker")
    ]
    return [("running", "parent", signal.SIGKILL)] if smoke else found[::every]


def measure(smoke: bool, every: int = 1) -> list[Count]:
    """Try every kill, or those of `kills`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([*CLEARWAY, *CAMPAIGN, "--out", str(folder / "whole")], check=True, capture_output=True)
        wanted = contents(folder / "whole")
        counts: dict[str, Count] = {}
        for stage, whom, number in kills(smoke, every):
            wrong, lived = _wrong(folder, stage, whom, number, wanted)
            after = "" if whom == "worker" else f", the last process gone after {lived:.2f} s"
            print(f"{stage}, {whom}, {number.name}: {wrong or 'survived'}{after}", file=sys.stderr, flush=True)
            counts.setdefault(stage, Count(f"kill while {stage}")).add(f"{whom}, {number.name}", wrong)
    return list(counts.values())


def _wrong(
    folder: Path, stage: str, whom: str, number: signal.Signals, wanted: dict[str, bytes]
) -> tuple[str | None, float]:
    """What went wrong, and how long processes lived on, s."""
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    (folder / "cache").mkdir(exist_ok=True)
    empty = {"NUMBA_CACHE_DIR": str(folder / "cache")} if stage == "compiling" else {}
    process = subprocess.Popen(
        [*CLEARWAY, *CAMPAIGN, "--out", str(out)], env=os.environ | empty, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=_heeding,
    )  # fmt: skip
    while process.poll() is None and not STAGES[stage](out, process.pid):
        time.sleep(0.002)
    workers = [pid for pid in session(process.pid) if pid != process.pid]
    try:
        if whom == "parent":
            process.send_signal(number)
        elif whom == "group":
            os.killpg(process.pid, number)
        elif workers:
            os.kill(workers[0], number)
    except ProcessLookupError:
        pass  # it was done sooner
    if whom == "worker":
        process.wait()  # another worker takes over
    began, waited = time.monotonic(), _waited(process.pid)
    lived = starved = 0.0
    while (left := session(process.pid)) and lived < SECONDS:
        time.sleep(0.02)
        starved = max(starved, _waited(process.pid) - waited)
        lived = max(0.0, time.monotonic() - began - starved)
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    process.wait()
    shutil.rmtree(folder / "cache", ignore_errors=True)
    if left and whom != "worker":
        return f"left running after {SECONDS:g} s: {left}", lived
    return _resumed_wrong(out, wanted), lived


def _waited(pid: int) -> float:
    """How long a process has been ready to run, and no core was free, s; 0 once it is gone."""
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) * 1e-9
    except (OSError, IndexError):
        return 0.0


def _resumed_wrong(out: Path, wanted: dict[str, bytes]) -> str | None:
    going_on = ["run", "--resume", str(out), "--workers", "2"] if (out / "campaign.json").exists() else None
    done = subprocess.run([*CLEARWAY, *(going_on or [*CAMPAIGN, "--out", str(out)])], capture_output=True, text=True)
    if done.returncode:
        return f"resumed with {done.returncode}: {done.stderr.strip()[-200:]}"
    if not (out / "report/index.html").exists():
        return "no report"
    found = contents(out)
    return (
        None
        if found == wanted
        else f"other bytes: {sorted(k for k in wanted if found.get(k) != wanted[k])}, {sorted(set(found) - set(wanted))}"
    )


def _heeding() -> None:
    """Signals do what they do by default, however this benchmark was started."""
    for number in SIGNALS[2:]:
        signal.signal(number, signal.SIG_DFL)


def contents(path: Path) -> dict[str, bytes]:
    """All that must be the same bytes: everything but the wall clock, the machine and what the report says of both."""
    files = (p for p in sorted(path.rglob("*")) if p.is_file() and "report" not in p.relative_to(path).parts)
    found = {
        str(p.relative_to(path)): p.read_bytes()
        for p in files
        if p.name not in ("timing.parquet", "thinking.parquet", "campaign.json")
    }
    campaign = json.loads((path / "campaign.json").read_text())
    return found | {"campaign.json": json.dumps({k: v for k, v in campaign.items() if k != "run"}).encode()}
