"""Scoring that was stopped goes on, and a plan that has grown is scored where it is new; what comes out is what one go gives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

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


class Stopped(Exception):
    pass


def stop(done: int, total: int, note: str = "") -> None:
    if done:
        raise Stopped


def prepared(folder: Path, text: str = PLAN) -> Path:
    for name, length in (("hold", 0.0), ("one", 2.0), ("two", 2.5), ("three", 3.0)):
        write(folder / f"{name}.tum", length)
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return folder / "plan.toml"


def contents(out: Path) -> dict[str, Any]:
    """The bytes of every file; of campaign.json what was asked, and the others' digests."""
    files = {p.relative_to(out).as_posix(): p for p in out.rglob("*") if p.is_file()}
    campaign = json.loads(files.pop("campaign.json").read_text(encoding="utf-8"))
    digests = {n: d for n, d in campaign.pop("run")["sha256"].items() if n != "campaign.json"}
    return {name: p.read_bytes() for name, p in files.items()} | {"campaign": campaign, "digests": digests}


def resumed(plan: Path, out: Path) -> tuple[int, int]:
    """Score what is new; how many trials stood already, of how many."""
    told: list[tuple[int, int]] = []

    def tell(done: int, total: int, note: str = "") -> None:
        if note != "looking into the files":
            told.append((done, total))

    clearway.score(plan, out=out, workers=1, resume=True, progress=tell)
    return told[0]


@pytest.mark.slow
def test_a_file_that_ties_all_and_changed_meanwhile_is_named(tmp_path: Path):
    plan = prepared(tmp_path)
    with pytest.raises(Stopped):
        clearway.score(plan, out=tmp_path / "out", workers=1, progress=stop)
    size = (tmp_path / "hold.tum").stat().st_size
    write(tmp_path / "hold.tum", 0.001)
    assert (tmp_path / "hold.tum").stat().st_size == size
    with pytest.raises(ClearwayError, match=r"cannot resume: its campaign differs in files\.hold.tum"):
        clearway.score(plan, out=tmp_path / "out", workers=1, resume=True)


@pytest.mark.parametrize("finished", [True, False])
def test_a_trial_whose_file_changed_meanwhile_is_scored_again(tmp_path: Path, finished: bool):
    plan = prepared(tmp_path)
    if finished:
        clearway.score(plan, out=tmp_path / "out", workers=1)
    else:
        with pytest.raises(Stopped):
            clearway.score(plan, out=tmp_path / "out", workers=1, progress=stop)
    write(tmp_path / "two.tum", 1.5)
    assert resumed(plan, tmp_path / "out") == (1, 2)
    clearway.score(plan, out=tmp_path / "whole", workers=1)
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")


GROWN = """[[trial]]
file = "three.tum"
contact = false
[[trial]]
[[trial]]
file = "two.tum"
"""


def test_a_plan_that_has_grown_gives_the_bytes_of_one_go(tmp_path: Path):
    plan = prepared(tmp_path, PLAN.split("[[trial]]")[0] + "[[trial]]" + PLAN.split("[[trial]]")[1])
    clearway.score(plan, out=tmp_path / "out", workers=1)
    text = plan.read_text(encoding="utf-8")
    plan.write_text(text + "[[trial]]\nattempted = false\n" + GROWN, encoding="utf-8")
    assert resumed(plan, tmp_path / "out") == (1, 4)
    plan.write_text("poses.B = [9.0, 0.0, 0.0]\n" + text + '[[trial]]\nnote = "x"\n' + GROWN, encoding="utf-8")
    assert resumed(plan, tmp_path / "out") == (4, 5)
    clearway.score(plan, out=tmp_path / "whole", workers=1)
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")


def test_what_all_trials_depend_on_may_not_change(tmp_path: Path):
    plan = prepared(tmp_path)
    clearway.score(plan, out=tmp_path / "out", workers=1)
    before = contents(tmp_path / "out")
    plan.write_text("test.xy_tolerance = 0.1\n" + PLAN, encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"cannot resume: its campaign differs in test_plan\.test\.xy_tolerance"):
        clearway.score(plan, out=tmp_path / "out", workers=1, resume=True)
    assert contents(tmp_path / "out") == before
