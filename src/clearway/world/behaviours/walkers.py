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
from clearway.crowds.social_force import QUANTUM, quanta
from clearway.crowds.walls import Walls
from clearway.crowds.ways import room_at
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.packing import transform
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.people import PersonSpec
from clearway.world.arrivals import walked
from clearway.world.behaviours.behaviour import GLANCE, PERIOD, STEPPING, Cast, CompiledBehaviour, Street, Things
from clearway.world.behaviours.routes import OnRoute, Routes, go_on, wish
from clearway.world.behaviours.wishes import speed_of
from clearway.world.laid import RobotTracks, lay
from clearway.world.tracks import place_twice, pose_at

FASTER = 1.3
"""The most that a person hurries, of the preferred speed (Helbing, Molnár 1995)."""
BESIDE = 0.3
"""A person leaves a robot so much room beyond its circumscribed disc where there is, and a thing beyond its discs, m: what people leave to
what stands on either side when they walk between (Hackney, Vallis, Cinelli 2013)."""
TOUCH = 0.07
"""Nearer than this nobody walks up to a robot's disc, m: who has less to either side, of a shoulder's width of 0.5 m, turns the shoulders
(Warren, Whang 1987)."""
IN_TIME = 0.5
"""Nobody nears a robot so fast that they would meet sooner, s (tau of Moussaïd, Helbing, Theraulaz 2011)."""
SLIM = 0.6
"""Nobody is moved nearer to what stands, or to somebody else, than this share of the radius of each: two who turn the shoulders, of 0.5 m,
brush past each other chest to chest, 0.3 m from middle to middle."""
PRESSING = 62.5
"""Acceleration of two who touch, for each metre that their discs overlap, 1/s^2 (Moussaïd, Helbing, Theraulaz 2011: 5000 kg/s^2, and 80 kg
for a radius of 0.25 m)."""
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
    tracks, since, there, robots, watched = street.value
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
            if crowd.rule == Rule.ORCA:
                heed(crowd, until - now, work)
            else:
                feel(crowd, until - now, work)
            lay(tracks.knots, tracks.rows, crowd.who, until, crowd.at)
        count += 1
    return count, False


class Scratch(NamedTuple):
    """Room for what k people work with who see n bodies.

    Attributes:
        bodies: These, see `everybody`.
        wanted: Who decides, and what each wants.
        chosen: (k, 2) at which each walks, m/s.
        headings: (k,) where each looks, rad.
        poses: (2, 3) of somebody, m and rad.
        orca: For ORCA.
    """

    bodies: Bodies
    wanted: Wishes
    chosen: FloatArray
    headings: FloatArray
    poses: FloatArray
    orca: orca.Scratch


