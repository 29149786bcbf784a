"""Results directories that were damaged: each is told in one sentence, or its trials are what they were; never other ones.

Finished ones are opened and read; of unfinished ones a finished trial is damaged, which has to be run again, to the same bytes.
"""

from __future__ import annotations

import contextlib
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from clearway.campaigns import CampaignInterrupted, CampaignPlan, resume_campaign, run_campaign
from clearway.errors import ClearwayError
from clearway.scenarios.suites import Selection
from clearway.trials.differences import first_difference
from clearway.trials.store import open_results
from fault_sections import Count
from fault_sections.kills import contents
from fault_sections.navigators import FILE


def _flip(content: bytes, rng: random.Random) -> bytes:
    """One bit is another one."""
    at = rng.randrange(len(content))
    return content[:at] + bytes([content[at] ^ 1 << rng.randrange(8)]) + content[at + 1 :]


def _zeros(content: bytes, rng: random.Random) -> bytes:
    """A block of zeros, as a disk leaves it that lost its power."""
    at = rng.randrange(len(content))
    return content[:at] + bytes(min(512, len(content) - at)) + content[at + 512 :]


DAMAGES: dict[str, Callable[[bytes, random.Random], bytes | None]] = {
    "a bit": _flip,
    "zeros": _zeros,
    "cut": lambda content, rng: content[: rng.randrange(len(content))],
    "empty": lambda content, rng: b"",
    "twice": lambda content, rng: content + content,
    "gone": lambda content, rng: None,
}


def measure(smoke: bool) -> list[Count]:
    rng, often = random.Random(0), 1 if smoke else 8
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole, begun, out = folder / "whole", folder / "begun", folder / "out"
        plan = CampaignPlan(
            ("hospital",), ("tiago",), (f"{FILE}:Drives",), Selection(batches=("NO",), speeds=(0.6,), repetitions=3),
            localisation="truth",
        )  # fmt: skip
        run_campaign(plan, whole, 1)
        with contextlib.suppress(CampaignInterrupted):
            run_campaign(plan, begun, 1, progress=_stop)
        finished, unfinished = Count("damage: finished results"), Count("damage: a trial of unfinished ones")
        for file in sorted(p.relative_to(whole) for p in whole.rglob("*") if p.is_file()):
            for how in DAMAGES:
                for _ in range(often if how in ("a bit", "zeros", "cut") else 1):
                    _damaged(whole, out, file, how, rng)
                    finished.add(f"{file}, {how}", _read_wrong(out, whole))
        for how in ("cut", "gone") if smoke else DAMAGES:
            for file in sorted(p.relative_to(begun) for p in begun.glob(".partial/*.trials")):
                _damaged(begun, out, file, how, rng)
                unfinished.add(f"{file}, {how}", _resumed_wrong(out, whole))
    return [finished, unfinished]


def _stop(done: int, total: int, note: str) -> None:
    if done == 2:
        raise KeyboardInterrupt


def _damaged(of: Path, out: Path, file: Path, how: str, rng: random.Random) -> None:
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(of, out)
    content = DAMAGES[how]((out / file).read_bytes(), rng)
    if content is None:
        (out / file).unlink()
    else:
        (out / file).write_bytes(content)


def _read_wrong(out: Path, whole: Path) -> str | None:
    wanted = open_results(whole)
    try:
        found = open_results(out)
        if not found.trials.equals(wanted.trials):
            return "another table of trials, and not a word"
        for i in range(len(wanted)):
            if (difference := first_difference(found.trial(i), wanted.trial(i))) is not None:
                return f"another trial, and not a word: {difference}"
    except ClearwayError as error:
        return "several lines" if "\n" in str(error) else None
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def _resumed_wrong(out: Path, whole: Path) -> str | None:
    try:
        resume_campaign(out, 1)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None if contents(out) == contents(whole) else "other bytes"
