"""What nobody saw is no clean success: stretches in which a contact could have been are to be confirmed, and named."""

from __future__ import annotations

import json

import numpy as np
import pytest
from small_plans import PLAN, RATE, Score, drive

from clearway.indicators import score_row
from clearway.trials import Outcome

CART = {"obstacles": [{"body": "cart"}]}
CONE = {"cone": {"shape": {"kind": "disc", "radius": 0.1}}}
ROBOT, SEEN = slice(1, 4), slice(4, 7)


def hidden(rows: np.ndarray, start: float, end: float, columns: slice = ROBOT) -> np.ndarray:
    """Nothing is seen between two times, both excluded [s]."""
    rows[max(int(start * RATE) + 1, 0) : int(end * RATE), columns] = np.nan
    return rows


def test_a_contact_that_nobody_could_see_is_to_be_confirmed(score: Score) -> None:
    """The cart's edge is 0.13 m beside the robot's as it passes, at 4.25 s."""
    seen = score_row(score(CART, drive(cart=(1.0, 0.5))))
    assert (seen["success"], seen["to_confirm"]) == (True, "")
    trial = score(CART, hidden(drive(cart=(1.0, 0.5)), 3.0, 5.5))
    row = score_row(trial)
    assert trial.outcome is Outcome.REACHED
    assert row["to_confirm"] == (
        "possible contact at 3.0 s (the robot was not seen from 3.0 to 5.5 s, 2.5 s, and may have touched obstacle 'cart': "
        "to be confirmed)"
    )
    assert row["MDO"] is None
    assert row["MDO_at_least"] == 0.0
    assert row["MDO_at_most"] == pytest.approx(seen["MDO"], abs=0.01), "it came as near on its way back"


def test_a_cone_in_a_stretch_that_nobody_saw(score: Score) -> None:
    """A wheelchair's outline, a cone that was placed, and 2.5 s without either."""
    chair = {"track": "robot", "shape": {"kind": "rectangle", "length": 1.0, "width": 0.6}}
    cone = {"obstacles": [{"body": "cone", "pose": [1.0, 0.0, 0.0]}], "legs": [{"name": "forth"}]}
    rows = hidden(drive()[: int(7 * RATE)], 2.9, 5.6)
    test = {"suite": "own", "xy_tolerance": 0.2, "yaw_tolerance": 0.2}
    legs = [PLAN["legs"][0]]
    row = score_row(score(cone, rows, robot=chair, bodies=CONE, test=test, legs=legs))
    assert row["success"] is True
    assert "may have touched obstacle 'cone'" in str(row["to_confirm"])
    assert row["MDO_at_least"] == 0.0
    assert row["MDO_at_most"] == pytest.approx(0.075, abs=0.001)


def test_the_operator_has_the_last_word(score: Score) -> None:
    rows = hidden(drive(cart=(1.0, 0.5)), 3.0, 5.5)
    denied = score(CART | {"contact": False}, rows)
    assert [e.kind for e in denied.events] == ["near miss"]
    assert score_row(denied)["to_confirm"] == ""
    touched = score(CART | {"contact": True}, rows)
    assert touched.outcome is Outcome.COLLISION
    assert touched.events[-1].t == pytest.approx(3.0)
    row = score_row(touched)
    assert (row["failure"], row["MDO"], row["to_confirm"]) == ("collision", 0.0, "")


def test_where_no_contact_could_have_been_nothing_is_to_be_confirmed(score: Score) -> None:
    """The same cart, and a gap at the other end of the way; and a cart too far away to be reached."""
    early = score(CART, hidden(drive(cart=(1.9, 0.5)), 2.6, 3.4))
    row, whole = score_row(early), score_row(score(CART, drive(cart=(1.9, 0.5))))
    assert early.events == ()
    assert row["MDO"] == whole["MDO"], "it was not nearer meanwhile"
    assert row["PL"] is None
    assert row["PL_at_least"] == pytest.approx(whole["PL"], abs=1e-3), "it drove straight on, as it happens"
    assert row["PL_at_most"] >= whole["PL"]
    far = score(CART, hidden(drive(cart=(1.0, 3.0)), 3.0, 5.5))
    assert far.events == ()


