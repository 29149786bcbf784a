"""What a capture system would have recorded of a trial: markers with noise, gaps and changed names, in a frame of its own.

The marker sets are paper A's: eight on the robot, four low and four high, and four on each obstacle, which here stand
on arms of different height, so that no two distances within a set are alike. Between the trial's samples the robot
drives the cubic that fits its poses and velocities, a moving obstacle drives on a line. Everything follows from the seed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.contract import PLACED
from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, FloatArray, Shape, inscribed_radius
from clearway.recordings.motion.tracks import unwrapped
from clearway.recordings.recording import Points, Recording, Track
from clearway.trials import Body, Trial

ROBOT = "robot"
"""The robot among the bodies of a capture."""
Coordinates = Mapping[str, tuple[float, float, float]]
"""Markers of one body by their full names: x, y, z in the body's frame (of the robot: base_link), m."""

BURST = 0.08
"""Mean length of a stretch in which a marker is unseen, s."""
LOST = (0.04, 0.15)
"""Mean and longest length of a stretch in which a system that solves rigid bodies itself loses one, s: it can do with some
of the markers."""
SWAP = (0.3, 0.8)
"""Shortest and longest stretch in which two markers have each other's names, s."""
BRAKING = 1.0
"""m/s^2 with which a robot that was still driving when its trial ended comes to rest."""
FASTEST = 10.0
"""m/s; a moving obstacle that was faster between two samples was carried, and unseen in between."""
ARM = 0.08
"""Shortest distance of an obstacle's markers from its axis, m: on a thin one they stand on arms."""
_LOW = ((1.0, 25.0, 0.10), (0.85, 125.0, 0.14), (1.0, 215.0, 0.12), (0.75, 320.0, 0.17))
_HIGH = ((0.55, 5.0, 0.82), (0.70, 100.0, 0.78), (0.45, 190.0, 0.86), (0.65, 275.0, 0.75))
_AROUND = ((1.0, 40.0, 0.08), (0.8, 130.0, 0.30), (1.0, 215.0, 0.45), (0.6, 330.0, 0.55))
"""Markers as share of the inscribed radius, direction [degrees], height [m]."""


@dataclass(frozen=True, slots=True)
class System:
    """A capture system and its habits. The default is a perfect one whose frame is the map.

    Attributes:
        rate: Samples in a second, Hz.
        noise: Standard deviation of each coordinate of a marker, m.
        gaps: Share of the time in which a marker is unseen.
        swaps: How often two markers of the robot change names.
        lead: For how long it records before the trial, s.
        tail: For how long it records after the trial, s.
        frame: Its frame's pose in the map: x, y [m], theta [rad].
        seed: Seed of noise, gaps and swaps.
    """

    rate: float = 100.0
    noise: float = 0.0
    gaps: float = 0.0
    swaps: int = 0
    lead: float = 0.0
    tail: float = 0.0
    frame: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0

    def __post_init__(self) -> None:
        for name, right, told in (
            ("rate", 0 < self.rate <= 10_000, "a number of Hz above 0, at most 10000"),
            ("noise", 0 <= self.noise < 1, "m, not below 0 and less than 1"),
            ("gaps", 0 <= self.gaps < 1, "a share, not below 0 and less than 1"),
            ("swaps", 0 <= self.swaps <= 1000, "a number of times, at most 1000"),
            ("lead", 0 <= self.lead <= 3600, "s, from 0 to 3600"),
            ("tail", 0 <= self.tail <= 3600, "s, from 0 to 3600"),
            ("seed", self.seed >= 0, "not below 0"),
        ):
            if not right:
                raise ClearwayError(f"{getattr(self, name)!r} is wrong: {told}", field=name)


LAB = System(noise=0.0005, gaps=0.02, swaps=1, lead=2.0, tail=2.0, frame=(1.35, -0.8, 0.6))
"""A usual one: half a millimetre of noise, 2 % gaps, its origin somewhere on the floor, recording before the robot starts."""


