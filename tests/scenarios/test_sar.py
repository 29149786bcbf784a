"""Suites of paper B's cases: what the generator promises, recomputed from closed forms, and the frozen file."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from typing import Any

import numpy as np
import pytest

from clearway.clairvoyant.space_time import shortest
from clearway.errors import ClearwayError
from clearway.robots import load_robot
from clearway.scenarios import sar_draws
from clearway.scenarios.check import check_scenario
from clearway.scenarios.motions import KNOT, states
from clearway.scenarios.sar import FROZEN, freeze, frozen
from clearway.scenarios.sar_draws import CASES, Case, Drawn, draw, generate, inflated, static_path
from clearway.scenarios.sar_rules import Layout, closing_gap, length
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection, seed_range
from clearway.scenarios.suites import load_suite

START, GOAL, RADIUS, ROBOT = np.array([1.75, 1.75]), np.array([12.25, 12.25]), 0.35, 0.25
SUITES = {
    "sar-case1": ["case 1"], "sar-case2": ["case 2"], "sar-confined": ["case 1 confined", "case 2 confined"],
    "sar-case3": ["case 3"], "sar-stress": ["stress"],
    "sar-misspecified": ["misspecified"],
}  # fmt: skip
SPEEDS = {"case 3": 0.6, "stress": 0.6}
every_case = pytest.mark.parametrize("case", list(CASES))


def build(suite: str, robot: str = "rescue", seed: int = 0, **selection: Any) -> list[Scenario]:
    return load_suite(suite).build(load_robot(robot), Selection(**selection), seed)


def exact(layout: Layout, t: np.ndarray) -> np.ndarray:
    """(k, n + m, 2) centres at the times `t` (k,), by the closed form where there is one; static ones first."""
    w = np.sqrt(layout.stiffness)
    s = t[:, None, None]
    moving = (
        layout.attraction + (layout.start - layout.attraction) * np.cos(w * s) + layout.velocity / w * np.sin(w * s)
    )
    if layout.motions:
        ways = [states(motion, float(t.max()) + 1.0) for motion in layout.motions]
        knots = KNOT * np.arange(len(ways[0]))
        moving = np.stack([[np.interp(t, knots, way[:, k]) for k in range(2)] for way in ways]).transpose(2, 0, 1)
    return np.concatenate([np.broadcast_to(layout.static, (len(t), *layout.static.shape)), moving], axis=1)


@functools.cache
def some(case: str) -> list[Drawn]:
    return [*frozen()[case], *(generate(CASES[case], seed) for seed in range(3))]


@pytest.mark.parametrize("suite", list(SUITES))
def test_ten_scenarios_of_each_case(suite: str) -> None:
    scenarios = build(suite)
    assert [s.labels.batch for s in scenarios] == [c for c in SUITES[suite] for _ in range(10)]
    assert len({s.name for s in scenarios}) == len(scenarios) == 10 * len(SUITES[suite])
    for s in scenarios:
        n, m = {"case 1": (6, 5), "case 3": (12, 16)}.get(s.labels.batch[:6], (8, 8))
        assert s.speed == SPEEDS.get(s.labels.batch, 1.0)
        assert [o.pose is None for o in s.obstacles] == [False] * n + [True] * m
        assert (s.floor_plan, s.localisation, s.tracking, s.livelock) == ("arena", "truth", "difference", True)
        assert (s.placement_xy, s.placement_yaw, s.legs[0].time_limit) == (0.0, 0.0, 120.0)
        assert s.legs[0].yaw_tolerance == math.inf
        assert s.optimal is not None
        assert s.disturbance is not None
    assert check_scenario(scenarios[0], load_robot("rescue")) == []
    assert check_scenario(scenarios[-1], load_robot("rescue")) == []


@every_case
def test_the_frozen_file_is_what_the_generator_draws(case: str) -> None:
    assert len(frozen()[case]) == FROZEN == 10
    assert max(drawn.optimal.error for drawn in frozen()[case]) <= 0.005
    for drawn, row in zip(frozen()[case], freeze(CASES[case], 2), strict=False):
        assert row["seed"] == drawn.seed
        for part in ("static", "start", "velocity", "attraction", "stiffness"):
            assert getattr(drawn.layout, part).tolist() == row[part]
        assert drawn.optimal.model_dump() == pytest.approx(row["optimal"], abs=1e-3)
        assert [m.model_dump(mode="json") for m in drawn.layout.motions] == row.get("motions", [])


@every_case
def test_what_is_drawn_keeps_the_rules(case: str) -> None:
    for drawn in some(case):
        layout = drawn.layout
        at = np.concatenate([layout.static, layout.start])
        apart = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))[np.triu_indices(len(at), 1)]
        assert apart.min() >= 2 * RADIUS
        for end in (START, GOAL):
            assert np.hypot(*(at - end).T).min() >= 1.5 + RADIUS
        for drawn_in in (at, layout.attraction):
            assert drawn_in.min() >= 1.5
            assert drawn_in.max() <= 12.5
        assert np.abs(layout.velocity).max() <= 0.5
        eta = (layout.stiffness * (2.0 + np.abs(layout.start - layout.attraction)) / 0.2 - 1) / 4
        assert eta[:, 0] == pytest.approx(eta[:, 1], abs=1e-4)  # one draw an obstacle
        assert -1e-4 < eta.min() < eta.max() < 1 + 1e-4
        assert drawn.optimal.time >= (math.dist(START, GOAL) - 0.2) / SPEEDS.get(case, 1.0) - 1e-4
        assert drawn.optimal.path >= math.dist(START, GOAL) - 0.2 - 1e-3
        if CASES[case].confined:
            assert np.abs(layout.start - layout.attraction).max() <= 3.0 + 1e-9
            swept = exact(layout, np.arange(0.0, 600.0, 0.05))[:, len(layout.static) :]
            assert swept.min() - RADIUS >= 0.0
            assert swept.max() + RADIUS <= 14.0


@pytest.mark.parametrize("case", [name for name, case in CASES.items() if case.closing_gap])
def test_a_gap_closes_on_the_static_way(case: str) -> None:
    """Recomputed from the closed form, a millisecond at a time, in the frame of the two that close in."""
    for drawn in some(case):
        path = static_path(drawn.layout)
        assert path is not None
        set_speed = SPEEDS.get(case, 1.0)
        found = closing_gap(drawn.layout, path, set_speed)
        assert found is not None
        assert round(found.speed / set_speed, 12) in (0.5, 0.75, 1.0)
        assert found.second >= len(drawn.layout.static)
        t = found.time + np.arange(-0.2, 0.2, 1e-3)
        reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        p = np.stack([np.interp(found.speed * t, reached, path[:, k]) for k in range(2)], axis=1)
        a, b = exact(drawn.layout, t)[:, [found.first, found.second]].transpose(1, 0, 2)
        to_a, to_b = a - p, b - p
        between = np.arccos(np.clip((to_a * to_b).sum(1) / np.hypot(*to_a.T) / np.hypot(*to_b.T), -1, 1))
        assert between.max() > math.pi - 0.05  # seen from the robot the two stand opposite each other
        meeting = t[int(between.argmax())]
        assert meeting == pytest.approx(found.time, abs=0.02)
        for moment, gap in ((found.time, found.gap), (found.time - 1.95, found.before)):
            one, two = exact(drawn.layout, np.array([moment]))[0, [found.first, found.second]]
            assert math.dist(one, two) - 2 * RADIUS == pytest.approx(gap, abs=2e-3)
        assert found.gap <= 0.6
        assert found.before >= 1.1


LEAVING = {"stress": (200311,)}
"""Seeds whose fastest way leaves a disc at the very moment from which on the disc is faster."""


@pytest.mark.parametrize("case", ["case 3", "stress", "misspecified"])
def test_the_harder_ones_have_a_way(case: str) -> None:
    """The clairvoyant's, a millisecond at a time: past everything, no faster than the set speed, as long as stored."""
    drawn_since = [generate(CASES[case], s) for s in LEAVING.get(case, ())]
    for drawn in [*frozen()[case][:4], *drawn_since]:
        way = shortest(
            START, GOAL, goal_radius=0.2, v_max=CASES[case].speed, static=inflated(drawn.layout.static), bound=False,
            moving=np.ascontiguousarray(drawn.layout.motion(60.0)[:, :, :2]), radii=np.full(len(drawn.layout.start), RADIUS + ROBOT),
            dt=0.05, area=(0.0, 0.0, 14.0, 14.0),
        )  # fmt: skip
        assert way is not None
        assert way.time == pytest.approx(drawn.optimal.time, rel=0.005)
        t = np.arange(0.0, way.time, 1e-3)
        at = np.stack([np.interp(t, way.points[:, 0], way.points[:, k]) for k in (1, 2)], axis=1)
        assert np.hypot(*np.diff(at, axis=0).T).max() <= 1.002e-3 * CASES[case].speed
        gap = np.hypot(*(exact(drawn.layout, t) - at[:, None]).transpose(2, 0, 1)) - RADIUS - ROBOT
        assert gap.min() > -2e-3
        assert math.dist(at[-1], GOAL) <= 0.2 + 1e-3