def test_bounds_hold_the_truth(score: Score) -> None:
    rows = drive(cart=(1.0, 0.8))
    whole = score_row(score(CART, rows.copy()))
    for start, end in ((3.0, 4.8), (2.5, 6.0), (12.5, 15.0)):
        row = score_row(score(CART, hidden(rows.copy(), start, end)))
        for name, slack in (("MDO", 1e-3), ("PL", 1e-3), ("TCS", 0.2)):
            known = (
                (row[name], row[name]) if row[name] is not None else (row[f"{name}_at_least"], row[f"{name}_at_most"])
            )
            assert known[0] - slack <= whole[name] <= known[1] + slack, (name, start)
        assert row["PL"] is None
        assert row["TCS"] is None
        assert "gaps" in json.loads(str(row["not_computable"]))["TCS"]


def test_an_obstacle_that_is_out_of_sight_may_have_come_near(score: Score) -> None:
    rows = drive(cart=(1.0, 0.9), cart_drives=True)
    assert score(CART, rows.copy()).events == ()
    trial = score(CART | {"obstacle_speed": 0.5}, hidden(rows.copy(), 3.0, 5.5, SEEN))
    (event,) = trial.events
    assert event.detail == (
        "moving obstacle 'cart' was not seen from 3.0 to 5.5 s, 2.5 s, and the robot may have touched it: to be confirmed"
    )
    assert score_row(trial)["MDO"] is None
    slow = score(CART, hidden(rows.copy(), 3.0, 5.5, SEEN))
    assert slow.events == (), "it never was faster than 2 cm/s"


def test_an_obstacle_that_leaves_the_picture_is_unseen_unless_it_comes_and_goes(score: Score) -> None:
    rows = hidden(drive(cart=(1.0, 0.9), cart_drives=True), 3.0, 99.0, SEEN)
    assert "cart" in str(score_row(score(CART | {"obstacle_speed": 0.5}, rows))["to_confirm"])
    visitor = {"cart": PLAN["bodies"]["cart"] | {"visits": True}}
    row = score_row(score(CART | {"obstacle_speed": 0.5}, rows, bodies=visitor))
    assert row["to_confirm"] == ""
    assert row["MDO"] is not None


def test_what_was_unseen_before_and_after_the_test_does_not_matter(score: Score) -> None:
    rows = hidden(drive(cart=(-0.5, 0.0)), -1.0, 1.0)
    assert score(CART, rows).events == ()


def test_a_robot_that_is_lost_for_good_beside_an_obstacle(score: Score) -> None:
    rows = hidden(drive(cart=(1.0, 0.45)), 4.0, 99.0)
    trial = score(CART, rows)
    assert trial.outcome is Outcome.ABORTED
    assert "may have touched obstacle 'cart'" in str(score_row(trial)["to_confirm"])


def test_a_heading_that_is_unknown_needs_the_room_of_a_turn(score: Score) -> None:
    """A robot of 0.6 m by 0.2 m passes 0.3 m beside the cart's edge: whether it could is a matter of its heading."""
    narrow = {"track": "robot", "shape": {"kind": "rectangle", "length": 0.6, "width": 0.2}}
    rows = drive(cart=(1.0, 0.4))
    assert score(CART, rows.copy(), robot=narrow).events == ()
    rows[int(2.6 * RATE) : int(6.0 * RATE), 3] = np.nan
    trial = score(CART, rows, robot=narrow)
    assert ["may have touched" in e.detail for e in trial.events] == [True]


def test_a_contact_between_two_samples_of_a_slow_recording(score: Score) -> None:
    """Two samples a second, 0.25 m apart; the robot of 0.04 m and the post of 0.02 m only meet between them."""
    small = {"track": "robot", "shape": {"kind": "disc", "radius": 0.04}}
    post = {"cart": PLAN["bodies"]["cart"] | {"shape": {"kind": "disc", "radius": 0.02}}}
    rows = drive(speed=0.5)[::10]
    at = rows[(rows[:, 1] > 0.8) & (rows[:, 3] == 0.0)][0, 1] + 0.125
    rows[:, 4:6] = at, 0.03
    trial = score(CART, rows, robot=small, bodies=post)
    assert score_row(trial)["MDO"] == 0.0
    assert "possible contact" in {e.kind for e in trial.events}


def test_an_obstacle_that_was_not_seen_once(score: Score) -> None:
    trial = score(CART, hidden(drive(), -1.0, 99.0, SEEN))
    row = score_row(trial)
    assert row["success"] is True
    assert "moving obstacle 'cart' was not seen from 0.0 to" in str(row["to_confirm"])
    assert "holds no position" in trial.provenance["motion"]["cart"]["notes"][0]
    assert (row["MDO_at_least"], row["MDO_at_most"]) == (0.0, None)
