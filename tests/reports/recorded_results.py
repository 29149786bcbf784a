"""Recordings made by hand: simulated trials as a motion capture would have seen them, with all that it can fail to see."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from synthetic_results import write_campaign

from clearway.geometry.shapes import Circle
from clearway.scenarios.suites import Selection
from clearway.trials import Body, Event, Outcome, Trial
from clearway.trials.store import Results

SIGMA, TURN = 0.0015, 0.004
CONDITIONS = {"place": "corridor 3", "operator": "A. Tester", "floor": "linoleum", "load": "none", "software": "nav 1.2",
              "capture": "8 cameras, 100 Hz", "date": "2026-11-20"}  # fmt: skip


def provenance(trial: Trial, number: int) -> dict[str, Any]:
    gaps = [{"start": 3.0, "end": 3.8, "filled": ""}, {"start": 7.0, "end": 7.1, "filled": "spline"}]
    quality = {"rate": 100.0, "seen": 0.981, "gaps": gaps, "residual": 0.00042, "residual_max": 0.0021, "swapped": 2, "refused": 0,
               "noise": 0.0005, "cutoff": 6.2, "notes": ["two markers changed names for 0.3 s and were put back"]}  # fmt: skip
    return {
        "clearway": "test",
        "number": number + 1,
        "test_plan": "plan.toml",
        "sources": {"capture": {"file": f"take {number}.csv", "sha256": "0" * 64, "format": "vicon", "notes": ["mm scaled to m"]},
                    "log": {"file": f"take {number}.mcap", "sha256": "1" * 64, "format": "bag", "notes": []}},
        "frame": "tied by 3 holds, residual 1.2 mm",
        "clock": {"log": {"seconds": -2.5, "sigma": 0.004, "correlation": 0.98, "note": ""}},
        "motion": {"robot": quality},
        "legs": ["forth: departure and arrival"],
        "conditions": CONDITIONS | ({"floor": "wet linoleum"} if number % 7 == 3 else {}),
        "note": "a door was open" if number == 2 else "",
    }  # fmt: skip


def measured(trial: Trial, number: int = 0) -> Trial:
    """The trial as a recording without a floor plan."""
    a = trial.attempt
    bodies = tuple(replace(b, sigma=0.003) for b in a.bodies if b.kind not in ("wall", "furniture"))
    attempt = replace(
        a, source="recorded", navigator="recorded", localisation="recorded", floor_plan="", scenario=None, seed=None, bodies=bodies
    )  # fmt: skip
    n, m = trial.moving_obstacles.shape[:2]
    sigma = np.empty((n, 1 + m, 2))
    sigma[:] = SIGMA, TURN
    return replace(
        trial, attempt=attempt, sigma=sigma, command=None, snapshots=(), provenance=provenance(trial, number), timing={}
    )  # fmt: skip


def gapped(trial: Trial, start: float = 3.0, end: float = 3.8) -> Trial:
    pose, velocity = trial.pose.copy(), trial.velocity.copy()
    lost = (trial.t > start) & (trial.t < end)
    pose[lost] = velocity[lost] = np.nan
    return replace(trial, pose=pose, velocity=velocity)


def blind(trial: Trial) -> Trial:
    """No heading of anything."""
    pose, moving_obstacles = trial.pose.copy(), trial.moving_obstacles.copy()
    pose[:, 2] = moving_obstacles[:, :, 2] = np.nan
    return replace(trial, pose=pose, moving_obstacles=moving_obstacles, estimate=None)


def aimless(trial: Trial) -> Trial:
    """Neither goals nor tolerances nor a set speed nor a footprint."""
    a = trial.attempt
    nowhere = {"start": np.full(3, np.nan), "goal": np.full(3, np.nan), "xy_tolerance": np.nan, "yaw_tolerance": np.nan}
    legs = tuple(replace(leg, **nowhere) for leg in a.legs)
    labels = replace(a.labels, speed=None)
    return replace(
        trial, attempt=replace(a, legs=legs, labels=labels, speed_limit=None, footprint=None, reference_length=None)
    )


def shapeless(trial: Trial) -> Trial:
    """Nobody knows the obstacles' outlines; one more lies somewhere unknown."""
    a = trial.attempt
    bodies = tuple(replace(b, shape=Circle(0.0), outlined=False) for b in a.bodies)
    lost = Body("lost", "obstacle", Circle(0.2), np.full(3, np.nan))
    return replace(trial, attempt=replace(a, bodies=(*bodies, lost)))


def unsure(trial: Trial) -> Trial:
    """Possibly touched, and an uncertainty as large as the tolerances."""
    events = (*trial.events, Event(4.2, "possible contact", "square 1, clearance 0.001 m"))
    return replace(trial, sigma=np.full_like(trial.sigma, 0.1), events=events)


def unrecorded(trial: Trial) -> Trial:
    return replace(
        trial, attempt=replace(trial.attempt, bodies=()), t=np.zeros(1), pose=np.full((1, 3), np.nan), velocity=None, estimate=None,
        leg=np.zeros(1, np.int64), moving_obstacles=np.empty((1, 0, 3)), spans=(), events=(), sigma=None, outcome=Outcome.ABORTED,
        reason="attempted, not recorded", provenance={"number": trial.provenance["number"], "conditions": CONDITIONS, "note": "drove into the bed"},
    )  # fmt: skip


def silent(trial: Trial) -> Trial:
    """Nothing is known of the uncertainty, and the velocity is unknown."""
    return replace(trial, sigma=None, velocity=None, provenance={})


LACKS = (lambda t: t, gapped, blind, aimless, shapeless, unsure, unrecorded, silent)
SELECTION = Selection(speeds=(0.6,), sizes=(0.15,), gaps=(1.0,), repetitions=2)


def write_recorded(
    out: Path, *, lacks: tuple[Any, ...] = LACKS, robots: tuple[str, ...] = ("tiago",), selection: Any = None
) -> Results:
    """A results directory of recordings, each lacking the next of `lacks`."""
    count = iter(range(10_000))

    def change(trial: Trial) -> Trial:
        number = next(count)
        return lacks[number % len(lacks)](measured(trial, number))

    return write_campaign(out, robots=robots, selection=selection or SELECTION, change=change)
