"""Replays of one test by two navigators and of two robots in one simulation: in a real browser, and as a video."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_results import asked_of, glide
from test_page_in_browser import complaints, find, load, wait

from clearway.contract import BodyKind
from clearway.errors import ClearwayError
from clearway.indicators import row_schema, score_row
from clearway.reports import write_replay
from clearway.reports.video import write_video
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Body, Trial
from clearway.trials.store import Results, TrialStore, write_partial


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """One test twice, by two navigators, each with two robots."""
    robot = load_robot("tiago")
    (scenario,) = load_suite("hospital").build(robot, Selection(batches=("NO",), speeds=(0.6,), repetitions=1))[:1]
    trials: list[Trial] = []
    for navigator, scene in (("alpha", scenario), ("beta", scenario.model_copy(update={"speed": 0.5}))):
        made = glide(scene, robot)
        other = Body("second", BodyKind.ROBOT, robot.shape, None)
        for member in ("first", "second"):
            about = replace(
                made.attempt,
                navigator=navigator,
                run=f"run {navigator}",
                member=member,
                bodies=(*made.attempt.bodies, other),
            )
            there = made.pose[:, None] + (0.0, 1.5, 0.0)
            trials.append(replace(made, attempt=about, moving_obstacles=there, thinking=np.full(len(made.t), 0.02)))
    out = tmp_path_factory.mktemp("fleet") / "out"
    with TrialStore(out, asked_of("hospital"), len(trials), row_schema()) as store:
        for i, trial in enumerate(trials):
            write_partial(store.partial, store.key, i, trial, {"id": str(i)} | score_row(trial))
        return store.finish()


@pytest.mark.browser
@pytest.mark.slow
def test_another_navigator_is_shown_beside_on_the_same_clock(browser: Any, fleet: Results) -> None:
    load(browser, write_replay(fleet, 1))
    state = "return Replay.state()"
    assert browser.execute_script(state)["fellows"] == [0]
    options = [o.get_attribute("value") for o in browser.find_elements("css selector", "#beside option")]
    assert options == ["", "3"]  # the same robot of the same test, by the other navigator
    assert not find(browser, "#stage-beside").is_displayed()
    alone = float(find(browser, "#scrub").get_attribute("max"))
    browser.execute_script(
        "const b = document.getElementById('beside'); b.value = '3'; b.dispatchEvent(new Event('change'))"
    )
    wait(browser, "return Replay.state().beside === 3")
    assert find(browser, "#stage-beside").is_displayed()
    assert find(browser, "#stage-title").text.startswith("alpha: ")
    assert find(browser, "#stage-beside-title").text.startswith("beta: ")
    assert float(find(browser, "#scrub").get_attribute("max")) > alone  # beta is slower
    assert find(browser, "#clearance").size["height"] > 200  # clearance, speed, yaw rate, decisions
    find(browser, "#next").click()
    wait(browser, "return Replay.state().trial === 3")
    assert browser.execute_script(state)["beside"] is None
    assert complaints(browser) == []


def test_a_video_shows_both_until_the_later_has_ended(fleet: Results, tmp_path: Path) -> None:
    from PIL import Image

    file = write_video(fleet, [0, 2], tmp_path / "both.gif", speed=60.0)
    with Image.open(file) as image:
        frames = image.n_frames
        size = image.size
    slower = fleet.trial(2).t[-1]
    assert frames == pytest.approx(slower / 60.0 * 15 + 1, abs=1.5)
    assert size[0] > 2 * size[1]
    assert [p.name for p in tmp_path.iterdir()] == ["both.gif"]


@pytest.mark.parametrize(
    ("trials", "name", "says"),
    [([0], "course.avi", "is no video"), ([0], "course", "no ending"), ([9], "a.gif", "there is no trial 9")],
)
def test_a_video_that_cannot_be_is_one_error(
    fleet: Results, tmp_path: Path, trials: list[int], name: str, says: str
) -> None:
    with pytest.raises(ClearwayError, match=says):
        write_video(fleet, trials, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_a_clear_sentence(fleet: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matplotlib.animation import FFMpegWriter

    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(ClearwayError, match=r"takes the program ffmpeg, which is not installed; \.gif takes nothing"):
        write_video(fleet, [0], tmp_path / "a.mp4")
