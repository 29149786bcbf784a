"""The clairvoyant's search: known answers, checks that share no code with it, and a brute-force search."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.clairvoyant.moving_discs import clear
from clearway.clairvoyant.reach import MARGIN, PER_STEP, STEPS, earliest
from clearway.clairvoyant.space_time import SpaceTimePath, scene_of, shortest

NONE = np.zeros((0, 3))
NOBODY = np.zeros((2, 0, 2))
DT = 0.05
AREA = (0.0, 0.0, 14.0, 14.0)
START, GOAL = np.array([1.75, 1.75]), np.array([12.25, 12.25])


def search(
    start, goal, *, static=NONE, moving=NOBODY, radii=(), goal_radius=0.1, v_max=1.0, **more
) -> SpaceTimePath | None:
    return shortest(
        np.array(start, dtype=float), np.array(goal, dtype=float), goal_radius=goal_radius, v_max=v_max,
        static=np.array(static, dtype=float), moving=np.asarray(moving, dtype=float), radii=np.array(radii, dtype=float),
        dt=DT, **more,
    )  # fmt: skip


def swinging(seed: int, static: int, moving: int, seconds: float = 30.0):
    """Discs that stand, and discs that swing about points, all apart from start and goal at first."""
    rng = np.random.default_rng(seed)
    places: list[np.ndarray] = []
    while len(places) < static + moving:
        p = rng.uniform(1.5, 12.5, 2)
        if min(np.hypot(*(p - q)) for q in (START, GOAL)) > 1.5 and all(np.hypot(*(p - q)) > 0.7 for q in places):
            places.append(p)
    t = np.arange(0.0, seconds + DT / 2, DT)[:, None, None]
    begin, centre = np.array(places[static:]).reshape(-1, 2), rng.uniform(1.5, 12.5, (moving, 2))
    rate = np.sqrt(rng.uniform(0.05, 0.4, (moving, 1)))
    ways = centre + (begin - centre) * np.cos(rate * t) + rng.uniform(-0.5, 0.5, (moving, 2)) / rate * np.sin(rate * t)
    return np.array([(*p, 0.6) for p in places[:static]]).reshape(-1, 3), ways, np.full(moving, 0.6)


def clearance(points: np.ndarray, static: np.ndarray, moving: np.ndarray, radii: np.ndarray) -> float:
    """Sampled densely, with nothing but numpy."""
    t = np.arange(points[0, 0], points[-1, 0], 5e-4)
    x, y = np.interp(t, points[:, 0], points[:, 1]), np.interp(t, points[:, 0], points[:, 2])
    gaps = [np.hypot(x - a, y - b) - r for a, b, r in static]
    clock = np.arange(len(moving)) * DT
    for j, r in enumerate(radii):
        gaps.append(np.hypot(x - np.interp(t, clock, moving[:, j, 0]), y - np.interp(t, clock, moving[:, j, 1])) - r)
    return float(min(g.min() for g in gaps)) if gaps else math.inf


def top_speed(points: np.ndarray) -> float:
    step = np.diff(points, axis=0)
    step = step[step[:, 0] > 1e-6]
    return float((np.hypot(step[:, 1], step[:, 2]) / step[:, 0]).max())


def past_one_disc(d: float, h: float, r: float) -> float:
    """Tangent, arc, tangent: from d before to d behind the centre of a disc that lies h beside the line."""
    far = math.hypot(d, h)
    return 2.0 * math.sqrt(far * far - r * r) + 2.0 * r * (math.atan2(d, h) - math.acos(r / far))


def test_nothing_in_the_way_is_exact() -> None:
    way = search((0, 0), (3, 4), goal_radius=0.5, v_max=0.5)
    assert way is not None
    assert way.time == pytest.approx(9.0, abs=1e-9)
    assert way.length == pytest.approx(4.5, abs=1e-9)
    assert way.error == 0.0
    assert way.points[-1] == pytest.approx([9.0, 2.7, 3.6], abs=1e-9)


@given(st.floats(0.0, 0.9), st.floats(0.3, 1.5), st.floats(2.0, 5.0))
@settings(max_examples=8, deadline=None)
def test_one_disc_that_stands_is_tangent_arc_tangent(beside: float, r: float, d: float) -> None:
    h = beside * r  # the disc's centre is h above the line: the way leads below
    way = search((-d, 0), (d, 0), static=[(0, h, r)], goal_radius=1e-3)
    assert way is not None
    exact = past_one_disc(d, h, r) - 1e-3
    assert way.length == pytest.approx(exact, rel=5e-4)
    assert way.time * (1 - way.error) <= exact <= way.time * (1 + 1e-9)


def corridor_with_a_gate(opens: float):
    """A wall of discs with one gap, and a disc in the gap that leaves at a known time, faster than the point."""
    wall = [(5.0, y, 0.6) for y in np.arange(-5.0, 5.1, 0.5) if abs(y) > 0.9]
    t = np.arange(0.0, 30.0, DT)
    gate = np.column_stack([np.full(len(t), 5.0), 4.0 * np.maximum(0.0, t - opens)])[:, None, :]
    return np.array(wall), gate


@pytest.mark.parametrize("opens", [0.0, 12.0])
def test_a_gate_is_waited_for(opens: float) -> None:
    wall, gate = corridor_with_a_gate(opens)
    more = {"static": wall, "moving": gate, "radii": [0.85], "area": (-1.0, -5.0, 11.0, 5.0), "horizon": 21.0}
    way = search((0, 0), (10, 0), **more)
    assert way is not None
    assert clearance(way.points, wall, gate, np.array([0.85])) > -1e-9
    if opens:
        assert opens + 4.0 < way.time * (1 + 1e-9)  # the disc's lower edge has to pass y = 0 before
        assert way.time < opens + 7.5
    else:
        assert way.time == pytest.approx(9.9, rel=0.01)


def test_no_way() -> None:
    ring = [(3 * math.cos(a), 3 * math.sin(a), 1.0) for a in np.linspace(0, math.tau, 13)[:-1]]
    assert search((0, 0), (6, 0), static=ring) is None  # walled in
    assert search((0, 0), (6, 0), static=[(0.5, 0, 1.0)]) is None  # starts inside
    assert search((0, 0), (6, 0), static=[(6, 0, 1.0)], goal_radius=0.5) is None  # ends inside
    assert search((0, 0), (6, 0), horizon=5.0) is None  # too late
    assert search((0, 0), (6, 0), area=(1.0, -1.0, 7.0, 1.0)) is None  # starts outside
    assert search((0, 0), (6, 0), area=(-1.0, -1.0, 5.0, 1.0)) is None  # ends outside


def test_at_the_goal_already() -> None:
    way = search((0, 0), (0.05, 0))
    assert way is not None
    assert (way.time, way.length, way.error) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("change", "named"),
    [({"v_max": 0.0}, "v_max"), ({"goal_radius": -1.0}, "goal_radius"), ({"radii": [1.0]}, "moving"),
     ({"start": (math.nan, 0)}, "start"), ({"goal": (math.inf, 0)}, "goal"), ({"static": [(0, 0, math.nan)]}, "static")],
)  # fmt: skip
def test_bad_input_is_named(change: dict, named: str) -> None:
    asked = {"start": (0, 0), "goal": (4, 0)} | change
    with pytest.raises(ValueError, match=named):
        search(asked.pop("start"), asked.pop("goal"), **asked)


@pytest.mark.parametrize("seed", range(10))
def test_ways_are_clear_and_the_error_is_small(seed: int) -> None:
    static, moving, radii = swinging(seed, 8, 8)
    way = search(START, GOAL, static=static, moving=moving, radii=radii, area=AREA, goal_radius=0.2)
    assert way is not None
    assert clearance(way.points, static, moving, radii) > -1e-6
    assert top_speed(way.points) <= 1.0 + 1e-3
    assert way.length <= way.time * (1.0 + 1e-5)
    assert way.error <= 0.008  # these discs are faster than those of the suites
    assert np.hypot(*(way.points[-1, 1:] - GOAL)) <= 0.2 + 1e-6
    assert (way.points[:, 1:] >= 0.0).all()
    assert (way.points[:, 1:] <= 14.0).all()
    still = search(START, GOAL, static=static, area=AREA, goal_radius=0.2)
    assert still is not None
    assert way.time >= still.time * (1.0 - 1e-9)  # more obstacles, no faster


def test_a_way_that_is_nowhere_is_not_clear() -> None:
    static, moving, radii = swinging(0, 1, 1)
    scene = scene_of(GOAL, 0.2, 1.0, static, moving, radii, DT, AREA)
    still = np.array([[0.0, *START], [0.1, *START]])
    assert clear(scene, still)
    still[1, 2] = math.nan
    assert not clear(scene, still)


def test_absent_discs_are_no_obstacle() -> None:
    moving = np.full((400, 1, 2), 3.0)
    moving[:, :, 1] = 0.0
    moving[:400] = np.nan
    way = search((0, 0), (6, 0), moving=moving, radii=[1.0])
    assert way is not None
    assert way.time == pytest.approx(5.9)
    moving[20:] = (3.0, 0.0)  # it appears in time
    later = search((0, 0), (6, 0), moving=moving, radii=[1.0])
    assert later is not None
    assert later.time == pytest.approx(past_one_disc(3.0, 0.0, 1.0) - 0.1, rel=1e-3)


def test_the_clock_of_moving_discs_can_have_begun_before() -> None:
    static, moving, radii = swinging(3, 4, 6)
    now = search(START, GOAL, static=static, moving=moving, radii=radii, area=AREA, start_time=2.0)
    shifted = search(START, GOAL, static=static, moving=moving[40:], radii=radii, area=AREA)
    assert now is not None
    assert shifted is not None
    assert now.time == pytest.approx(shifted.time, rel=1e-6)
    assert now.points[0, 0] == 2.0


def flooded(start, goal, radius, static, moving, radii, h: float, every: int, step: float, grow: float) -> int:
    """The layer in which nodes (x, y, layer) within `radius` of the goal are first reached, with moves up to `step`."""
    axis = np.arange(round(6.0 / h) + 1) * h
    x, y = np.meshgrid(axis, axis, indexing="ij")
    n = int(step / h) + 1
    moves = [(i, j) for i in range(-n, n + 1) for j in range(-n, n + 1) if math.hypot(i, j) * h <= step + 1e-12]
    now = np.zeros(x.shape, bool)
    now[round(start[0] / h), round(start[1] / h)] = True
    near = np.hypot(x - goal[0], y - goal[1]) <= radius
    for k in range(1, 200):
        then = np.zeros_like(now)
        where = np.argwhere(now)
        for move in moves:
            there = where + move
            there = there[((there >= 0) & (there < len(axis))).all(axis=1)]
            then[there[:, 0], there[:, 1]] = True
        for a, b, r in (*static, *((*moving[k * every, j], r) for j, r in enumerate(radii))):
            then &= np.hypot(x - a, y - b) >= r + grow
        now = then
        if (now & near).any():
            return k
    raise AssertionError("never reached")


def brute_force(start, goal, radius, static, moving, radii, h: float, every: int) -> tuple[float, float]:
    """Bounds below and above on the arrival from floods that know nothing of tangents.

    Below: a way's nearest nodes are reached by steps longer by a node's diagonal, round discs smaller by as much.
    Above: discs are larger by what a gap can close in half a layer.
    """
    delta, diagonal = every * DT, math.sqrt(2.0) * h
    common = (start, goal)
    first = flooded(*common, radius + diagonal, static, moving, radii, h, every, delta + diagonal, -diagonal)
    last = flooded(*common, radius, static, moving, radii, h, every, delta, 0.5 * delta * 1.9)
    return (first - 1) * delta, last * delta


@pytest.mark.parametrize("seed", range(3))
def test_a_brute_force_search_agrees(seed: int) -> None:
    rng = np.random.default_rng(seed)
    static = np.array([(*rng.uniform(1.8, 4.2, 2), 0.4)])
    t = np.arange(0.0, 20.0, DT)[:, None, None]
    velocity = rng.uniform(-0.6, 0.6, (2, 2))
    moving = rng.uniform(1.8, 4.2, (2, 2)) + velocity * t
    start, goal = np.array([0.6, 0.6]), np.array([5.4, 5.4])
    way = search(start, goal, static=static, moving=moving, radii=[0.4, 0.4], area=(0, 0, 6, 6), goal_radius=0.2)
    below, above = brute_force(start, goal, 0.2, static, moving, [0.4, 0.4], 0.05, 6)
    assert way is not None
    assert below <= way.time <= above


def test_the_grids_two_steps_reach_far_enough_in_every_direction() -> None:
    angle = np.linspace(0.0, math.tau, 5001)
    direction = np.stack([np.cos(angle), np.sin(angle)])
    total = np.zeros(len(angle))
    for square in STEPS:
        i, j = np.mgrid[-22:23, -22:23]
        nodes = np.stack([i[i * i + j * j <= square], j[i * i + j * j <= square]], axis=1)
        total += (nodes @ direction).max(axis=0)
    assert total.min() >= len(STEPS) * PER_STEP - 1e-9
    assert total.max() <= len(STEPS) * PER_STEP * 1.0107
    near = np.abs(angle - math.pi / 4) < math.radians(10)
    assert total[near].mean() <= len(STEPS) * PER_STEP * 1.0017


def closest_on_the_grid(headings: np.ndarray) -> float:
    """How close the best sequence of nodes stays to a way at full speed with these headings, one a layer, in nodes."""
    way = np.cumsum(PER_STEP * np.stack([np.cos(headings), np.sin(headings)], axis=1), axis=0)
    nodes, worst = np.zeros((1, 2)), np.zeros(1)
    around = np.stack(np.mgrid[-5:6, -5:6], axis=-1).reshape(-1, 2)
    for k, at in enumerate(way):
        there = np.round(at) + around
        far = ((there[:, None] - nodes[None]) ** 2).sum(axis=2)
        before = np.where(far <= STEPS[k % len(STEPS)], worst[None], np.inf).min(axis=1)
        worst = np.maximum(before, np.hypot(*(there - at).T))
        nodes, worst = there[worst <= 5.0], worst[worst <= 5.0]
        assert len(nodes)
    return float(worst.min())


def test_any_way_can_be_followed_on_the_grid_within_its_margin() -> None:
    """What the lower bound rests on."""
    rng = np.random.default_rng(0)
    for _ in range(6):
        begin = np.full(100, rng.uniform(0.0, math.tau))
        bend = np.where(np.arange(100) < 50, 0.0, rng.uniform(-0.6, 0.6))
        wander = np.cumsum(rng.normal(0.0, 0.15, 100) * (rng.random(100) < 0.3))
        zigzag = rng.uniform(0.0, 0.5) * (-1.0) ** np.arange(100)
        for turns in (0.0, bend, wander, zigzag):
            assert closest_on_the_grid(begin + turns) <= MARGIN


@pytest.mark.parametrize("seed", range(5))
def test_the_lower_bound_lies_below_and_rises_with_a_finer_grid(seed: int) -> None:
    static, moving, radii = swinging(seed + 50, 6, 6)
    scene = scene_of(GOAL, 0.2, 1.0, static, moving, radii, DT, AREA)
    way = search(START, GOAL, static=static, moving=moving, radii=radii, area=AREA, goal_radius=0.2)
    assert way is not None
    assert clear(scene, way.points)
    bounds = [earliest(scene, START, 0.0, way.time + 0.5, delta) for delta in (0.2, 0.1, 0.05)]
    assert max(bounds) <= way.time
    assert bounds[0] <= bounds[1] + 0.01
    assert bounds[1] <= bounds[2] + 0.01
