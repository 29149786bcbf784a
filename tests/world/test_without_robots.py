"""What people do without robots: the same as with robots whom nobody sees, later where one stands in the way."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from worlds import Pilot, constant, make_robot, make_scenario

from clearway.contract import BodyKind, Command
from clearway.indicators.delay import mean_delay, mean_detour, worst_delay
from clearway.trials import Errand, Trial
from clearway.world import simulate_all, without_robots
from clearway.world.drive import Driver
from clearway.world.without_robots import completed

STANDS, BESIDE = (9.5, 0.3, 0.0), (15.0, 0.0, 0.0)
"""In the ward's corridor, in the way of who comes along it; and where it ends."""


def walker(name: str, start: tuple[float, float], *route: tuple[float, float], **more: Any) -> dict[str, Any]:
    return {"name": name, "start": start, "route": [{"at": p} for p in route], "speed": 1.2} | more


VISITOR = walker("visitor", (13.5, 0.2), (5.0, 0.3))


def waits(seconds: float) -> Pilot:
    """Stands, and says that it is there after so long, of each leg in turn."""
    return Pilot(lambda sensing: Command(0.0, 0.0, arrived=sensing.t >= seconds * (1 + sensing.goal.leg)))


def stand(people: Any, seconds: float = 5.0, start: Any = STANDS, **scenario: Any) -> Trial:
    """A trial of a robot that stands in the ward and counts as arrived after so long."""
    leg = {"name": "there", "goal": start, "time_limit": 40.0, "arrival": "declared"}
    made = make_scenario(floor_plan="ward", people=people, start=start, **{"legs": [leg]} | scenario)
    pilots = [waits(seconds) for _ in made.names()]
    driven = [Driver(make_robot(), pilot, navigator="test", localisation="truth") for pilot in pilots]
    trial = simulate_all(made, driven)[0]
    assert trial.outcome == "reached"
    return replace(trial, errands=completed(made, trial.errands, trial.spans))


@pytest.mark.parametrize("rule", ["social-force", "orca", "headed-social-force"])
def test_who_sees_nobody_is_delayed_by_nothing(rule: str) -> None:
    people = [
        VISITOR | {"sees_robots": False, "behaviour": rule},
        walker("nurse", (4.0, -0.2), (14.0, 0.0), sees_robots=False, behaviour=rule),
    ]
    trial = stand(people, start=BESIDE)
    assert [e.arrived for e in trial.errands] == [e.arrived_without for e in trial.errands]
    assert mean_delay.__wrapped__(trial) == worst_delay.__wrapped__(trial) == mean_detour.__wrapped__(trial) == 0.0


def test_a_robot_in_the_corridor_delays_and_leads_round() -> None:
    trial = stand([VISITOR])
    assert mean_delay(trial).value > 0.15
    assert mean_detour(trial).value > 0.02
    elsewhere = stand([VISITOR], start=BESIDE)
    assert abs(mean_delay(elsewhere).value) < mean_delay(trial).value / 2


def test_it_counts_after_the_trial_has_ended_and_the_robot_is_gone() -> None:
    """One second only, and the visitor is on his way for six more; he arrives all the same."""
    short, long = stand([VISITOR], 1.0), stand([VISITOR], 5.0)
    assert short.t[-1] == pytest.approx(1.0, abs=0.11)
    assert short.errands[0].arrived > 5.0
    assert mean_delay(short).value < mean_delay(long).value
    assert short.errands[0].arrived_without == long.errands[0].arrived_without


def test_arrival_and_path_are_those_of_a_plain_reading_of_the_motion() -> None:
    """Of people whom robots do not concern: at the first sample within 0.3 m of the place, by the chords up to there."""
    robot = make_robot(period=0.05)
    leg = {"name": "there", "goal": (3.0, 0.0, 0.0), "time_limit": 20.0}
    people = [
        walker("a", (13.5, 0.2), (9.3, 0.0), (5.0, 0.3), sees_robots=False),
        walker("b", (4.0, -0.3), (12.0, 0.0), sees_robots=False),
    ]
    made = make_scenario(floor_plan="ward", people=people, start=(-5.0, -2.0, 0.0), legs=[leg])
    trial = simulate_all(made, [Driver(robot, constant(0.0), navigator="test", localisation="truth")])[0]
    errands = completed(made, [Errand(e.body, e.place, math.nan, math.nan) for e in trial.errands], trial.spans)
    assert [e.place for e in errands] == [1, 0]
    first = next(k for k, b in enumerate(trial.attempt.bodies) if b.kind is BodyKind.PERSON)
    for errand in errands:
        person = people[errand.body - first]
        way = trial.moving_obstacles[:, errand.body - first, :2]
        k = 0
        for stop in person["route"]:
            k = next(i for i in range(k, len(way)) if math.dist(way[i], stop["at"]) <= 0.3)
        assert errand.arrived_without == pytest.approx(trial.t[k], abs=1e-6)
        assert errand.path_without == pytest.approx(float(np.hypot(*np.diff(way[: k + 1], axis=0).T).sum()), abs=1e-6)


