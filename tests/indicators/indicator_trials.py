"""Trials made by hand, with values that can be worked out on paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from clearway.geometry.shapes import Circle, rectangle
from clearway.trials import Attempt, Body, Labels, Leg, Outcome, Span, Trial

A, B = np.array([0.0, 0.0, 0.0]), np.array([5.0, 0.0, 0.0])
HOME = np.array([0.0, 0.0, math.pi])


def leg(name, start, goal, **changes):
    return replace(Leg(name, start, goal, xy_tolerance=0.2, yaw_tolerance=0.2), **changes)


def shuttle(
    *, speed=0.5, acceleration=0.5, stop=(4.9, 0.1), dt=0.1, bodies=(), moving_obstacles=None, **changes
) -> Trial:
    """Forth, turn, back on the line A-B at trapezoidal speed; stops at x = stop[0], then at x = stop[1].

    With the defaults each leg takes 1 s to speed up (0.25 m), 1 s to stop and 4.3 m / 0.5 m/s = 8.6 s between:
    10.6 s; the turn takes 4 s at pi / 4 rad/s. It stands 0.5 s at the end of each scored leg: 11.1 s each.
    """
    ramp, way = speed / acceleration, abs(stop[0])
    legs, t0, parts, spans = (), 0.0, [], []
    for index, (here, there, yaw) in enumerate([(0.0, stop[0], 0.0), (stop[0], stop[0], 0.0), (*stop, math.pi)]):
        if index == 1:
            duration = 4.0
        else:
            way = abs(there - here)
            duration = 2 * ramp + (way - speed * ramp) / speed + 0.5
        steps = round(duration / dt)
        t = np.linspace(0.0, duration, steps + 1)
        if index == 1:
            x, v, w = np.full_like(t, here), 0 * t, np.full_like(t, math.pi / 4)
            yaw = t * math.pi / 4
        else:
            moving = duration - 0.5
            v = np.clip(np.minimum(t, moving - t) * acceleration, 0.0, speed)
            up, down = np.minimum(t, ramp), np.clip(moving - t, 0.0, ramp)
            s = acceleration * up**2 / 2 + speed * np.clip(t - ramp, 0.0, moving - 2 * ramp)
            s = s + np.where(t > moving - ramp, acceleration * (ramp**2 - down**2) / 2, 0.0)
            x, w = here + np.sign(there - here) * s, 0 * t
        parts.append((t0 + t, np.stack([x, 0 * t, yaw + 0 * t], 1), np.stack([v, w], 1), np.full(len(t), index)))
        spans.append(Span(index, t0, t0 + duration, True))
        t0 += duration
    keep = [slice(None) if i == 2 else slice(None, -1) for i in range(3)]
    t, pose, velocity, number = (np.concatenate([p[k][s] for p, s in zip(parts, keep, strict=True)]) for k in range(4))
    legs = (leg("forth", A, B), leg("turn", B, B, scored=False), leg("back", np.array([5.0, 0.0, math.pi]), HOME))
    attempt = Attempt(
        Labels("hospital", "NO", "line", 0.5), "tiago", "move-base", "amcl", Circle(0.27), legs, tuple(bodies), 0.5, dt,
        reference_length=5.0, scenario="NO-1", seed=7,
    )  # fmt: skip
    fields = {
        f: changes.pop(f) for f in ("footprint", "speed_limit", "reference_length", "legs", "labels") if f in changes
    }
    none = np.empty((len(t), 0, 3))
    trial = Trial(
        replace(attempt, **fields), t, pose, velocity, pose + np.array([0.03, 0.04, -0.02]), velocity, number,
        none if moving_obstacles is None else moving_obstacles(t), tuple(spans), (), Outcome.REACHED,
    )  # fmt: skip
    return replace(trial, **changes)


def box(x, y, edge=0.3, yaw=0.0, kind="obstacle"):
    return Body(f"box {x} {y}", kind, rectangle(edge, edge), np.array([x, y, yaw]))


def moved(trial: Trial, dx: float, dy: float, turn: float) -> Trial:
    """The same trial in a scene that was turned and then shifted."""
    c, s = math.cos(turn), math.sin(turn)

    def by(poses):
        poses = np.asarray(poses, dtype=float)
        x, y, yaw = poses[..., 0], poses[..., 1], poses[..., 2]
        wrapped = np.remainder(yaw + turn + math.pi, 2 * math.pi) - math.pi
        return np.stack([c * x - s * y + dx, s * x + c * y + dy, wrapped], -1)

    attempt = trial.attempt
    legs = tuple(replace(g, start=by(g.start), goal=by(g.goal)) for g in attempt.legs)
    bodies = tuple(b if b.pose is None else replace(b, pose=by(b.pose)) for b in attempt.bodies)
    return replace(
        trial, attempt=replace(attempt, legs=legs, bodies=bodies), pose=by(trial.pose),
        estimate=None if trial.estimate is None else by(trial.estimate), moving_obstacles=by(trial.moving_obstacles),
    )  # fmt: skip
