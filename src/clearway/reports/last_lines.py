"""The last lines of a run: why trials failed, in words; and the same for machines."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from clearway.reports.causes import causes_of_all, failures
from clearway.reports.findings import Findings
from clearway.statistics.summary import summary
from clearway.trials.store import Results


def why_trials_failed(results: Results) -> str:
    """The three commonest reasons of failure, each with how many trials, a typical one, and what might be tried; empty if none failed."""
    f = Findings(results)
    count = failures(f.rows)
    if not count:
        return ""
    lines = [f"{count} of {len(f.rows)} trials failed; most of them because the robot"]
    for c in causes_of_all(f):
        who = f" ({c.who})" if len(f.systems) > 1 else ""
        lines.append(
            f"  {c.count:>4} x {c.words}{who}, as in trial {c.trial}" + (f"; try: {c.advice}" if c.advice else "")
        )
    return "\n".join(lines)


def for_machines(results: Results) -> dict[str, Any]:
    """Success, indicators and their intervals by system, batch and speed, and the commonest reasons of failure, as JSON values."""
    f = Findings(results)
    return {"summary": summary(results.trials).to_pylist(), "reasons": [asdict(cause) for cause in causes_of_all(f)]}