def test_one_by_one_is_the_same_distribution() -> None:
    """What obstacles keep on their own, drawn until it is kept or refused layout by layout: the same, much sooner."""
    case = Case("few", 2, 3, closing_gap=False, confined=True)
    sets = []
    for one in (False, True):
        drawn = [generate(dataclasses.replace(case, name=f"few {one}", one_by_one=one), s).layout for s in range(60)]
        sets.append(np.stack([np.concatenate([d.static, d.start, d.attraction, d.velocity]) for d in drawn]))
    spread = np.sqrt(sum(s.var(0) / 60 for s in sets))
    z = (sets[0].mean(0) - sets[1].mean(0)) / spread
    assert np.abs(z).max() < 4.0
    assert 0.4 < (z**2).mean() < 2.2  # 22 numbers or so, about 1
    refused = [
        generate(dataclasses.replace(case, name=f"few {one}", one_by_one=one), 0).refused for one in (False, True)
    ]
    assert set(refused[1]) <= {"overlap"}


@every_case
def test_the_static_way_is_free_and_no_shorter_than_the_straight_one(case: str) -> None:
    for drawn in some(case):
        path = static_path(drawn.layout)
        assert path is not None
        assert path[0].tolist() == START.tolist()
        assert path[-1].tolist() == GOAL.tolist()
        dense = np.concatenate([np.linspace(a, b, 200) for a, b in itertools.pairwise(path)])
        gap = np.hypot(*(dense[:, None] - drawn.layout.static).transpose(2, 0, 1)) - RADIUS - ROBOT
        assert gap.min() > -1e-9
        assert math.dist(START, GOAL) <= length(path) <= 1.3 * math.dist(START, GOAL)


