"""Whether a contact could have been avoided: hand-made contacts of each class, and the search against random ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import Circle, rectangle
from clearway.indicators import score_row
from clearway.indicators.avoidable import FORESIGHT, PLANNER, TOO_LATE, avoidable
from clearway.indicators.cause import cause, who_moved
from clearway.indicators.escape import escapes, prolonged
from clearway.robots import DriveLimits
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Span, Trial

PERIOD = 0.15
AT_ONCE = DriveLimits(-1.0, 1.0, np.inf, np.inf, 1.5, np.inf, np.inf)


def contact(discs: np.ndarray, *, sight: float | None = 4.0, bodies: tuple[Body, ...] = (), **changes: object) -> Trial:
    """A disc of 0.25 m that stands at the origin, heading along x, until one of the `discs` (n, m, 2) of 0.35 m is there."""
    n, m = discs.shape[:2]
    robot = np.zeros((n, 3))
    moving_obstacles = tuple(Body(f"d{k}", "moving obstacle", Circle(0.35), None) for k in range(m))
    leg = Leg("way", robot[0], np.array([9.0, 0.0, 0.0]), 0.2, np.inf)
    attempt = Attempt(
        Labels("own", "own", "own", 1.0), "rescue", "some", "truth", Circle(0.25), (leg,), bodies + moving_obstacles, 1.0, PERIOD,
        limits=AT_ONCE, sight=sight,
    )  # fmt: skip
    t = PERIOD * np.arange(n)
    trial = Trial(
        replace(attempt, **changes), t, robot, np.zeros((n, 2)), robot, np.zeros((n, 2)), np.zeros(n, np.int64),
        np.concatenate([discs, np.zeros((n, m, 1))], axis=2), (Span(0, 0.0, float(t[-1]), False),),
        (Event(float(t[-1]), "contact", "moving obstacle 'd0' at 1 m/s, robot at 0 m/s", 0),), Outcome.COLLISION,
    )  # fmt: skip
    return trial


def ring(count: int, speed: float, n: int = 40) -> np.ndarray:
    """`count` discs that close in on the origin from all around at `speed` [m/s], there at the end: (n, count, 2)."""
    angles = 2 * np.pi * np.arange(count) / count
    away = 0.6 + speed * PERIOD * np.arange(n)[::-1]
    return away[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def test_one_disc_on_an_open_floor_can_be_evaded() -> None:
    assert avoidable(contact(ring(1, 1.0))) == PLANNER


def test_a_ring_is_left_in_time_or_not_at_all() -> None:
    """Eight discs at 1 m/s: 4.35 m away they leave gaps of 2.6 m (0.75 s before the contact of 0.33 m, less than the
    robot's 0.5 m); whoever sees no farther than 0.7 m has them around it already."""
    assert avoidable(contact(ring(8, 1.0))) == FORESIGHT
    assert avoidable(contact(ring(8, 1.0), sight=0.9)) == TOO_LATE
    assert avoidable(contact(ring(8, 1.0), sight=None)) == "", "nobody knows when it was seen"
    assert avoidable(contact(ring(1, 1.0), sight=None)) == PLANNER, "which does not matter here"


@pytest.mark.parametrize(("v_min", "expected"), [(-1.0, PLANNER), (0.0, FORESIGHT)])
def test_backwards_is_a_way_out_for_who_can_drive_so(v_min: float, expected: str) -> None:
    """A corridor as wide as the robot with a disc that comes along it: there is no time left to turn around."""
    walls = tuple(Body(f"wall {s}", "wall", rectangle(40.0, 0.1), np.array([0.0, 0.31 * s, 0.0])) for s in (-1, 1))
    disc = ring(1, 0.6)
    assert avoidable(contact(disc, bodies=walls, limits=AT_ONCE._replace(v_min=v_min))) == expected


@pytest.mark.parametrize(("rate", "expected"), [(np.inf, True), (2.0, True), (0.2, False)])
def test_a_base_that_cannot_speed_up_does_not_get_away(rate: float, expected: bool) -> None:
    """A disc at 1.5 m/s, 1.125 m off: to get 0.6 m aside or away the robot has about 0.75 s."""
    trial = contact(ring(1, 1.5), limits=DriveLimits(-1.0, 1.0, rate, rate, 1.5, 10.0, 10.0))
    end = float(trial.t[-1])
    assert escapes(trial, end - 0.75, end + 1.5) is expected
    assert escapes(trial, end - 5.0, end + 1.5) is True


def test_an_escape_has_to_last() -> None:
    """A second disc comes later from behind: until the contact the robot can back off, a second later it is caught."""
    n = 40
    first, t = ring(1, 0.9, n)[:, 0], PERIOD * np.arange(n)
    walls = tuple(Body(f"wall {s}", "wall", rectangle(40.0, 0.1), np.array([0.0, 0.31 * s, 0.0])) for s in (-1, 1))
    behind = np.column_stack([-(1.4 + 0.6 * (t[-1] - t)), np.zeros(n)])
    trial = contact(np.stack([first, behind], axis=1), bodies=walls)
    end = float(trial.t[-1])
    assert escapes(trial, end - 0.75, end) is True
    assert escapes(trial, end - 0.75, end + 1.5) is False
    assert avoidable(contact(first[:, None], bodies=walls)) == PLANNER, "without the second one it gets away"


def test_what_is_no_contact_has_no_class() -> None:
    trial = contact(ring(1, 1.0))
    assert avoidable(replace(trial, outcome=Outcome.TIMEOUT, events=())) == ""
    assert avoidable(replace(trial, attempt=replace(trial.attempt, limits=None))) == ""
    row = score_row(
        replace(trial, events=(Event(0.0, "assumption", "too fast"), Event(0.3, "assumption", "a"), *trial.events))
    )
    assert (row["avoidable"], row["violations"]) == (PLANNER, 2)
    assert score_row(trial)["violations"] == 0


def test_a_known_wall_is_seen_from_the_start() -> None:
    trial = contact(
        np.full((20, 1, 2), 50.0), bodies=(Body("w", "wall", rectangle(0.1, 9.0), np.array([0.3, 0.0, 0.0])),)
    )
    told = replace(
        trial,
        events=(
            Event(float(trial.t[-1]), "contact", "wall 'w' at 0 m/s, robot at 1 m/s", len(trial.attempt.bodies) - 1),
        ),
    )
    assert avoidable(told) == PLANNER


@pytest.mark.parametrize("short", [1.0, 0.3], ids=["contact at a sample", "contact within a period"])
def test_moving_obstacles_go_on_as_they_went(short: float) -> None:
    """Oscillation, damped oscillation, constant acceleration and speed, rest: each by its closed form."""
    n, ahead = 30, 1.5
    t = PERIOD * np.arange(n)
    t[-1] = t[-2] + short * PERIOD

    def way(t: np.ndarray) -> np.ndarray:
        damped = np.exp(-0.4 * t) * np.cos(1.1 * t)
        return np.stack(
            [np.stack([3 + 2 * np.cos(0.6 * t + 1), 5 * np.sin(0.13 * t)], 1), np.stack([damped, 1 + damped], 1),
             np.stack([0.3 * t**2, 1 - 0.7 * t], 1), np.stack([0 * t + 2, 0 * t - 1], 1)], axis=1,
        )  # fmt: skip

    trial = replace(contact(way(t)), t=t)
    times = t[-1] + np.linspace(-1.0, ahead, 26)
    assert np.abs(prolonged(trial, times)[:, :, :2] - way(times)).max() < 2e-3


def test_what_follows_no_rule_goes_on_at_its_last_speed_and_what_is_absent_stays_so() -> None:
    n = 30
    rng = np.random.default_rng(3)
    walk = np.cumsum(rng.normal(0, 0.05, (n, 2)), axis=0)
    gone = np.full((n, 2), np.nan)
    gone[:10] = 1.0
    trial = contact(np.stack([walk, gone], axis=1))
    out = prolonged(trial, trial.t[-1] + np.array([0.0, 0.3]))
    np.testing.assert_allclose(out[1, 0, :2], walk[-1] + 2 * (walk[-1] - walk[-2]), atol=1e-9)
    assert np.isnan(out[:, 1, :2]).all()


@pytest.mark.parametrize("before", ["far away", "absent", "within sight"])
def test_what_appears_on_the_robot_stays_where_it_appeared(before: str) -> None:
    """It was elsewhere a sample before, or nowhere: that tells nothing of where it goes on."""
    discs = np.full((30, 1, 2), {"far away": 9.0, "absent": np.nan, "within sight": 2.0}[before])
    discs[-1] = 0.5, 0.0
    trial = contact(discs)
    trial = replace(trial, t=np.append(trial.t[:-1], trial.t[-2] + 0.4 * PERIOD))
    out = prolonged(trial, trial.t[-1] + np.array([-0.1, -0.01, 0.0, 1.5]))
    np.testing.assert_array_equal(out[2:, 0, :2], [[0.5, 0.0], [0.5, 0.0]])
    assert np.isnan(out[1, 0]).all()
    assert np.isfinite(out[0]).all() == (before != "absent")
    assert who_moved(trial) == "obstacle"
    assert cause(trial) == "contact at rest"
    assert avoidable(trial) == TOO_LATE


@pytest.mark.parametrize("seed", range(8))
def test_it_finds_a_way_wherever_random_driving_does(seed: int) -> None:
    """Twelve discs around the robot, at up to 1.5 m/s towards it: 1500 random manoeuvres of fifteen commands."""
    rng = np.random.default_rng(seed)
    n, count = 12, 12
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(0, 0.5, count)) / count
    start = rng.uniform(1.6, 2.6, count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    speed = -start / np.linalg.norm(start, axis=1)[:, None] * rng.uniform(0.2, 1.5, count)[:, None]
    discs = start + PERIOD * np.arange(n)[:, None, None] * speed
    trial = contact(discs)
    begin, until = 0.45, 0.45 + 2.25
    poses, left = np.tile([0.0, 0.0, 0.0], (1500, 1)), np.ones(1500, dtype=bool)
    bodies, before = trial.attempt.bodies, np.zeros((2, 1500))
    for k in range(15):
        v, w = rng.uniform(-1, 1, 1500), rng.uniform(-1.5, 1.5, 1500)
        keep = rng.random(1500) < (0.6 if k else 0.0)
        v, w = before = np.where(keep, before, (v, w))
        for i in range(1, 4):
            middle = poses[:, 2] + 0.025 * w
            poses = poses + 0.05 * np.column_stack([v * np.cos(middle), v * np.sin(middle), w])
            at = start + (begin + 0.15 * k + 0.05 * i) * speed
            moving_obstacles = np.tile(np.column_stack([at, np.zeros(count)]), (1500, 1, 1))
            left &= min_clearance(Circle(0.25), poses, bodies, moving_obstacles) > 0
    if left.any():
        assert escapes(trial, begin, until) is True
