"""Contacts that nobody could have seen: stretches in which the robot or an obstacle was not seen, and in which the two may
have touched, by where they were last and next seen and by their largest speeds. A person has to say whether they did."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from clearway.contract import PLACED, EventKind
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius
from clearway.recordings.lab.contacts import COVERAGE, SURVEYED
from clearway.trials import Attempt, Body, Event
from clearway.trials.unseen import Way, body_ways, nearest, robot_way

NAMED = 4
"""Bodies that are named of those that may have been touched."""
Stretch = tuple[float, float]


def unseen_contacts(
    attempt: Attempt,
    t: FloatArray,
    pose: FloatArray,
    moving_obstacles: FloatArray,
    sigma: FloatArray | None,
    during: Stretch,
) -> tuple[Event, ...]:
    """Events `possible contact`, one for each such stretch, at its start. Bodies without an outline are skipped, and all
    without a footprint.

    Args:
        attempt: What was attempted.
        t: (n,) time, s.
        pose: (n, 3) pose of the robot in the map: x, y [m], theta [rad], NaN where unseen.
        moving_obstacles: (n, m, 3) poses of the bodies without a pose, NaN where unseen.
        sigma: (n, 1 + m, 2) as `Trial.sigma`, NaN or None where unknown.
        during: From when to when the robot was tested, s; what was unseen before and after does not matter.
    """
    if attempt.footprint is None or len(t) < 2:
        return ()
    robot = robot_way(attempt, t, pose, attempt.footprint)
    ways = body_ways(attempt, t, moving_obstacles)
    unsure = [
        COVERAGE * math.hypot(_of_robot(attempt.footprint, sigma), _of_body(attempt, b, sigma)) for b in attempt.bodies
    ]
    hidden = robot.unseen()

    def touched(index: int, stretch: Stretch) -> bool:
        start, end = max(stretch[0], during[0]), min(stretch[1], during[1])
        return start <= end and nearest(robot, ways[index], start, end)[0] <= unsure[index]

    outlined = [i for i, body in enumerate(attempt.bodies) if body.outlined and _somewhere(ways[i], body)]
    events = []
    for stretch in hidden:
        if near := [i for i in outlined if touched(i, stretch)]:
            events.append(_event(stretch, "the robot", [attempt.bodies[i] for i in near], near))
    for i in outlined:
        for stretch in ways[i].unseen() if attempt.bodies[i].pose is None else ():
            if any(touched(i, part) for part in _without(stretch, hidden)):
                events.append(_event(stretch, _name(attempt.bodies[i]), [], [i]))
    return tuple(sorted(events, key=lambda e: e.t))


def _somewhere(way: Way, body: Body) -> bool:
    """Whether anything is known of where the body was; of one that stands, its place in the map."""
    return body.pose is None or bool(np.isfinite(way.pose[:, :2]).all())


def _event(stretch: Stretch, who: str, touched: Sequence[Body], indices: Sequence[int]) -> Event:
    start, end = stretch
    whom = "it" if not touched else ", ".join(map(_name, touched[:NAMED]))
    whom += f" and {len(touched) - NAMED} more" if len(touched) > NAMED else ""
    subject = "and may have touched" if touched else "and the robot may have touched"
    said = f"{who} was not seen from {start:.1f} to {end:.1f} s, {end - start:.1f} s, {subject} {whom}: to be confirmed"
    return Event(start, EventKind.POSSIBLE_CONTACT, said, indices[0] if len(indices) == 1 else None)


def _name(body: Body) -> str:
    return f"{body.kind} {body.name!r}"


def _without(stretch: Stretch, others: Sequence[Stretch]) -> Iterator[Stretch]:
    """What of a stretch lies outside the others, which are in order."""
    start, end = stretch
    for a, b in others:
        if b <= start or a >= end:
            continue
        if a > start:
            yield start, a
        start = max(start, b)
    if start < end or start == end == stretch[0]:
        yield start, end


def _of_robot(footprint: Shape, sigma: FloatArray | None) -> float:
    return 0.0 if sigma is None else _placed(footprint, sigma[:, 0])


def _of_body(attempt: Attempt, body: Body, sigma: FloatArray | None) -> float:
    if body.pose is not None:
        return max(body.sigma, 0.0 if body.kind in PLACED else SURVEYED)
    moving = [b for b in attempt.bodies if b.pose is None]
    return 0.0 if sigma is None else _placed(body.shape, sigma[:, 1 + moving.index(body)])


def _placed(shape: Shape, sigma: FloatArray) -> float:
    """Standard uncertainty of the place of an outline, as it usually is, m; 0 where nobody knows."""
    known = [c[np.isfinite(c)] for c in sigma.T]
    place, heading = (float(np.median(c)) if len(c) else 0.0 for c in known)
    return math.hypot(place, 0.0 if isinstance(shape, Circle) else heading * circumscribed_radius(shape))
