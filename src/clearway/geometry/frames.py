"""Planar frames: poses (3,) x [m], y [m], theta [rad] composed and taken relative to each other."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


@kernel
def compose(a: FloatArray, b: FloatArray) -> FloatArray:
    """The pose `b`, given in the frame `a`, in the frame that `a` is given in: (3,), theta in (-pi, pi]."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return np.array((a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrap(a[2] + b[2])))


@kernel
def relative(a: FloatArray, b: FloatArray) -> FloatArray:
    """The pose `b` as seen from `a`, both given in one frame: (3,), such that `compose(a, relative(a, b))` is `b`."""
    c, s = math.cos(a[2]), math.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    return np.array((c * dx + s * dy, c * dy - s * dx, wrap(b[2] - a[2])))


@kernel
def inverse(a: FloatArray) -> FloatArray:
    """The pose of the frame in which `a` is given as seen from `a`: (3,), theta in (-pi, pi]."""
    return relative(a, np.zeros(3))
