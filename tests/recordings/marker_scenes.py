"""Made captures: a body with markers on a path that is known, with noise, hidden markers and swapped names."""

from __future__ import annotations

import numpy as np

from clearway.recordings.recording import Points

EIGHT = np.array(
    [
        (0.20, 0.15, 0.30),
        (0.18, -0.16, 0.32),
        (-0.21, 0.14, 0.35),
        (-0.17, -0.19, 0.31),
        (0.05, 0.02, 0.90),
        (-0.06, 0.11, 0.85),
        (0.22, 0.01, 0.60),
        (-0.12, -0.08, 0.75),
    ]
)
"""m; of paper A's robots, roughly: eight markers, in base_link."""

FOUR = np.array([(0.25, 0.25, 0.5), (0.25, -0.20, 0.5), (-0.22, 0.05, 0.5), (0.0, 0.02, 0.62)])
"""m; of an obstacle."""


def circle(n: int, rate: float = 100.0, radius: float = 1.0, speed: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """t (n,) and base_link's pose (n, 3), counter-clockwise from (radius, 0)."""
    t = np.arange(n) / rate
    a = speed / radius * t
    return t, np.stack((radius * np.cos(a), radius * np.sin(a), a + np.pi / 2), axis=1)


def eight(n: int, rate: float = 100.0, size: float = 1.5, period: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    """A figure of eight, `period` s a round."""
    t = np.arange(n) / rate
    a = 2 * np.pi * t / period
    x, y = size * np.sin(a), size * np.sin(a) * np.cos(a)
    theta = np.unwrap(np.arctan2(np.cos(2 * a), np.cos(a)))
    return t, np.stack((x, y, theta), axis=1)


def straight(length: float, speed: float = 0.5, acceleration: float = 0.5, rate: float = 100.0, rest: float = 1.0):
    """From rest along x to rest, `rest` s at each end: t, pose."""
    ramp = speed / acceleration
    cruise = length / speed - ramp
    t = np.arange(round((2 * ramp + cruise + 2 * rest) * rate)) / rate
    s = np.clip(t - rest, 0.0, 2 * ramp + cruise)
    up = np.minimum(s, ramp)
    down = np.maximum(s - ramp - cruise, 0.0)
    x = acceleration * up**2 / 2 + speed * np.clip(s - ramp, 0.0, cruise) + speed * down - acceleration * down**2 / 2
    return t, np.stack((x, np.zeros_like(x), np.zeros_like(x)), axis=1)


def capture(
    t: np.ndarray,
    pose: np.ndarray,
    markers: np.ndarray = EIGHT,
    *,
    rng: np.random.Generator | None = None,
    noise: float = 0.0005,
    gaps: float = 0.0,
    prefix: str = "robot:",
    extra: int = 0,
) -> Points:
    """Markers (m, 3) in base_link as a capture sees them; `gaps`: share of the samples that is hidden, each by itself."""
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    xyz = np.empty((len(t), len(markers), 3))
    xyz[:, :, 0] = pose[:, :1] + c[:, None] * markers[:, 0] - s[:, None] * markers[:, 1]
    xyz[:, :, 1] = pose[:, 1:2] + s[:, None] * markers[:, 0] + c[:, None] * markers[:, 1]
    xyz[:, :, 2] = markers[:, 2]
    if rng is not None:
        xyz += noise * rng.standard_normal(xyz.shape)
        xyz[rng.random(xyz.shape[:2]) < gaps] = np.nan
    names = tuple(f"{prefix}{i + 1}" for i in range(len(markers)))
    if extra:
        names += tuple(f"other:{i + 1}" for i in range(extra))
        xyz = np.concatenate((xyz, np.full((len(t), extra, 3), 9.0)), axis=1)
    return Points(names, t, xyz)


def swap(points: Points, i: int, j: int, start: int, stop: int) -> Points:
    """The same capture in which markers i and j have each other's names from frame `start` to before `stop`."""
    xyz = points.xyz.copy()
    xyz[start:stop, [i, j]] = xyz[start:stop, [j, i]]
    return Points(points.names, points.t, xyz)


def path_length(pose: np.ndarray) -> float:
    """m, over chords."""
    return float(np.hypot(*np.diff(pose[:, :2], axis=0).T).sum())
