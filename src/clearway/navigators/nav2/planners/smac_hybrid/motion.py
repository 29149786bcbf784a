"""The motions by which Hybrid-A* goes from node to node: straight, and along circles to the headings that it tells apart.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner/src/node_hybrid.cpp (HybridMotionTable), in its float32.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.navigators.nav2.planners.parameters import SmacHybridParameters

Singles = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int32]
Single = Any
"""A float32, which mypy takes for no float."""

FORWARD, LEFT, RIGHT, REVERSE, REVERSE_LEFT, REVERSE_RIGHT = range(1, 7)

_F = np.float32


class Motion(NamedTuple):
    """What leads on from a node, and what it costs; lengths in cells.

    Attributes:
        dx: (motions, headings) float64 along x.
        dy: (motions, headings) float64 along y.
        turn: (motions,) float32 steps of heading.
        kind: (motions,) int32 FORWARD to REVERSE_RIGHT.
        travel: (motions,) float32 length.
        headings: How many headings there are in a full turn.
        bin_size: Angle between two headings, rad, float32.
        radius: Least turning radius, float32.
        reverse: Whether it drives backwards too.
        reward: What a cell's length costs on free ground, float32.
        cost_penalty: Weight of a cell's cost, float32.
        quadratic: Whether a cell's cost counts squared.
        change_penalty: Added to the next where the turn changes, float32.
        non_straight_penalty: Multiplies what a turn costs, float32.
        reverse_penalty: Multiplies what it costs to drive backwards, float32.
    """

    dx: npt.NDArray[np.float64]
    dy: npt.NDArray[np.float64]
    turn: Singles
    kind: Integers
    travel: Singles
    headings: int
    bin_size: Single
    radius: Single
    reverse: bool
    reward: Single
    cost_penalty: Single
    quadratic: bool
    change_penalty: Single
    non_straight_penalty: Single
    reverse_penalty: Single


def make_motion(parameters: SmacHybridParameters, radius: float) -> Motion:
    """The motions of a base whose least turning radius is `radius` cells."""
    p = parameters
    r, headings = _F(radius), p.angle_quantization_bins
    reverse = p.motion_model_for_search == "REEDS_SHEPP"
    bin_size = _F(2) * _F(math.pi) / _F(headings)
    least = _F(2.0 * math.asin(math.sqrt(2.0) / float(_F(2) * r)))  # a chord that leaves the cell
    steps = _F(1) if least < bin_size else np.ceil(least / bin_size)
    angle = steps * bin_size
    x, y = r * np.sin(angle), r - r * np.cos(angle)
    chord = np.hypot(x, y)
    rows = [(chord, _F(0), _F(0), FORWARD), (x, y, steps, LEFT), (x, -y, -steps, RIGHT)]
    if reverse:
        rows += [(-chord, _F(0), _F(0), REVERSE), (-x, y, -steps, REVERSE_LEFT), (-x, -y, steps, REVERSE_RIGHT)]
    if p.allow_primitive_interpolation:
        for i in range(1, int(steps)):
            n = _F(i)
            wider = chord / (_F(2) * np.sin(n * bin_size / _F(2)))
            x, y = wider * np.sin(n * bin_size), wider - wider * np.cos(n * bin_size)
            rows += [(x, y, n, LEFT), (x, -y, -n, RIGHT)]
            if reverse:
                rows += [(-x, y, -n, REVERSE_LEFT), (-x, -y, n, REVERSE_RIGHT)]
    xs, ys, turn = (np.array([row[k] for row in rows], np.float32) for k in range(3))
    kind = np.array([row[3] for row in rows], np.int32)
    heading = bin_size * np.arange(headings, dtype=np.float32)
    cosine, sine = np.cos(heading).astype(np.float64), np.sin(heading).astype(np.float64)
    arc = turn * bin_size
    with np.errstate(divide="ignore", invalid="ignore"):
        travel = np.where(turn == 0, chord, chord / (_F(2) * np.sin(arc / _F(2))) * arc)
    return Motion(
        xs[:, None] * cosine - ys[:, None] * sine,
        xs[:, None] * sine + ys[:, None] * cosine,
        turn,
        kind,
        travel.astype(np.float32),
        headings,
        bin_size,
        r,
        reverse,
        _F(1) - _F(p.retrospective_penalty),
        _F(p.cost_penalty),
        p.use_quadratic_cost_penalty,
        _F(p.change_penalty),
        _F(p.non_straight_penalty),
        _F(p.reverse_penalty),
    )
