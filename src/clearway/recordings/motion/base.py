"""From what was fitted (a marker set, a rigid body of the file) to base_link: the transform, and how surely it is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Motion

SHORTEST = 0.5
"""m; a shorter drive tells too little of the heading."""

STRAIGHT = (0.02, 0.01, math.radians(10))
"""m, share of the length, rad: a drive is straight if it leaves its line by less than the larger of the first two (rms)
and the headings on it differ by less than the last: on an even arc the chord still is the mean heading."""

TURN = math.radians(90)
"""rad; a turn in place that is smaller leaves the centre too unsure."""

AT_REST = (0.005, math.radians(0.5))
"""m, rad: a static pose varies by less (standard deviation)."""


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """base_link in the frame of what was fitted: a point x of base_link lies at rotation @ x + point.

    Attributes:
        rotation: (3, 3) axes of base_link in the frame of what was fitted.
        point: (3,) origin of base_link there, m.
        sigma: Standard uncertainty of its position [m, one axis] and heading [rad].
        residual: Residual of whatever it was found by, m; None if it was given.
        note: How it was found, a sentence.
    """

    rotation: FloatArray
    point: FloatArray
    sigma: tuple[float, float]
    residual: float | None
    note: str


def from_offset(offset: Sequence[float], sigma: tuple[float, float] = (0.0, 0.0)) -> Base:
    """The base whose pose (x [m], y [m], theta [rad]) in the frame of the body was given; `sigma`: how surely."""
    x, y, theta = offset
    return Base(_about_z(theta), np.array((x, y, 0.0)), sigma, None, "base_link by the offset that was given")


def from_static_and_straight(
    static: Motion | None,
    pose: FloatArray | None,
    straight: Motion,
    *,
    turn: Motion | None = None,
    placed: tuple[float, float] = (0.0, 0.0),
    file: object = None,
    field: str | None = None,
) -> Base:
    """The base from a straight drive forward (its heading) and a static pose or a turn in place (its position).

    Args:
        static: The body at rest on `pose` (3,), base_link's pose in the frame that `static` is given in.
        straight: A straight drive forward, at least 0.5 m, in any frame.
        turn: A turn in place of at least 90 degrees, whose centre is base_link's origin (a differential drive); goes
            before `static` for the position.
        placed: Standard uncertainty [m, rad] with which the robot was placed. All motions are of the body itself (made
            with base=None, of one model or rigid body), z up.

    Raises:
        ClearwayError: neither static pose nor turn, not at rest, too short, not straight, in reverse, no heading.
    """
    mean = None
    if static is not None and pose is not None:
        mean, scatter = _resting(static, file, field)
    if turn is not None:
        point, residual, unsure = _centre(turn, file, field)
        how = f"the centre of a turn in place ({residual * 1e3:.1f} mm rms)"
    elif mean is not None and pose is not None:
        point, residual, unsure = _seen_from(mean, pose), 0.0, math.hypot(scatter, placed[0])
        how = "a static pose"
    else:
        raise ClearwayError(
            "a straight drive gives the heading alone; a static pose (with its known pose) or a turn in place is needed"
            " for the position of base_link",
            file=file,
            field=field,
        )
    direction, slide, deviation, length = _direction(straight, point, file, field)
    if mean is not None and pose is not None:
        differ = wrap(direction - float(pose[2] - mean[2]))
        if abs(differ) > math.pi / 2:
            raise ClearwayError(
                f"the straight drive leads {math.degrees(abs(differ)):.0f} degrees off where the robot looked on the static"
                " pose: it was driven in reverse, or the static pose's heading is wrong; drive it forward",
                file=file,
                field=field,
            )
        if abs(differ) > math.radians(1):
            how += (
                f" (whose heading differs from the drive's by {math.degrees(differ):.1f} degrees: the drive's counts)"
            )
    note = f"base_link by {how} and a straight drive of {length:.2f} m ({deviation * 1e3:.1f} mm rms off its line)"
    return Base(_about_z(direction), np.array((*point, 0.0)), (unsure, slide), max(residual, deviation), note)


def from_static(
    static: Motion,
    pose: FloatArray,
    *,
    turn: Motion | None = None,
    placed: tuple[float, float] = (0.0, 0.0),
    file: object = None,
    field: str | None = None,
) -> Base:
    """The base from a static pose alone: as good as the robot was placed, in heading too (obstacles, as a rule).

    With a `turn` in place its centre is base_link's origin, and the static pose counts for the heading.
    """
    mean, scatter = _resting(static, file, field)
    rotation = _about_z(float(pose[2] - mean[2]))
    if turn is not None:
        point, residual, unsure = _centre(turn, file, field)
        how = f"the centre of a turn in place ({residual * 1e3:.1f} mm rms) and a static pose"
        return Base(rotation, np.array((*point, 0.0)), (unsure, placed[1]), residual, f"base_link by {how}")
    sigma = (math.hypot(scatter, placed[0]), placed[1])
    note = "base_link by a static pose alone"
    return Base(rotation, np.array((*_seen_from(mean, pose), 0.0)), sigma, None, note)


def _about_z(theta: float) -> FloatArray:
    c, s = math.cos(theta), math.sin(theta)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def _seen_from(body: FloatArray, pose: FloatArray) -> FloatArray:
    """The origin of `pose` (3,) in the frame of the body's pose (3,): (2,)."""
    c, s = math.cos(body[2]), math.sin(body[2])
    arm = np.asarray(pose[:2]) - body[:2]
    return np.array((c * arm[0] + s * arm[1], c * arm[1] - s * arm[0]))


