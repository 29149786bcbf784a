"""People who walk along routes and keep out of each other's way by one rule.

All of a crowd decide at once, each by what it sees: the others where they are, robots where they were a reaction time ago, on as
they drove then. Ways round what stands come from the floor; the rule keeps the shoulders off it. All of it is compiled, for as many
decisions in a row as there are until a robot asks where everybody is.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds import headed_social_force, orca, social_force
from clearway.crowds.bodies import Bodies, Wishes
from clearway.crowds.headed_social_force import FARINA, Facing
from clearway.crowds.walls import Walls
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.packing import transform
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.people import PersonSpec
from clearway.world.arrivals import walked
from clearway.world.behaviours.behaviour import GLANCE, PERIOD, STEPPING, Cast, CompiledBehaviour, Street, Things
from clearway.world.behaviours.keeping_off import BESIDE, FAR, Around, Walker, keep_off
from clearway.world.behaviours.routes import OnRoute, Routes, go_on, wish
from clearway.world.behaviours.wishes import speed_of
from clearway.world.laid import RobotTracks, bound_for, lay
from clearway.world.tracks import ROOM, place_twice, pose_at

FASTER = 1.3
"""The most that a person hurries, of the preferred speed (Helbing, Molnár 1995)."""
TURNING = 4.0
"""The most that a person turns, rad/s."""


class Rule(IntEnum):
    """By which a crowd walks."""

    ORCA = 0
    SOCIAL_FORCE = 1
    HEADED_SOCIAL_FORCE = 2


class Crowd(NamedTuple):
    """k people who walk by one rule.

    Attributes:
        rule: By which, a `Rule`.
        every: At every so many instants they decide.
        who: (k,) int64, which of the moving bodies they are.
        at: (k, 3) their poses.
        velocity: (k, 2) at which they walk, m/s.
        turn_rate: (k,) at which they turn, rad/s, where the rule says so.
        v_max: (k,) the most that each walks at, m/s.
        sees: (k,) int64, the layers that each looks at.
        route: Where they are on their routes.
        reactions: (q,) the reaction times of those who see robots, each once, s.
        care: How far they look, by ORCA.
        group: (m,) int64, to which group each moving body belongs; negative: to none.
        radius: (m,) of the moving bodies, m.
        things: Those of them that are no people.
        walls: What stands.
    """

    rule: int
    every: int
    who: npt.NDArray[np.int64]
    at: FloatArray
    velocity: FloatArray
    turn_rate: FloatArray
    v_max: FloatArray
    sees: npt.NDArray[np.int64]
    route: OnRoute
    reactions: FloatArray
    care: orca.Care
    group: npt.NDArray[np.int64]
    radius: FloatArray
    things: Things
    walls: Walls


@kernel
def hold_crowd(crowd: Crowd) -> Held[Crowd]:
    """`crowd`, as `walk_until` takes it."""
    return Held(crowd)


class Walkers(CompiledBehaviour):
    """A crowd that walks by one rule.

    Args:
        cast: Who they are, and where.
        rule: By which they walk.

    Attributes:
        members: As `Behaviour` has it.
        speed: The same.
        crowd: As `CompiledBehaviour` has it.
    """

    def __init__(self, cast: Cast, rule: Rule) -> None:
        people, k = cast.people, len(cast.people)
        preferred = np.array([speed_of(person, cast.seed) for person in people])
        self.members, self.speed = cast.members, FASTER * preferred
        self._routes = Routes(people, preferred, cast.room, cast.seed)
        self._at = np.array([(*person.start, course_of(person)) for person in people], np.float64)
        reactions = sorted({person.reaction for person in people if person.sees_robots})
        sees = [1 | (2 << reactions.index(p.reaction) if p.sees_robots else 0) for p in people]
        self.crowd = hold_crowd(
            Crowd(
                rule=int(rule),
                every=round(people[0].decides_every / PERIOD),
                who=np.array(cast.members, np.int64),
                at=self._at,
                velocity=np.zeros((k, 2)),
                turn_rate=np.zeros(k),
                v_max=self.speed,
                sees=np.array(sees, np.int64),
                route=self._routes.now,
                reactions=np.array(reactions, np.float64),
                # as CrowdNav sets it for people: ten neighbours within 10 m, 5 s ahead
                care=orca.Care(np.full(k, 10.0), np.full(k, 10, np.int64), np.full(k, 5.0), np.full(k, 1.0)),
                group=cast.group,
                radius=cast.radius,
                things=cast.things,
                walls=cast.walls,
            )
        )

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """They appear at time 0, and mind no legs."""
        return self._at.copy() if t == 0.0 else None

    def look_up(self) -> None:
        """Those ways that people are to take who have none yet."""
        self._routes.look_up()


@kernel
def walk_until(
    held: Held[Crowd], street: Held[Street], leg: int, count: int, t: float, looked: bool
) -> tuple[int, bool]:
    """`among.walk_until`."""
    tracks, since, decides_too, there, robots, watched = street.value
    crowd = held.value
    work = scratch(crowd, robots)
    while count * PERIOD <= t:
        now, until, decides = count * PERIOD, (count + crowd.every) * PERIOD, count % crowd.every == 0
        place_twice(tracks, leg, since, now, now - PERIOD, there)
        if not looked:
            full = walked(now, there[0], watched)
            if (decides and go_on(now, crowd.at, crowd.route)) or full:
                return count, True
        looked = False
        if decides:
            look_round(crowd, there, robots, now, work)
            bound_for(tracks, decides_too, now, work.around.bound, work.around.free)
            if crowd.rule == Rule.ORCA:
                heed(crowd, until - now, work)
            else:
                feel(crowd, until - now, work)
            lay(tracks.knots, tracks.rows, crowd.who, until, crowd.at, ROOM)
        count += 1
    return count, False


class Scratch(NamedTuple):
    """Room for what k people work with who see n bodies.

    Attributes:
        around: These, see `everybody`.
        wanted: Who decides, and what each wants.
        chosen: (k, 2) at which each walks, m/s.
        headings: (k,) where each looks, rad.
        poses: (2, 3) of somebody, m and rad.
        orca: For ORCA.
    """

    around: Around
    wanted: Wishes
    chosen: FloatArray
    headings: FloatArray
    poses: FloatArray
    orca: orca.Scratch


@kernel
def scratch(crowd: Crowd, robots: RobotTracks) -> Scratch:
    """Room to work with for `crowd` among `robots`."""
    k, m = len(crowd.who), len(crowd.radius)
    n = m + len(crowd.things.of) + len(crowd.reactions) * present(robots)
    bodies = Bodies(np.empty((n, 2)), np.empty((n, 2)), np.empty(n), np.ones(n, np.int64), np.ones(n))
    return Scratch(
        around=Around(
            bodies,
            np.empty((m, 3)),
            np.empty(m, np.bool_),
            np.zeros(n),
            crowd.route.room,
            crowd.walls,
            np.empty((2 * n, 3)),
        ),
        wanted=Wishes(crowd.who, np.empty((k, 2)), crowd.v_max, crowd.sees),
        chosen=np.empty((k, 2)),
        headings=np.empty(k),
        poses=np.empty((2, 3)),
        orca=orca.scratch(n, crowd.care, crowd.walls),
    )


@light
def look_round(crowd: Crowd, there: FloatArray, robots: RobotTracks, t: float, work: Scratch) -> None:
    """Everybody of a crowd takes note of what it wants and of who is there at time `t` [s].

    Args:
        crowd: Who they are.
        there: (2, n, 3) poses of the moving bodies now and a `PERIOD` ago, NaN where one is absent.
        robots: The robots.
        work: Where it is written down.
    """
    wish(t, crowd.at, crowd.velocity, crowd.route, work.wanted.velocity)
    everybody(crowd, there, robots, t, work.poses, work.around.bodies, work.around.age)
    for k in range(len(crowd.at)):
        work.headings[k] = crowd.at[k, 2]


@light
def heed(crowd: Crowd, dt: float, work: Scratch) -> None:
    """Take everybody of a crowd on for `dt` [s] by ORCA."""
    orca.choose(work.around.bodies, work.wanted, crowd.care, crowd.walls, crowd.every * PERIOD, work.orca, work.chosen)
    walk(crowd, work.wanted.velocity, work.chosen, work.headings, TURNING * dt, work.around, dt)


@kernel
def feel(crowd: Crowd, dt: float, work: Scratch) -> None:
    """Take everybody of a crowd on for `dt` [s] by social forces."""
    bodies, wanted, headings, turning = work.around.bodies, work.wanted, work.headings, TURNING * dt
    period = crowd.every * PERIOD
    group = np.full(len(bodies.radius), -1)
    group[: len(crowd.group)] = crowd.group
    for k in range(len(crowd.who)):
        if crowd.route.settles[k]:
            group[crowd.who[k]] = -1
    if crowd.rule == Rule.SOCIAL_FORCE:
        chosen = social_force.velocities(bodies, wanted, group, social_force.MOUSSAID, crowd.walls, period)
    else:
        chosen, facing = headed_social_force.velocities(
            bodies,
            wanted,
            Facing(headings, crowd.turn_rate),
            group,
            social_force.MOUSSAID,
            FARINA,
            crowd.walls,
            period,
        )
        headings, turning = facing.heading, -1.0
        crowd.turn_rate[:] = facing.turn_rate
    walk(crowd, wanted.velocity, chosen, headings, turning, work.around, dt)


@light
def everybody(
    crowd: Crowd, there: FloatArray, robots: RobotTracks, t: float, poses: FloatArray, out: Bodies, age: FloatArray
) -> None:  # fmt: skip
    """Write down everything that moves, as a crowd sees it at time `t` [s]: the moving bodies, of which things are far away, as their discs
    come next, then the robots, each once for each reaction time; nobody counts on a thing or a robot to step aside.

    Args:
        crowd: Who looks; these know how fast they are.
        there: (2, n, 3) poses of the moving bodies now and a `PERIOD` ago; one that is absent is far away.
        robots: The robots.
        poses: (2, 3) room to work with.
        out: What is written: n = m + d + q r bodies of the m that move, the d discs of things and the r robots `present`, all of layer 1 and
            share 1 before.
        age: (n,) how old what is seen of each is, s; of robots it is written.
    """
    m = len(crowd.radius)
    for i in range(m):
        there_now = math.isfinite(there[0, i, 0])
        for c in range(2):
            out.position[i, c] = there[0, i, c] if there_now else FAR
            moved = (there[0, i, c] - there[1, i, c]) / PERIOD
            out.velocity[i, c] = moved if math.isfinite(moved) else 0.0
        out.radius[i], out.share[i] = crowd.radius[i], 0.5
    for k in range(len(crowd.who)):
        out.velocity[crowd.who[k], 0], out.velocity[crowd.who[k], 1] = crowd.velocity[k, 0], crowd.velocity[k, 1]
    j = m
    for d in range(len(crowd.things.of)):
        i = crowd.things.of[d]
        out.position[i], out.velocity[i] = FAR, 0.0
        for k in range(2):
            transform(
                crowd.things.disc[d : d + 1, :2], there[k, i, 0], there[k, i, 1], there[k, i, 2], poses[k : k + 1, :2]
            )
        for c in range(2):
            out.position[j, c] = poses[0, c] if math.isfinite(poses[0, c]) else FAR
            moved = (poses[0, c] - poses[1, c]) / PERIOD
            out.velocity[j, c] = moved if math.isfinite(moved) else 0.0
        out.radius[j] = crowd.things.disc[d, 2] + BESIDE
        j += 1
    for k in range(len(crowd.reactions)):
        reaction = crowd.reactions[k]
        for r in range(len(robots.laid)):
            if robots.laid[r] > 0:
                glance(robots.knots[r], robots.laid[r], t - reaction, reaction, poses, out.position[j], out.velocity[j])
                out.radius[j], out.layer[j], age[j] = robots.reach[r] + BESIDE, 2 << k, reaction
                j += 1


@light
def present(robots: RobotTracks) -> int:
    """How many of the robots are there."""
    n = 0
    for r in range(len(robots.laid)):
        n += robots.laid[r] > 0
    return n


@light
def glance(
    knots: FloatArray, count: int, t: float, ahead: float, poses: FloatArray, position: FloatArray, velocity: FloatArray
) -> None:  # fmt: skip
    """Where something will be `ahead` [s] after time `t` [s], as it drives then, by the track `knots` (count, 4).

    Args:
        knots: As `Laid` has them.
        count: The same.
        t: When it is looked at, s.
        ahead: How long it is taken to drive on, s.
        poses: (2, 3) room to work with.
        position: (2,) m; written.
        velocity: (2,) m/s; written.
    """
    now, before, first, last = poses[0], poses[1], knots[0, 0], knots[count - 1, 0]
    pose_at(knots, 0, count, min(max(t, first), last), now)
    pose_at(knots, 0, count, min(max(t - GLANCE, first), last), before)
    for c in range(2):
        velocity[c] = (now[c] - before[c]) / GLANCE
        position[c] = now[c] + ahead * velocity[c]


@light
def walk(
    crowd: Crowd, wanted: FloatArray, chosen: FloatArray, headings: FloatArray, turning: float, around: Around, dt: float
) -> None:  # fmt: skip
    """Take each person a step further.

    Args:
        crowd: Who they are; where they are, and how fast, is updated.
        wanted: (k, 2) velocities at which they would walk alone, m/s.
        chosen: (k, 2) velocities by the rule, m/s; updated to those that are walked.
        headings: (k,) by the rule, rad.
        turning: The most that a person turns, rad, who faces where it wants to walk; negative: the rule says where it faces.
        around: What they keep off.
        dt: How long the step takes, s.
    """
    at, bodily = crowd.at, crowd.rule != Rule.ORCA  # ORCA presses nobody off
    for k in range(len(at)):
        keep_off(
            Walker(crowd.who[k], at[k, 0], at[k, 1], at[k, 2], crowd.sees[k], crowd.v_max[k]),
            chosen[k],
            bodily,
            around,
            dt,
        )
        at[k, 0], at[k, 1] = at[k, 0] + chosen[k, 0] * dt, at[k, 1] + chosen[k, 1] * dt
        crowd.velocity[k, 0], crowd.velocity[k, 1] = chosen[k, 0], chosen[k, 1]
        if turning < 0.0:
            at[k, 2] = headings[k]
        elif math.hypot(wanted[k, 0], wanted[k, 1]) > STEPPING:  # who makes room goes on looking there
            turn = wrap(math.atan2(wanted[k, 1], wanted[k, 0]) - at[k, 2])
            at[k, 2] = wrap(at[k, 2] + min(max(turn, -turning), turning))


def course_of(person: PersonSpec) -> float:
    """Where a person looks at first: to the first place of the route."""
    if not person.route:
        return 0.0
    (x, y), (gx, gy) = person.start, person.route[0].at
    return math.atan2(gy - y, gx - x)
