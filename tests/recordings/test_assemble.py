"""A trial of a test plan, from small files whose motion is known by hand: out and back over 2 m, with a turn between."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_plans import PLAN, RATE, Score, drive, write

from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.trials import Outcome


def test_legs_goals_and_indicators_of_a_drive_known_by_hand(score: Score) -> None:
    trial = score({})
    row = score_row(trial)
    assert trial.outcome is Outcome.REACHED
    assert trial.attempt.source == "recorded"
    assert [s.leg for s in trial.spans] == [0, 1, 2]
    assert row["CT"] == pytest.approx(2 * (2.0 / 0.5 + 0.5), abs=0.15)
    assert row["PL"] == pytest.approx(4.0, abs=1e-6)
    assert (row["DE"], row["OE"]) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert row["success"] is True
    assert "forth:" in trial.provenance["legs"][0]
    told = [leg.planner_xy_tolerance for leg in trial.attempt.legs]
    assert np.isnan(told).all(), "nobody knows what a real robot's planner was told"


def test_a_span_corrects_one_leg_and_leaves_the_others(score: Score) -> None:
    found = score({})
    told = score({"legs": [{"name": "back", "span": [12.5, 17.0]}]})
    assert told.spans[0] == found.spans[0]
    assert (told.spans[2].start, told.spans[2].end) == (12.5, 17.0)
    assert told.attempt.legs[2].goal == pytest.approx([0.0, 0.0, math.pi])


def test_a_goal_that_only_the_tie_is_missing_of_is_not_called_unknown(score: Score) -> None:
    untied = {"capture": {"format": "table"}}
    row = score_row(score({}, drive(rest=3.0), sources=untied))
    why = json.loads(row["not_computable"])
    assert row["success"] is None
    for name in ("DE", "OE", "success"):
        assert "nothing ties the recording to the map, in which the goals are given" in why[name]
    with pytest.raises(
        ClearwayError, match=r"nothing ties the recording.*drove 1 times.*give that frame or their spans"
    ):
        score({}, sources=untied)
    names = [{"name": "forth"}, {"name": "turn", "scored": False}, {"name": "back"}]
    row = score_row(score({}, drive(rest=3.0), sources=untied, legs=names))
    assert json.loads(row["not_computable"])["DE"] == "the goal of leg forth is unknown"


def test_legs_that_overlap_are_refused(score: Score) -> None:
    with pytest.raises(ClearwayError, match="before leg turn ends"):
        score({"legs": [{"name": "back", "span": [3.0, 17.0]}]})


def test_an_attempt_without_a_recording_counts_and_knows_nothing(score: Score) -> None:
    trial = score({"file": "", "note": "battery died"})
    row = score_row(trial)
    assert (trial.outcome, trial.reason) == (Outcome.ABORTED, "attempted, not recorded")
    assert row["success"] is False
    assert row["CT"] is None
    assert row["note"] == "battery died"


@pytest.mark.parametrize(
    ("field", "words"),
    [("intervention", "help"), ("stopped", "emergency stop"), ("aborted", "aborted by the operator")],
)
def test_what_the_operator_did_ends_the_attempt(score: Score, field: str, words: str) -> None:
    trial = score({field: True})
    assert trial.outcome is Outcome.ABORTED
    assert words in trial.reason
    assert score_row(trial)["success"] is False


def test_a_contact_that_was_seen_is_a_collision(score: Score) -> None:
    trial = score({"contact": True})
    assert trial.outcome is Outcome.COLLISION
    assert score_row(trial)["failure"] == "collision"  # when it was nobody said: not that the robot stood


def test_an_overlap_that_nobody_can_be_sure_of_is_to_be_confirmed(score: Score) -> None:
    near = {"obstacles": [{"body": "cart"}]}
    trial = score(near, drive(cart=(1.0, 0.2)))  # a table says nothing of its uncertainty
    row = score_row(trial)
    assert trial.outcome is Outcome.REACHED
    assert [e.kind for e in trial.events] == ["possible contact"] * 2  # going and coming
    assert row["MDO"] == 0.0
    assert "cart" in str(row["to_confirm"])
    denied = score(near | {"contact": False}, drive(cart=(1.0, 0.2)))
    assert [e.kind for e in denied.events] == ["near miss"] * 2
    assert not score_row(denied)["to_confirm"]
    seen = score(near | {"contact": True}, drive(cart=(1.0, 0.2)))
    assert seen.outcome is Outcome.COLLISION
    assert seen.events[-1].t == trial.events[0].t


def test_a_measured_obstacle_that_stands_is_placed_and_one_that_drives_moves(score: Score) -> None:
    near = {"obstacles": [{"body": "cart"}]}
    still = score(near)
    assert [(b.name, b.kind) for b in still.attempt.bodies] == [("cart", "obstacle")]
    assert still.attempt.bodies[0].pose == pytest.approx([1.0, 1.0, 0.0])
    assert score_row(still)["MDO"] == pytest.approx(1.0 - 0.1 - 0.27, abs=1e-6)
    moving = score(near, drive(cart_drives=True))
    assert moving.attempt.bodies[0].pose is None
    assert moving.moving_obstacles[-1, 0] == pytest.approx([1.0, 1.3, 0.0], abs=1e-6)


def test_without_a_tie_only_what_needs_the_map_is_lost(score: Score) -> None:
    capture = {"capture": {"format": "table"}}
    rows = drive(rest=3.0)  # without goals only long rests part the legs
    row = score_row(score({"obstacles": [{"body": "cart"}]}, rows, sources=capture))
    assert row["CT"] is not None
    assert row["PL"] == pytest.approx(4.0, abs=1e-6)
    assert row["MDO"] == pytest.approx(0.63, abs=1e-6)  # both were measured, in one frame
    assert row["DE"] is None
    assert "goal" in str(row["not_computable"])
    placed = score_row(score({"obstacles": [{"body": "cart", "pose": [1.0, 1.0, 0.0]}]}, rows, sources=capture))
    assert placed["MDO"] is None


def test_without_a_robot_the_rest_stands(score: Score) -> None:
    row = score_row(score({}, test={"suite": "own"}))
    assert row["PL"] == pytest.approx(4.0, abs=1e-6)
    assert row["DE"] == pytest.approx(0.0, abs=1e-6)
    assert row["success"] is None  # nobody knows the tolerance
    assert row["PL_norm"] is None


def test_a_turned_and_shifted_frame_comes_back(score: Score) -> None:
    rows = drive()
    a, shift = 0.7, np.array([3.0, -1.0])
    turn = np.array([[math.cos(a), math.sin(a)], [-math.sin(a), math.cos(a)]])  # row vectors: R^T
    for x in (1, 4):
        rows[:, x : x + 2] = rows[:, x : x + 2] @ turn + shift
        rows[:, x + 2] += a
    back = [*(-shift @ turn.T).tolist(), -a]
    trial = score({}, rows, sources={"capture": {"format": "table", "frame": {"transform": back}}})
    assert trial.pose[-1] == pytest.approx([0.0, 0.0, -math.pi], abs=1e-6)
    assert score_row(trial)["DE"] == pytest.approx(0.0, abs=1e-6)


def test_a_second_file_is_tied_by_speed_and_tells_what_the_robot_believed(score: Score, tmp_path: Path) -> None:
    rows = drive()
    log = rows[20:].copy()  # begins 1 s later, on a clock of its own
    log[:, 0] += 500.0 - log[0, 0]
    log[:, 2] += 0.05
    write(tmp_path, "log.csv", log)
    trial = score(
        {"files": {"log": "log.csv"}}, rows,
        sources=PLAN["sources"] | {"log": {"format": "table", "frame": {"same": True}, "estimate": "robot"}},
    )  # fmt: skip
    assert trial.provenance["clock"]["log"]["seconds"] == pytest.approx(1.0 - 500.0, abs=0.01)
    assert trial.estimate is not None
    assert np.isnan(trial.estimate[:15]).all()
    assert trial.estimate[-1, 1] == pytest.approx(0.05, abs=1e-3)
    row = score_row(trial)
    assert row["DE_self"] == pytest.approx(0.05, abs=1e-3)


def test_a_second_file_that_is_an_hour_off_is_refused(score: Score, tmp_path: Path) -> None:
    rows = drive()
    log = rows.copy()
    log[:, 0] += 3600.0
    write(tmp_path, "log.csv", log)
    own = {"format": "table", "frame": {"same": True}, "estimate": "robot"}
    for clock in ("same", 1.0):
        with pytest.raises(ClearwayError, match="no time in common"):
            score({"files": {"log": "log.csv"}}, rows, sources=PLAN["sources"] | {"log": own | {"clock": clock}})
    trial = score({"files": {"log": "log.csv"}}, rows, sources=PLAN["sources"] | {"log": own | {"clock": -3600.0}})
    assert trial.estimate is not None


def test_goals_of_the_log_begin_the_legs_and_say_where_to(score: Score, tmp_path: Path) -> None:
    rows = drive()
    sent = np.array([[1.5, 2.0, 0.0, 0.0], [7.3, 2.0, 0.0, math.pi], [12.4, 0.0, 0.0, math.pi]])
    write(tmp_path, "goals.csv", np.column_stack([sent, np.zeros((3, 3))]))
    log = {"format": "table", "frame": {"same": True}, "clock": "same", "goals": "robot"}
    legs = [{k: v for k, v in leg.items() if k not in ("start", "goal")} for leg in PLAN["legs"]]
    trial = score({"files": {"log": "goals.csv"}}, rows, sources=PLAN["sources"] | {"log": log}, legs=legs)
    assert [leg.goal[0] for leg in trial.attempt.legs] == [2.0, 2.0, 0.0]
    assert [s.start for s in trial.spans] == pytest.approx([1.5, 7.3, 12.4])
    assert score_row(trial)["DE"] == pytest.approx(0.0, abs=1e-6)


def test_a_span_outside_the_file_names_the_file(score: Score, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=r"one\.csv: span: \(50, 60\) s is not in the recording; it has 0\.000 to"):
        score({"span": [50.0, 60.0]})


def test_an_end_that_did_not_show_is_to_be_confirmed(score: Score) -> None:
    rows = drive()
    row = score_row(score({}, rows[: len(rows) - int(2.3 * RATE)]))  # the record ends before the robot has stopped
    assert "leg back ended without a rest" in str(row["to_confirm"])
    assert not score_row(score({}, rows))["to_confirm"]


def test_a_record_that_ends_under_way_is_told_apart_from_a_robot_that_stopped(score: Score) -> None:
    rows = drive()
    under_way = score({}, rows[: int(4.5 * RATE)])
    row = score_row(under_way)
    assert under_way.outcome is Outcome.ABORTED
    assert "leg forth: the recording ends at 4.5 s, while the robot moves" in under_way.reason
    assert "give all of it" in str(row["to_confirm"])
    rows[int(4.5 * RATE) :, 1:4] = rows[int(4.5 * RATE), 1:4]  # stuck there
    stuck = score({}, rows)
    assert stuck.reason == "leg forth was not finished"
    assert not score_row(stuck)["to_confirm"]
    assert under_way.provenance["number"] == 1


def test_without_goals_a_cut_record_is_no_failure(score: Score) -> None:
    """Nobody can tell whether it would have arrived."""
    rows = drive(rest=3.0)
    row = score_row(score({}, rows[: len(rows) - int(3.0 * RATE)], sources={"capture": {"format": "table"}}))
    assert row["success"] is None
    assert row["CT"] is not None
    assert "leg back ended without a rest" in str(row["to_confirm"])


def test_what_ties_the_frame_cancels_between_bodies_of_one_capture(score: Score) -> None:
    frame = {"transform": [0.0, 0.0, 0.0], "uncertainty": [0.01, 0.0]}
    sources = {"capture": {"format": "table", "frame": frame}}
    cart = {"obstacles": [{"body": "cart"}]}
    trial = score(cart, sources=sources)
    assert trial.attempt.bodies[0].measured
    own = np.full((len(trial.t), 1, 2), 0.001)
    known = replace(trial, sigma=np.hypot(own, [0.01, 0.0]), tie=np.tile([0.01, 0.0], (len(trial.t), 1)))
    body = replace(trial.attempt.bodies[0], sigma=float(np.hypot(0.01, 0.001)))
    known = replace(known, attempt=replace(known.attempt, bodies=(body,)))
    row = score_row(known)
    assert row["MDO_U"] == pytest.approx(2 * math.hypot(0.001, 0.001), rel=1e-6)
    assert row["DE_U"] == pytest.approx(2 * np.hypot(0.01, 0.001), rel=1e-6)


def test_a_gap_stays_open_and_costs_only_what_crosses_it(score: Score) -> None:
    rows = drive()
    rows[60:80, 1:4] = np.nan  # 1 s, while it drives
    row = score_row(score({}, rows))
    assert row["CT"] is not None
    assert row["PL"] is None
    assert "gap" in str(row["not_computable"])
    assert row["DE"] == pytest.approx(0.0, abs=1e-6)


def test_a_leg_that_takes_too_long_is_a_timeout(score: Score) -> None:
    legs = [{**leg, **({"time_limit": 3.0} if leg["name"] == "forth" else {})} for leg in PLAN["legs"]]
    trial = score({}, legs=legs)
    assert trial.outcome is Outcome.TIMEOUT
    assert "forth" in trial.reason


def test_a_faster_capture_is_thinned(score: Score) -> None:
    trial = score({}, test=PLAN["test"] | {"rate": 6.0})
    assert np.diff(trial.t) == pytest.approx(0.2)


def test_a_log_of_the_whole_day_is_tied_by_the_whole_file(score: Score, tmp_path: Path) -> None:
    one = drive()
    two = one[1:].copy()
    two[:, 0] += one[-1, 0]
    two[:, 3] *= -1  # it turns the other way on its way back to the start, which nobody recorded
    day = np.concatenate([one, two])
    log = day.copy()
    log[:, 0] += 500.0
    log[:, 2] += 0.05
    write(tmp_path, "log.csv", log)
    sources = PLAN["sources"] | {"log": {"format": "table", "frame": {"same": True}, "estimate": "robot"}}
    half = float(one[-1, 0])
    for span in ([0.0, half], [half, 2 * half]):
        trial = score({"span": span, "files": {"log": "log.csv"}}, day, sources=sources)
        assert trial.provenance["clock"]["log"]["seconds"] == pytest.approx(-500.0, abs=0.01)
        assert trial.estimate is not None
        assert np.isfinite(trial.estimate).all()


def test_goals_of_the_log_are_for_the_legs_that_have_none(score: Score, tmp_path: Path) -> None:
    """The plan has the first one; it was sent twice."""
    sent = np.array([[1.3, 2.0, 0.0, 0.0], [1.5, 2.0, 0.0, 0.0], [7.3, 2.0, 0.0, math.pi], [12.4, 0.0, 0.0, math.pi]])
    write(tmp_path, "goals.csv", np.column_stack([sent, np.zeros((4, 3))]))
    log = {"format": "table", "frame": {"same": True}, "clock": "same", "goals": "robot"}
    legs = [PLAN["legs"][0], {"name": "turn", "scored": False}, {"name": "back"}]
    trial = score({"files": {"log": "goals.csv"}}, drive(), sources=PLAN["sources"] | {"log": log}, legs=legs)
    assert [tuple(leg.goal[:2]) for leg in trial.attempt.legs] == [(2.0, 0.0), (2.0, 0.0), (0.0, 0.0)]
    assert trial.outcome is Outcome.REACHED


def test_a_leg_that_ends_unseen_is_to_be_confirmed(score: Score) -> None:
    rows = drive()
    end = int((2 + 2.0 / 0.5 + 0.5) * RATE)
    rows[end - 12 : end + 8, 1:4] = np.nan
    row = score_row(score({}, rows))
    assert "leg forth: the robot was not seen for 1.1 s about its end; give its span" in str(row["to_confirm"])
    given = score_row(score({"legs": [{"name": "forth", "span": [2.0, 6.5]}]}, rows))
    assert "not seen" not in str(given["to_confirm"])


def test_a_record_that_ends_unseen_is_to_be_confirmed(score: Score) -> None:
    rows = drive()
    rows[-60:, 1:4] = np.nan
    row = score_row(score({}, rows))
    assert row["success"] is False
    assert "leg back: the robot was not seen for 3.0 s about its end" in str(row["to_confirm"])