def captured(trial: Trial, system: System = LAB, *, bodies: bool = False) -> Recording:
    """The trial as `system` records it; its t = 0 is `system.lead` before the trial's.

    Args:
        bodies: Whether to give poses of rigid bodies (tracks of kind `body`) instead of markers.
    """
    n = max(1, math.floor((system.lead + float(trial.t[-1]) + system.tail) * system.rate + 1e-9) + 1)
    t = np.arange(n) / system.rate
    poses = {ROBOT: robot_at(trial, t - system.lead)}
    for name, (body, column) in obstacles(trial).items():
        if body.pose is not None:
            poses[name] = np.tile(body.pose, (n, 1))
        else:
            poses[name] = moving_obstacle_at(trial, column, t - system.lead)
    return _record(t, poses, marker_sets(trial), system, bodies=bodies)


def held(
    trial: Trial, pose: FloatArray, system: System = LAB, *, seconds: float = 3.0, bodies: bool = False
) -> Recording:
    """The trial's robot at rest on `pose` (3,) in the map."""
    t = np.arange(max(2, round(seconds * system.rate))) / system.rate
    return _record(t, {ROBOT: np.tile(pose, (len(t), 1))}, marker_sets(trial), system, bodies=bodies)


def straight(
    trial: Trial,
    pose: FloatArray,
    system: System = LAB,
    *,
    length: float = 2.0,
    speed: float = 0.4,
    bodies: bool = False,
) -> Recording:
    """The trial's robot at rest on `pose` (3,) in the map, then driving straight ahead: up to speed, along, to rest."""
    ramp = speed / BRAKING
    duration = length / speed + ramp
    t = np.arange(round((duration + 2.0) * system.rate)) / system.rate
    s = np.clip(t - 1.0, 0.0, duration)
    up, down = np.minimum(s, ramp), np.maximum(s - (duration - ramp), 0.0)
    way = BRAKING * up**2 / 2 + speed * np.maximum(s - ramp, 0.0) - BRAKING * down**2 / 2
    poses = np.column_stack([
        pose[0] + way * math.cos(pose[2]), pose[1] + way * math.sin(pose[2]), np.full(len(t), pose[2])
    ])  # fmt: skip
    return _record(t, {ROBOT: poses}, marker_sets(trial), system, bodies=bodies)


# --- who carries which markers ---------------------------------------------------------------------------------------


def body_name(body: Body) -> str:
    """A name that every format can hold and that tells bodies of different trials apart: `square_1_300` is 300 mm wide."""
    return f"{re.sub(r'[^A-Za-z0-9]+', '_', body.name).strip('_') or 'body'}_{round(1000 * _width(body.shape))}"


def obstacles(trial: Trial) -> dict[str, tuple[Body, int]]:
    """Every obstacle of a trial by its `body_name`, numbered where that doesn't tell two apart, and which of those that move it
    is, if it does."""
    found: dict[str, tuple[Body, int]] = {}
    column = 0
    for body in trial.attempt.bodies:
        if body.kind in PLACED:
            name, k = body_name(body), 2
            while name in found:
                name, k = f"{body_name(body)}_{k}", k + 1
            found[name] = body, column
        column += body.pose is None
    return found


def marker_sets(trial: Trial) -> dict[str, Coordinates]:
    """Of the robot and of every obstacle: its markers, named `BODY:MARKER`, with their coordinates."""
    size = 0.25 if trial.attempt.footprint is None else inscribed_radius(trial.attempt.footprint)
    sets: dict[str, Coordinates] = {ROBOT: _set(ROBOT, (*_LOW, *_HIGH), 0.9 * size)}
    for name, (body, _) in obstacles(trial).items():
        sets[name] = _set(name, _AROUND, max(ARM, 0.9 * inscribed_radius(body.shape)))
    return sets


def plan_tables(trial: Trial, *, bodies: bool = False) -> dict[str, Any]:
    """[robot] and [bodies] of a test plan that scores a capture of the trial; `bodies`: as for `captured`."""
    sets = marker_sets(trial)

    def seen(name: str) -> dict[str, Any]:
        if bodies:
            return {"track": name}
        return {"markers": f"{name}:", "coordinates": {marker: list(at) for marker, at in sets[name].items()}}

    around = obstacles(trial).items()
    others = {name: {"shape": shape_table(b.shape)} | seen(name) | visiting(trial, b) for name, (b, _) in around}
    return {ROBOT: seen(ROBOT), "bodies": others}


def visiting(trial: Trial, body: Body) -> dict[str, bool]:
    """That a moving obstacle comes and goes, as a plan says it: a simulated one that is not there is not unseen."""
    visits = body.pose is None and (body.visits or trial.attempt.source == "simulated")
    return {"visits": True} if visits else {}


