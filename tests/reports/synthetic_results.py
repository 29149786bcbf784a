"""A made-up campaign for the tests of reports: real scenarios, a robot that glides along drawn curves, no simulator."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.contract import Diagnostics
from clearway.geometry.shapes import rectangle
from clearway.indicators import row_schema, score_row
from clearway.robots import Robot, load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import RobotBodySpec, Scenario, SquareSpec
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Snapshot, Span, Trial
from clearway.trials.store import Results, TrialStore, write_partial

PERIOD = 0.1


def glide(scenario: Scenario, robot: Robot, *, fail: bool = False) -> Trial:
    """A trial in which the robot drives forth, turns and drives back along a smooth detour; `fail`: it hits something."""
    rng = np.random.default_rng(scenario.seed % 2**32)
    plan = load_floor_plan(scenario.floor_plan)
    fixed = [Body(f.name, f.kind, f.shape, f.pose) for f in plan.fixtures]
    moving_obstacles = []
    for o in scenario.obstacles:
        if isinstance(o.shape, SquareSpec):
            fixed.append(Body(o.name, "obstacle", rectangle(o.shape.edge, o.shape.edge), np.array(o.pose)))
        else:
            assert isinstance(o.shape, RobotBodySpec)
            moving_obstacles.append(Body(o.name, "moving obstacle", load_robot(o.shape.robot).shape, None))
    legs, at = [], np.array(scenario.start)
    for leg in scenario.legs:
        xy, yaw = leg.tolerances(robot.tolerances)
        legs.append(Leg(leg.name, at, np.array(leg.goal), xy, yaw, leg.scored, leg.time_limit))
        at = np.array(leg.goal)
    big = scenario.labels.size or (0.5 if moving_obstacles else 0.0)
    detour = (big + 0.8 * robot.d_base + 0.1 * rng.random()) * (0.0 if scenario.labels.batch == "NO" else 1.0)
    poses, speeds, index, spans, t = [], [], [], [], 0.0
    for k, leg in enumerate(legs):
        path, v = _turn(leg, robot) if leg.name == "turn" else _drive(leg, scenario.speed, detour, robot, rng)
        spans.append(Span(k, t, t + PERIOD * (len(path) - 1 + (k < len(legs) - 1)), True))
        poses.append(path)
        speeds.append(v)
        index += [k] * len(path)
        t += PERIOD * len(path)
    pose, velocity, leg_of = np.vstack(poses), np.vstack(speeds), np.array(index)
    n = len(pose)
    time = np.arange(n) * PERIOD
    outcome, events, reason = Outcome.REACHED, (), ""
    if fail:
        n = int(0.3 * n)
        pose, velocity, leg_of, time = pose[:n], velocity[:n], leg_of[:n], time[:n]
        last = float(time[-1])
        spans = [replace(s, end=min(s.end, last), reached=s.end <= last) for s in spans if s.start < last]
        outcome, reason = Outcome.COLLISION, "touched square 1"
        events = (Event(float(time[-1]), "contact", "square 1"),)
    tracks = np.full((n, len(moving_obstacles), 3), np.nan)
    for column, o in enumerate(o for o in scenario.obstacles if o.runs):
        for span in spans:
            for run in (r for r in o.runs if r.leg == legs[span.leg].name):
                _walk(tracks[:, column], time, span, run)
    estimate = pose + np.cumsum(rng.normal(0, [0.002, 0.002, 0.001], pose.shape), axis=0)
    snapshots = tuple(
        Snapshot(
            float(time[i]),
            Diagnostics({"global plan": pose[i:, :2], "local plan": pose[i : i + 15, :2]}, status="controlling"),
        )
        for i in range(0, n - 1, 20)
    )
    labels = Labels(**scenario.labels.model_dump(), speed=scenario.speed)
    attempt = Attempt(
        labels, robot.name, "move-base", scenario.localisation, robot.shape, tuple(legs), (*fixed, *moving_obstacles),
        scenario.speed, PERIOD, scenario.reference_length, scenario.floor_plan, scenario.name, scenario.seed,
    )  # fmt: skip
    return Trial(
        attempt, time, pose, velocity, estimate, velocity, leg_of, tracks, tuple(spans), events, outcome, reason,
        snapshots, {"clearway": "test"}, {"wall": 0.1},
    )  # fmt: skip


def _drive(leg: Leg, speed: float, detour: float, robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    a, b = leg.start, leg.goal
    length = math.dist(a[:2], b[:2]) - rng.uniform(0.1, 0.55) * robot.tolerances.xy
    v = np.minimum(np.minimum(np.arange(1, 5000) * 0.05, speed), np.inf)
    s = np.cumsum(v) * PERIOD
    n = int(np.searchsorted(s, length))
    s, v = s[:n], v[:n] * (1 + 0.01 * rng.normal(size=n))
    v[-max(3, int(speed / 0.06)) :] *= 0.5
    x, y = s, detour * np.exp(-(((s - 2.5) / 0.8) ** 2)) + 0.01 * np.sin(s * 3 + rng.uniform(0, 6))
    heading = np.gradient(y, x) if n > 1 else np.zeros(n)
    heading = np.arctan(heading) + np.linspace(0, rng.normal(0, 0.3 * robot.tolerances.yaw), n)
    c, d = math.cos(a[2]), math.sin(a[2])
    pose = np.c_[a[0] + c * x - d * y, a[1] + d * x + c * y, a[2] + heading]
    return pose, np.c_[v, np.gradient(heading) / PERIOD]


def _turn(leg: Leg, robot: Robot) -> tuple[np.ndarray, ...]:
    a = np.linspace(leg.start[2], leg.goal[2], 25)
    return np.c_[np.full(25, leg.start[0]), np.full(25, leg.start[1]), a], np.c_[np.zeros(25), np.full(25, 1.2)]


def _walk(track: np.ndarray, time: np.ndarray, span: Span, run) -> None:
    (x0, y0), (x1, y1) = run.path[0], run.path[-1]
    length = math.dist((x0, y0), (x1, y1))
    s = (time - span.start - run.delay) * run.speed / length
    on = (s >= 0) & (s <= 1) & (time >= span.start) & (time < span.end)
    track[on] = np.c_[x0 + s * (x1 - x0), y0 + s * (y1 - y0), np.full(len(s), math.atan2(y1 - y0, x1 - x0))][on]


def asked_of(*suites: str, **more: Any) -> dict[str, Any]:
    """The part of campaign.json that says what a report has to know of the suites, and of their usual robots."""
    robots = {robot for name in suites for robot in load_suite(name).robots}
    return {
        "suites": {name: load_suite(name).about() | more for name in suites},
        "robots": {robot: json.loads(load_robot(robot).model_dump_json()) for robot in robots},
    }


def write_campaign(
    out: Path, robots: tuple[str, ...] = ("hosbot", "tiago"), selection: Selection | None = None,
    change: Callable[[Trial], Trial] = lambda trial: trial, suite: str = "hospital",
) -> Results:  # fmt: skip
    """A results directory of a hospital suite, every 23rd trial of it a collision."""
    known = {name: json.loads(load_robot(name).model_dump_json()) for name in robots}
    asked = asked_of(suite) | {"robots": known, "navigators": ["move-base"], "seed": 1}
    scenarios = [
        (s, r) for r in map(load_robot, robots) for s in load_suite(suite).build(r, selection or Selection(), 1)
    ]
    with TrialStore(out, asked, len(scenarios), row_schema()) as store:
        for i, (scenario, robot) in enumerate(scenarios):
            trial = change(glide(scenario, robot, fail=i % 23 == 22))
            write_partial(store.partial, store.key, i, trial, score_row(trial))
        return store.finish()
