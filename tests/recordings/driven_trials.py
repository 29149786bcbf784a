"""Trials whose every indicator is known on paper: made of formulas, for captures, exports and the round trip."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import Circle, rectangle
from clearway.trials import Attempt, Body, Labels, Leg, Outcome, Span, Trial

SPEED, PERIOD, RAMP = 0.6, 0.1, 1.0
"""m/s, s, m/s^2 (also rad/s^2 up to 1 rad/s in the turn)."""


def profile(way: float, top: float, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """How far (n,), how fast (n,) at `t`, and how long it takes: up to speed at `RAMP`, along, to rest."""
    ramp = top / RAMP
    whole = way / top + ramp
    s = np.clip(t, 0.0, whole)
    far = (
        RAMP * np.minimum(s, ramp) ** 2 / 2
        + top * np.maximum(s - ramp, 0.0)
        - RAMP * np.maximum(s - (whole - ramp), 0.0) ** 2 / 2
    )
    return far, np.clip(np.minimum(RAMP * s, RAMP * (whole - s)), 0.0, top), whole


def forth_and_back(*, moving_obstacle: bool = True, square: bool = True, batch: str = "CE") -> Trial:
    """5 m from A = (-2.5, 1) along x to B, half a turn there, and back; a square of 0.3 m stands 0.8 m beside the way, a
    disc of 0.25 m passes 1 m beside it at 0.4 m/s while the first leg is driven.

    PL is 10 m, DE 30 mm at B and 20 mm at A, OE 0, MDO 0.8 - 0.15 - 0.27 = 0.38 m.
    """
    forth, turn, back = 5.03, math.pi, 5.03 + 0.02
    _, _, first = profile(forth, SPEED, np.zeros(1))
    _, _, second = profile(turn, 1.0, np.zeros(1))
    _, _, third = profile(back, SPEED, np.zeros(1))
    ends = [PERIOD * math.ceil(d / PERIOD + 1e-9) for d in (first, second, third)]
    n = round(sum(ends) / PERIOD) + 1
    t = PERIOD * np.arange(n)
    x1, v1, _ = profile(forth, SPEED, t)
    a2, w2, _ = profile(turn, 1.0, t - ends[0])
    x3, v3, _ = profile(back, SPEED, t - ends[0] - ends[1])
    pose = np.column_stack([-2.5 + x1 - x3, np.ones(n), a2])
    leg = np.searchsorted(np.cumsum(ends)[:2], t - 1e-9, side="right")
    marks = np.concatenate([[0.0], np.cumsum(ends)])
    bodies = [Body("wall 1", "wall", rectangle(8.0, 0.1), np.array([0.0, 3.0, 0.0]))]
    if square:
        bodies.append(Body("square", "obstacle", rectangle(0.3, 0.3), np.array([0.0, 0.2, 0.0])))
    moving_obstacles = np.empty((n, 0, 3))
    if moving_obstacle:
        bodies.append(Body("person", "moving obstacle", Circle(0.25), None))
        moving_obstacles = np.column_stack([3.0 - 0.4 * t, np.full(n, 2.0), np.full(n, math.pi)])[:, None]
        moving_obstacles[t > ends[0]] = np.nan
    a, b = np.array([-2.5, 1.0, 0.0]), np.array([2.5, 1.0, 0.0])
    b_turned, a_turned = np.array([2.5, 1.0, math.pi]), np.array([-2.5, 1.0, math.pi])
    attempt = Attempt(
        labels=Labels("hospital", batch, "complex", SPEED, obstacle_speed=0.4, size=0.3),
        robot="tiago",
        navigator="formula",
        localisation="truth",
        footprint=Circle(0.27),
        legs=(
            Leg("forth", a, b, 0.2, 0.2, time_limit=45.0),
            Leg("turn", b, b_turned, 0.2, 0.2, scored=False, time_limit=25.0),
            Leg("back", b_turned, a_turned, 0.2, 0.2, time_limit=45.0),
        ),
        bodies=tuple(bodies),
        speed_limit=SPEED,
        period=PERIOD,
        reference_length=5.0,
        floor_plan="hall",
    )
    return Trial(
        attempt=attempt,
        t=t,
        pose=pose,
        velocity=np.column_stack([v1 + v3, w2]),
        estimate=pose + np.array([0.01, 0.0, 0.0]),
        command=None,
        leg=leg,
        moving_obstacles=moving_obstacles,
        spans=tuple(Span(i, float(marks[i]), float(marks[i + 1]), True) for i in range(3)),
        events=(),
        outcome=Outcome.REACHED,
        provenance={"source": "formula"},
    )
