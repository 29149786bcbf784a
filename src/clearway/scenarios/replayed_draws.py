"""Draws recordings of people who were never there: the generator behind the suites `replayed` and `replayed-held-out`.

Two streams of people cross an open floor, each from its own side to the opposite one, by Clearway's social force, and are kept as an
overhead camera over a square would see them. When each comes, where it wants to and how fast are drawn from a stream keyed by (suite,
seed), so that a seed gives the same recording for ever.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from clearway.crowds import social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.walls import Walls, walls_of
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal, stream, uniform
from clearway.scenarios.replay import Replay, Walk

SECONDS = 110.0
"""How long people come, s."""
BEGIN = 20.0
"""When the robot is to start, s: the first have crossed by then."""
FROM, SIDE = 7.5, 6.5
"""How far from the middle people come in and go, and half the edge of what the camera sees, m."""
EVERY = 0.4
"""Time from a sample to the next, s."""
RADIUS = 0.25
"""Of a person, m."""
FASTER = 1.3
"""The most that a person hurries, of the preferred speed (Helbing, Molnár 1995)."""
_STEP = 0.05
_FAR = 1e6
"""Where those are who haven't come yet or have gone, m; each `_APART` from the next one."""
_APART = 1e3


@dataclass(frozen=True, slots=True)
class Streams:
    """Two streams of people that meet in the middle of the floor, and the robot's task among them.

    Attributes:
        suite: Its name.
        batch: Of the recordings.
        turn: From the direction of the first, east, to that of the second, rad.
        every: From one person of a stream to the next on average, s.
        width: Of a stream, m.
        speed: Preferred by people, mean and standard deviation, m/s; drawn normal, cut at two of these.
        start: Of the robot: x, y [m], theta [rad].
        goal: x, y [m].
        set_speed: m/s, unless the run says otherwise.
    """

    suite: str
    batch: str
    turn: float
    every: float
    width: float
    speed: tuple[float, float]
    start: tuple[float, float, float]
    goal: tuple[float, float]
    set_speed: float


CROSSING = Streams("replayed", "made", 0.5 * math.pi, 3.4, 3.0, (1.34, 0.26), (-5.0, 0.0, 0.0), (5.0, 0.0), 0.6)
"""As in the recording that comes with Clearway, speeds as in Weidmann 1993."""
COUNTERFLOW = Streams(
    "replayed-held-out", "counterflow", math.pi, 2.2, 5.0, (1.0, 0.2), (0.0, -5.5, 1.5708), (0.0, 5.5), 0.8
)
"""Two streams towards each other, wider, denser and slower, which the robot crosses, faster."""


def draw(streams: Streams, seed: int, family: str = "held out") -> Replay:
    """The recording that `seed` gives; `family` names recordings of their own for the same seeds."""
    key = stream(seed, f"{streams.suite} {family}")
    each = math.ceil(SECONDS / streams.every)
    begin, ends, speed = np.empty(2 * each), np.empty((2 * each, 2, 2)), np.empty(2 * each)
    mean, spread = streams.speed
    for k, (east, i) in enumerate(itertools.product((True, False), range(each))):
        u = [uniform(key, k, j) for j in range(3)]
        begin[k] = streams.every * (i + 0.5 * u[0])  # never two at once at one place
        across = [streams.width * (v - 0.5) for v in u[1:]]
        c, s = (1.0, 0.0) if east else (math.cos(streams.turn), math.sin(streams.turn))
        ends[k] = [(c * x - s * y, s * x + c * y) for x, y in zip((-FROM, FROM), across, strict=True)]
        speed[k] = mean + spread * next(z for j in itertools.count(3) if abs(z := normal(key, k, j)) <= 2.0)
    every = round(EVERY / _STEP)
    places = _walk(begin, ends, speed, math.ceil(SECONDS / EVERY), every, walls_of([]))
    walks = [_seen(f"{k + 1}", places[:, k]) for k in range(2 * each)]
    return Replay(f"{streams.suite}, {seed}", tuple(w for w in walks if len(w.track) > 1), streams.start, streams.goal)


def _seen(name: str, places: FloatArray) -> Walk:
    """What the camera sees of a person who is at `places` (n, 2) [m] at the samples, NaN where it isn't there."""
    within = np.flatnonzero((np.abs(places) <= SIDE).all(axis=1))
    samples = range(within[0], within[-1] + 1) if len(within) else ()
    at = np.round(places, 2)
    return Walk(name, tuple((round(k * EVERY, 1), float(at[k, 0]), float(at[k, 1])) for k in samples))


@kernel
def _walk(begin: FloatArray, ends: FloatArray, speed: FloatArray, samples: int, every: int, walls: Walls) -> FloatArray:
    """(samples, n, 2) where people are every so many steps, m; NaN before they come and once they are across.

    Args:
        begin: (n,) when each comes, s.
        ends: (n, 2, 2) from where to where each walks, m.
        speed: (n,) at which each would walk alone, m/s.
        samples: How many samples.
        every: How many steps lie between two of these.
        walls: None.
    """
    n = len(begin)
    found = np.full((samples, n, 2), np.nan)
    bodies = Bodies(np.empty((n, 2)), np.zeros((n, 2)), np.full(n, RADIUS), np.ones(n, np.int64), np.full(n, 0.5))
    wishes = Wishes(np.arange(n), np.zeros((n, 2)), FASTER * speed, np.ones(n, np.int64))
    alone, there, gone = np.full(n, -1), np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    for i in range(n):
        bodies.position[i] = _FAR + _APART * i
    for step in range(samples * every):
        for i in range(n):
            if not there[i] and not gone[i] and begin[i] <= step * _STEP:
                there[i] = True
                bodies.position[i] = ends[i, 0]
            if there[i]:
                ways = ends[i, 1] - bodies.position[i]
                along = ends[i, 1] - ends[i, 0]
                left = ways[0] * along[0] + ways[1] * along[1]
                length = math.sqrt(ways[0] * ways[0] + ways[1] * ways[1])
                if left <= 0.0 or length < RADIUS:
                    there[i], gone[i] = False, True
                    bodies.position[i] = _FAR + _APART * i
                    bodies.velocity[i] = 0.0
                    wishes.velocity[i] = 0.0
                else:
                    wishes.velocity[i] = ways * (speed[i] / length)
        if step % every == 0:
            for i in range(n):
                if there[i]:
                    found[step // every, i] = bodies.position[i]
        bodies.velocity[:] = social_force.velocities(bodies, wishes, alone, social_force.MOUSSAID, walls, _STEP)
        for i in range(n):
            if there[i]:
                bodies.position[i] += bodies.velocity[i] * _STEP
    return found
