"""A trial as a rosbag2 MCAP (stub)."""

from __future__ import annotations

from pathlib import Path

from clearway.errors import ClearwayError
from clearway.trials.trial import Trial

EPOCH = 946684800.0
"""UNIX time [s] of 2000-01-01: a trial does not know when it was."""


def write_trial(path: Path, trial: Trial, *, scans: bool = True, epoch: float = EPOCH) -> None:
    """Write a trial: a bag folder with metadata.yaml, or a bare file where `path` ends in `.mcap`."""
    raise ClearwayError("cannot be written yet", file=path)
