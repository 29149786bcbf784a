"""What stood and moved around the robot in a recorded trial: placed by the plan, or measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clearway.contract import BodyKind
from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.recordings.alignment import clocks
from clearway.recordings.lab.lab import ROBOT, Lab
from clearway.recordings.lab.robot_log import Offsets, Recordings
from clearway.recordings.lab.test_plan import PlacedSpec, RecordedTrialSpec, seen_from, shape_of
from clearway.recordings.motion.motion import Motion, NeverSeen, Quality
from clearway.scenarios.floorplan import load_floor_plan
from clearway.trials import Body

STOOD = (0.02, 0.05)
"""m, rad: a measured obstacle that moved less stood, and stands at its mean pose; a marker set's noise moves it less."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """The bodies around the robot.

    Their uncertainty holds that of both outlines, the robot's too: only a clearance hangs on it.

    Attributes:
        bodies: All of them, the moving ones last.
        moving_obstacles: (n, m, 3) pose of each moving one in the map: x, y [m], theta [rad].
        sigma: (n, m, 2) standard uncertainty of position [m] and heading [rad], NaN if unknown.
        told: How well each was seen, for the trial's provenance.
    """

    bodies: tuple[Body, ...]
    moving_obstacles: FloatArray
    sigma: FloatArray
    told: Mapping[str, Any]


def fixtures(lab: Lab, tied: bool) -> list[Body]:
    """Walls and furniture of the floor plan, where the map is known."""
    which = lab.plan.test.floor_plan
    if which is None or not tied:
        return []
    floor = load_floor_plan(seen_from(lab.folder, which))
    return [Body(f.name, BodyKind(f.kind), f.shape, np.array(f.pose, dtype=np.float64)) for f in floor.fixtures]


def obstacles(
    lab: Lab, spec: RecordedTrialSpec, recordings: Recordings, offsets: Offsets, t: FloatArray, *, tied: bool
) -> Obstacles:
    standing: list[Body] = []
    moving: list[Body] = []
    poses: list[FloatArray] = []
    sigmas: list[FloatArray] = []
    told: dict[str, Any] = {}
    for placed in lab.placed(spec, recordings):
        person = lab.body(placed.body).kind == "person"
        still_kind, moving_kind = (BodyKind.PERSON,) * 2 if person else (BodyKind.OBSTACLE, BodyKind.MOVING_OBSTACLE)
        shape, outlined = _shape(lab, placed.body)
        outlines = math.hypot(lab.body(placed.body).outline, lab.plan.robot.outline)
        if placed.pose is not None or not lab.body(placed.body).measured:
            pose = lab.pose(placed.pose) if tied else np.full(3, np.nan)
            sigma = math.hypot(lab.body(placed.body).uncertainty, outlines)
            standing.append(Body(placed.body, still_kind, shape, pose, sigma, outlined))
            continue
        try:
            motion = _measured(lab, placed, recordings, offsets, t)
        except NeverSeen as error:
            motion = _nowhere(t, str(error))
        together = lab.source_of(placed.body) == lab.source_of(ROBOT)
        outlined &= lab.linked(placed.body)  # else nobody knows where on the markers the shape is
        told[placed.body] = motion.told
        if (still := _stood(motion)) is not None:
            known = lab.body(placed.body).uncertainty if motion.sigma is None else np.nanmedian(motion.sigma[:, 0])
            sigma = math.hypot(float(known), outlines)
            standing.append(Body(placed.body, still_kind, shape, still, sigma, outlined, together))
        else:
            visits = _visits(lab, placed.body, recordings)
            moving.append(Body(placed.body, moving_kind, shape, None, 0.0, outlined, together, visits))
            poses.append(motion.wrapped)
            own = np.full((len(t), 2), np.nan) if motion.sigma is None else motion.sigma
            sigmas.append(np.hypot(own, [outlines, 0.0]))
    moving_obstacles = np.stack(poses, axis=1) if poses else np.empty((len(t), 0, 3))
    sigma_of = np.stack(sigmas, axis=1) if sigmas else np.empty((len(t), 0, 2))
    return Obstacles((*standing, *moving), moving_obstacles, sigma_of, told)


def _visits(lab: Lab, name: str, recordings: Recordings) -> bool:
    """Whether an obstacle was not there while its source had nothing of it: people walk into a picture and out of it."""
    body = lab.body(name)
    if body.visits is not None:
        return body.visits
    return body.kind == "person" or recordings[lab.source_of(name)].format == "pedestrians"


def _measured(lab: Lab, placed: PlacedSpec, recordings: Recordings, offsets: Offsets, t: FloatArray) -> Motion:
    """How an obstacle moved, at the robot's samples."""
    source = lab.source_of(placed.body)
    if source not in recordings:
        raise ClearwayError(
            f"the trial has no file of the source {source!r}, which measures {placed.body!r}", field="files"
        )
    motion, _ = lab.motion(placed.body, recordings[source])
    if source not in offsets:
        return clocks.resample(motion, t)
    seen = clocks.resample(motion, t - offsets[source].seconds)
    if seen.sigma is None:
        return seen
    # where it was a moment earlier or later, as far as the clocks are unsure
    moved = np.nan_to_num(np.abs(seen.velocity)) * offsets[source].sigma
    return replace(seen, sigma=np.hypot(seen.sigma, moved))


def _nowhere(t: FloatArray, why: str) -> Motion:
    """The motion of a body that was there, and not seen once."""
    nothing = np.full((len(t), 3), np.nan)
    return Motion(t, nothing, nothing[:, :2], None, Quality(rate=0.0, seen=0.0), (why,))


def _stood(motion: Motion) -> FloatArray | None:
    """(3,) the mean pose of a body that did not move; None if it did, or was never seen."""
    seen = np.isfinite(motion.pose[:, :2]).all(axis=1)
    if not seen.any():
        return None
    p = motion.pose[seen]
    middle = np.median(p[:, :2], axis=0)
    heading = p[np.isfinite(p[:, 2]), 2]
    turned = float(np.ptp(heading)) if len(heading) else 0.0
    if float(np.hypot(*(p[:, :2] - middle).T).max()) > STOOD[0] or turned > STOOD[1]:
        return None
    return np.array([*middle, math.remainder(float(np.median(heading)), math.tau) if len(heading) else math.nan])


def _shape(lab: Lab, name: str) -> tuple[Shape, bool]:
    spec = lab.body(name).shape
    return (Circle(0.0), False) if spec is None else (shape_of(spec, lab.folder), True)
