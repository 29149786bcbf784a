"""What the search weighs: time gone, time to go, and how far it is from where it should be."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import inlined, light
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.contact import Base


class SearchCosts(NamedTuple):
    """What the search weighs.

    Attributes:
        step: Time from one layer to the next, s.
        stride: So many instants of the forecast are in it.
        contact_cost: So many seconds a contact is worth.
        discount: Factor on that per second ahead, as there is time to think again.
        margin: Distance that is kept from what stands, m.
        soft: Distance up to which nearness to what stands costs, m; no less than the margin.
        near: What it costs at the margin, s per s.
        yaw_change_cost: What a change of the yaw rate costs, s per rad/s.
        reverse_cost: What driving backwards costs, s per s.
        reach: Radius around the goal that ends the way, m.
        union: So many of the first instants count at any time, the belts of a planner that is blind to time; 0: each
            at its own.
        stop: Whether the robot has to stop at the goal.
        pace: Speed of the reference that is tracked where time to go doesn't count, see `worth`, m/s; 0: it counts.
        heading: With which heading it has to be there, rad.
        turn: Within which of that, rad; inf: the heading is free, or it can turn there.
        manoeuvres: What that takes, see `manoeuvres.manoeuvres_of`; `NONE` where the heading doesn't count.
        halt: What it costs to be where no certificate lets it go on, see `stopping`, s per s; 0: nothing, or nobody asks.
        ahead: In how many instants it can be at rest; 0 where `halt` is.
        sectors: Whether some nodes of each sector are kept; if not, as many more of the best.
    """

    step: float
    stride: int
    contact_cost: float
    discount: float
    margin: float
    soft: float
    near: float
    yaw_change_cost: float
    reverse_cost: float
    reach: float
    union: int
    stop: bool
    pace: float
    heading: float
    turn: float
    manoeuvres: FloatArray
    halt: float
    ahead: int
    sectors: bool


@light
def time_to_go(base: Base, far: float, cos_off: float, v: float, stop: bool) -> float:
    """How long it takes to a goal `far` [m] away past what stands, s, forwards or backwards, whichever is faster.

    A turn by a at full speed on an arc loses (a - sin a) / turn; what is lost to speeding up and braking is added.

    Args:
        base: The robot's base.
        far: Length of the way, in metres.
        cos_off: Cosine of the angle between the heading and the way.
        v: Speed now, in m/s.
        stop: Whether the robot has to stop there.
    """
    limits = base.limits
    fall = limits.deceleration if stop else math.inf
    return to_go(limits.v_min, limits.v_max, limits.omega_max, limits.acceleration, fall, far, cos_off, v)


@inlined
def to_go(
    low: float, high: float, turn: float, rate: float, fall: float, far: float, cos_off: float, v: float
) -> float:
    """The same with speeds from `low` to `high`, growth and decline `rate` and `fall` of them, and yaw rate `turn`."""
    cos_off = min(max(cos_off, -1.0), 1.0)
    a = abs(cos_off)  # Abramowitz and Stegun 4.4.45: within 7e-5 rad, at a third of the time
    off = math.sqrt(1.0 - a) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - a * 0.0187293)))
    if cos_off < 0.0:
        off = math.pi - off
    lost = off - math.sqrt(1.0 - a * a)
    best = _along(high, rate, fall, far, v) + lost / turn
    if low < 0.0:
        best = min(best, _along(-low, rate, fall, far, -v) + (math.pi - 2.0 * off + lost) / turn)
    return best


@inlined
def _along(high: float, rate: float, fall: float, far: float, v: float) -> float:
    """The same on a line, for one who drives towards the goal with `v`, at most with `high`."""
    lost = 0.0
    if fall < math.inf:
        stop = 0.5 * v * v / fall
        if v > 0.0 and stop > far:  # beyond it, and back
            return v / fall + math.sqrt(2.0 * (stop - far) * (1.0 / rate + 1.0 / fall))
        if v < high and far < 0.5 * (high * high - v * abs(v)) / rate + 0.5 * high * high / fall:  # never that fast
            top2 = max((far + 0.5 * v * abs(v) / rate) / (0.5 / rate + 0.5 / fall), 0.0)
            top = math.sqrt(top2)
            return max(top - v, 0.0) / rate + top / fall
        lost = 0.5 * high / fall
    if rate < math.inf:
        lost += max(high - v, 0.0) ** 2 / (2.0 * rate * high)
    return far / high + lost


@light
def faces(costs: SearchCosts, theta: float) -> bool:
    """Whether the heading `theta` [rad] will do at the goal."""
    return costs.turn == math.inf or abs(wrap(theta - costs.heading)) <= costs.turn


@light
def worth(costs: SearchCosts, first: float, t: float, far: float, left: float) -> float:
    """What it counts to be `far` [m] from the goal `t` [s] from now, s.

    With time to go that is the time gone and that `left` [s]. Without (`SearchCosts.pace` > 0) it is what tracking a reference
    counts, as in paper B: how far the place is, either way, from one that goes at the pace from `first` [m] on.
    """
    if costs.pace > 0.0:
        return abs(far - max(first - costs.pace * t, 0.0)) / costs.pace
    return t + left
