"""The run sheet has every trial once, says where things stand, and needs nothing but itself to be printed."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from clearway.recordings.lab.test_plan import TestPlan
from clearway.recordings.protocol.lab_trials import scenarios
from clearway.recordings.protocol.protocol import parsed, skeleton
from clearway.recordings.protocol.run_sheet import sheet_of
from clearway.scenarios.suites import Selection
from html_outline import outline


@pytest.fixture(scope="module")
def sheet() -> str:
    return sheet_of(parsed(skeleton()), scenarios("hospital", "tiago"))


def numbers(text: str) -> list[int]:
    return [int(n) for n in re.findall(r'<td class="n"><b>(\d+)</b>', text)]


def test_every_trial_once_in_order(sheet: str):
    assert numbers(sheet) == list(range(1, 337))


def test_well_formed_and_self_contained(sheet: str):
    count = Counter(tag for tag, _ in outline(sheet))
    assert count["section"] == 37  # 36 set-ups and the list of obstacles
    assert count["svg"] == 36
    assert not re.search(r"https?://|src=|<script|<link|@import|url\(", sheet)
    assert "size: A4" in sheet


def test_a_single_set_up_is_no_plural():
    one = Selection(batches=("NO",), speeds=(0.6,), repetitions=1)
    text = skeleton(selection=one)
    assert "Test plan: 1 trial of the suite" in text
    assert "(1 set-up in all)" in text
    said = " ".join(sheet_of(parsed(text), scenarios("hospital", "tiago", one)).split())
    assert "1 trial of the suite hospital" in said
    assert ", in 1 set-up; about" in said


def test_five_boxes_a_trial(sheet: str):
    boxes = sum(attributes.get("class") == "box" for _, attributes in outline(sheet))
    assert boxes == 5 * 336 + 9 + 6  # and one an obstacle, one a line of the checklist


def test_where_things_stand_and_how_the_moving_obstacle_goes(sheet: str):
    assert "square-60cm-2: 2.5 m from A towards B, 0.84 m to the left" in sheet
    assert "2.5 | 0.84</text>" in sheet
    assert "forth: hosbot from 6 | 0 to \N{MINUS SIGN}1 | 0" in sheet


def test_hours_of_driving_by_hand(sheet: str):
    # 10 m each: 126 trials at 0.2 m/s (3 NO, 84 SO, 15 MO, 24 CE), 123 at 0.6, 87 at 1.0: 6300 + 2050 + 870 s; half a turn
    # at 1 rad/s and 1 s for each of three legs: 336 x 6.14 s = 2064 s
    assert "about 3.1 hours of driving" in sheet
    short = sheet_of(parsed(skeleton(selection=Selection(batches=("NO",), speeds=(0.2,), repetitions=2))))
    assert "about 2 minutes of driving" in short  # 2 x (10 m / 0.2 m/s + 6.14 s) = 112 s


def test_a_moving_obstacle_is_recorded_at_rest_before_the_trials(sheet: str):
    assert re.search(r"hosbot at rest, 10 s, on A, looking along A to B \(static_hosbot\.csv\)", sheet)
    assert not re.search(r"hosbot at rest", sheet_of(parsed(skeleton(selection=Selection(batches=("SO",))))))


def test_abbreviations_are_explained_where_they_are_used(sheet: str):
    assert "<b>CE</b>: complex environment" in sheet
    assert "<b>d_base</b>: the robot&#39;s width" in sheet or "<b>d_base</b>: the robot's width" in sheet
    short = sheet_of(parsed(skeleton(selection=Selection(batches=("NO",)))))
    assert "d_base" not in short
    assert "<b>SO</b>" not in short


def test_sections_are_numbered_through(sheet: str):
    for text in (sheet, sheet_of(parsed(skeleton(selection=Selection(batches=("NO",)))))):
        found = [int(n) for n in re.findall(r"<h2>(\d)\.", text)]
        assert found == list(range(1, len(found) + 1))
        assert text.count("<h2>") == len(found)


def test_coordinates_hold_on_any_plan():
    """The same test seen from A is the same, wherever A and B lie in the map."""
    ours = skeleton(selection=Selection(batches=("SO",), sizes=(0.3,), speeds=(0.2,)))
    plan = parsed(ours)

    def moved(pose: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        return None if pose is None else (10 - pose[1], -4 + pose[0], pose[2] + 1.5707963267948966)

    trials = tuple(
        t.model_copy(update={"obstacles": tuple(o.model_copy(update={"pose": moved(o.pose)}) for o in t.obstacles)})
        for t in plan.trials
    )
    poses = {n: moved(p) for n, p in plan.poses.items()}
    surveyed = plan.sources["capture"].frame.surveyed
    other = plan.model_copy(update={"poses": poses, "trials": trials})

    def body(text: str) -> str:
        return text[text.index("<section", text.index("5. Each trial")) :]

    assert surveyed
    assert body(sheet_of(other)) == body(sheet_of(plan))


def test_names_that_are_markup_stay_text(tmp_path: Path):
    text = skeleton(selection=Selection(batches=("NO",), speeds=(1.0,), repetitions=1))
    text = text.replace('suite = "hospital"', 'suite = "</style><script>alert(1)</script>"')
    text = text.replace('place = ""', 'place = "<b>here</b>"')
    page = sheet_of(parsed(text))
    assert "<script" not in page
    assert "<b>here" not in page
    assert "&lt;b&gt;here" in page


def test_a_plan_without_poses_or_legs():
    plan = TestPlan.model_validate({"trial": [{"file": "a.csv", "note": "x"}, {}]})
    page = sheet_of(plan)
    assert numbers(page) == [1, 2]
    outline(page)  # well-formed
    assert "a.csv" in page
