"""A trial's video by a pattern, and where in it an event is: linked in the report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.recordings.test_score_resumed import write

import clearway
from clearway.errors import ClearwayError
from clearway.recordings.lab.plan_file import load_test_plan

pytestmark = pytest.mark.slow

PLAN = """
sources.capture = { format = "tum", frame.same = true }
video = { files = "film/{number:02d}*", offset = 2.5 }
robot.track = "trajectory"
[[trial]]
file = "one.tum"
span = [0.5, 7.9]
contact_at = [3.5]
[[trial]]
file = "two.tum"
video = "film/own #2.mp4"
video_offset = -1.0
contact_at = [3.0]
[[trial]]
file = "three.tum"
"""


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    for name in ("one", "two", "three"):
        write(tmp_path / f"{name}.tum", 2.0)
    (tmp_path / "film").mkdir()
    (tmp_path / "film/01 north.mp4").write_bytes(b"")
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    return tmp_path


def test_videos_are_found_and_tell_when(lab: Path):
    results = clearway.score(lab / "plan.toml", out=lab / "out", workers=1)
    assert [results.trial(i).provenance.get("video") for i in range(3)] == [
        {"file": "film/01 north.mp4", "start": 3.0},
        {"file": "film/own #2.mp4", "start": -1.0},
        None,
    ]
    (lab / "plan.toml").write_text(PLAN.replace("{number:02d}*", "all.mp4"), encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"video\.files.*says nothing of trials"):
        load_test_plan(lab / "plan.toml")


def test_another_offset_scores_what_it_concerns(lab: Path):
    clearway.score(lab / "plan.toml", out=lab / "out", workers=1)
    (lab / "plan.toml").write_text(PLAN.replace("2.5", "4.5"), encoding="utf-8")
    results = clearway.score(lab / "plan.toml", out=lab / "out", workers=1, resume=True)
    assert results.trial(0).provenance["video"]["start"] == 5.0


def test_events_link_to_their_moment(lab: Path, browser: Any):
    page = clearway.score(lab / "plan.toml", out=lab / "results" / "out", workers=1).report()
    browser.get(f"file://{page}")
    found = []
    for trial in range(3):
        browser.execute_async_script("Replay.show(arguments[0]).then(arguments[1])", trial)
        found.append([a.get_attribute("href") for a in browser.find_elements("css selector", "#events a")])
    assert found == [[f"file://{lab}/film/01%20north.mp4#t=6.0"], [f"file://{lab}/film/own%20%232.mp4#t=2.0"], []]