def _known(motion: Motion, what: str, file: object, field: str | None) -> FloatArray:
    pose = motion.pose[np.isfinite(motion.pose).all(axis=1)]
    if len(pose) < 2:
        raise ClearwayError(
            f"the body is not seen with its heading in the {what}; another stretch is needed", file=file, field=field
        )
    return pose


def _resting(static: Motion, file: object, field: str | None) -> tuple[FloatArray, float]:
    """Mean pose (3,) over the stretch, and the standard uncertainty of its position, m."""
    pose = _known(static, "static pose", file, field)
    mean, vary = pose.mean(axis=0), pose.std(axis=0)
    off = float(math.hypot(vary[0], vary[1])), float(vary[2])
    if off[0] > AT_REST[0] or off[1] > AT_REST[1]:
        raise ClearwayError(
            f"the body is not at rest in the static pose: it varies by {off[0] * 1e3:.1f} mm and"
            f" {math.degrees(off[1]):.2f} degrees; at most {AT_REST[0] * 1e3:.0f} mm and"
            f" {math.degrees(AT_REST[1]):.1f} degrees would be right; give a span in which it stands",
            file=file,
            field=field,
        )
    own = 0.0 if static.sigma is None else float(np.nanmedian(static.sigma[:, 0]))
    return mean, math.hypot(off[0] / math.sqrt(2), own)


def _direction(
    straight: Motion, point: FloatArray, file: object, field: str | None
) -> tuple[float, float, float, float]:
    """Direction of travel in the body's frame [rad], its standard uncertainty [rad], rms distance from the line [m],
    length [m]; `point` (2,): base_link's origin in the body's frame.

    The displacement is the sum of the steps along theta + direction, whatever the robot does about its line.
    """
    pose = _known(straight, "straight drive", file, field)
    away = np.hypot(*(pose[:, :2] - pose[0, :2]).T)
    length = float(away.max())
    if length < SHORTEST:
        raise ClearwayError(
            f"the straight drive is {length:.2f} m long; at least {SHORTEST} m is needed", file=file, field=field
        )
    # base_link's origin, which moves where the robot looks however it wanders
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    path = pose[:, :2] + np.stack((c * point[0] - s * point[1], s * point[0] + c * point[1]), axis=1)
    line = path[int(away.argmax())] - path[0]
    course = math.atan2(line[1], line[0])
    line = line / np.hypot(*line)
    along, across = (path - path[0]) @ line, (path - path[0]) @ np.array((-line[1], line[0]))
    deviation = float(np.std(across))
    turned = float(np.ptp(pose[:, 2]))
    back = float((np.maximum.accumulate(along) - along).max())
    problem = ""
    if deviation > max(STRAIGHT[0], STRAIGHT[1] * length):
        problem = f"it leaves its line by {deviation * 1e3:.0f} mm (rms)"
    elif turned > STRAIGHT[2]:
        problem = f"the body turns by {math.degrees(turned):.1f} degrees on it"
    elif back > 0.05:
        problem = f"it comes back by {back:.2f} m: forth and in reverse"
    if problem:
        raise ClearwayError(
            f"the straight drive is not straight: {problem}; give a span of one straight drive forward",
            file=file,
            field=field,
        )
    middle, step = (pose[1:, 2] + pose[:-1, 2]) / 2, np.diff(along)
    direction = wrap(course - math.atan2(float(np.sin(middle) @ step), float(np.cos(middle) @ step)))
    slid = across[1:] - np.cumsum(np.sin(middle + direction - course) * step)
    # what makes a robot slide lasts for decimetres, not for samples: so many independent looks at the line there are
    looks = max(2.0, length / 0.25)
    return direction, float(np.std(slid)) * math.sqrt(12 / looks) / length, deviation, length


def _centre(turn: Motion, file: object, field: str | None) -> tuple[FloatArray, float, float]:
    """Centre of rotation in the body's frame (2,) [m], rms residual [m], standard uncertainty of one coordinate [m].

    m_k + R(theta_k) p = c for all k is linear in p and c.
    """
    pose = _known(turn, "turn in place", file, field)
    turned = float(np.ptp(pose[:, 2]))
    if turned < TURN:
        raise ClearwayError(
            f"the turn in place covers {math.degrees(turned):.0f} degrees; at least {math.degrees(TURN):.0f} are needed",
            file=file,
            field=field,
        )
    # evenly over the angle: a robot that lingers at the ends would else count more there
    pose = pose[
        np.unique(
            np.searchsorted(np.maximum.accumulate(abs(pose[:, 2] - pose[0, 2])), np.linspace(0, turned, 360)).clip(
                0, len(pose) - 1
            )
        )
    ]
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    one, zero = np.ones(len(pose)), np.zeros(len(pose))
    rows = np.concatenate((np.stack((c, -s, -one, zero), axis=1), np.stack((s, c, zero, -one), axis=1)))
    right = -np.concatenate((pose[:, 0], pose[:, 1]))
    found = np.linalg.lstsq(rows, right, rcond=None)[0]
    left = right - rows @ found
    residual = float(np.sqrt((left**2).sum() / len(pose)))
    if residual > AT_REST[0] * 2:
        raise ClearwayError(
            f"the turn in place moves its centre by {residual * 1e3:.0f} mm (rms); at most {AT_REST[0] * 2e3:.0f} mm"
            " would be right: the robot has to turn on the spot",
            file=file,
            field=field,
        )
    looks = max(2.0, turned / math.radians(15))  # as with the line: what moves the centre lasts
    covariance = np.linalg.inv(rows.T @ rows) * len(pose) / looks
    return found[:2], residual, float(residual / math.sqrt(2) * math.sqrt((covariance[0, 0] + covariance[1, 1]) / 2))
