"""Trials made of thin air, the same every time, for the tests of the store."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyarrow as pa

from clearway.contract import BodyKind, Diagnostics, EventKind
from clearway.geometry.shapes import Circle, rectangle
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Snapshot, Span, Trial

SCHEMA = pa.schema(
    [
        pa.field("scenario", pa.string()),
        pa.field("speed", pa.float64(), metadata={"unit": "m/s"}),
        pa.field("success", pa.bool_()),
    ]
)


def make_trial(i: int, n: int = 40) -> Trial:
    """Trial number i, with n samples; every third has a moving obstacle, every fifth fails."""
    rng = np.random.default_rng(i)
    m = int(i % 3 == 0)
    bodies = [Body("wall", BodyKind.WALL, rectangle(4.0, 0.1), np.array([0.0, 2.0, 0.0]))]
    bodies += [Body("cart", BodyKind.MOVING_OBSTACLE, Circle(0.3), None)] * m
    leg = Leg("forth", np.zeros(3), np.array([5.0, 0.0, 0.0]), 0.1, np.inf)
    attempt = Attempt(
        labels=Labels("made", "M", "free", 0.6),
        robot="tiago",
        navigator="none",
        localisation="truth",
        footprint=Circle(0.27),
        legs=(leg,),
        bodies=tuple(bodies),
        speed_limit=0.6,
        period=0.1,
        reference_length=5.0,
        floor_plan="hall",
        scenario=f"made-{i}",
        seed=i,
    )
    line = rng.normal(size=(6, 2))
    return Trial(
        attempt=attempt,
        t=0.1 * np.arange(n),
        pose=rng.normal(size=(n, 3)),
        velocity=rng.normal(size=(n, 2)),
        estimate=rng.normal(size=(n, 3)),
        command=rng.normal(size=(n, 2)),
        leg=np.zeros(n, np.int64),
        moving_obstacles=rng.normal(size=(n, m, 3)),
        spans=(Span(0, 0.0, 0.1 * (n - 1), i % 5 != 0),),
        events=(Event(0.5, EventKind.STATUS, "recovery: clear"),),
        outcome=Outcome.TIMEOUT if i % 5 == 0 else Outcome.REACHED,
        snapshots=(Snapshot(0.5, Diagnostics({"global plan": line}, status="driving")),),
        provenance={"source": "made"},
    )


def make_recorded(i: int, n: int = 40) -> Trial:
    """Trial number i as if it had been measured: uncertainties, an obstacle without an outline, no set speed."""
    trial = make_trial(i, n)
    bed = Body(
        "bed", BodyKind.OBSTACLE, Circle(0.0), np.array([1.0, 1.0, np.nan]), sigma=0.005, outlined=False, measured=True
    )
    a = trial.attempt
    attempt = replace(
        a, labels=replace(a.labels, speed=None), bodies=(*a.bodies, bed), speed_limit=None, scenario=None, seed=None, source="recorded"
    )  # fmt: skip
    sigma = np.random.default_rng(i).uniform(0.001, 0.01, (n, 1 + trial.moving_obstacles.shape[1], 2))
    sigma[3] = np.nan
    return replace(
        trial,
        attempt=attempt,
        sigma=sigma,
        tie=sigma[:, 0] / 2,
        events=(Event(1.0, EventKind.POSSIBLE_CONTACT, "bed", 0),),
    )


def make_row(i: int) -> dict[str, object]:
    return {"id": f"made/{i}", "scenario": f"made-{i}", "speed": 0.6, "success": i % 5 != 0}
