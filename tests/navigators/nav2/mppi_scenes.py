"""Random scenes for MPPI's critics, as the compiled ones take them and as the oracle does."""

from __future__ import annotations

import math

import numpy as np

from clearway.navigators.common.mppi.samples import Samples
from clearway.navigators.nav2.controllers.mppi.critics.rollouts import Rollouts
from clearway.navigators.nav2.seams import CostView, Tolerances

MODELS = {"diff": (False, 0.0), "omni": (True, 0.0), "ackermann": (False, 0.4)}
DT = np.float32(0.05)


def view(rng, rows=50, cols=70, tracks_unknown=True, inflation=0.6):
    """A costmap with blobs of obstacles, inflation and unknown ground about them."""
    centres = rng.uniform((0, 0), (rows, cols), (6, 2))
    r, c = np.mgrid[:rows, :cols]
    distance = np.min([np.hypot(r - a, c - b) for a, b in centres], axis=0) * 0.05
    cost = np.where(
        distance < 0.06, 254, np.where(distance < 0.2, 253, 252 * np.exp(-4.0 * (distance - 0.2)) * (distance < 0.6))
    )
    cost = np.where(rng.uniform(size=cost.shape) < 0.01, 255, cost).astype(np.uint8)
    polygon = np.array([(0.25, 0.2), (0.25, -0.2), (-0.2, -0.2), (-0.2, 0.2)])
    return CostView(cost, np.array([-1.02, -1.53]), 0.05, polygon, 0.2, 0.32, 4.0, inflation, tracks_unknown)


def samples(rng, pose, steps=31, batch=40):
    """Random walks of speeds, and where they lead."""

    def walk(scale):
        return (
            scale * rng.normal(size=(1, batch)) + 0.3 * scale * np.cumsum(rng.normal(size=(steps, batch)), axis=0)
        ).astype(np.float32)

    vx, vy, wz = walk(0.4) + np.float32(0.3), walk(0.2), walk(0.8)
    yaw = pose[2] + np.cumsum(wz, axis=0) * 0.05
    x = pose[0] + np.cumsum(vx * np.cos(yaw) - vy * np.sin(yaw), axis=0) * 0.05
    y = pose[1] + np.cumsum(vx * np.sin(yaw) + vy * np.cos(yaw), axis=0) * 0.05
    return Samples(vx, vy, wz, vx, vy, wz, *(np.ascontiguousarray(a, np.float32) for a in (x, y, yaw)))


def path(rng, points):
    """A winding path from the origin."""
    yaw = rng.uniform(-math.pi, math.pi) + np.cumsum(rng.normal(0.0, 0.12, points))
    step = rng.uniform(0.02, 0.06)
    xy = np.cumsum(step * np.stack((np.cos(yaw), np.sin(yaw)), axis=1), axis=0)
    return np.column_stack((xy, yaw)).astype(np.float32).astype(np.float64)


def scene(seed, model="diff", **of_view):
    """The same scene for a compiled critic and for the oracle."""
    rng = np.random.default_rng(seed)
    pose = np.array([*rng.uniform(-0.1, 0.1, 2), rng.uniform(-3, 3)])
    holonomic, radius = MODELS[model]
    made, way, seen = samples(rng, pose), path(rng, int(rng.integers(1, 60))), view(rng, **of_view)
    tolerances = Tolerances(0.25, 0.25)
    rollouts = Rollouts(made, pose, way, tolerances, seen, DT, holonomic, np.float32(radius))
    plain = {name: getattr(made, name).T.astype(np.float64) for name in ("vx", "vy", "wz", "x", "y", "yaw")}
    plain |= {"model": model, "radius": radius, "dt": 0.05, "pose": pose, "path": way, "tolerance": 0.25}
    plain |= {"length": float(np.hypot(*np.diff(way[:, :2], axis=0).T).sum()), "cost": seen.cost, "origin": seen.origin}
    plain |= {"resolution": seen.resolution, "footprint": seen.footprint, "inscribed": seen.inscribed}
    plain |= {"circumscribed": seen.circumscribed, "scaling": seen.scaling, "inflation": seen.inflation}
    return rollouts, plain | {"tracks_unknown": seen.tracks_unknown}
