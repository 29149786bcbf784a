"""Scoring that was stopped goes on only with the very files that it began with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway.errors import ClearwayError

PLAN = """
sources.capture = { format = "tum", frame = { static_poses = [{ file = "hold.tum", pose = [0.0, 0.0, 0.0] }] } }
robot.track = "trajectory"
[[trial]]
file = "one.tum"
[[trial]]
file = "two.tum"
"""


def write(path: Path, length: float) -> None:
    t = np.arange(0.0, 8.0, 0.05)
    way = length * (1 - np.cos(np.pi * np.clip((t - 2.0) / 4.0, 0.0, 1.0))) / 2
    zero = np.zeros_like(t)
    np.savetxt(path, np.column_stack([t, way, zero, zero, zero, zero, zero, zero + 1.0]), fmt="%.6f")


@pytest.mark.parametrize("changed", ["one.tum", "hold.tum"])
def test_a_file_that_changed_meanwhile_is_named(tmp_path: Path, changed: str) -> None:
    for name, length in (("hold", 0.0), ("one", 2.0), ("two", 2.0)):
        write(tmp_path / f"{name}.tum", length)
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")

    def stop(done: int, total: int, note: str = "") -> None:
        if done:
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        clearway.score(tmp_path / "plan.toml", out=tmp_path / "out", workers=1, progress=stop)
    size = (tmp_path / changed).stat().st_size
    write(tmp_path / changed, 0.001)
    assert (tmp_path / changed).stat().st_size == size
    with pytest.raises(ClearwayError, match=rf"cannot resume: its campaign differs in files\.{changed}"):
        clearway.score(tmp_path / "plan.toml", out=tmp_path / "out", workers=1, resume=True)
