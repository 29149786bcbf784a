"""Several robots on their ways at once: each decides at its own instants, and none drives through another.

At the end of a control period it is known where all the others went in it. So a robot drives it twice: once among what stands, for
all who go by where it is, then, where it may meet one of them, among where they went. What others decided within that one period because of where it would have
been had nothing moving been in its way, they have decided.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from clearway.contract import BodyKind
from clearway.trials import Body
from clearway.world.drive import Drive
from clearway.world.traffic import Traffic

_SAME = 1e-9  # s
_TIE = 1e-4
"""Contacts within this are at once, s: the two who touch find it each in their own steps."""


def together(drives: Sequence[Drive], names: Sequence[str], traffic: Traffic) -> Iterator[Sequence[Drive]]:
    """Drive until the trial of each robot is over; robots whose own is over stand where they come to rest.

    Args:
        drives: Of each robot, in the order in which they joined the traffic.
        names: Of the robots as the others meet them.
        traffic: What moves there.

    Yields:
        Those whose control periods begin: each has to `decide`, or to `sense` and `follow`, before it goes on.
    """
    traffic.start()
    for drive in drives:
        drive.begin()
    if len(drives) == 1:
        yield from _alone(drives, traffic)
        return
    due = list(drives)
    while True:
        yield due
        if all(drive.outcome is not None for drive in drives):
            return
        under_way = [drive for drive in drives if not drive.halted]
        for drive in due:
            if not drive.halted:
                drive.rehearse(traffic)
        end = min(drive.end for drive in under_way)
        traffic.decide_until(end)
        due = _settle(under_way, dict(zip(names, drives, strict=True)), end)


def _alone(drives: Sequence[Drive], traffic: Traffic) -> Iterator[Sequence[Drive]]:
    """The same of one robot: whatever it touches ends it all."""
    (drive,), decided, ridden_among = drives, traffic.decided, traffic.ridden_among
    while drive.outcome is None:
        yield drives
        if drive.outcome is not None:
            return
        if ridden_among:
            touched = drive.ride()
        else:
            if decided:
                drive.rehearse(traffic)
                traffic.decide_until(drive.end)
            _, touched = drive.look()
        if touched is None:
            drive.keep()
        else:
            drive.collide(touched)


def _settle(under_way: Sequence[Drive], named: dict[str, Drive], end: float) -> list[Drive]:
    """What the robots that are under way drive until `end` [s], now that it is known where all the others went by then: those whose
    periods end there; whoever is still in its period may be stopped before that too."""
    who = {drive: name for name, drive in named.items()}
    looked = {drive: drive.look() for drive in under_way}
    while True:
        hits = {d: (t, touched) for d, (t, touched) in looked.items() if touched is not None and t <= end + _SAME}
        if not hits:
            break
        first = min(t for t, _ in hits.values())
        stopped = {d: touched for d, (t, touched) in hits.items() if t <= first + _TIE}
        for drive, touched in stopped.items():
            drive.collide(touched)
        for drive, touched in stopped.items():
            other = _robot(touched, named)
            if other is not None and not other.halted:
                other.collide(other.world.body(who[drive]), first)
        looked = {drive: drive.look() for drive in looked if not drive.halted}
    due = [drive for drive in looked if drive.end <= end + _SAME]
    for drive in due:
        drive.keep()
    return due


def _robot(touched: Body, named: dict[str, Drive]) -> Drive | None:
    """The robot that was touched, if it was one of them."""
    return named.get(touched.name) if touched.kind == BodyKind.ROBOT else None
