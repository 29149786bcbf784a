"""Draws the motions of the suite `sar-misspecified`; their bounds stand in `clearway/stand_ins.toml`."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import uniform
from clearway.scenarios.motions import DampedSpec, DrivenSpec, PursuitSpec, ShakenSpec, StopAndGoSpec
from clearway.scenarios.sar_rules import Layout
from clearway.stand_ins import stand_ins

KINDS = ("damped", "shaken", "stop-and-go", "pursuit")
"""Of the first obstacle, the second, ...; then again."""

_OWN = stand_ins("misspecified")


def misspecified(layout: Layout, path: FloatArray, key: np.uint64) -> Layout:
    """The layout with other motions: its obstacles start where they did, those that oscillate as fast as they did.

    Args:
        path: (n, 2) the shortest way past what stands, m: what a pursued point patrols.
        key: Key of the stream of random numbers.
    """
    return dataclasses.replace(layout, motions=tuple(_motion(layout, j, path, key) for j in range(len(layout.start))))


def _motion(layout: Layout, j: int, path: FloatArray, key: np.uint64) -> DrivenSpec:
    def drawn(index: int, between: list[float]) -> float:
        return round(between[0] + (between[1] - between[0]) * uniform(key, j, index), 4)

    kind = KINDS[j % len(KINDS)]
    own: dict[str, Any] = _OWN[kind]
    seed = int(2**31 * uniform(key, j, 0))
    begin: dict[str, Any] = {"start": _pair(layout.start[j]), "speed": _OWN["speed"]}
    if kind == "stop-and-go":
        return StopAndGoSpec(kind=kind, **begin | own, acceleration=_OWN["sudden"], seed=seed)
    begin["acceleration"] = _OWN["acceleration"]
    if kind == "pursuit":
        points = tuple(_pair(p) for p in np.round(path, 4))
        return PursuitSpec(kind=kind, **begin | own | {"path": points, "pace": drawn(1, own["pace"])})
    swing = {name: _pair(getattr(layout, name)[j]) for name in ("velocity", "attraction", "stiffness")}
    given = begin | own | swing | {"damping": drawn(1, own["damping"])}
    return DampedSpec(kind="damped", **given) if kind == "damped" else ShakenSpec(kind="shaken", **given, seed=seed)


def _pair(numbers: FloatArray) -> tuple[float, float]:
    x, y = numbers.tolist()
    return x, y