def test_a_seed_gives_the_same_whichever_others_are_drawn() -> None:
    alone = generate(CASES["case 1"], 7)
    after = [generate(CASES["case 1"], s) for s in (5, 6, 7)][-1]
    assert alone.layout.start.tolist() == after.layout.start.tolist()
    assert alone.optimal == after.optimal
    others = {generate(CASES["case 1"], s).layout.start[0, 0] for s in range(10)}
    assert len(others | {d.layout.start[0, 0] for d in frozen()["case 1"]}) == 20  # frozen ones are a family apart


def test_seeds_select_what_is_drawn() -> None:
    scenarios = build("sar-case1", seeds=(3, 6))
    assert [s.labels.configuration for s in scenarios] == ["seed-3", "seed-4", "seed-5"]
    start = scenarios[0].obstacles[6].oscillation
    assert start is not None
    assert start.start == tuple(generate(CASES["case 1"], 3).layout.start[0])
    both = build("sar-confined", seeds=(0, 2))
    assert [s.labels.batch for s in both] == ["case 1 confined"] * 2 + ["case 2 confined"] * 2
    assert len(build("sar-confined", seeds=(0, 2), batches=("case 1 confined",))) == 2


def test_a_disturbance_by_a_factor() -> None:
    """Everything else stays: the same pushes, longer."""
    as_is, twice, none = (build("sar-case1", disturbance=f)[0] for f in (1.0, 2.0, 0.0))
    assert as_is == build("sar-case1")[0]
    assert twice.disturbance is not None
    assert twice.disturbance.model_dump() == {
        "position": 0.02, "heading": 0.02, "velocity": 0.0, "turn": 0.0, "at_rest": True
    }  # fmt: skip
    assert none.disturbance is not None
    assert none.disturbance.position == none.disturbance.heading == 0.0
    assert twice.model_copy(update={"disturbance": as_is.disturbance}) == as_is
    assert twice.model_dump_json() != as_is.model_dump_json()  # which is what resuming compares
    with pytest.raises(ClearwayError, match="the suite 'hospital' has no disturbance that could be multiplied by 2"):
        build("hospital", robot="tiago", disturbance=2.0)
    for wrong in (-1.0, math.nan, math.inf):
        with pytest.raises(
            ClearwayError, match=f"disturbance: {wrong:g} is no factor on a disturbance: 0 for none, 1 as"
        ):
            build("sar-case1", disturbance=wrong)


