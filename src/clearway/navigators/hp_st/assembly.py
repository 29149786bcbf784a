"""What a trial is decided with: settings, costs and bounds, as they follow from the parameters, the robot and the task."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from clearway.contract import Task
from clearway.geometry.footprint import footprint
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.ahead import blurred
from clearway.navigators.common.inputs import area_of
from clearway.navigators.hp_st.decision import Evasion
from clearway.navigators.hp_st.environment.contact import Base
from clearway.navigators.hp_st.environment.sight import sees, sight_of
from clearway.navigators.hp_st.guarantee.certificate import Rules, Safety
from clearway.navigators.hp_st.guarantee.stopping import fastest_certified, longest_braking, widest_braking
from clearway.navigators.hp_st.parameters import Parameters
from clearway.navigators.hp_st.search.costs import SearchCosts
from clearway.navigators.hp_st.search.manoeuvres import NONE
from clearway.navigators.hp_st.ways import ENDLESS, Settings
from clearway.robots import Robot
from clearway.robots.drive_limits import DriveLimits

PACE = 0.5
"""Share of the top speed at which the reference goes that is tracked without time to go: paper B's."""

CONTROLS = np.array(
    [(1, 0), (1, 1), (1, -1), (1, 0.4), (1, -0.4), (0.5, 0), (0.5, 1), (0.5, -1), (0, 0), (0, 1), (0, -1),
     (-1, 0), (-1, 1), (-1, -1), (-0.5, 0)], dtype=np.float64,
)  # fmt: skip
"""What a step of the search tries, as shares of the limits of v and omega."""


class Assembly(NamedTuple):
    """What doesn't change during a trial, but for the goal's reach and the place from which it looked.

    Attributes:
        settings: Of each decision.
        base: The robot's base, as fast as a certificate lets it be.
        costs: What the search weighs.
        safety: What a certificate assumes of the robot.
        rules: What else it assumes and demands.
        evasion: When and how it drives without a certificate.
    """

    settings: Settings
    base: Base
    costs: SearchCosts
    safety: Safety
    rules: Rules
    evasion: Evasion


def assemble(p: Parameters, task: Task, robot: Robot, guarantee: str, without: Collection[str]) -> Assembly:
    """What `robot` decides with in `task`, with that `guarantee` and `without` those ingredients."""
    layers = p.short if "horizon" in without else p.layers
    stride = max(1, round(p.step / task.period))
    periods = layers * stride
    sight, limits, body = sight_of(robot, p.scan_range), robot.limits(task.speed_limit), footprint(robot.shape)
    car = limits.kind == "ackermann"
    certified = guarantee != "none" and "certificate" not in without and not car
    if not p.reverse or "reverse" in without:
        limits = limits._replace(v_min=0.0)
    disturbance = np.array(
        (p.disturbance_position, p.disturbance_heading, p.disturbance_velocity, p.disturbance_turn, float(p.disturbed_at_rest))
    )  # fmt: skip
    late = task.latency.expected
    start = np.array((p.pose_error, p.pose_error, p.heading_error))
    safety = Safety(limits, task.period, disturbance, blurred(start, disturbance, late, task.period, limits.fastest))
    rules = Rules(
        p.obstacle_acceleration, area_of(task), sight, p.unseen_speed, late, np.full(3, math.nan), p.turning_rests
    )
    if certified and not sees(sight, math.pi, 0.0):  # it drives nowhere that it doesn't look, certified or not
        limits = limits._replace(v_min=0.0)
    free = Base(limits, body)
    if certified:  # it plans to go no faster than it could be certified to stop
        v = fastest_certified(body, safety, rules)
        limits = limits._replace(v_max=v, v_min=max(limits.v_min, -v))
    settings = Settings(
        period=task.period, periods=periods, layers=layers, narrow=p.narrow, wide=p.wide, low_cost_threshold=p.low_cost_threshold,
        budget=ENDLESS if task.budget.iterations is None else task.budget.iterations,
        controls=_controls(limits),
        candidates=1 if "candidates" in without else p.candidates, apart=p.apart, keep=p.keep, rounds=0 if car else p.rounds,
        effort=p.effort, heading_weight=p.heading_weight,
        spread=np.array((p.own_spread, p.own_growth, p.most_spread)),
        certified=certified, hit=p.hit, imminent=periods,
    )  # fmt: skip
    halts = certified and p.halt_cost > 0.0 and math.isfinite(limits.deceleration)
    ahead = longest_braking(limits, task.period) if halts else 0
    margin = max(p.margin, widest_braking(safety)) if halts else p.margin
    costs = SearchCosts(
        stride * task.period, stride, p.contact_cost, p.discount, margin, max(p.soft, margin), p.near, p.yaw_change_cost, p.reverse_cost, 0.1,
        0 if "time-aware" not in without else periods, max(limits.acceleration, limits.deceleration) < math.inf,
        0.0 if "time-to-go" not in without else PACE * limits.v_max, 0.0, math.inf, NONE, p.halt_cost if ahead else 0.0,
        ahead, "candidates" not in without,
    )  # fmt: skip
    evasion = Evasion(
        p.hit if certified and guarantee == "evasive" else math.inf, p.proceed, max(1, round(p.proceed_horizon / task.period)),
        settings._replace(certified=False, controls=_controls(free.limits)), free,
        costs._replace(margin=p.margin, soft=max(p.soft, p.margin), halt=0.0, ahead=0),
        halts or limits != free.limits,
    )  # fmt: skip
    return Assembly(settings, Base(limits, body), costs, safety, rules, evasion)


def _controls(limits: DriveLimits) -> FloatArray:
    """(C, 2) what a step of the search tries within `limits`."""
    return CONTROLS if limits.v_min < 0.0 else CONTROLS[:11].copy()
