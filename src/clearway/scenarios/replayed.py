"""The suites `replayed` and `replayed-held-out`: a robot is sent from A to B through people who were recorded.

They walk as they were recorded, blindly: they don't see the robot, so that its effect on them is zero by construction. A
recording of nothing but people comes with `replayed`, which is entered at several times; `Selection.replay` holds a user's own, which somebody
else has read. `Selection.seeds` draws others, see `replayed_draws`, one for each trial, or times of the user's own; the frozen ones of
`replayed-held-out` are drawn from numbers of their own.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator
from functools import cache, partial
from importlib import resources
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.reading.limits import PEOPLE
from clearway.robots import Robot
from clearway.scenarios import replayed_draws
from clearway.scenarios.people import PersonSpec
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.replay import MOST_TIMES, Replay, Walk
from clearway.scenarios.replayed_draws import BEGIN, COUNTERFLOW, CROSSING, RADIUS, STAYS_FREE, Streams
from clearway.scenarios.scenario import LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import (
    Generator,
    Selection,
    Suite,
    draw,
    draw_label,
    refuse_speeds,
    scenario_seed,
    selected_seeds,
)

TIMES = 10
"""At so many times of the recording the robot starts, if nobody says when."""
FROZEN = 20
"""Recordings of `replayed-held-out`."""
WAIT = 0.2
"""After which it looks again, s."""
PATIENCE, LEAST = 3.0, 30.0
"""Time for the leg: so many times what the straight way takes at the set speed, and s more."""
REACH = 10.0
"""Start and goal lie no further from where people walk, m: else the coordinates are of another frame."""
EDGES = (25, 50, 100)
"""Half the edges of the open floors that a recording may be on, m."""
OWN = "own"
"""The batch of somebody's own recording."""
MADE = Replay("crossing.csv", (), CROSSING.start, CROSSING.goal)
"""The task in the recording that comes with Clearway, less who walks there."""
_Draw = Callable[[Streams, int], Replay | None]


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


@cache
def _frozen(streams: Streams) -> tuple[Replay, ...]:
    """Recordings of which every one can be got through: a test says so, and nobody has to search for the ways again."""
    return tuple(replayed_draws.one_draw(streams, k, "frozen") for k in range(1, FROZEN + 1))


def build(robot: Robot, selection: Selection, seed: int, streams: Streams, drawn: _Draw) -> list[Scenario]:
    """One scenario for each recording, or each time at which the robot starts in one (and speed, and repetition).

    Raises:
        ClearwayError: start or goal lie far from everybody, somebody stands at the start, or the floor is too small.
    """
    refuse_speeds(selection.speeds, robot)
    return [
        _scenario(streams, selection, label, replay, t, speed, repetition, seed)
        for speed in selection.speeds or (min(streams.set_speed, robot.drive.v_max),)
        for label, replay, t in _entered(robot, selection, speed, streams, drawn)
        for repetition in range(1, (selection.repetitions or 1) + 1)
    ]


def _entered(
    robot: Robot, selection: Selection, speed: float, streams: Streams, drawn: _Draw
) -> Iterator[tuple[str, Replay | None, float]]:
    """Labels, recordings (None: it has yet to be drawn), and when the robot starts in each, s on its clock."""
    own = selection.replay
    if selection.seeds is not None:
        for one in _seeds(selection, streams):
            if own is not None:
                yield draw_label(one), own, _some_time(robot, own, speed, one)
            else:
                replay = drawn(streams, one)
                yield draw_label(one), replay, 0.0 if replay is None else _begin(robot, replay)
    elif own is not None or streams is CROSSING:
        replay = own or made()
        for k, t in enumerate(_starts(robot, replay, speed), start=1):
            yield f"time-{k}", replay, t
    else:
        for k, replay in enumerate(_frozen(streams), start=1):
            yield f"recording-{k}", replay, _begin(robot, replay)


def _seeds(selection: Selection, streams: Streams) -> list[int]:
    return selected_seeds(selection, f"{streams.suite}-seed-")


def _calls(selection: Selection, streams: Streams) -> list[tuple[Streams, int]]:
    """What `replayed_draws.draw` is to be called with for the `selection`: nothing is drawn but a time where somebody brings a recording."""
    return [] if selection.replay is not None else [(streams, s) for s in _seeds(selection, streams)]


def _begin(robot: Robot, replay: Replay) -> float:
    """When the robot starts in a recording that was drawn, s: at once, unless it is so large that somebody stands at its start."""
    return _free(robot, replay, BEGIN, replay.walks[-1].track[-1][0])


def _some_time(robot: Robot, replay: Replay, speed: float, seed: int) -> float:
    """The time that `seed` gives of somebody's recording: one of those that were asked for, else any at which the start is free, s."""
    part = draw(seed, "when the robot starts")
    if replay.times:
        return _starts(robot, replay, speed)[int(part * len(replay.times))]
    first, last, span = _span(replay, speed)
    return _free(robot, replay, first + part * span, last)