def test_repetitions_and_campaign_seeds_change_the_disturbance_only() -> None:
    one, two = build("sar-case1", repetitions=2, configurations=("scenario-4",))
    (other,) = build("sar-case1", seed=1, configurations=("scenario-4",))
    assert one.obstacles == two.obstacles == other.obstacles
    assert len({one.seed, two.seed, other.seed}) == 3
    assert one.optimal == two.optimal


def test_the_limit_holds_for_the_robot_and_speed_that_it_was_searched_for() -> None:
    assert build("sar-case1", speeds=(0.5,))[0].optimal is None
    assert build("sar-case3", speeds=(1.0,))[0].optimal is None
    assert build("sar-case3", speeds=(0.6,))[0].optimal is not None
    tiago = build("sar-case1", robot="tiago")[0]
    assert (tiago.speed, tiago.optimal) == (1.0, None)


@pytest.mark.parametrize("text", ["", "3", "5:5", "6:5", "-1:4", "a:b", "0:1:2", "0.5:2"])
def test_what_is_no_range_of_seeds(text: str) -> None:
    with pytest.raises(ClearwayError, match="is no range of seeds; 0:200 are the seeds 0 to 199"):
        seed_range(text)


def test_other_wrong_selections() -> None:
    assert seed_range("0:200") == (0, 200)
    with pytest.raises(ClearwayError, match="'2:1' is no range of seeds"):
        build("sar-case1", seeds=(2, 1))
    with pytest.raises(ClearwayError, match="the suite 'hospital' has no generator"):
        build("hospital", robot="tiago", seeds=(0, 1))
    with pytest.raises(ClearwayError, match="'sar-case1' takes place in 'arena', not in 'hall'"):
        build("sar-case1", floor_plan="hall")
    with pytest.raises(ClearwayError, match=r"1.5 m/s is out of reach for 'rescue', at most 1"):
        build("sar-case1", speeds=(1.5,))


def test_a_generator_that_finds_nothing_says_why_and_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sar_draws, "DRAWS", 40)
    with pytest.raises(ClearwayError) as raised:
        generate(Case("crowd", 80, 80, closing_gap=False), 0)
    assert str(raised.value) == ("seeds: crowd, seed 0: none of 40 draws makes a solvable scenario (overlap 100.0 %)")
    assert sum(generate(CASES["case 1"], 1).refused.values()) < 40


def test_no_oscillator_is_faster_than_stated() -> None:
    """scenarios/DECISIONS.md: 4.37 m/s and 1.213 m/s^2 in the plane, confined ones 2.02 m/s and 0.906 m/s^2. Corners of what is
    drawn reach it (12.5 - 1.5 = 11 m on both axes), nothing drawn exceeds it."""
    for confined, far, speed, acceleration in ((False, 11.0, 4.372, 1.2126), (True, 3.0, 2.0249, 0.9056)):
        d = np.linspace(0.0, far, 2001)
        k = 1.0 / (2.0 + d)
        assert math.sqrt(2) * np.sqrt(k * d**2 + 0.25).max() == pytest.approx(speed, abs=1e-3)
        assert math.sqrt(2) * np.sqrt((k * d) ** 2 + 0.25 * k).max() == pytest.approx(acceleration, abs=1e-3)
        seen = 0.0
        for case in CASES.values():
            if case.confined != confined or case.misspecified:
                continue
            for attempt in range(200):
                drawn = draw(case, np.uint64(7), attempt)
                peak = np.sqrt(drawn.stiffness) * drawn.amplitude()
                assert np.hypot(*peak.T).max() <= speed
                assert np.hypot(*(np.sqrt(drawn.stiffness) * peak).T).max() <= acceleration
                seen = max(seen, float(np.hypot(*peak.T).max()))
        assert seen > 0.8 * speed
