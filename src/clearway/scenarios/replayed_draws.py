"""Draws recordings of people who were never there: the generator behind the suites `replayed` and `replayed-held-out`.

Two streams of people cross an open floor, each from its own side to the opposite one, by Clearway's social force, and are kept as an
overhead camera over a square would see them. When each comes, where it wants to and how fast are drawn from a stream keyed by (suite,
seed), so that a seed gives the same recording for ever. Recordings that nobody could get through are refused: a clairvoyant disc as large as
TIAGo has to find a way at the set speed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from clearway.clairvoyant.extremals import fastest
from clearway.clairvoyant.moving_discs import clear
from clearway.clairvoyant.space_time import scene_of
from clearway.crowds import social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.walls import Walls, walls_of
from clearway.errors import ClearwayError
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.geometry.streams import normal, stream, uniform
from clearway.robots import load_robot
from clearway.scenarios.replay import Replay, Walk

SECONDS = 110.0
"""How long people come, s."""
BEGIN = 20.0
"""When the robot is to start, s: the first have crossed by then."""
STAYS_FREE = 0.1
"""Gap between a person and the robot at its start below which it would have to wait, m."""
SOLVED = 30.0
"""So long a clairvoyant may take, s; the straight way takes 14 to 17 s, and the robot has more than 70 s."""
FROM, SIDE = 7.5, 6.5
"""How far from the middle people come in and go, and half the edge of what the camera sees, m."""
EVERY = 0.4
"""Time from a sample to the next, s."""
RADIUS = 0.25
"""Of a person, m."""
FASTER = 1.3
"""The most that a person hurries, of the preferred speed (Helbing, Molnár 1995)."""
_STEP = 0.05
_DRAWS = 1000
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


def draw(streams: Streams, seed: int) -> Replay:
    """The recording that `seed` gives: the first draw that can be got through.

    Raises:
        ClearwayError: none of very many can.
    """
    draws = (one_draw(streams, seed, "held out", attempt) for attempt in range(_DRAWS))
    found = next((replay for replay in draws if solvable(streams, replay)), None)
    if found is None:
        raise ClearwayError(f"{streams.suite}, seed {seed}: none of {_DRAWS} draws is solvable", field="seeds")
    return found


def one_draw(streams: Streams, seed: int, family: str, attempt: int = 0) -> Replay:
    """A recording, good or bad; `family` names recordings of their own for the same seeds."""
    key = stream(seed, f"{streams.suite} {family}")
    each = math.ceil(SECONDS / streams.every)
    begin, ends, speed = np.empty(2 * each), np.empty((2 * each, 2, 2)), np.empty(2 * each)
    mean, spread = streams.speed
    for k, (east, i) in enumerate(itertools.product((True, False), range(each))):
        own = 2 * each * attempt + k
        u = [uniform(key, own, j) for j in range(3)]
        begin[k] = streams.every * (i + 0.5 * u[0])  # never two at once at one place
        across = [streams.width * (v - 0.5) for v in u[1:]]
        c, s = (1.0, 0.0) if east else (math.cos(streams.turn), math.sin(streams.turn))
        ends[k] = [(c * x - s * y, s * x + c * y) for x, y in zip((-FROM, FROM), across, strict=True)]
        speed[k] = mean + spread * next(z for j in itertools.count(3) if abs(z := normal(key, own, j)) <= 2.0)
    every = round(EVERY / _STEP)
    places = _walk(begin, ends, speed, math.ceil(SECONDS / EVERY), every, walls_of([]))
    walks = (_seen(f"{k + 1}", places[:, k]) for k in range(2 * each))
    seen = tuple(walk for walk in walks if len(walk.track) > 1)
    return Replay(f"{streams.suite}, {seed}", seen, streams.start, streams.goal)


def solvable(streams: Streams, replay: Replay) -> bool:
    """Whether nobody is at the robot's start when it starts, and one who knows everybody's future gets to the goal from then on."""
    robot = load_robot("tiago")
    apart, t = RADIUS + circumscribed_radius(robot.shape), np.arange(0.0, SOLVED, _STEP)
    tracks = [np.array(walk.track) for walk in replay.walks]
    at = np.array([[np.interp(BEGIN + t, w[:, 0], w[:, k], math.nan, math.nan) for k in (1, 2)] for w in tracks])
    start, moving = np.array(streams.start[:2]), np.ascontiguousarray(at.transpose(2, 0, 1))
    if (np.hypot(*(moving[0] - start).T) < apart + STAYS_FREE).any():
        return False
    scene = scene_of(
        np.array(streams.goal), robot.tolerances.xy, streams.set_speed, np.zeros((0, 3)), moving,
        np.full(len(tracks), apart), _STEP, None,
    )  # fmt: skip
    way = fastest(scene, start, 0.0, SOLVED)
    return way is not None and clear(scene, way)


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
