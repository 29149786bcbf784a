"""People as CrowdNav moves them, so that its test cases come out as they do there.

Chen, Liu, Kreiss, Alahi 2019 ("Crowd-robot interaction: crowd-aware robot navigation with attention-based deep reinforcement
learning"), by the code that they published. It differs from the behaviour `orca` in that nobody is like a person: all decide at once
and seldom, want straight to their goals and never stray, see everything as it is now, and take a robot for one of their kind.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds import orca
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.walls import Walls
from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.shapes import FloatArray
from clearway.world.arrivals import walked
from clearway.world.behaviours.behaviour import PERIOD, STEPPING, Cast, CompiledBehaviour, Street
from clearway.world.behaviours.walkers import course_of, glance, present
from clearway.world.behaviours.wishes import speed_of
from clearway.world.laid import RobotTracks, lay
from clearway.world.tracks import ROOM, place_twice

DECIDES_EVERY = 0.25
"""Time from a decision to the next, s; in between everybody walks straight on."""
KEPT = 0.01
"""By so much each takes itself and all others for larger, m."""
SLOWING = 1.0
"""Who is nearer to its goal than the way of this time slows down so as to be there no sooner, s."""
_SAME = 1e-9  # s


class Crowd(NamedTuple):
    """k people who walk so.

    Attributes:
        who: (k,) int64, which of the moving bodies they are.
        at: (k, 3) where they are: x, y [m], theta [rad].
        velocity: (k, 2) as they chose it last, m/s.
        goal: (k, 2) where they want to, m.
        v_max: (k,) at which they walk, m/s.
        sees: (k,) int64, the layers that each looks at: 1 people, 2 robots.
        care: How far they look.
        radius: (m,) of the moving bodies, as they take them, m.
        walls: What stands.
        next: (1,) when they decide next, s.
    """

    who: npt.NDArray[np.int64]
    at: FloatArray
    velocity: FloatArray
    goal: FloatArray
    v_max: FloatArray
    sees: npt.NDArray[np.int64]
    care: orca.Care
    radius: FloatArray
    walls: Walls
    next: FloatArray


@kernel
def hold_crowd(crowd: Crowd) -> Held[Crowd]:
    """`crowd`, as `walk_until` takes it."""
    return Held(crowd)


class CrowdNav(CompiledBehaviour):
    """A crowd that walks by ORCA as CrowdNav runs it: ten neighbours within 10 m, 5 s ahead, half of the avoiding.

    Args:
        cast: Who they are, and where.

    Attributes:
        members: As `Behaviour` has it.
        speed: The same.
        crowd: As `CompiledBehaviour` has it.
    """

    def __init__(self, cast: Cast) -> None:
        people, k = cast.people, len(cast.people)
        self.members, self.speed = cast.members, np.array([speed_of(person, cast.seed) for person in people])
        self._at = np.array([(*person.start, course_of(person)) for person in people], np.float64)
        self.crowd = hold_crowd(
            Crowd(
                who=np.array(cast.members, np.int64),
                at=self._at,
                velocity=np.zeros((k, 2)),
                goal=np.array([person.route[0].at if person.route else person.start for person in people], np.float64),
                v_max=self.speed,
                sees=np.array([3 if person.sees_robots else 1 for person in people], np.int64),
                care=orca.Care(np.full(k, 10.0), np.full(k, 10, np.int64), np.full(k, 5.0), np.full(k, 5.0)),
                radius=cast.radius + KEPT,
                walls=cast.walls,
                next=np.zeros(1),
            )
        )

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They appear at time 0, and mind no legs."""
        return self._at.copy() if t == 0.0 else None


@kernel
def walk_until(
    held: Held[Crowd], street: Held[Street], leg: int, count: int, t: float, looked: bool
) -> tuple[int, bool]:
    """`among.walk_until`; in between decisions everybody walks on."""
    tracks, since, _, there, robots, watched = street.value
    crowd = held.value
    at = crowd.at
    while count * PERIOD <= t:
        now, until = count * PERIOD, (count + 1) * PERIOD
        place_twice(tracks, leg, since, now, now - PERIOD, there)
        if not looked and walked(now, there[0], watched):
            return count, True
        looked = False
        if now >= crowd.next[0] - _SAME:
            crowd.next[0] += DECIDES_EVERY
            decide(crowd, there, robots, now)
        for k in range(len(at)):
            for c in range(2):
                at[k, c] += (until - now) * crowd.velocity[k, c]
        lay(tracks.knots, tracks.rows, crowd.who, until, at, ROOM)
        count += 1
    return count, False


@kernel
def decide(crowd: Crowd, there: FloatArray, robots: RobotTracks, t: float) -> None:
    """Everybody chooses a velocity at time `t` [s].

    Args:
        crowd: Who they are; updated.
        there: (2, n, 3) poses of the moving bodies now and a `PERIOD` ago, NaN where one is absent.
        robots: The robots.
    """
    at, wanted = crowd.at, np.empty((len(crowd.at), 2))
    for k in range(len(at)):
        x, y = crowd.goal[k, 0] - at[k, 0], crowd.goal[k, 1] - at[k, 1]
        share = min(crowd.v_max[k] / max(math.hypot(x, y), 1e-12), 1.0 / SLOWING)
        wanted[k, 0], wanted[k, 1] = share * x, share * y
    wishes = Wishes(crowd.who, wanted, crowd.v_max, crowd.sees)
    n = len(crowd.radius) + present(robots)
    bodies = Bodies(np.empty((n, 2)), np.zeros((n, 2)), np.empty(n), np.ones(n, np.int64), np.full(n, 0.5))
    everybody(crowd, there, robots, t, np.empty((2, 3)), bodies)
    crowd.velocity[:] = orca.velocities(bodies, wishes, crowd.care, crowd.walls, DECIDES_EVERY)
    for k in range(len(at)):
        v_x, v_y = crowd.velocity[k]
        if math.hypot(v_x, v_y) > STEPPING:
            at[k, 2] = math.atan2(v_y, v_x)


@light
def everybody(
    crowd: Crowd, there: FloatArray, robots: RobotTracks, t: float, poses: FloatArray, out: Bodies
) -> None:  # fmt: skip
    """Write everything that moves at time `t` [s], as they see it, to `out`; robots are behind the others, in a layer of their own.
    `poses` (2, 3) is room to work with."""
    m = len(crowd.radius)
    for i in range(m):
        there_now = math.isfinite(there[0, i, 0])
        for c in range(2):
            out.position[i, c] = there[0, i, c] if there_now else 1e6
            moved = (there[0, i, c] - there[1, i, c]) / PERIOD
            out.velocity[i, c] = moved if math.isfinite(moved) else 0.0
        out.radius[i] = crowd.radius[i]
    for k in range(len(crowd.who)):
        out.velocity[crowd.who[k], 0], out.velocity[crowd.who[k], 1] = crowd.velocity[k, 0], crowd.velocity[k, 1]
    j = m
    for r in range(len(robots.laid)):
        if robots.laid[r] > 0:
            glance(robots.knots[r], robots.laid[r], t, 0.0, poses, out.position[j], out.velocity[j])
            out.radius[j], out.layer[j] = robots.reach[r] + KEPT, 2
            j += 1
