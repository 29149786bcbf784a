"""The ways that a decision chooses from: searched for, tracked, and weighed by one yardstick."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.contact import (
    Base,
    PredictedObstacles,
    belts_of,
    collision_risks,
    near,
    predicted_obstacles,
    room_around,
)
from clearway.navigators.hp_st.environment.field import Field, look
from clearway.navigators.hp_st.guarantee.certificate import Safety
from clearway.navigators.hp_st.guarantee.stopping import Halting, StepEnd, stopping_risk
from clearway.navigators.hp_st.guarantee.tube import drive
from clearway.navigators.hp_st.search.candidates import distinct
from clearway.navigators.hp_st.search.costs import SearchCosts, faces, time_to_go, worth
from clearway.navigators.hp_st.search.goal_approach import home
from clearway.navigators.hp_st.search.layer import Problem
from clearway.navigators.hp_st.search.manoeuvres import to_manoeuvre
from clearway.navigators.hp_st.search.search import nodes_of, search
from clearway.navigators.hp_st.search.tree import COST, Tree, follow, leaf
from clearway.navigators.hp_st.tracking import track
from clearway.robots.drive_limits import immediate

ENDLESS = 2**62
"""A budget of so many nodes is none."""


class Settings(NamedTuple):
    """What doesn't change during a trial.

    Attributes:
        period: Control period in seconds.
        periods: N, the periods of a plan.
        layers: Of the search.
        narrow: Nodes that the search keeps in a layer at first.
        wide: Nodes that it keeps where the narrow search finds no way of low cost.
        low_cost_threshold: A way that costs no more than this is not searched on, in seconds.
        budget: Nodes that the search may have in all.
        controls: (C, 2) shares of the limits of v and omega that a step of the search tries.
        candidates: Ways of distinct topology that are compared, at most.
        apart: Two ways differ where the bearing of an obstacle turns by more than that, in radians.
        keep: By so much another plan has to be better than the last one, in seconds.
        rounds: Linearisations of the tracking problem, at most.
        effort: Weight of the commands' changes in the tracking problem.
        heading_weight: Weight of the heading's error beside the position's there, in metres per radian.
        spread: (3,) how uncertain what the search sees may be, see `predicted_obstacles`.
        certified: Whether a plan needs a certificate.
        hit: Risk of contact in a period, if it stood, from which on it isn't slow beside who moves.
        imminent: So many of a plan's periods count in a risk of contact.
    """

    period: float
    periods: int
    layers: int
    narrow: int
    wide: int
    low_cost_threshold: float
    budget: int
    controls: FloatArray
    candidates: int
    apart: float
    keep: float
    rounds: int
    effort: float
    heading_weight: float
    spread: FloatArray
    certified: bool
    hit: float
    imminent: int


class Memory(NamedTuple):
    """What passes from one decision to the next.

    Attributes:
        plan: (N, 2) commands of the last plan from now on, in m/s and rad/s.
        velocity: (2,) v and omega that the base drives now, in m/s and rad/s.
        age: (3,) periods since it began to stand; 1 if there is a plan, else 0; and periods since something had a certificate.
    """

    plan: FloatArray
    velocity: FloatArray
    age: FloatArray


class Scene(NamedTuple):
    """What a decision is about: the robot, what surrounds it, and what it wants.

    Attributes:
        settings: What doesn't change during a trial.
        base: The robot's base.
        obstacles: As the search sees them.
        field: Distances to the goal.
        area: (4,) x_min, y_min, x_max, y_max of where the robot's centre may be, in metres.
        costs: What the search weighs.
        safety: What a certificate assumes of the robot.
        start: (5,) x, y, theta, v, omega of the robot now.
    """

    settings: Settings
    base: Base
    obstacles: PredictedObstacles
    field: Field
    area: FloatArray
    costs: SearchCosts
    safety: Safety
    start: FloatArray


class Found(NamedTuple):
    """What a search has found.

    Attributes:
        tree: All ways that it has looked at.
        layer: Of the best end.
        node: Of the best end in its layer; -1: there is none.
        low_cost: Whether the way there costs little.
        spent: Nodes that the decision has spent so far.
        cut: Whether the budget left fewer nodes than were asked for.
    """

    tree: Tree
    layer: int
    node: int
    low_cost: bool
    spent: int
    cut: bool


class Ways(NamedTuple):
    """Plans to choose from; the last of them is the last decision's.

    Attributes:
        commands: (P, N, 2) v and omega of each period, in m/s and rad/s.
        states: (P, N + 1, 5) where they lead: x, y, theta, v, omega.
        total: (P,) what each costs by `weigh`, in seconds; inf: there is no such plan.
        cost: (P,) the risk in that, in seconds.
    """

    commands: FloatArray
    states: FloatArray
    total: FloatArray
    cost: FloatArray


@kernel
def weigh(scene: Scene, commands: FloatArray, states: FloatArray) -> tuple[float, float, float]:
    """What a plan costs by the yardstick of the search, s.

    Args:
        scene: What the decision is about.
        commands: (N, 2) v and omega of the plan, in m/s and rad/s.
        states: (N + 1, 5) where it leads, filled.

    Returns:
        Time gone and to go (see `worth`) and risk together; the risk alone; and the greatest risk of contact with what moves in a
        period, a probability.
    """
    costs, base, obstacles, field, start = scene.costs, scene.base, scene.obstacles, scene.field, scene.start
    n, c = len(commands), scene.settings.period
    plan = drive(start, commands, scene.safety.limits, c)
    foot, fastest = base.foot, max(base.limits.v_max, -base.limits.v_min)
    step, turned, risked = np.empty((2, 1)), np.empty(1), np.empty(1)
    nearby, halting = room_around(obstacles), Halting(base, obstacles.reach, costs.margin, c, c)
    cost, total, hit = 0.0, -1.0, 0.0
    first, _, _ = look(field, start[0], start[1])
    fall = base.limits.deceleration
    braking = 0.5 * fastest * fastest / fall + costs.margin if costs.halt > 0.0 else 0.0
    states[0] = start
    for k in range(n):
        x, y, theta = plan.states[k, 0], plan.states[k, 1], plan.states[k, 2]
        dx, dy = plan.states[k + 1, 0] - x, plan.states[k + 1, 1] - y
        states[k + 1, :3] = plan.states[k + 1]
        states[k + 1, 3:] = plan.velocities[k + 1]
        if total >= 0.0:
            continue
        weight = costs.contact_cost * costs.discount ** (k * c)
        nearness = costs.near * costs.step / weight
        moving = belts_of(obstacles, k, 1, costs.union, costs.ahead, nearby.belts)
        s, m = near(moving, x, y, foot.circumscribed + fastest * c + braking, costs.soft, nearby)
        turn = plan.inputs[k, 1] * c
        step[0], step[1], turned[0] = dx, dy, turn
        collision_risks(nearby, s, m, foot, costs.margin, costs.soft, nearness, theta, step[0], step[1], turned, risked)
        risk = risked[0] if risked[0] >= 0.0 else 1.0
        if k < scene.settings.imminent:
            collision_risks(nearby, s, m, foot, costs.margin, costs.soft, 0.0, theta, step[0], step[1], turned, risked)
            hit = max(hit, min(risked[0], 1.0) if risked[0] >= 0.0 else 1.0)
        cost += weight * risk * c / costs.step
        if costs.halt > 0.0:
            end = StepEnd(theta + turn, dx, dy, plan.velocities[k + 1, 0], plan.velocities[k + 1, 1])
            cost += costs.halt * c * costs.discount ** (k * c) * stopping_risk(nearby, s, m, halting, end)
        cost += costs.yaw_change_cost * abs(plan.velocities[k + 1, 1] - plan.velocities[k, 1])
        if plan.inputs[k, 0] < 0.0:
            cost += costs.reverse_cost * c
        gx, gy = field.goal[0] - x, field.goal[1] - y
        if costs.stop:
            left, v = math.hypot(gx - dx, gy - dy), plan.velocities[k + 1, 0]
            near_enough = left <= costs.reach and v * v <= 2.0 * fall * costs.reach
            if near_enough and faces(costs, plan.states[k + 1, 2]):
                total = worth(costs, first, (k + 1) * c, 0.0, abs(v) / fall + left / base.limits.v_max)
            continue
        share = min(max((gx * dx + gy * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
        if math.hypot(gx - share * dx, gy - share * dy) <= costs.reach:
            total = worth(costs, first, k * c, 0.0, max(math.hypot(gx, gy) - costs.reach, 0.0) / base.limits.v_max)
    if total < 0.0:
        x, y, theta = states[n, 0], states[n, 1], states[n, 2]
        far, ux, uy = look(field, x, y)
        left = time_to_go(base, far, ux * math.cos(theta) + uy * math.sin(theta), states[n, 3], costs.stop)
        if len(costs.manoeuvres) > 0:
            way = to_manoeuvre(costs.manoeuvres, field.goal, costs.heading, x, y, theta)
            left = max(left, way / base.limits.v_max)
        total = worth(costs, first, n * c, far, left)
    return total + cost, cost, hit


@kernel
def pose_scene(
    settings: Settings, base: Base, memory: Memory, forecast: Forecast, field: Field, area: FloatArray, costs: SearchCosts,
    safety: Safety, pose: FloatArray,
) -> Scene:  # fmt: skip
    """What the decision at `pose` (3,) is about."""
    start = np.empty(5)
    start[0], start[1], start[2] = pose[0], pose[1], pose[2]
    start[3], start[4] = memory.velocity[0], memory.velocity[1]
    obstacles = predicted_obstacles(forecast, settings.spread)
    return Scene(settings, base, obstacles, field, area, costs, safety, start)


@kernel
def beside_who_moves(scene: Scene, slow: Base, memory: Memory) -> Scene:
    """`scene` with a base that is `slow` there, to which the last plan, one of the ways, is held too; with its own where that is no
    faster, or who comes would hit the robot if it braked and stood (`Settings.hit`)."""
    fast, top = scene.base.limits, slow.limits
    if top.v_max >= fast.v_max and top.v_min <= fast.v_min:
        return scene
    n = scene.settings.periods
    _, _, risk = weigh(scene, np.zeros((n, 2)), np.empty((n + 1, 5)))
    if risk >= scene.settings.hit:
        return scene
    for k in range(n):
        v = memory.plan[k, 0]
        allowed = top.v_max if v > 0.0 else -top.v_min
        if abs(v) > allowed:
            memory.plan[k] *= allowed / abs(v)
    return Scene(
        scene.settings, slow, scene.obstacles, scene.field, scene.area, scene.costs, scene.safety, scene.start
    )  # fmt: skip


@kernel
def find(scene: Scene, memory: Memory, beam: int, spent: int, dear: float) -> Found:
    """Search with up to `beam` nodes a layer, fewer where what the budget leaves after `spent` nodes asks for it; no farther once
    all ways risk more than `dear` [s]."""
    settings = scene.settings
    width = beam
    while width > 1 and settings.layers * nodes_of(width) > settings.budget - spent:
        width -= 1
    problem = Problem(
        scene.start, scene.base, scene.obstacles, scene.field, scene.area, scene.costs, settings.controls,
        _hint(scene, memory),
    )  # fmt: skip
    tree = search(problem, settings.layers, width, dear)
    layer, index = leaf(tree)
    low_cost = index >= 0 and layer > 0 and tree.nodes[layer, index, COST] <= settings.low_cost_threshold
    return Found(tree, layer, index, low_cost, spent + int(tree.count.sum()), width < beam)


@kernel
def widen(scene: Scene, memory: Memory, found: Found) -> Found:
    """Search wider, where no way of low cost has been found and the budget leaves more than there was."""
    settings = scene.settings
    if found.low_cost or found.cut or settings.wide <= settings.narrow:
        return found
    if settings.layers * nodes_of(settings.narrow) >= settings.budget - found.spent:
        return Found(found.tree, found.layer, found.node, found.low_cost, found.spent, True)
    return find(scene, memory, settings.wide, found.spent, math.inf)


@kernel
def find_or_widen(scene: Scene, memory: Memory, spent: int) -> Found:
    """Search with a narrow beam, which ends early where the wide one is sure to follow; then with that, see `widen`."""
    settings = scene.settings
    surely = settings.narrow < settings.wide and settings.budget == ENDLESS
    dear = settings.low_cost_threshold if surely else math.inf
    return widen(scene, memory, find(scene, memory, settings.narrow, spent, dear))


@kernel
def _hint(scene: Scene, memory: Memory) -> FloatArray:
    """(L, 2) what the last plan does in each layer; none if there is no plan."""
    settings, stride, n = scene.settings, scene.costs.stride, scene.settings.periods
    if not memory.age[1] > 0.0:
        return np.zeros((0, 2))
    hint, plan = np.zeros((settings.layers, 2)), memory.plan
    at_once = immediate(scene.base.limits)
    for k in range(settings.layers):
        for i in range(2):
            if at_once:
                for j in range(stride):
                    hint[k, i] += plan[min(k * stride + j, n - 1), i] / stride
            else:
                hint[k, i] = plan[min((k + 1) * stride, n) - 1, i]
    return hint


@kernel
def gather(scene: Scene, memory: Memory, found: Found, rounds: int) -> Ways:
    """The best way that was found, the best of each other topology, the way home, and the last plan.

    The best of the new ones is tracked: `rounds` linearisations, at most.
    """
    settings, costs, base, n = scene.settings, scene.costs, scene.base, scene.settings.periods
    tree, stride = found.tree, costs.stride
    ends = distinct(tree, scene.obstacles, stride, found.layer, found.node, settings.candidates, settings.apart)
    count = len(ends) + (1 if costs.stop else 0)
    commands, states = np.zeros((count + 1, n, 2)), np.empty((count + 1, n + 1, 5))
    total, cost = np.full(count + 1, math.inf), np.full(count + 1, math.inf)
    for p in range(len(ends)):
        follow(tree, ends[p, 0], ends[p, 1], stride, commands[p])
    if costs.stop:
        home(scene.start, base.limits, scene.field, settings.period, costs.reach, commands[count - 1])
    best = 0
    for p in range(count):
        total[p], cost[p], _ = weigh(scene, commands[p], states[p])
        if total[p] < total[best]:
            best = p
    if memory.age[1] > 0.0:
        commands[count] = memory.plan
        total[count], cost[count], _ = weigh(scene, commands[count], states[count])
        total[count] -= settings.keep
    if rounds > 0 and total[best] < total[count]:
        better = track(
            scene.obstacles, costs, scene.start, states[best], commands[best], base, scene.area, settings.period,
            rounds, settings.effort, settings.heading_weight,
        )  # fmt: skip
        tried = np.empty((n + 1, 5))
        value, risk, _ = weigh(scene, better, tried)
        if value < total[best]:
            total[best], cost[best] = value, risk
            commands[best], states[best] = better, tried
    return Ways(commands, states, total, cost)