@kernel
def scratch(crowd: Crowd, robots: RobotTracks) -> Scratch:
    """Room to work with for `crowd` among `robots`."""
    k, n = len(crowd.who), len(crowd.radius) + len(crowd.things.of) + len(crowd.reactions) * present(robots)
    return Scratch(
        bodies=Bodies(np.empty((n, 2)), np.empty((n, 2)), np.empty(n), np.ones(n, np.int64), np.ones(n)),
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
    everybody(crowd, there, robots, t, work.poses, work.bodies)
    for k in range(len(crowd.at)):
        work.headings[k] = crowd.at[k, 2]


@light
def heed(crowd: Crowd, dt: float, work: Scratch) -> None:
    """Take everybody of a crowd on for `dt` [s] by ORCA."""
    orca.choose(work.bodies, work.wanted, crowd.care, crowd.walls, crowd.every * PERIOD, work.orca, work.chosen)
    walk(crowd, work.wanted.velocity, work.chosen, work.headings, TURNING * dt, work.bodies, dt)


@kernel
def feel(crowd: Crowd, dt: float, work: Scratch) -> None:
    """Take everybody of a crowd on for `dt` [s] by social forces."""
    bodies, wanted, headings, turning = work.bodies, work.wanted, work.headings, TURNING * dt
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
    walk(crowd, wanted.velocity, chosen, headings, turning, bodies, dt)


@light
def everybody(
    crowd: Crowd, there: FloatArray, robots: RobotTracks, t: float, poses: FloatArray, out: Bodies
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
    """
    m = len(crowd.radius)
    for i in range(m):
        there_now = math.isfinite(there[0, i, 0])
        for c in range(2):
            out.position[i, c] = there[0, i, c] if there_now else 1e6
            moved = (there[0, i, c] - there[1, i, c]) / PERIOD
            out.velocity[i, c] = moved if math.isfinite(moved) else 0.0
        out.radius[i], out.share[i] = crowd.radius[i], 0.5
    for k in range(len(crowd.who)):
        out.velocity[crowd.who[k], 0], out.velocity[crowd.who[k], 1] = crowd.velocity[k, 0], crowd.velocity[k, 1]
    j = m
    for d in range(len(crowd.things.of)):
        i = crowd.things.of[d]
        out.position[i], out.velocity[i] = 1e6, 0.0
        for k in range(2):
            transform(
                crowd.things.disc[d : d + 1, :2], there[k, i, 0], there[k, i, 1], there[k, i, 2], poses[k : k + 1, :2]
            )
        for c in range(2):
            out.position[j, c] = poses[0, c] if math.isfinite(poses[0, c]) else 1e6
            moved = (poses[0, c] - poses[1, c]) / PERIOD
            out.velocity[j, c] = moved if math.isfinite(moved) else 0.0
        out.radius[j] = crowd.things.disc[d, 2] + BESIDE
        j += 1
    for k in range(len(crowd.reactions)):
        reaction = crowd.reactions[k]
        for r in range(len(robots.laid)):
            if robots.laid[r] > 0:
                glance(robots.knots[r], robots.laid[r], t - reaction, reaction, poses, out.position[j], out.velocity[j])
                out.radius[j], out.layer[j] = robots.reach[r] + BESIDE, 2 << k
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
    crowd: Crowd, wanted: FloatArray, chosen: FloatArray, headings: FloatArray, turning: float, bodies: Bodies, dt: float
) -> None:  # fmt: skip
    """Take each person a step further; never into what stands or into somebody, whatever pushes, nor up against a thing, or a robot that it
    sees.

    Args:
        crowd: Who they are; where they are, and how fast, is updated.
        wanted: (k, 2) velocities at which they would walk alone, m/s.
        chosen: (k, 2) velocities by the rule, m/s; updated to those that are walked.
        headings: (k,) by the rule, rad.
        turning: The most that a person turns, rad, who faces where it wants to walk; negative: the rule says where it faces.
        bodies: Everything that moves: people, things, robots.
        dt: How long the step takes, s.
    """
    at, room, radius = crowd.at, crowd.route.room, crowd.route.radius
    things = len(crowd.radius)
    first = things + len(crowd.things.of)
    robots = (len(bodies.radius) - first) // max(len(crowd.reactions), 1)
    bodily = crowd.rule != Rule.ORCA  # ORCA keeps bodies apart itself
    for k in range(len(at)):
        if bodily:
            press_off(crowd, k, chosen[k], bodies, dt)
        for j in range(things, len(bodies.radius)):
            if crowd.sees[k] & bodies.layer[j]:
                away = bodies.position[j, 0] - at[k, 0], bodies.position[j, 1] - at[k, 1]
                drives = bodies.velocity[j, 0], bodies.velocity[j, 1]
                apart = radius[k] + bodies.radius[j]
                reaction = crowd.reactions[(j - first) // robots] if j >= first else 0.0
                hold_off(chosen[k], at[k, 2], Sighting(away, drives, reaction, apart), dt, crowd.v_max[k])
        if bodily:
            stop_short(crowd, k, chosen[k], bodies, dt)
        x, y = at[k, 0] + chosen[k, 0] * dt, at[k, 1] + chosen[k, 1] * dt
        if room_at(room, x, y) < min(room_at(room, at[k, 0], at[k, 1]), SLIM * radius[k]):
            chosen[k, 0] = chosen[k, 1] = 0.0
            x, y = at[k, 0], at[k, 1]
        at[k, 0], at[k, 1] = x, y
        crowd.velocity[k, 0], crowd.velocity[k, 1] = chosen[k, 0], chosen[k, 1]
        if turning < 0.0:
            at[k, 2] = headings[k]
        elif math.hypot(wanted[k, 0], wanted[k, 1]) > STEPPING:  # who makes room goes on looking there
            turn = wrap(math.atan2(wanted[k, 1], wanted[k, 0]) - at[k, 2])
            at[k, 2] = wrap(at[k, 2] + min(max(turn, -turning), turning))


@light
def press_off(crowd: Crowd, k: int, velocity: FloatArray, bodies: Bodies, dt: float) -> None:
    """Have person `k` pressed off those whom it touches: forces know no bodies. In which order people are listed changes no bit.

    Args:
        crowd: Who they are.
        k: One of them.
        velocity: (2,) at which it would walk, m/s; updated.
        bodies: Everything that moves.
        dt: Until the next decision, s.
    """
    me, px, py = crowd.who[k], 0, 0
    for i in range(len(crowd.radius)):
        dx, dy, touching = (
            bodies.position[i, 0] - crowd.at[k, 0],
            bodies.position[i, 1] - crowd.at[k, 1],
            crowd.radius[i] + crowd.radius[me],
        )
        if i == me or max(abs(dx), abs(dy)) > touching or not crowd.sees[k] & bodies.layer[i]:
            continue
        distance = max(math.hypot(dx, dy), 1e-9)
        press = PRESSING * max(touching - distance, 0.0) * dt / distance
        px, py = px + quanta(press * dx), py + quanta(press * dy)
    velocity[0], velocity[1] = velocity[0] - px * QUANTUM, velocity[1] - py * QUANTUM
    faster = max(math.hypot(velocity[0], velocity[1]) / crowd.v_max[k], 1.0)
    velocity[0], velocity[1] = velocity[0] / faster, velocity[1] / faster


@light
def stop_short(crowd: Crowd, k: int, velocity: FloatArray, bodies: Bodies, dt: float) -> None:
    """Slow person `k` down so far that it takes no more than half of the room that is left to anybody in a step of `dt` [s].

    Args:
        crowd: Who they are.
        k: One of them.
        velocity: (2,) at which it would walk, m/s; updated.
        bodies: Everything that moves.
        dt: Until the next decision, s.
    """
    me, far, slower = crowd.who[k], 2.0 * crowd.v_max[k] * dt, 1.0
    for i in range(len(crowd.radius)):
        dx, dy, slim = (
            bodies.position[i, 0] - crowd.at[k, 0],
            bodies.position[i, 1] - crowd.at[k, 1],
            SLIM * (crowd.radius[i] + crowd.radius[me]),
        )
        if i == me or max(abs(dx), abs(dy)) > slim + far or not crowd.sees[k] & bodies.layer[i]:
            continue
        distance = max(math.hypot(dx, dy), 1e-9)
        onto, most = (velocity[0] * dx + velocity[1] * dy) / distance, max(0.5 * (distance - slim) / dt, 0.0)
        slower = min(slower, most / onto) if onto > most else slower
    velocity[0], velocity[1] = slower * velocity[0], slower * velocity[1]


class Sighting(NamedTuple):
    """A robot, or a disc of a thing, as somebody sees it.

    Attributes:
        to: (x, y) from the person to where it is by now if it has driven on, m.
        drives: (vx, vy) of it when it was seen, m/s.
        reaction: How long ago that was, s.
        apart: How far from middle to middle the person would leave it, m.
    """

    to: tuple[float, float]
    drives: tuple[float, float]
    reaction: float
    apart: float


@light
def hold_off(velocity: FloatArray, heading: float, robot: Sighting, dt: float, v_max: float) -> None:
    """Have somebody near a robot no faster than lets them meet `IN_TIME` from now, or at the next decision if that is later, wherever it has
    braked since it was seen; and make room for one that is before its eyes and comes on faster.

    Args:
        velocity: (2,) of the person, m/s; updated.
        heading: Where the person looks, rad.
        robot: What the person sees.
        dt: Until the next decision, s.
        v_max: The most that the person walks at, m/s.
    """
    to, drives, reaction, apart = robot
    wx, wy = reaction * drives[0], reaction * drives[1]
    back = min(max((to[0] * wx + to[1] * wy) / max(wx * wx + wy * wy, 1e-12), 0.0), 1.0)
    x, y = to[0] - back * wx, to[1] - back * wy
    in_time, meet = max(IN_TIME, dt), apart - BESIDE + TOUCH
    _near(velocity, x, y, max((math.hypot(x, y) - meet) / in_time, 0.0))
    away, onto = math.hypot(to[0], to[1]), drives[0] * to[0] + drives[1] * to[1]
    if onto < 0.0 and math.cos(heading) * to[0] + math.sin(heading) * to[1] > 0.0:
        _near(velocity, to[0], to[1], max((away - meet) / in_time + onto / max(away, 1e-9), -v_max))
        faster = max(math.hypot(velocity[0], velocity[1]) / v_max, 1.0)  # who steps back goes on sideways too
        velocity[0] /= faster
        velocity[1] /= faster


@light
def _near(velocity: FloatArray, x: float, y: float, most: float) -> None:
    """Take from the `velocity` (2,) what is more than `most` [m/s] towards (x, y)."""
    distance = max(math.hypot(x, y), 1e-9)
    excess = (velocity[0] * x + velocity[1] * y) / distance - most
    if excess > 0.0:
        velocity[0] -= excess * x / distance
        velocity[1] -= excess * y / distance


def course_of(person: PersonSpec) -> float:
    """Where a person looks at first: to the first place of the route."""
    if not person.route:
        return 0.0
    (x, y), (gx, gy) = person.start, person.route[0].at
    return math.atan2(gy - y, gx - x)
