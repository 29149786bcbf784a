"""The suite `replayed`: a robot is sent from A to B through people who were recorded, at several times of the recording.

They walk as they were recorded, blindly: they don't see the robot, so that its effect on them is zero by construction. A
recording of nothing but people comes with it; `Selection.replay` holds a user's own, which somebody else has read.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from functools import cache, partial
from importlib import resources

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.reading.limits import PEOPLE
from clearway.robots import Robot
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.replay import MOST_TIMES, Replay, Walk
from clearway.scenarios.scenario import LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import Selection, Suite, refuse_speeds, scenario_seed

SPEED = 0.6
"""Set speed unless the run says otherwise, m/s."""
TIMES = 10
"""At so many times of the recording the robot starts, if nobody says when."""
RADIUS = 0.25
"""Of a person, m."""
STAYS_FREE = 0.1
"""Gap between a person and the robot at its start below which it waits, m."""
WAIT = 0.2
"""After which it looks again, s."""
PATIENCE, LEAST = 3.0, 30.0
"""Time for the leg: so many times what the straight way takes at the set speed, and s more."""
REACH = 10.0
"""Start and goal lie no further from where people walk, m: else the coordinates are of another frame."""
EDGES = (25, 50, 100)
"""Half the edges of the open floors that a recording may be on, m."""
MADE = Replay("crossing.csv", (), (-5.0, 0.0, 0.0), (5.0, 0.0))
"""The task in the recording that comes with Clearway, less who walks there."""


@cache
def made() -> Replay:
    """The recording that comes with Clearway: two streams of people who cross, made by its own social force."""
    text = (resources.files("clearway.scenarios") / "replayed_people" / MADE.source).read_text("utf-8")
    tracks: dict[str, list[tuple[float, float, float]]] = {}
    for row in csv.DictReader(text.splitlines()):
        tracks.setdefault(row["id"], []).append((float(row["t"]), float(row["x"]), float(row["y"])))
    return Replay(MADE.source, tuple(Walk(n, tuple(t)) for n, t in tracks.items()), MADE.start, MADE.goal)


def floor(edge: int) -> FloorPlan:
    """An open floor around the recording's origin: what stood there, no recording of people says."""
    bounds = (-float(edge), -float(edge), float(edge), float(edge))
    return FloorPlan(f"open-{edge}", f"Open floor, {2 * edge} m square", (), None, None, None, None, bounds)


def build(robot: Robot, selection: Selection, seed: int) -> list[Scenario]:
    """One scenario for each time (and speed, and repetition) at which the robot starts.

    Raises:
        ClearwayError: start or goal lie far from everybody, somebody stands at the start, or the floor is too small.
    """
    replay = selection.replay or made()
    plan = selection.floor_plan or f"open-{_edge(replay)}"
    refuse_speeds(selection.speeds, robot)
    found = []
    for speed in selection.speeds or (min(SPEED, robot.drive.v_max),):
        for k, t in enumerate(_starts(robot, replay, speed), start=1):
            for repetition in range(1, (selection.repetitions or 1) + 1):
                found.append(_scenario(replay, plan, speed, k, t, repetition, seed, own=selection.replay is not None))
    return found


def _scenario(
    replay: Replay, plan: str, speed: float, k: int, t: float, repetition: int, seed: int, *, own: bool
) -> Scenario:
    name = f"replayed-time-{k}-v{speed:g}-r{repetition}"
    x, y, *heading = replay.goal
    limit = LEAST + PATIENCE * math.dist(replay.start[:2], (x, y)) / speed
    leg = LegSpec(
        name="there",
        goal=(x, y, heading[0] if heading else 0.0),
        yaw_tolerance=None if heading else math.inf,
        time_limit=limit,
    )
    people = tuple(_people(replay, t, t + limit))
    if len(people) > PEOPLE:
        raise ClearwayError(
            f"{len(people)} people walk there within {limit:.0f} s; at most {PEOPLE} do", file=replay.source
        )
    return Scenario(
        name=name,
        floor_plan=plan,
        start=replay.start,
        legs=(leg,),
        speed=speed,
        people=people,
        labels=LabelSpec(batch="own" if own else "made", configuration=f"time-{k}", repetition=repetition),
        localisation="truth",
        seed=scenario_seed(seed, name),
    )


