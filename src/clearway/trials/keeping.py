"""What is kept of a finished trial beside its row in the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, TypeAlias

from clearway.trials.trial import Trial

Keep: TypeAlias = Literal["trajectories", "failures", "table"]
KEEPS: dict[Keep, str] = {
    "trajectories": "everything of every trial",
    "failures": "everything of trials that did not succeed; of the others their rows in the table",
    "table": "of every trial its row in the table",
}
"""What may be kept, in words."""
_MARK = "kept"


def is_kept(keep: Keep, row: Mapping[str, Any]) -> bool:
    """Whether all of a trial with this row in the table is kept."""
    return keep == "trajectories" or (keep == "failures" and row["success"] is not True)


def outline(trial: Trial, keep: Keep) -> Trial:
    """What is left of a trial that is not kept: what was attempted, how it ended, and where the robot stood at first."""
    return replace(
        trial,
        t=trial.t[:1],
        pose=trial.pose[:1],
        velocity=None,
        estimate=None,
        command=None,
        leg=trial.leg[:1],
        moving_obstacles=trial.moving_obstacles[:1],
        spans=(),
        events=(),
        tie=None,
        sigma=None,
        cut=None,
        snapshots=(),
        provenance={**trial.provenance, _MARK: keep},
        thinking=None,
        between=None,
    )


def is_outline(trial: Trial) -> bool:
    """Whether the trial was not kept, and this is its outline."""
    return trial.provenance.get(_MARK) in KEEPS