def test_the_place_is_the_one_walked_to_when_the_trial_ends() -> None:
    route = [{"at": (12.0, 0.2), "wait": 3.0}, {"at": (6.0, 0.2)}]
    person = {"name": "ann", "start": (13.5, 0.2), "route": route, "speed": 1.2}
    places = [stand([person], seconds, BESIDE).errands[0].place for seconds in (0.5, 2.5, 5.5, 15.0)]
    assert places == [0, 0, 1, 1], "on the way, waiting there, on the way, there"


def test_a_route_that_begins_anew_has_ever_more_places() -> None:
    person = walker("ann", (13.5, 0.2), (12.0, 0.2), (13.5, 0.2), loop=True)
    errand = stand([person], 8.0, (5.0, 0.0, 0.0)).errands[0]
    assert errand.place >= 4
    assert errand.arrived > 8.0
    assert errand.arrived == errand.arrived_without


def test_what_is_known_does_not_hang_on_what_was_asked_before() -> None:
    person = walker("ann", (13.5, 0.2), (12.0, 0.2), (9.0, 0.2), (6.0, 0.2))
    made = make_scenario(floor_plan="ward", people=[person], start=BESIDE)
    first = next(e.body for e in stand([person]).errands)
    asked = [Errand(first, place, 0.0, 0.0) for place in (0, 2, 1)]
    one_by_one = [completed(made, [errand], ())[0] for errand in asked]
    without_robots._walk_of.cache_clear()
    assert list(one_by_one) == [completed(made, [errand], ())[0] for errand in asked[::-1]][::-1]
    times = [one_by_one[k].arrived_without for k in (0, 2, 1)]
    assert times == sorted(times)
    assert times[0] < times[1]


def test_who_goes_nowhere_has_no_errand() -> None:
    still = {"name": "still", "start": (7.0, 0.5), "behaviour": "still"}
    track = {"name": "film", "behaviour": "recorded", "track": [(0.0, 6.0, 0.0), (9.0, 7.0, 0.0)], "sees_robots": False}
    trial = stand([still, track], start=BESIDE)
    assert trial.errands == ()
    assert mean_delay(trial).why == "nobody there walks to a place by a decision of its own"


def test_obstacles_that_go_by_the_robots_legs_begin_when_they_did() -> None:
    """A cart that a nurse meets only because the robot's second leg begins at 4 s: without robots she meets it as well."""
    legs = [{"name": n, "goal": BESIDE, "time_limit": 20.0, "arrival": "declared"} for n in ("there", "on")]
    cart = {
        "name": "cart", "shape": {"kind": "disc", "radius": 0.4}, "runs": [{"leg": "on", "path": [(8.0, 0.3), (5.0, 0.3)], "speed": 0.4}],
    }  # fmt: skip
    person = VISITOR | {"sees_robots": False}
    with_cart, alone = (stand([person], 4.0, BESIDE, legs=legs, obstacles=o) for o in ([cart], []))
    assert len(with_cart.spans) == 2
    assert with_cart.errands[0].arrived != alone.errands[0].arrived
    for trial in (with_cart, alone):
        assert (mean_delay(trial).value, mean_detour(trial).value) == (0.0, 0.0)


def test_nobody_knows_it_where_others_drive() -> None:
    leg = {"name": "x", "goal": (5.0, 0.0, 0.0), "time_limit": 9.0, "arrival": "declared"}
    other = {"name": "robot 2", "start": (5.0, -0.6, 0.0), "legs": [leg]}
    assert mean_delay(stand([VISITOR], start=BESIDE, robots=[other])).value is not None
    driven = stand([VISITOR], start=BESIDE, robots=[other | {"role": "other"}])
    assert math.isnan(driven.errands[0].arrived_without)
    assert mean_delay(driven).why == "nobody knows how people walk there without robots"
