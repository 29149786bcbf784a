"""The social force model against PySocialForce (independent software, MIT), step by step, and where the two differ.

PySocialForce takes the angle between two directions without wrapping it: who sees somebody across its own -x axis gets
another force there, so those are left out. See `src/clearway/crowds/DECISIONS.md`.
"""

from __future__ import annotations

import logging
import math

import numba
import numpy as np
import pytest

from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.social_force import MOUSSAID, forces, velocities
from clearway.crowds.walls import walls_of

RADIUS, PERIOD = 0.35, 0.1
THEIRS = MOUSSAID._replace(strength=5.1, wall_strength=10.0, wall_span=0.2, breadth=math.inf)
"""Its default parameters, which are pedsim_ros's."""


@pytest.fixture(scope="module")
def pysocialforce(tmp_path_factory):
    """The package, uncompiled, which is quicker here. On import it opens a log file in the working directory and makes the root
    logger tell everything."""
    root, patch = logging.getLogger(), pytest.MonkeyPatch()
    level, handlers = root.level, list(root.handlers)
    patch.chdir(tmp_path_factory.mktemp("log"))
    patch.setattr(numba.config, "DISABLE_JIT", True)
    try:
        return pytest.importorskip("pysocialforce")
    finally:
        patch.undo()
        named = logging.getLogger("root")
        for handler in [*named.handlers]:
            if handler not in handlers:
                named.removeHandler(handler)
                handler.close()
        root.setLevel(level)
        named.setLevel(level)


def simulator(package, state, groups=None, walls=None):
    """Its simulation of `state` (n, 6) x, y, v, goal, every force reaching as far as it does."""
    made = package.Simulator(state.copy(), groups=groups, obstacles=walls)
    made.peds.step_width = PERIOD
    made.config.config["obstacle_force"]["threshold"] = 1e3
    for force in made.forces:
        force.init(made, made.config)
    return made


def seen(state):
    """What it knows, for the kernel: v_max is 1.3 times the first speed there, and what everybody wants."""
    n = len(state)
    return Bodies(
        state[:, :2].copy(), state[:, 2:4].copy(), np.full(n, RADIUS), np.ones(n, np.int64), np.full(n, 0.5)
    )  # fmt: skip


def unwrapped(state):
    """(n,) whether its angle to anybody leaves -pi to pi."""
    n, found = len(state), np.zeros(len(state), bool)
    for i in range(n):
        for j in range(n):
            if i != j:
                e = (state[i, :2] - state[j, :2]) / np.hypot(*(state[i, :2] - state[j, :2]))
                t = 2.0 * (state[j, 2:4] - state[i, 2:4]) + e
                found[i] |= abs(math.atan2(t[1], t[0]) - math.atan2(e[1], e[0])) > math.pi
    return found


def scene(seed, n):
    rng = np.random.default_rng(seed)
    grid = np.array([(i, j) for i in range(6) for j in range(6)], float)
    place = 1.5 * grid[rng.permutation(36)[:n]] + rng.uniform(-0.3, 0.3, (n, 2))
    velocity = rng.uniform(0.6, 1.3, (n, 1)) * np.column_stack(
        ((w := rng.uniform(0, 2 * np.pi, n), np.cos(w))[1], np.sin(w))
    )
    return np.column_stack((place, velocity, place + rng.uniform(10, 20, (n, 1)) * velocity))


@pytest.mark.parametrize("walls", [None, [(-3, 12, -2, -2), (-3, -3, -2, 12)]])
def test_step_by_step(pysocialforce, walls):
    """Five walk for 3 s by its own steps; each of ours is taken from the state that it is in."""
    compared = 0
    points = [p for line in pysocialforce.scene.EnvState(walls).obstacles for p in line]
    posts = walls_of([[p] for p in points])
    for seed in range(12):
        theirs = simulator(pysocialforce, scene(seed, 5), walls=walls)
        v_max = 1.3 * np.hypot(*theirs.peds.vel().T)
        for _ in range(30):
            before = theirs.peds.state.copy()
            theirs.step_once()
            way = before[:, 4:6] - before[:, :2]
            wish = v_max[:, None] * way / np.hypot(*way.T)[:, None]
            n = len(before)
            wishes = Wishes(np.arange(n), wish, v_max, np.ones(n, np.int64))
            ours = velocities(seen(before), wishes, np.full(n, -1), THEIRS, posts, PERIOD)
            good = ~unwrapped(before)
            assert np.abs(ours - theirs.peds.vel())[good].max(initial=0.0) < 1e-6
            compared += good.sum()
    assert compared > 600  # of 1,800


def test_the_forces_in_a_group(pysocialforce):
    """Its versions after the paper: attraction as ours, gaze for a speed of 1 m/s, repulsion for a distance of 1 m."""
    from pysocialforce import forces as theirs

    everybody, compared = [[0, 1], [2, 3, 4]], np.zeros(3, int)
    group = np.array((0, 0, 1, 1, 1))
    for seed in range(40):
        rng = np.random.default_rng(seed)
        state = scene(seed, 5)
        state[:, :2] = rng.uniform(0.0, 2.5, (5, 2))
        state[:, 4:6] = state[:, :2] + 10.0 * state[:, 2:4]
        made = simulator(pysocialforce, state, everybody)
        wishes = Wishes(np.arange(5), np.zeros((5, 2)), np.full(5, 9.0), np.ones(5, np.int64))
        for k, (name, parameter, factor) in enumerate(
            (
                ("GroupCoherenceForce", "attraction", 3.0),
                ("GroupGazeForce", "gaze", 4.0),
                ("GroupRepulsiveForce", "repulsion", 1.0),
            )
        ):
            force = getattr(theirs, name)()
            force.init(made, made.config)
            force.factor = factor
            expected = force.get_force()
            silent = MOUSSAID._replace(strength=0.0, attraction=0.0, gaze=0.0, repulsion=0.0, apart=0.55)
            ours = forces(seen(state), wishes, group, silent._replace(**{parameter: factor}), walls_of([]))
            if name == "GroupGazeForce":
                expected = expected * np.hypot(*state[:, 2:4].T)[:, None]
            if name == "GroupRepulsiveForce":  # of two only: with three it does not tell whose distance it was
                d = np.hypot(*(state[0, :2] - state[1, :2]))
                ours, expected = ours[:2], expected[:2] / d
            assert np.abs(ours - expected).max() < 1e-9
            compared[k] += (np.abs(expected) > 1e-3).any()
    assert (compared >= 5).all()
