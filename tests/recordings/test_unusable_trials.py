"""One bad trial never stops the others: it is aborted with its reason; what is wrong in the plan is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from small_plans import PLAN, drive, write

import clearway
from clearway.errors import ClearwayError
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.protocol.toml_text import toml
from clearway.reports import recordings
from clearway.reports.findings import Findings

LOG = {"format": "table", "frame": {"same": True}, "estimate": "robot"}


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """Three trials with the robot's own log beside them, the second of which can be spoilt."""
    rows = drive(cart=(1.0, 0.8))
    for i in range(3):
        write(tmp_path, f"{i}.csv", rows)
        write(tmp_path, f"log{i}.csv", rows[20:])
    return written(tmp_path)


def written(folder: Path, **changed: Any) -> Path:
    sources = PLAN["sources"] | {"log": LOG | {"clock": "speed"}}
    trials = [
        {
            "file": f"{i}.csv",
            "files": {"log": f"log{i}.csv"},
            "speed": 0.5,
            "repetition": i + 1,
            "obstacles": [{"body": "cart"}],
        }
        for i in range(3)
    ]
    path = folder / "plan.toml"
    path.write_text(toml(PLAN | {"sources": sources, "trial": trials} | changed), encoding="utf-8")
    return path


def never_moved(folder: Path) -> None:
    rows = drive(cart=(1.0, 0.8))
    rows[:, 1:4] = 0.0
    write(folder, "1.csv", rows)


def garbage(folder: Path) -> None:
    (folder / "1.csv").write_bytes(bytes(range(256)) * 20)


def empty(folder: Path) -> None:
    (folder / "log1.csv").write_bytes(b"")


def gone(folder: Path) -> None:
    (folder / "1.csv").unlink()


def no_estimate(folder: Path) -> None:
    (folder / "log1.csv").with_suffix(".toml").write_text(
        'time = { column = "t" }\n[bodies.other]\nx = "x"\ny = "y"\nyaw = "th"\n', encoding="utf-8"
    )


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (never_moved, "the first source shows the robot at rest"),
        (garbage, "1.csv"),
        (empty, "log1.csv"),
        (gone, "no such file: '1.csv'"),
        (no_estimate, "unknown topic or track 'robot'"),
    ],
)
def test_the_others_are_scored(tmp_path: Path, plan: Path, spoil: Any, why: str) -> None:
    spoil(tmp_path)
    said = [str(p) for p in problems_of(plan)]
    assert len(said) == 1, said
    assert why in said[0], "check finds it beforehand"
    results = clearway.score(plan, out=tmp_path / "out", workers=1)
    good, bad, last = results.trials.to_pylist()
    assert (good["success"], last["success"]) == (True, True)
    assert good["CT"] == last["CT"]
    assert (bad["outcome"], bad["failure"], bad["success"]) == ("aborted", "aborted", False)
    assert bad["reason"].startswith("attempted; the recording cannot be used: ")
    assert why in bad["reason"]
    assert why.partition("'")[0] in bad["to_confirm"]
    assert set(json.loads(bad["not_computable"]).values()) == {"the recording cannot be used"}
    f = Findings(results)
    assert [r["trial"] for r in recordings.unusable(f)] == [1]
    assert recordings.unrecorded(f) == []
    assert any("The recording of 1 attempt cannot be used" in line for line in recordings.deviations(f))


def test_what_every_recording_lacks_lies_in_the_plan(tmp_path: Path, plan: Path) -> None:
    log = {"sources": PLAN["sources"] | {"log": LOG | {"estimate": "robto"}}}
    with pytest.raises(
        ClearwayError, match=r"sources.log.estimate: unknown topic or track 'robto'; did you mean 'robot'"
    ):
        clearway.score(written(tmp_path, **log), out=tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


def test_where_no_recording_can_be_used_nothing_is_written(tmp_path: Path, plan: Path) -> None:
    """Only scoring finds it: the plan says nothing of when the goals were sent, and the legs are two too many."""
    legs = {"legs": [{"name": f"leg {i}"} for i in range(5)]}
    with pytest.raises(ClearwayError, match="the goals are unknown"):
        clearway.score(written(tmp_path, **legs), out=tmp_path / "out", workers=1)
    assert not (tmp_path / "out" / "campaign.json").exists()


def test_what_the_operator_noted_stands_first(tmp_path: Path) -> None:
    rows = drive()
    for i in range(2):
        write(tmp_path, f"{i}.csv", rows)
    trials = [{"file": "0.csv"}, {"file": "1.csv", "stopped": True}]
    path = written(tmp_path, sources=PLAN["sources"], trial=trials)
    garbage(tmp_path)
    bad = clearway.score(path, out=tmp_path / "out", workers=1).trials.to_pylist()[1]
    assert bad["reason"].startswith("emergency stop; the recording cannot be used: ")
