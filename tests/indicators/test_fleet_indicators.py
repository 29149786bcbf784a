"""A run of several robots: times, contacts, who waited for whom, circles of those who waited."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from indicator_trials import box, shuttle

from clearway.contract import BodyKind, EventKind
from clearway.geometry.shapes import Circle
from clearway.indicators import score_row
from clearway.indicators.fleet import contacts, deadlocks, makespan, sum_of_times, waiting, waits
from clearway.trials import Body, Event, Outcome


def rows(*trials):
    return [score_row(trial) for trial in trials]


def other(name):
    return Body(name, BodyKind.ROBOT, Circle(0.27), None)


def driving(member, others=(), *, dt=0.1, seconds=20.0, **changes):
    """A robot that stands at x = 0 all the time; `others`: names and where each stands."""
    base = shuttle()
    t = np.arange(0.0, seconds + 1e-9, dt)
    at = np.array([[x, y, 0.0] for _, (x, y) in others]).reshape(len(others), 3)
    bodies = tuple(other(name) for name, _ in others)
    attempt = replace(
        base.attempt, member=member, run="run", bodies=(box(9.0, 9.0), *bodies), legs=base.attempt.legs[:1]
    )
    spans = (replace(base.spans[0], end=seconds, reached=False),)
    trial = replace(
        base, attempt=attempt, t=t, pose=np.zeros((len(t), 3)), velocity=np.zeros((len(t), 2)), estimate=None, command=None,
        leg=np.zeros(len(t), np.int64), moving_obstacles=np.tile(at, (len(t), 1, 1)), spans=spans, outcome=Outcome.TIMEOUT,
    )  # fmt: skip
    return replace(trial, **changes)


def arrived(trial, at):
    return replace(trial, spans=(replace(trial.spans[0], end=at, reached=True),), outcome=Outcome.REACHED)


def test_makespan_and_sum_are_of_robots_that_all_arrived():
    run = rows(arrived(driving("a"), 12.0), arrived(driving("b"), 15.5))
    assert (makespan(run).value, sum_of_times(run).value) == (15.5, 27.5)
    late = [*run, *rows(driving("c"))]
    assert makespan(late).why == "c did not arrive (timeout)"
    assert sum_of_times(late).value is None


def test_it_waits_for_the_nearest_while_it_stands_within_a_metre():
    trial = driving("a", [("b", (1.2, 0.0)), ("c", (0.0, 1.4)), ("d", (5.0, 5.0))])
    assert waits(trial) == {"b": pytest.approx(20.0)}
    moving = trial.moving_obstacles.copy()
    moving[trial.t > 12.0, 0] = np.nan
    left = replace(trial, moving_obstacles=moving)
    assert waits(left) == {"b": pytest.approx(12.1), "c": pytest.approx(7.9)}
    assert json.loads(score_row(left)["waits"]) == waits(left)
    turning = trial.velocity.copy()
    turning[trial.t < 5.0, 1] = 0.1
    assert waits(replace(trial, velocity=turning)) == {"b": pytest.approx(15.0)}
    assert waits(driving("a", [("b", (1.6, 0.0))])) == {}
    assert waiting(rows(trial, driving("b", [("a", (1.0, 0.0))]))) == {
        ("a", "b"): pytest.approx(20.0),
        ("b", "a"): pytest.approx(20.0),
    }


def test_a_circle_of_those_who_wait_is_one_deadlock_and_whoever_waits_for_it_is_in_none():
    near = (0.9, 0.0)
    circle = [driving(a, [(b, near)]) for a, b in ("ab", "bc", "ca")]
    behind = driving("d", [("a", near)])
    pair = [driving(a, [(b, near)]) for a, b in ("ef", "fe")]
    assert deadlocks(rows(*circle, behind, *pair)).value == 2
    assert deadlocks(rows(*circle[:2], behind)).value == 0
    assert deadlocks(rows(*circle[:2], arrived(circle[2], 9.0))).value == 0, "who has arrived waits for nobody"
    moved = circle[2].velocity.copy()
    moved[-10, 0] = 0.3
    assert deadlocks(rows(*circle[:2], replace(circle[2], velocity=moved))).value == 0


def test_two_who_touch_each_other_have_one_contact():
    def touching(member, whom):
        trial = driving(member, [(whom, (0.5, 0.0))])
        return replace(trial, events=(Event(3.0, EventKind.CONTACT, "", 1),), outcome=Outcome.COLLISION)

    wall = replace(driving("c"), events=(Event(4.0, EventKind.CONTACT, "", 0),), outcome=Outcome.COLLISION)
    assert contacts(rows(touching("a", "b"), touching("b", "a"))).value == 1
    assert contacts(rows(touching("a", "b"), touching("b", "a"), wall, driving("d"))).value == 2


def test_a_robot_alone_waits_for_nobody():
    assert waits(shuttle(bodies=(box(2.5, 1.0),))) == {}
    row = score_row(shuttle())
    assert (row["waits"], row["blocked_by"]) == ("", "")