def shape_table(shape: Shape) -> dict[str, Any]:
    """A shape as a plan has it."""
    if isinstance(shape, Circle):
        return {"kind": "disc", "radius": shape.radius}
    return {"kind": "polygon", "vertices": [list(v) for v in shape.vertices]}


def _set(name: str, places: tuple[tuple[float, float, float], ...], size: float) -> Coordinates:
    def at(share: float, degrees: float, height: float) -> tuple[float, float, float]:
        angle = math.radians(degrees)
        return round(share * size * math.cos(angle), 4), round(share * size * math.sin(angle), 4), height

    return {f"{name}:m{i}": at(*place) for i, place in enumerate(places, 1)}


def _width(shape: Shape) -> float:
    if isinstance(shape, Circle):
        return 2 * shape.radius
    return float(np.ptp(shape.array[:, 0]))


# --- where everything is between the trial's samples ------------------------------------------------------------------


def robot_at(trial: Trial, t: FloatArray) -> FloatArray:
    """(n, 3) true poses at times `t` (n,) [s], theta unwrapped; before the trial at rest on its first pose, after it
    coming to rest; NaN where the trial has a gap."""
    theta = unwrapped(trial.pose[:, 2])
    pose = np.column_stack([trial.pose[:, :2], theta])
    if len(trial.t) == 1:
        return np.tile(pose[0], (len(t), 1))
    i, share, width = _between(trial.t, t)
    a, b = pose[i], pose[i + 1]
    line = a + share[:, None] * (b - a)
    out = line
    if trial.velocity is not None:
        v, omega, *aside = trial.velocity.T
        v_y = aside[0] if aside else np.zeros_like(v)
        c, s = np.cos(theta), np.sin(theta)
        rates = np.column_stack([v * c - v_y * s, v * s + v_y * c, omega])
        cubic = _hermite(a, b, rates[i] * width[:, None], rates[i + 1] * width[:, None], share[:, None])
        out = np.where(np.isfinite(cubic).all(axis=1, keepdims=True), cubic, line)
    out = np.where((share == 0)[:, None], a, np.where((share == 1)[:, None], b, out))
    out[t < trial.t[0]] = pose[0]
    late = t > trial.t[-1]
    out[late] = pose[-1]
    if trial.velocity is not None and np.isfinite(trial.velocity[-1]).all():
        v, omega = trial.velocity[-1, :2]
        stop = abs(v) / BRAKING
        s = np.minimum(t[late] - trial.t[-1], stop)
        way = v * s - math.copysign(BRAKING, v) * s**2 / 2
        turned = 0.0 if stop == 0 else omega * (s - s**2 / (2 * stop))
        middle = pose[-1, 2] + turned / 2
        out[late] += np.column_stack([way * np.cos(middle), way * np.sin(middle), np.zeros(len(s)) + turned])
    return out


def moving_obstacle_at(trial: Trial, column: int, t: FloatArray) -> FloatArray:
    """(n, 3) poses of a moving obstacle at times `t` (n,) [s]; NaN while it is absent. One that is there at the trial's beginning
    or end was on its way before, and goes on afterwards."""
    track = trial.moving_obstacles[:, column]
    if len(trial.t) == 1:
        return np.tile(track[0], (len(t), 1))
    i, share, width = _between(trial.t, t)
    a, b = track[i], track[i + 1]
    step = b - a
    step[:, 2] = np.remainder(step[:, 2] + np.pi, 2 * np.pi) - np.pi
    step[np.hypot(step[:, 0], step[:, 1]) > FASTEST * width] = np.nan
    out: FloatArray = np.where((share == 0)[:, None], a, np.where((share == 1)[:, None], b, a + share[:, None] * step))
    before, after = t < trial.t[0], t > trial.t[-1]
    out[before, 2], out[after, 2] = track[0, 2], track[-1, 2]  # going on, it doesn't turn
    return out


def _between(samples: FloatArray, t: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray, FloatArray]:
    """For each of `t`: the interval that it lies in, its share of the way through it, and the interval's length.

    Rounding at a sample is taken for the sample."""
    i = np.clip(np.searchsorted(samples, t + 1e-9, side="right") - 1, 0, len(samples) - 2)
    width = samples[i + 1] - samples[i]
    share = (t - samples[i]) / width
    share[np.abs(share * width) < 1e-9] = 0.0
    share[np.abs((share - 1) * width) < 1e-9] = 1.0
    return i, share, width