def _scenario(
    streams: Streams,
    selection: Selection,
    label: str,
    replay: Replay | None,
    t: float,
    speed: float,
    repetition: int,
    seed: int,
) -> Scenario:
    name = f"{streams.suite}-{label}-v{speed:g}-r{repetition}"
    start, goal = (streams.start, streams.goal) if replay is None else (replay.start, replay.goal)
    x, y, *heading = goal
    limit = LEAST + PATIENCE * math.dist(start[:2], (x, y)) / speed
    leg = LegSpec(
        name="there",
        goal=(x, y, heading[0] if heading else 0.0),
        yaw_tolerance=None if heading else math.inf,
        time_limit=limit,
    )
    people = () if replay is None else tuple(_people(replay, t, t + limit))
    if replay is not None and len(people) > PEOPLE:
        raise ClearwayError(
            f"{len(people)} people walk there within {limit:.0f} s; at most {PEOPLE} do", file=replay.source
        )
    batch = streams.batch if selection.replay is None else OWN
    return Scenario(
        name=name,
        floor_plan=selection.floor_plan or f"open-{EDGES[0] if replay is None else _edge(replay)}",
        start=start,
        legs=(leg,),
        speed=speed,
        people=people,
        labels=LabelSpec(batch=batch, configuration=label, repetition=repetition),
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
    first, last, span = _span(replay, speed)
    for t in replay.times:
        if not first <= t <= last:
            raise ClearwayError(f"nobody walks at {t:g} s; people do from {first:g} to {last:g} s", field="at")
        if near := _at_the_start(robot, replay, t):
            raise ClearwayError(f"person {near!r} is where {robot.name!r} is to start at {t:g} s", field="at")
    if replay.times:
        return list(replay.times)
    return [_free(robot, replay, first + span * k / TIMES, last) for k in range(TIMES)]


def _span(replay: Replay, speed: float) -> tuple[float, float, float]:
    """When the first person walks and the last one does, and how long after the first one the robot may start, s: so that its straight way ends
    before the last one goes, or in the first half of a short recording."""
    first, last = min(w.track[0][0] for w in replay.walks), max(w.track[-1][0] for w in replay.walks)
    takes = math.dist(replay.start[:2], replay.goal[:2]) / speed
    return first, last, max(last - first - takes, 0.5 * (last - first))


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


def _written(replay: Replay) -> list[Any]:
    return [replay.source, [[walk.name, walk.track] for walk in replay.walks]]


def _read(values: list[Any], streams: Streams) -> Replay:
    source, walks = values
    tracks = ((name, tuple((t, x, y) for t, x, y in track)) for name, track in walks)
    return Replay(source, tuple(Walk(name, track) for name, track in tracks), streams.start, streams.goal)


def _suite(
    streams: Streams,
    title: str,
    description: str,
    source: str,
    batches: tuple[str, ...],
    configurations: tuple[str, ...],
) -> Suite:
    make = partial(build, streams=streams)
    outlines = partial(make, drawn=lambda streams, seed: None)
    generator = Generator(
        partial(_calls, streams=streams), replayed_draws.draw, outlines, _written, partial(_read, streams=streams)
    )
    return Suite(
        streams.suite,
        title,
        description,
        batches=batches,
        configurations=configurations,
        make=partial(make, drawn=generator),
        robots=("tiago",),
        source=source,
        replays=streams is CROSSING,
        floor_plans={f"open-{edge}": partial(floor, edge) for edge in EDGES} if streams is CROSSING else {},
        generator=generator,
    )


REPLAYED = _suite(
    CROSSING,
    "A robot among recorded people",
    "a robot goes from A to B through people who walk as they were recorded and do not see it",
    "Among recorded people a robot goes from A to B while they walk as they were recorded, as many have done with the ETH and UCY sets: they do"
    " not see it, so its effect on them is zero by construction, and what is asked is whether it gets through.",
    (CROSSING.batch, OWN),
    tuple(f"time-{k + 1}" for k in range(MOST_TIMES)),
)
HELD_OUT_REPLAYED = _suite(
    COUNTERFLOW,
    "A robot among recorded people, held out",
    "a robot goes across two streams of people towards each other, at another density and other speeds, on which nothing was chosen",
    "Among recorded people, held out, a robot goes across two streams of people towards each other, who walk as Clearway's own social force had them walk: they do"
    " not see it, so its effect on them is zero by construction. Nothing was chosen there, and nothing is published of it.",
    (COUNTERFLOW.batch,),
    tuple(f"recording-{k + 1}" for k in range(FROZEN)),
)
