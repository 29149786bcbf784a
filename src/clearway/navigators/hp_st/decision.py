"""One decision: ways through space and time, tracked, compared by one yardstick, and certified before they are driven."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.candidates import distinct
from clearway.navigators.hp_st.certificate import Rules, Safety, Verdict, longest_certified
from clearway.navigators.hp_st.contact import BELT, Base, Crowd, belts_of, crowd_of, meet, near
from clearway.navigators.hp_st.field import Field, look
from clearway.navigators.hp_st.homing import home
from clearway.navigators.hp_st.search import (
    COST,
    Wishes,
    leaf,
    search,
    time_to_go,
    trace,
    worth,
)
from clearway.navigators.hp_st.tracking import track
from clearway.navigators.hp_st.tube import Plan, Tube, drive

PLANNED, KEPT, STORED, STOPPED = range(4)
STATUSES = ("planned", "kept", "stored", "stopped")
"""How a decision was found: a new plan; the last one; the remainder of the last certified plan; no way at all."""


class Settings(NamedTuple):
    """What doesn't change during a trial.

    Attributes:
        period: s. periods: N, of a plan. layers, narrow, wide, calm: of the search. controls: (C, 2) see `search`.
        candidates, apart, keep, rounds, effort, heading_weight: see `parameters`. spread: (3,) own standard deviation
        [m], its growth [m/s], and the most that any may be [m]. certified: whether a plan needs a certificate.
    """

    period: float
    periods: int
    layers: int
    narrow: int
    wide: int
    calm: float
    controls: FloatArray
    candidates: int
    apart: float
    keep: float
    rounds: int
    effort: float
    heading_weight: float
    spread: FloatArray
    certified: bool


class Memory(NamedTuple):
    """What passes from one decision to the next; the kernels write into it.

    Attributes:
        plan: (N, 2) commands of the last plan, from now on. velocity: (2,) v, omega that the base drives now. age: (2,)
        periods since it began to stand, and whether there is a plan.
    """

    plan: FloatArray
    velocity: FloatArray
    age: FloatArray


class Thought(NamedTuple):
    """A decision and how it was found.

    Attributes:
        commands: (N, 2) of the plan that was chosen, states: (N + 1, 5) where it leads. cost: what it risks, s.
        status: index into STATUSES. certified: how many of its periods may be driven before the robot would have to
        brake; -1: none (or nobody asked). stored: the plan so stopped. tube: about it. verdict: on what was refused.
        ways: (P, N + 1, 2) of all candidates, count of them, choice among them (-1: the last plan). nodes: of the search.
    """

    commands: FloatArray
    states: FloatArray
    cost: float
    status: int
    certified: int
    stored: Plan
    tube: Tube
    verdict: Verdict
    ways: FloatArray
    count: int
    choice: int
    nodes: int


@kernel
def weigh(
    settings: Settings, base: Base, crowd: Crowd, field: Field, area: FloatArray, wishes: Wishes, start: FloatArray,
    limits: FloatArray, commands: FloatArray, states: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """What a plan costs by the yardstick of the search: time gone and to go, and what it risks, s.

    Args:
        start: (5,). commands: (N, 2). states: (N + 1, 5), filled.

    Returns:
        Both together, and the risk alone.
    """
    n, c = len(commands), settings.period
    plan = drive(start, commands, limits, c)
    still, foot, fastest = crowd.still, base.foot, max(base.high, -base.low)
    belts = np.empty((len(crowd.radius) * (len(crowd.at) + 1), BELT))
    stills, movers = np.empty((len(still), 3)), np.empty((len(belts), BELT))
    nearness = wishes.near * c / wishes.fear
    cost, total = 0.0, -1.0
    first, _, _ = look(field, start[0], start[1])
    fall = base.rates[1]
    states[0] = start
    for k in range(n):
        x, y, theta = plan.states[k, 0], plan.states[k, 1], plan.states[k, 2]
        dx, dy = plan.states[k + 1, 0] - x, plan.states[k + 1, 1] - y
        states[k + 1, :3] = plan.states[k + 1]
        states[k + 1, 3:] = plan.velocities[k + 1]
        if total >= 0.0:
            continue
        moving = belts_of(crowd, k, 1, wishes.union, belts)
        s, m = near(still, belts, moving, x, y, foot.circumscribed + fastest * c, wishes.soft, stills, movers)
        risk = meet(
            stills, s, movers, m, foot.vertices, foot.radius, foot.circumscribed, wishes.margin, wishes.soft, nearness,
            theta, dx, dy, plan.inputs[k, 1] * c,
        )  # fmt: skip
        if risk < 0.0:
            risk = 1.0
        cost += wishes.fear * wishes.fade ** (k * c) * risk * c / wishes.step
        cost += wishes.swing * abs(plan.velocities[k + 1, 1] - plan.velocities[k, 1])
        if plan.inputs[k, 0] < 0.0:
            cost += wishes.back * c
        gx, gy = field.goal[0] - x, field.goal[1] - y
        if wishes.stop:
            left, v = math.hypot(gx - dx, gy - dy), plan.velocities[k + 1, 0]
            if left <= wishes.reach and v * v <= 2.0 * fall * wishes.reach:
                total = worth(wishes, first, (k + 1) * c, 0.0, abs(v) / fall + left / base.high)
            continue
        share = min(max((gx * dx + gy * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
        if math.hypot(gx - share * dx, gy - share * dy) <= wishes.reach:
            total = worth(wishes, first, k * c, 0.0, max(math.hypot(gx, gy) - wishes.reach, 0.0) / base.high)
    if total < 0.0:
        x, y, theta = states[n, 0], states[n, 1], states[n, 2]
        far, ux, uy = look(field, x, y)
        left = time_to_go(base, far, ux * math.cos(theta) + uy * math.sin(theta), states[n, 3], wishes.stop)
        total = worth(wishes, first, n * c, far, left)
    return total + cost, cost


@kernel
def decide(
    settings: Settings, base: Base, memory: Memory, forecast: Forecast, field: Field, area: FloatArray, wishes: Wishes,
    rules: Rules, safety: Safety, pose: FloatArray,
) -> Thought:  # fmt: skip
    """Decide what to drive from `pose` (3,)."""
    n, stride = settings.periods, wishes.stride
    crowd = crowd_of(forecast, settings.spread)
    start = np.empty(5)
    start[:3] = pose
    start[3:] = memory.velocity
    hint = np.zeros((0, 2))
    if memory.age[1] > 0.0:
        hint = np.empty((settings.layers, 2))
        for k in range(settings.layers):
            last = min((k + 1) * stride, n) - 1
            hint[k, 0], hint[k, 1] = memory.plan[last, 0], memory.plan[last, 1]
            if base.rates.min() == math.inf:
                hint[k] = 0.0
                for j in range(stride):
                    hint[k] += memory.plan[min(k * stride + j, n - 1)] / stride
    tree = search(start, base, crowd, field, area, wishes, settings.layers, settings.narrow, settings.controls, hint)
    layer, index = leaf(tree)
    nodes = int(tree.count.sum())
    if index < 0 or tree.nodes[layer, index, COST] > settings.calm or layer == 0:
        tree = search(start, base, crowd, field, area, wishes, settings.layers, settings.wide, settings.controls, hint)
        layer, index = leaf(tree)
        nodes += int(tree.count.sum())

    ends = distinct(tree, crowd, stride, layer, index, settings.candidates, settings.apart)
    most = len(ends) + (2 if wishes.stop else 1)
    commands, states = np.zeros((most, n, 2)), np.empty((most, n + 1, 5))
    total, cost = np.full(most, math.inf), np.full(most, math.inf)
    tried, risk_tried = np.empty((n + 1, 5)), 0.0
    for p in range(len(ends)):
        _, told = trace(tree, ends[p, 0], ends[p, 1])
        for k in range(min(len(told) * stride, n)):
            commands[p, k] = told[k // stride]
        total[p], cost[p] = weigh(
            settings, base, crowd, field, area, wishes, start, safety.limits, commands[p], states[p]
        )
        if settings.rounds > 0:
            better = track(
                crowd, wishes, start, states[p], commands[p], base, area, safety.limits, settings.period, settings.rounds,
                settings.effort, settings.heading_weight,
            )  # fmt: skip
            value, risk_tried = weigh(settings, base, crowd, field, area, wishes, start, safety.limits, better, tried)
            if value < total[p]:
                total[p], cost[p] = value, risk_tried
                commands[p] = better
                states[p] = tried
    if wishes.stop:
        p = len(ends)
        home(start, base, field, safety.limits, settings.period, wishes.reach, commands[p])
        total[p], cost[p] = weigh(
            settings, base, crowd, field, area, wishes, start, safety.limits, commands[p], states[p]
        )
    last = most - 1
    if memory.age[1] > 0.0:
        commands[last] = memory.plan
        total[last], cost[last] = weigh(
            settings, base, crowd, field, area, wishes, start, safety.limits, commands[last], states[last]
        )
        total[last] -= settings.keep
    ways = states[:last, :, :2].copy()

    order = np.argsort(total)
    none = Verdict(True, -1, math.inf)
    choice, certified = order[0], -1
    plan = drive(start, commands[choice], safety.limits, settings.period)
    about = Tube(
        np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros((0, 2, 3)), np.zeros((0, 2))
    )  # fmt: skip
    if total[choice] == math.inf:
        return Thought(commands[last], states[last], math.inf, STOPPED, -1, plan, about, none, ways, last, -1, nodes)
    standing = memory.age[0] >= 2.0
    if settings.certified:
        for o in range(most):
            p = order[o]
            if total[p] == math.inf:
                break
            plan = drive(start, commands[p], safety.limits, settings.period)
            certified, plan, about, none = longest_certified(plan, base.foot, forecast, rules, safety, standing, 1)
            if certified >= 1:
                choice = p
                break
        if certified < 1:
            return Thought(
                commands[order[0]], states[order[0]], cost[order[0]], STORED, -1, plan, about, none, ways, last, -1,
                nodes,
            )  # fmt: skip
    status = KEPT if choice == last else PLANNED
    return Thought(
        commands[choice], states[choice], cost[choice], status, certified, plan, about, none, ways, last,
        choice if choice < last else -1, nodes,
    )  # fmt: skip
