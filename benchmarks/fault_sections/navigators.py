"""Navigators that misbehave, each in a campaign of two beside one that doesn't.

Survived is what ends in results in which the other navigator's trial is as it is without a misbehaving one, or, where it
is seen before anything runs, in one sentence; within five minutes (`PATIENCE` has who may take longer), and with nothing left
running.
"""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from fault_sections import Count

FILE = Path(__file__).parents[2] / "tests/campaigns/misbehaving_navigators.py"
SECONDS = 300.0
"""That a campaign may take, on a machine that has other work too; alone it is some 10 s."""
PATIENCE = {"CompilesForEver": 900.0}
"""s for those for whom that is not enough: only what goes on between two compilations counts as the navigator's time."""


SMOKE = ("raises", "crashes", "hangs")
"""Kinds of which one is tried in a smoke run."""


def measure(smoke: bool) -> list[Count]:
    spec = importlib.util.spec_from_file_location("misbehaving_navigators", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    from clearway.campaigns import CampaignPlan, run_campaign
    from clearway.reports.text import headline
    from clearway.scenarios.suites import Selection

    csv.field_size_limit(1 << 30)
    with tempfile.TemporaryDirectory() as folder:
        some = Selection(scenarios=("NO-v0.6-r1",))
        plan = CampaignPlan(("hospital",), ("tiago",), (f"{FILE}:Drives",), some, localisation="truth")
        headline(run_campaign(plan, Path(folder) / "warm", 0).trials)  # whoever is forked off has all that it needs
        wanted = _run(Path(folder) / "alone", ["Drives"])
        return [
            _kind(kind, list(module.CLASSES[kind])[: 1 if smoke else None], Path(folder), wanted)
            for kind in (SMOKE if smoke else module.CLASSES)
        ]


def _kind(kind: str, names: list[str], folder: Path, wanted: Any) -> Count:
    count = Count(f"navigator: {kind}")
    for name in names:
        wrong = _wrong(folder / name, name, wanted)
        print(f"{kind}: {name}: {wrong or 'survived'}", file=sys.stderr, flush=True)
        count.add(name, wrong)
    return count


def _wrong(out: Path, name: str, wanted: Any) -> str | None:
    found = _run(out, [name, "Drives"])
    if found["left"]:
        return f"left running: {found['left']}"
    if found["said"].startswith("clearway: ") and found["said"].count("\n") == 1 and found["code"] == 2:
        return None
    if "rows" not in found:
        return f"no results: {found['code']}, {found['said'].strip()[-300:]}"
    if found["rows"][1] != wanted["rows"][0]:
        return f"the other's trial: {found['rows'][1]}"
    return None if found["json"] else "what it printed stands in the JSON"


def _run(out: Path, names: list[str]) -> dict[str, Any]:
    """What came of a campaign: its exit code, what it said, the trials' row if there are results."""
    said, told = out.with_suffix(".err"), out.with_suffix(".out")
    arguments = ["run", "hospital", "--robot", "tiago", "--scenario", "NO-v0.6-r1", "--localisation", "truth"]
    arguments += [part for name in names for part in ("--navigator", f"{FILE}:{name}")]
    arguments += ["--decision-limit", "1", "--workers", "1", "--no-report", "--json", "--out", str(out)]
    patience = max(PATIENCE.get(name, SECONDS) for name in names)
    child = os.fork()
    if child == 0:
        _be_clearway(arguments, said, told)
    code, began = None, time.monotonic()
    while code is None and time.monotonic() - began < patience:
        pid, status = os.waitpid(child, os.WNOHANG)
        code = os.waitstatus_to_exitcode(status) if pid else None
        time.sleep(0.02)
    if code is None:
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
    while (left := session(child)) and code is not None and time.monotonic() - began < patience + 6.0:
        time.sleep(0.1)
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    found = {"code": code, "said": said.read_text(errors="replace"), "left": left if code is not None else []}
    if (out / "trials.csv").exists() and not (out / ".partial").exists():
        found["rows"] = [
            {k: v for k, v in row.items() if k not in ("trial",)} for row in csv.DictReader((out / "trials.csv").open())
        ]
        try:
            found["json"] = json.loads(told.read_text())["trials"] == len(names)
        except (ValueError, UnicodeError):
            found["json"] = False
    return found


def _be_clearway(arguments: list[str], said: Path, told: Path) -> None:
    os.setsid()
    for number, file in ((1, told), (2, said)):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT), number)
    code = 70
    try:
        from clearway.cli import main

        sys.argv = ["clearway", *arguments]
        main()
        code = 0
    except SystemExit as done:
        code = done.code if isinstance(done.code, int) else 1
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)


def session(leader: int) -> list[int]:
    """The processes of a session that are alive."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, _, of = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if int(of) == leader and state != "Z":
                found.append(int(entry.name))
    return found