def _people(replay: Replay, begin: float, end: float) -> Iterator[PersonSpec]:
    """Who walks there from `begin` to `end` [s], with times from `begin` on."""
    for walk in replay.walks:
        times = np.array([sample[0] for sample in walk.track])
        first = max(int(np.searchsorted(times, begin, side="right")) - 1, 0)
        track = walk.track[first : int(np.searchsorted(times, end, side="left")) + 1]
        if len(track) < 2 or times[-1] <= begin or times[0] >= end:
            continue
        moved = tuple((t - begin, x, y) for t, x, y in track)
        yield PersonSpec(
            name=f"person {walk.name}",
            start=moved[0][1:],
            radius=RADIUS,
            behaviour="recorded",
            track=moved,
            sees_robots=False,
        )


def _starts(robot: Robot, replay: Replay, speed: float) -> list[float]:
    """When the robot starts, s on the recording's clock.

    Raises:
        ClearwayError: at a time that was asked for somebody stands there, or nobody walks any more; or it is never free.
    """
    first, last = min(w.track[0][0] for w in replay.walks), max(w.track[-1][0] for w in replay.walks)
    for t in replay.times:
        if not first <= t <= last:
            raise ClearwayError(f"nobody walks at {t:g} s; people do from {first:g} to {last:g} s", field="at")
        if near := _at_the_start(robot, replay, t):
            raise ClearwayError(f"person {near!r} is where {robot.name!r} is to start at {t:g} s", field="at")
    if replay.times:
        return list(replay.times)
    takes = math.dist(replay.start[:2], replay.goal[:2]) / speed
    span = max(last - first - takes, 0.5 * (last - first))
    return [_free(robot, replay, first + span * k / TIMES, last) for k in range(TIMES)]


def _free(robot: Robot, replay: Replay, t: float, last: float) -> float:
    """The first time from `t` [s] on at which nobody stands at the start."""
    near = None
    for k in range(max(1, math.ceil((last - t) / WAIT))):
        if (near := _at_the_start(robot, replay, t + k * WAIT)) is None:
            return t + k * WAIT
    x, y, _ = replay.start
    raise ClearwayError(
        f"({x:g}, {y:g}) is where people stand from {t:g} s on, person {near!r} last: {robot.name!r} finds no room",
        field="start",
    )


def _at_the_start(robot: Robot, replay: Replay, t: float) -> str | None:
    """Who is at the robot's start at time `t` [s], if anybody is."""
    room = circumscribed_radius(robot.shape) + RADIUS + STAYS_FREE
    for walk in replay.walks:
        if walk.track[0][0] <= t <= walk.track[-1][0]:
            times, x, y = np.array(walk.track).T
            if math.dist((np.interp(t, times, x), np.interp(t, times, y)), replay.start[:2]) < room:
                return walk.name
    return None


def _edge(replay: Replay) -> int:
    """Half the edge of the smallest floor that holds everybody, the start and the goal.

    Raises:
        ClearwayError: start or goal lie far from everybody, or no floor is large enough.
    """
    places = _places(replay)
    low, high = places.min(axis=0), places.max(axis=0)
    where = f"x {low[0]:g} to {high[0]:g} m, y {low[1]:g} to {high[1]:g} m"
    if (reach := float(np.abs(places).max())) > EDGES[-1]:
        raise ClearwayError(
            f"people walk up to {reach:.0f} m from the origin ({where}), at most {EDGES[-1]} m are; is it in metres?",
            file=replay.source,
        )
    for field, place in (("start", replay.start), ("goal", replay.goal)):
        far = float(np.hypot(*np.maximum(np.maximum(low - place[:2], place[:2] - high), 0.0)))
        if far > REACH:
            raise ClearwayError(
                f"({place[0]:g}, {place[1]:g}) is {far:.0f} m from where anybody walks ({where}); at most {REACH:g} m are",
                field=field,
            )
    ends = np.abs([*replay.start[:2], *replay.goal[:2]])
    needed = max(reach, float(ends.max())) + 2.0
    return next((edge for edge in EDGES if edge >= needed), EDGES[-1])


def _places(replay: Replay) -> FloatArray:
    """(n, 2) where people were, m."""
    return np.concatenate([np.array(walk.track)[:, 1:] for walk in replay.walks])


REPLAYED = Suite(
    name="replayed",
    title="A robot among recorded people",
    description="a robot goes from A to B through people who walk as they were recorded and do not see it",
    batches=("made", "own"),
    configurations=tuple(f"time-{k + 1}" for k in range(MOST_TIMES)),
    make=build,
    robots=("tiago",),
    source="Among recorded people a robot goes from A to B while they walk as they were recorded, as many have done with the ETH and UCY sets: they do"
    " not see it, so its effect on them is zero by construction, and what is asked is whether it gets through.",
    replays=True,
    floor_plans={f"open-{edge}": partial(floor, edge) for edge in EDGES},
)