def _hermite(a: FloatArray, b: FloatArray, da: FloatArray, db: FloatArray, s: FloatArray) -> FloatArray:
    out: FloatArray = a + s * (da + s * (3 * (b - a) - 2 * da - db + s * (2 * (a - b) + da + db)))
    return out


# --- what the cameras make of it --------------------------------------------------------------------------------------


def _record(
    t: FloatArray, poses: Mapping[str, FloatArray], sets: Mapping[str, Coordinates], system: System, *, bodies: bool
) -> Recording:
    rng = np.random.default_rng([system.seed, *b"capture"])
    x, y, turn = system.frame
    c, s = math.cos(turn), math.sin(turn)
    seen = {}
    for name, pose in poses.items():  # poses in the capture's frame
        dx, dy = pose[:, 0] - x, pose[:, 1] - y
        seen[name] = np.column_stack([c * dx + s * dy, c * dy - s * dx, pose[:, 2] - turn])
    file = Path("synthetic")
    if bodies:
        tracks = {name: _track(t, pose, sets[name], system, rng) for name, pose in seen.items()}
        return Recording(file, "synthetic", tracks=tracks)
    names = tuple(marker for name in seen for marker in sets[name])
    xyz = np.concatenate([_placed(pose, sets[name]) for name, pose in seen.items()], axis=1)
    xyz += rng.normal(0.0, system.noise, xyz.shape) if system.noise else 0.0
    for k in range(len(names)):
        xyz[_unseen(t, system, rng), k] = np.nan
    own = len(sets[ROBOT])
    for _ in range(system.swaps):
        one, other = rng.choice(own, 2, replace=False)
        length = rng.uniform(*SWAP)
        begin = rng.uniform(t[0], max(t[0], t[-1] - length))
        rows = np.flatnonzero((t >= begin) & (t < begin + length))[:, None]
        xyz[rows, [one, other]] = xyz[rows, [other, one]]
    return Recording(file, "synthetic", points=Points(names, t, xyz))


def _placed(pose: FloatArray, coordinates: Coordinates) -> FloatArray:
    """(n, m, 3) markers of a body at `pose` (n, 3)."""
    at = np.array(list(coordinates.values()))
    c, s = np.cos(pose[:, 2])[:, None], np.sin(pose[:, 2])[:, None]
    return np.stack(
        [
            pose[:, 0, None] + c * at[:, 0] - s * at[:, 1],
            pose[:, 1, None] + s * at[:, 0] + c * at[:, 1],
            np.where(np.isfinite(pose[:, 0, None]), at[:, 2], np.nan),
        ],
        axis=2,
    )


def _track(
    t: FloatArray, pose: FloatArray, coordinates: Coordinates, system: System, rng: np.random.Generator
) -> Track:
    """A rigid body as the system solves it: the mean of m markers, its heading by their lever arms."""
    arms = np.array(list(coordinates.values()))[:, :2]
    spread = math.sqrt(float((arms**2).sum()))
    out = pose.copy()
    if system.noise:
        out[:, :2] += rng.normal(0.0, system.noise / math.sqrt(len(arms)), (len(t), 2))
        out[:, 2] += rng.normal(0.0, system.noise / spread, len(t))
    out[_unseen(t, system, rng, *LOST)] = np.nan
    position = np.column_stack([out[:, :2], np.where(np.isfinite(out[:, 0]), 0.0, np.nan)])
    none = np.where(np.isfinite(out[:, 2]), 0.0, np.nan)
    return Track(
        "body", "", "", t, position, np.column_stack([none, none, np.sin(out[:, 2] / 2), np.cos(out[:, 2] / 2)])
    )


def _unseen(
    t: FloatArray, system: System, rng: np.random.Generator, mean: float = BURST, longest: float = math.inf
) -> npt.NDArray[np.bool_]:
    """(n,) in which samples something is unseen: bursts of `mean` length [s] that together make the share `gaps`."""
    out = np.zeros(len(t), dtype=np.bool_)
    if system.gaps <= 0:
        return out
    left = round(system.gaps * len(t))
    while left > 0:
        length = min(left, 1 + int(min(rng.exponential(mean), longest) * system.rate))
        begin = int(rng.integers(0, max(1, len(t) - length + 1)))
        out[begin : begin + length] = True
        left -= length
    return out
