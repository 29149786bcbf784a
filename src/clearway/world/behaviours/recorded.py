"""People who walk as they were recorded, and give way to a robot that they see."""

from __future__ import annotations

import math

import numpy as np

from clearway.crowds import social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.walls import walls_of
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import ABSENT, PERIOD, STEPPING, Cast, Scene
from clearway.world.behaviours.keeping_off import BESIDE
from clearway.world.behaviours.surroundings import seen, step_of
from clearway.world.behaviours.walkers import FASTER

CATCH_UP = 1.0
"""Who has given way wants to be back on the recorded way in this time, s."""
BACK = 0.02
"""Who is so near to where it was recorded, m, and not pushed, is there."""
PUSHED = 0.05
"""A push below this is none, m/s^2."""
_NOWHERE = walls_of([])


class Recorded:
    """People on recorded ways, there from the first instant of theirs to the last. Who sees robots is pushed off the way by
    their social force, and comes back to it, and keeps off others and what stands meanwhile; who is on the way doesn't look for these: they
    were minded when it was recorded. Who doesn't see robots walks blindly.

    Args:
        cast: Who they are.
    """

    def __init__(self, cast: Cast) -> None:
        self.members, self._cast = cast.members, cast
        self._tracks = [np.array(person.track, dtype=np.float64) for person in cast.people]
        self.speed = np.array([FASTER * _fastest(track) for track in self._tracks])
        self._at = np.full((len(cast.people), 3), np.nan)
        self._velocity = np.zeros((len(cast.people), 2))

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """Their clocks are the trial's; they mind no legs."""
        if t > 0.0:
            return None
        for k, track in enumerate(self._tracks):
            self._at[k] = _pose(track, 0.0)
        return self._at.copy()

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Walk on from `t` to `until` [s]."""
        for k, (person, track) in enumerate(zip(self._cast.people, self._tracks, strict=True)):
            before, self._at[k] = self._at[k].copy(), _pose(track, until)
            if person.sees_robots and math.isfinite(before[0]) and math.isfinite(self._at[k, 0]):
                self._give_way(k, before, t, until, scene)
            self._velocity[k] = np.nan_to_num((self._at[k, :2] - before[:2]) / (until - t))
        return self._at.copy()

    def _give_way(self, k: int, at: FloatArray, t: float, until: float, scene: Scene) -> None:
        """Have person `k`, who is at `at` (3,), go where robots push it, as long as they do and until it is back on its way."""
        planned, track, v_max = self._at[k], self._tracks[k], float(self.speed[k])
        bodies = self._bodies(k, at, t, scene)
        ahead = min(until + CATCH_UP, float(track[-1, 0]))
        wish = (_pose(track, ahead)[:2] - at[:2]) / max(ahead - t, until - t)
        wishes = Wishes(np.zeros(1, np.int64), wish[None], self.speed[k : k + 1], np.ones(1, np.int64))
        alone = np.full(len(bodies.radius), -1, np.int64)
        push = social_force.forces(bodies, wishes, alone, social_force.MOUSSAID, _NOWHERE)[0]
        if math.hypot(*push) < PUSHED and math.dist(_pose(track, t)[:2], at[:2]) < BACK:
            step = planned[:2] - at[:2]
            planned[:2] = at[:2] + step * min(v_max * (until - t) / max(math.hypot(*step), 1e-9), 1.0)
            return
        chosen = social_force.velocities(bodies, wishes, alone, social_force.MOUSSAID, _NOWHERE, PERIOD)[0]
        planned[:] = at
        step_of(self._cast, k, planned, chosen, v_max, t, scene)
        if math.hypot(*wish) > STEPPING:
            planned[2] = math.atan2(wish[1], wish[0])

    def _bodies(self, k: int, at: FloatArray, t: float, scene: Scene) -> Bodies:
        """Person `k` at `at` (3,), and the robots as it sees them at time `t` [s]."""
        person = self._cast.people[k]
        robots = [seen(robot, t, person.reaction) for robot in scene.robots]
        position, velocity = (
            np.array([at[:2], *(p for p, _ in robots)]),
            np.array([self._velocity[k], *(v for _, v in robots)]),
        )
        radius = np.array([person.radius, *(float(robot.shape.reach[0]) + BESIDE for robot in scene.robots)])
        n = len(radius)
        return Bodies(position, velocity, radius, np.ones(n, np.int64), np.ones(n))


def _pose(track: FloatArray, t: float) -> FloatArray:
    """(3,) where the track (n, 3) of t [s], x, y [m] has its person at time `t` [s], NaN before it begins and after it ends;
    it faces where it goes."""
    if not track[0, 0] <= t <= track[-1, 0]:
        return ABSENT
    k = min(int(np.searchsorted(track[:, 0], t, side="right")), len(track) - 1)
    (t0, x0, y0), (t1, x1, y1) = track[k - 1].tolist(), track[k].tolist()
    share = (t - t0) / (t1 - t0)
    return np.array([x0 + share * (x1 - x0), y0 + share * (y1 - y0), math.atan2(y1 - y0, x1 - x0)])


def _fastest(track: FloatArray) -> float:
    step = np.diff(track, axis=0)
    return float((np.hypot(step[:, 1], step[:, 2]) / step[:, 0]).max())
