"""The lidar's errors: each has the distribution that the robot's file says, and without them ranges are exact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from worlds import body, make_robot

from clearway.contract import Goal
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, FloatArray, Polygon, rectangle
from clearway.trials import Body
from clearway.world.tracks import tracks
from clearway.world.traffic import Traffic
from clearway.world.world import World

BEAMS = 361
LIDAR = {
    "beams": BEAMS, "angle_min": -1.0, "angle_max": 1.0, "range_min": 0.05, "range_max": 10.0, "sigma": 0.0,
    "mount": (0.1, 0.0, 0.0),
}  # fmt: skip
INCREMENT = 2.0 / (BEAMS - 1)
NOWHERE = Goal(np.zeros(3), 0.1, 0.1)
AROUND = [body(Circle(4.0), 0.1, 0.0)]
"""Seen from inside: 4 m away wherever a beam goes."""


def sweeps(bodies: Sequence[Body], seed: int = 1, n: int = 200, **errors: float) -> FloatArray:
    """(n, beams) of a robot that stands at the origin."""
    traffic = Traffic(tracks([], ["leg"]), [], ["leg"])
    world = World(make_robot(lidar=LIDAR | errors), np.zeros(3), 1.0, bodies, traffic, seed)
    world.begin()
    rows = []
    for t in range(n):
        scan = world.sensing(0.1 * t, NOWHERE).scan
        assert scan is not None
        rows.append(scan.ranges)
        world.keep(0.1 * t, world.drive(0.1 * t)[0])
    return np.array(rows)


def exact(bodies: Sequence[Body]) -> FloatArray:
    rays = beams(BEAMS, -1.0, 1.0, 0.05, 10.0)
    return sweep(scene([b.shape for b in bodies], np.array([b.pose for b in bodies])), rays, np.array([0.1, 0.0, 0.0]))


def test_without_errors_the_ranges_are_exact() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        x, y = rng.uniform(1.0, 5.0, 6), rng.uniform(-4.0, 4.0, 6)
        bodies = [
            body(Circle(0.3), a, b) if a > 3 else body(rectangle(0.4, 0.7), a, b, a) for a, b in zip(x, y, strict=True)
        ]
        assert (sweeps(bodies, n=1)[0] == exact(bodies)).all()


def test_noise_has_its_deviation_and_is_independent() -> None:
    error = sweeps(AROUND, sigma=0.02) - 4.0
    assert abs(error.std() / 0.02 - 1.0) < 0.02
    assert abs(error.mean()) < 4 * 0.02 / math.sqrt(error.size)
    beside, later = (error[:, 1:] * error[:, :-1]).mean(), (error[1:] * error[:-1]).mean()
    assert max(abs(beside), abs(later)) < 4 * 0.02**2 / math.sqrt(error.size)


def test_bias_is_one_draw_a_trial_within_its_bound() -> None:
    drawn = []
    for seed in range(200):
        error = sweeps(AROUND, seed, n=3, bias=0.06) - 4.0
        assert np.ptp(error) < 1e-12
        drawn.append(error[0, 0])
    assert np.abs(drawn).max() < 0.06
    assert np.abs(drawn).max() > 0.057  # evenly: of 200 draws one lies in the outer twentieth but for 1 case in 30,000
    assert abs(np.std(drawn) - 0.06 / math.sqrt(3)) < 0.005
    assert abs(np.mean(drawn)) < 0.01


def test_lost_returns_have_their_rate_and_are_independent() -> None:
    lost = np.isinf(sweeps(AROUND, n=400, dropout=0.02))
    n, p = lost.size, 0.02
    assert abs(lost.mean() - p) < 4 * math.sqrt(p / n)
    assert np.abs(lost.mean(axis=0) - p).max() < 5 * math.sqrt(p / len(lost))  # at every bearing alike
    pairs = (lost[:, 1:] & lost[:, :-1]).sum()
    assert abs(pairs - n * p * p) < 4 * math.sqrt(n * p * p)


STEP = [body(Polygon(((0.0, -9.0), (0.0, 0.013))), 2.1, 0.0), body(Polygon(((0.0, -9.0), (0.0, 9.0))), 2.6, 0.0)]
"""A plate 2 m ahead, right of beam 181, and a wall half a metre behind it."""


def test_mixed_pixels_lie_between_the_two_surfaces_beside_the_edge() -> None:
    plain, spot = exact(STEP), 2.5  # beams wide
    edge = next(i for i in range(BEAMS) if plain[i + 1] - plain[i] > 0.4)
    found = sweeps(STEP, divergence=spot * INCREMENT, pulse=0.75)
    changed = np.abs(found - plain) > 0.005  # by the other surface, not by its own curvature
    assert set(np.flatnonzero(changed.any(axis=0))) <= set(range(edge - 1, edge + 3))
    near, far = plain[edge - 2 : edge + 1].min(), plain[edge + 1 : edge + 4].max()
    assert (found[changed] > near).all()
    assert (found[changed] < far).all()
    # as many beams as the spot is wide, but for the shares below 1 % on either side
    assert abs(changed.sum(axis=1).mean() - 0.98 * spot) < 4 * math.sqrt(0.25 / len(found))
    depth = (found[changed] - near) / (far - near)
    assert abs(np.mean(depth) - 0.5) < 0.05
    assert np.histogram(depth, 4, (0.0, 1.0))[0].min() > 0.15 * depth.size


def test_echoes_further_apart_than_the_pulse_do_not_mix() -> None:
    assert (sweeps(STEP, n=20, divergence=0.02, pulse=0.45) == exact(STEP)).all()


def test_a_slanted_wall_has_no_edges() -> None:
    """Met at up to 79 degrees: neighbouring ranges differ by more than at many an edge, but lie on one surface."""
    wall = [body(Polygon(((0.0, 0.0), (6.0, 3.0))), 0.3, -1.2)]
    plain = exact(wall)
    assert np.diff(plain[np.isfinite(plain)]).max() > 0.15
    assert (sweeps(wall, n=5, divergence=0.02, pulse=0.75) == plain).all()


def test_a_thin_pole_is_drawn_towards_what_stands_behind_it() -> None:
    """A spot four beams wide over a pole of one: its light comes for the most part from 0.4 m behind."""
    pole = [body(rectangle(0.02, 0.008), 2.11, 0.0), body(Polygon(((0.0, -3.0), (0.0, 3.0))), 2.5, 0.0)]
    found = sweeps(pole, divergence=4 * INCREMENT, pulse=0.75)[:, 176:185]
    assert (found.min(axis=1) > 2.19).all()  # at most two beams' width of four
    assert abs((2.4 - found).sum(axis=1).mean() - 0.4) < 0.1  # what one range lacks the others have


def test_all_is_a_function_of_seed_and_period() -> None:
    errors = {"sigma": 0.02, "bias": 0.06, "divergence": 0.0144, "pulse": 0.75, "dropout": 0.004}
    one, other = sweeps(STEP, 4, 5, **errors), sweeps(STEP, 4, 5, **errors)
    assert (one == other).all()
    assert (one[0] != one[1]).any()
    assert (one[0] != sweeps(STEP, 5, 1, **errors)[0]).any()
