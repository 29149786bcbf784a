"""One decision: which of the ways is driven. Certified before it is, or where that leads to a contact, without."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.contact import Base
from clearway.navigators.hp_st.environment.field import Field
from clearway.navigators.hp_st.guarantee.certificate import Rules, Safety, longest_certified
from clearway.navigators.hp_st.guarantee.tube import Plan, Tube, drive
from clearway.navigators.hp_st.search.candidates import by_first_step
from clearway.navigators.hp_st.search.costs import SearchCosts
from clearway.navigators.hp_st.search.tree import follow
from clearway.navigators.hp_st.ways import (
    Found,
    Memory,
    Scene,
    Settings,
    Ways,
    beside_who_moves,
    find_or_widen,
    gather,
    pose_scene,
    weigh,
)

PLANNED, KEPT, STORED, STOPPED, EVADING = range(5)
STATUSES = ("planned", "kept", "stored", "stopped", "evading")
"""How a decision was found: a new plan; the last one; the remainder of the last certified plan; no way at all; a plan without a
certificate (see `evade`)."""


class Evasion(NamedTuple):
    """When it drives something without a certificate, and how that is found.

    Attributes:
        hit: From this risk of contact in a period on, of a plan that is certified (if there is none, of braking and standing); inf: never.
        proceed: Where nothing has had a certificate in the last period either: up to this risk of contact in a period.
        soon: Of so many periods that is; what comes later it decides anew.
        settings: Those of a search that needs no certificate.
        base: The robot's base, without what a certificate asks of it.
        costs: What that search weighs.
        again: Whether that search differs from the first one; if not, the first one's ways are all that there are.
    """

    hit: float
    proceed: float
    soon: int
    settings: Settings
    base: Base
    costs: SearchCosts
    again: bool


class Decision(NamedTuple):
    """A decision and how it was found.

    Attributes:
        commands: (N, 2) v and omega of the plan that was chosen, in m/s and rad/s.
        states: (N + 1, 5) where it leads: x, y, theta, v, omega.
        cost: What it risks, in seconds.
        status: How it was found, an index into STATUSES.
        certified: How many of its periods may be driven before the robot has to brake; -1: none, or nobody asked.
        stored: The plan so stopped.
        tube: The tube about `stored`.
        ways: (P, N + 1, 2) places along all new candidates, in metres.
        choice: Index of the chosen one among them; -1: it is the last plan, or there is none.
        nodes: Nodes that the search has spent.
        cut: Whether the budget ended the search.
    """

    commands: FloatArray
    states: FloatArray
    cost: float
    status: int
    certified: int
    stored: Plan
    tube: Tube
    ways: FloatArray
    choice: int
    nodes: int
    cut: bool


@kernel
def choose(scene: Scene, memory: Memory, forecast: Forecast, rules: Rules, found: Found, ways: Ways) -> Decision:
    """The best of the ways; where certificates are asked for, the best that has one for its first period at least."""
    settings, safety, foot = scene.settings, scene.safety, scene.base.foot
    last = len(ways.total) - 1
    shown = ways.states[:last, :, :2].copy()
    first = int(np.argmin(ways.total))
    choice, certified = first, -1
    plan = drive(scene.start, ways.commands[choice], safety.limits, settings.period)
    about = Tube(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros((0, 2, 3)), np.zeros((0, 2)))
    left = ways.total.copy()
    status = STOPPED if left[first] == math.inf else PLANNED
    while settings.certified and left[choice] < math.inf:
        plan = drive(scene.start, ways.commands[choice], safety.limits, settings.period)
        certified, plan, about = longest_certified(
            plan, foot, forecast, rules, safety, memory.age[0] >= 2.0, 1
        )  # fmt: skip
        if certified >= 1:
            break
        left[choice] = math.inf
        choice = int(np.argmin(left))
    if status != STOPPED and settings.certified and certified < 1:
        status, choice = STORED, first
        tree, commands, states = found.tree, np.zeros(ways.commands[0].shape), np.empty(ways.states[0].shape)
        for end in by_first_step(tree):  # none of the best: another first step may do
            commands[:] = 0.0
            follow(tree, end[0], end[1], scene.costs.stride, commands)
            whole = drive(scene.start, commands, safety.limits, settings.period)
            certified, plan, about = longest_certified(whole, foot, forecast, rules, safety, memory.age[0] >= 2.0, 1)
            if certified >= 1:
                _, cost, _ = weigh(scene, commands, states)
                return Decision(commands, states, cost, PLANNED, certified, plan, about, shown, -1, found.spent, found.cut)  # fmt: skip
    if status == PLANNED and choice == last:
        status = KEPT
    return Decision(
        ways.commands[choice], ways.states[choice], ways.cost[choice], status, certified, plan, about, shown,
        choice if status == PLANNED else -1, found.spent, found.cut,
    )  # fmt: skip


@kernel
def evade(scene: Scene, memory: Memory, evasion: Evasion, ways: Ways, decision: Decision) -> Decision:
    """`decision`; or a plan without a certificate.

    That is the best of the `ways`, where nothing has had a certificate in the last period either and it risks little soon; or that, or what
    another search finds (`Evasion.again`), where what is certified (if that is nothing, to brake and stand) leads to a contact and it at
    least halves the risk of one.
    """
    if evasion.hit == math.inf:
        return decision
    free = Scene(
        evasion.settings, evasion.base, scene.obstacles, scene.field, scene.area, evasion.costs, scene.safety, scene.start
    )  # fmt: skip
    commands, states = np.zeros(decision.commands.shape), np.empty(decision.states.shape)
    certified = decision.status == PLANNED or decision.status == KEPT
    if not certified and memory.age[2] > 0.0:
        bold, risk = _boldest(free, ways, decision, decision.nodes, decision.cut)
        if evasion.proceed < risk < math.inf and evasion.soon < len(commands):
            _, _, risk = weigh(free, bold.commands[: evasion.soon], states)
        if risk <= evasion.proceed:
            return bold
    if certified:
        commands[:] = decision.commands
    _, _, hit = weigh(free, commands, states)
    if hit < evasion.hit:
        return decision
    if evasion.again:
        found = find_or_widen(free, memory, decision.nodes)
        bold, risk = _boldest(free, gather(free, memory, found, free.settings.rounds), decision, found.spent, found.cut)
    else:
        bold, risk = _boldest(free, ways, decision, decision.nodes, decision.cut)
    return bold if risk <= 0.5 * hit else decision


@kernel
def _boldest(free: Scene, ways: Ways, instead: Decision, nodes: int, cut: bool) -> tuple[Decision, float]:
    """To drive the best of the `ways` without a certificate, and its greatest risk of contact in a period; inf: there is none.

    Args:
        free: What the decision is about, without what a certificate asks.
        ways: Plans to choose from.
        instead: What is decided else.
        nodes: Nodes that have been spent.
        cut: Whether the budget ended the search.
    """
    best, last, states = int(np.argmin(ways.total)), len(ways.total) - 1, np.empty(instead.states.shape)
    if ways.total[best] == math.inf:
        return instead, math.inf
    _, cost, risk = weigh(free, ways.commands[best], states)
    shown = ways.states[:last, :, :2].copy()
    bold = Decision(
        ways.commands[best], states, cost, EVADING, -1, instead.stored, instead.tube, shown, best if best < last else -1, nodes, cut
    )  # fmt: skip
    return bold, risk


@kernel
def decide(
    settings: Settings, base: Base, slow: Base, memory: Memory, forecast: Forecast, counted: Forecast, field: Field, area: FloatArray,
    costs: SearchCosts, rules: Rules, safety: Safety, evasion: Evasion, pose: FloatArray,
) -> Decision:  # fmt: skip
    """Decide what to drive from `pose` (3,), with the `base`, or `slow` as it is beside who moves; of the forecast that counts in
    certificates which is `counted`."""
    scene = beside_who_moves(
        pose_scene(settings, base, memory, forecast, field, area, costs, safety, pose), slow, memory
    )
    found = find_or_widen(scene, memory, 0)
    ways = gather(scene, memory, found, settings.rounds)
    return evade(scene, memory, evasion, ways, choose(scene, memory, counted, rules, found, ways))
