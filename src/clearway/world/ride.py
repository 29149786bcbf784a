"""A control period of one robot in as few calls of kernels as there can be."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.held import Held
from clearway.geometry.shapes import FloatArray
from clearway.world.between import Near, far
from clearway.world.laid import lay_way
from clearway.world.plant import drive_period, unmet
from clearway.world.setting import ELAPSED, STATE, WAY, Moving, Setting


class Ride(NamedTuple):
    """A robot on its way.

    Attributes:
        setting: It, among all that it can touch.
        nothing: What moves when nothing does.
        state: (STATE,) now, see `setting`.
        began: (STATE,) when the period began; kept up where somebody decides by where it drives.
        rehearsed: (STATE,) as the period ends if it meets nobody.
        knots: (ROBOTS_ROOM, 4) its track as those see it who decide, see `laid.RobotTracks`.
        laid: (1,) int64, how many knots that has.
        as_rehearsed: (1,) whether `Setting.way` is the rehearsed way, and nothing that stands is in it.
        near: How near it has come to what moves.
    """

    setting: Setting
    nothing: Moving
    state: FloatArray
    began: FloatArray
    rehearsed: FloatArray
    knots: FloatArray
    laid: npt.NDArray[np.int64]
    as_rehearsed: npt.NDArray[np.bool_]
    near: Near


class Period(NamedTuple):
    """A control period.

    Attributes:
        number: How many came before.
        t: When it begins, s.
        end: Decisions up to this time are made before it is over, s.
    """

    number: int
    t: float
    end: float


@kernel
def hold(ride: Ride) -> Held[Ride]:
    """`ride`, as the others here take it."""
    return Held(ride)


@light
def rehearse(ride: Ride, count: int, leg: int, t: float) -> None:
    """Lay the track that the robot would drive in control period `count`, from time `t` [s] on, if nothing else moved.

    Args:
        leg: The leg whose tracks count.
    """
    vehicle, still, _, commands, way, room = ride.setting
    state, period = ride.state, vehicle.period
    hit = drive_period(state, count, leg, t, Setting(vehicle, still, ride.nothing, commands, way, room))
    ride.as_rehearsed[0] = hit < 0
    for c in range(STATE):
        ride.rehearsed[c] = state[c]
    if hit >= 0:  # from there on it stands
        n = len(way) - 1
        reached = max(math.ceil(state[ELAPSED] / period * n - 1e-9), 1)
        for i in range(reached + 1, n + 1):
            for c in range(WAY):
                way[i, c] = way[reached, c]
    for c in range(STATE):
        state[c] = ride.began[c]
    lay_way(ride.knots, ride.laid, t, period, way)


@light
def drive(ride: Ride, count: int, leg: int, t: float) -> int:
    """Drive in control period `count`, from time `t` [s] on, or until contact, now that it is known where all others go: the same when it
    is asked again.

    Returns:
        As `plant.drive_period`.
    """
    if unmet(ride.began, ride.rehearsed, leg, t, ride.setting) and ride.as_rehearsed[0]:
        for c in range(STATE):
            ride.state[c] = ride.rehearsed[c]
        return -1
    ride.as_rehearsed[0] = False
    for c in range(STATE):
        ride.state[c] = ride.began[c]
    return drive_period(ride.state, count, leg, t, ride.setting)


@light
def seen_far(ride: Ride, leg: int, t: float, hit: int) -> bool:
    """Whether nothing of the period that began at `t` [s] is worth being kept between its samples, see `between.far`."""
    driven = ride.setting.vehicle.period if hit < 0 else ride.state[ELAPSED]
    return far(ride.setting, ride.near, leg, t, driven)


@kernel
def rehearse_held(held: Held[Ride], count: int, leg: int, t: float) -> None:
    """`rehearse`."""
    _rehearse(held, count, leg, t)


@kernel
def drive_held(held: Held[Ride], count: int, leg: int, t: float) -> tuple[int, bool]:
    """`drive`; what it hit, and whether nothing is worth being kept."""
    return _drive(held, count, leg, t)


@kernel
def drive_on(held: Held[Ride], count: int, leg: int, t: float) -> tuple[int, bool]:
    """Drive among what stands or runs on rails; what it hit, and whether nothing is worth being kept."""
    return _drive_on(held, count, leg, t)


@light
def _rehearse(held: Held[Ride], count: int, leg: int, t: float) -> None:
    rehearse(held.value, count, leg, t)


@light
def _drive(held: Held[Ride], count: int, leg: int, t: float) -> tuple[int, bool]:
    ride = held.value
    hit = drive(ride, count, leg, t)
    return hit, seen_far(ride, leg, t, hit)


@light
def _drive_on(held: Held[Ride], count: int, leg: int, t: float) -> tuple[int, bool]:
    ride = held.value
    hit = drive_period(ride.state, count, leg, t, ride.setting)
    return hit, seen_far(ride, leg, t, hit)
