"""A compiled crowd from decision to decision, alone or with a robot that drives among it.

Whichever crowd it is, one kernel takes it as far as it gets: up to a time, or until there is something to look up or to write down, which Python sees
to. A new kind of crowd is a line in `_WALK_UNTIL`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from clearway.geometry.compiled import kernel
from clearway.geometry.held import Held
from clearway.world.arrivals import Arrivals
from clearway.world.behaviours import crowdnav, walkers
from clearway.world.behaviours.behaviour import CompiledBehaviour, Street
from clearway.world.ride import Period, Ride, drive, rehearse, seen_far


def walk_until(
    crowd: Held[Any], street: Held[Street], leg: int, count: int, t: float, looked: bool
) -> tuple[int, bool]:  # fmt: skip
    """Decide from instant number `count` on, up to time `t` [s], or until there is something to `look` to; for kernels.

    Args:
        crowd: Who they are; updated.
        street: Where they are; their tracks are laid, for a `PERIOD` beyond the last decision.
        leg: Number of the leg that the tracks are in.
        count: Number of decisions so far.
        t: The last decision is not after it.
        looked: Whether at the first of these instants that has been seen to.

    Returns:
        The number of decisions by then, and whether there is something to `look` to.
    """
    raise NotImplementedError


_WALK_UNTIL = {walkers.Crowd: walkers.walk_until, crowdnav.Crowd: crowdnav.walk_until}


@overload(walk_until)  # type: ignore[untyped-decorator]
def _walk_until(crowd: Any, street: Any, leg: Any, count: Any, t: Any, looked: Any) -> Any:
    of_its_kind: Any = _WALK_UNTIL[crowd.field_dict["value"].instance_class]

    def chosen(crowd: Any, street: Any, leg: Any, count: Any, t: Any, looked: Any) -> Any:
        return of_its_kind(crowd, street, leg, count, t, looked)

    return chosen


@kernel
def _walk(
    crowd: Held[Any], street: Held[Street], leg: int, count: int, t: float, looked: bool
) -> tuple[int, bool]:  # fmt: skip
    return walk_until(crowd, street, leg, count, t, looked)


class Among(NamedTuple):
    """A robot among a crowd.

    Attributes:
        crowd: See `walk_until`.
        street: The same.
        ridden: The robot.
    """

    crowd: Held[Any]
    street: Held[Street]
    ridden: Held[Ride]


@kernel
def hold_among(crowd: Held[Any], street: Held[Street], ridden: Held[Ride]) -> Held[Among]:
    """A robot among a crowd, as `ride_until` takes it."""
    return Held(Among(crowd, street, ridden))


@kernel
def _ride(
    among: Held[Among], leg: int, count: int, number: int, t: float, end: float, looked: bool
) -> tuple[int, bool, int, bool]:  # fmt: skip
    """Whether there is something to `look` to; if not, what the robot hit, and whether nothing is worth being kept."""
    crowd, street, ridden = among.value
    ride = ridden.value
    if not looked:
        rehearse(ride, number, leg, t)
    count, news = walk_until(crowd, street, leg, count, end, looked)
    if news:
        return count, True, -1, True
    hit = drive(ride, number, leg, t)
    return count, False, hit, seen_far(ride, leg, t, hit)


def decide_until(
    behaviour: CompiledBehaviour, street: Held[Street], leg: int, count: int, t: float, arrivals: Arrivals
) -> int:
    """`walk_until` time `t` [s], whatever there is to look to; the number of decisions by then."""
    looked = False
    while True:
        count, news = _walk(behaviour.crowd, street, leg, count, t, looked)
        if not news:
            return count
        look(behaviour, arrivals)
        looked = True


def ride_until(
    behaviour: CompiledBehaviour, among: Held[Among], leg: int, count: int, period: Period, arrivals: Arrivals
) -> tuple[int, int, bool]:  # fmt: skip
    """The same to the end of the `period` of the only robot, which drives `among` them meanwhile.

    Returns:
        The number of decisions by then, what it hit, see `plant.drive_period`, and whether nothing is worth being kept, see `ride.seen_far`.
    """
    looked = False
    while True:
        count, news, hit, far = _ride(among, leg, count, *period, looked)
        if not news:
            return count, hit, far
        look(behaviour, arrivals)
        looked = True


def look(behaviour: CompiledBehaviour, arrivals: Arrivals) -> None:
    """The crowd's kernel has stopped, as there is something to look up or to write down: that is done."""
    behaviour.look_up()
    arrivals.take_note()
