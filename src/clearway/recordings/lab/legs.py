"""Finds when each leg of a trial was driven: departure, arrival, the turn between.

Where goals are known they decide: a robot that waits for somebody on its way has not arrived. A leg begins when the
robot moves off from its start, and ends with the first instant of its last rest at the goal, final rotation included.
Where one leg runs into the next without a rest, it ends where the robot came nearest to its goal.
When a goal was sent or when the robot called it reached can't be seen from outside: a simulated leg also holds the
robot's first thinking, 0.1 s to 0.2 s, and lasts up to one control period beyond standstill.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Motion
from clearway.recordings.motion.rests import ARM, Course, Rest, course
from clearway.trials import Leg
from clearway.trials.trial import UNTIED

NEAR = 0.5
"""m; a rest so near to a goal, or within 2.5 of its tolerances, is an arrival there."""
USUAL, LEAST = 0.2, 0.01
"""m, and rad; tolerances that are looked by where they are unknown, and the smallest."""
SLACK = 1.25
"""Rests within so many tolerances go before others near the goal."""
ROUGH = 2.0
"""Within so many, a short stop may be an arrival as well."""
LEFT = 1.5
"""m; farther off than that and half the leg, the robot has left its goal for good."""
PAUSE = 0.5
"""s; a shorter stop, such as between braking and turning, is none farther off."""
AGAIN = 2.0
"""s; after so long it comes back to a goal that it has passed, it is another visit."""
MOVED = 0.1
"""m (or turning by a third of a radian): less is no leg."""
UNSEEN = 0.2
"""s; a leg whose start or end lies at a longer gap may have begun or ended anywhere in it."""


@dataclass(frozen=True, slots=True)
class FoundLeg:
    """When a leg was driven.

    Attributes:
        leg: Its index among the trial's legs.
        start: When it began, s on the motion's clock.
        end: When it ended, s on the motion's clock.
        reached: Whether the robot came to rest at the goal.
        why: How that is known: a sentence for people, who may correct it in the plan.
        rested: Whether its end was seen by a rest; else it is where the robot came nearest to the goal.
        unseen: For how long the robot was not seen about its start and about its end, s; 0 where it was.
    """

    leg: int
    start: float
    end: float
    reached: bool
    why: str
    rested: bool = True
    unseen: tuple[float, float] = (0.0, 0.0)


def find_legs(
    motion: Motion, legs: Sequence[Leg], *, rest: float = 2.0, sent: FloatArray | None = None, untied: bool = False
) -> list[FoundLeg]:
    """The legs that were begun, in order; one that was not reached is the last.

    Args:
        motion: Motion of base_link, in the map where goals are known.
        legs: The trial's legs, goals NaN where unknown.
        rest: s; a rest this long is no pause. It separates legs whose goals are unknown.
        sent: (k,) s on the motion's clock: when goals were sent, if that was recorded. A leg then begins with that.
        untied: Whether goals are given, and only the motion's tie to the map is missing.

    Raises:
        ClearwayError: the robot was hardly seen, or where goals are unknown, what was driven is not as many legs; the
            message says what was found.
    """
    if not legs:
        raise ClearwayError("the trial has no legs to find")
    seen = course(motion)
    legs = [_asked(leg) for leg in legs]
    if all(np.isfinite(leg.goal[:2]).all() for leg in legs):
        found = _by_goals(seen, legs, rest)
    else:
        found = _by_rests(seen, legs, rest, untied)
    found = [replace(f, unseen=(_unseen(motion, seen, f.start), _unseen(motion, seen, f.end))) for f in found]
    return found if sent is None else _sent(found, np.sort(np.asarray(sent, dtype=np.float64)))


def _unseen(motion: Motion, seen: Course, at: float) -> float:
    """How long the gap is that `at` [s] lies in or beside, or the stretch without the robot that ends the record; s."""
    bounds = np.concatenate((motion.t[:1], seen.t, motion.t[-1:]))
    usual = float(np.median(np.diff(seen.t)))
    steps = np.diff(bounds)
    beside = (bounds[:-1] <= at + usual) & (at - usual <= bounds[1:]) & (steps > max(UNSEEN, 3 * usual) + 1e-9)
    return float(steps[beside].max(initial=0.0))


def _asked(leg: Leg) -> Leg:
    """The leg with tolerances to look by, where its own are unknown or none."""
    xy, yaw = (USUAL if math.isnan(v) else max(v, LEAST) for v in (leg.xy_tolerance, leg.yaw_tolerance))
    return replace(leg, xy_tolerance=xy, yaw_tolerance=yaw)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where a leg starts or ends, with how near counts as there: m, rad (inf: any heading)."""

    pose: FloatArray
    xy: float
    yaw: float

    def holds(self, pose: FloatArray, share: float = 1.0) -> bool:
        return _away(pose, self.pose) <= share * self.xy and _turned(pose, self.pose) <= share * self.yaw


def _away(pose: FloatArray, place: FloatArray) -> float:
    return math.hypot(pose[0] - place[0], pose[1] - place[1])


def _turned(pose: FloatArray, place: FloatArray) -> float:
    """rad, 0 where a heading is unknown."""
    turn = float(pose[2] - place[2])
    return abs(math.remainder(turn, math.tau)) if math.isfinite(turn) else 0.0


def _length(leg: Leg) -> float:
    """m from start to goal; inf if the start is unknown."""
    length = _away(leg.goal, leg.start)
    return length if math.isfinite(length) else math.inf


def _places(legs: Sequence[Leg], i: int) -> tuple[_Place, _Place]:
    """Start and goal of leg i, so near that neither holds the other, nor the goal the next leg's."""
    leg = legs[i]
    start = leg.start if np.isfinite(leg.start[:2]).all() or i == 0 else legs[i - 1].goal
    reach = max(NEAR, 2.5 * leg.xy_tolerance if math.isfinite(leg.xy_tolerance) else 0.0)
    neighbours = [start, *([legs[i + 1].goal] if i + 1 < len(legs) else [])]
    there = [_away(leg.goal, n) for n in neighbours]
    turns = [_turned(n, leg.goal) for n, d in zip(neighbours, there, strict=True) if d < NEAR]
    near = min([reach, *(0.4 * d for d in there if d >= NEAR)])
    # the turn between decides only where the robot shall turn on the spot
    yaw = min([0.5 * turn for turn in turns if turn > leg.yaw_tolerance] or [math.inf])
    own = [_turned(start, leg.goal)] if there[0] < NEAR else []
    away = min([math.inf, *(0.5 * turn for turn in own if turn > leg.yaw_tolerance)])
    return _Place(start, near, away), _Place(leg.goal, near, yaw)


def _by_goals(seen: Course, legs: Sequence[Leg], rest: float) -> list[FoundLeg]:
    found: list[FoundLeg] = []
    before: Rest | None = None
    for i, leg in enumerate(legs):
        start, goal = _places(legs, i)
        after = -math.inf if before is None else before.start
        home = [r for r in seen.rests if r.start >= after and start.holds(r.pose)]
        if before is not None and _away(start.pose, before.pose) < LEFT and before not in home:
            home = [before, *home]  # it stopped short of where this leg should start
        arrival = _arrival(seen, legs, i, goal, home, after, rest)
        off, why_off = _departure(seen, start, home, before, arrival, goal, rest)
        if arrival is None:
            if before is None or _goes(seen, off):
                found.append(FoundLeg(i, off, float(seen.t[-1]), False, f"{why_off}; {_never(seen, leg, off)}"))
            break
        end, why_end = arrival.start, _at_goal(arrival, leg)
        found.append(FoundLeg(i, min(off, end), end, True, f"{why_off}; {why_end}", arrival.duration > 0.0))
        before = arrival
    return found


def _arrival(
    seen: Course, legs: Sequence[Leg], i: int, goal: _Place, home: list[Rest], after: float, rest: float
) -> Rest | None:
    """The rest that ends leg i: the first long one within the tolerances, else the last of that visit."""
    leg = legs[i]
    # a robot that already stood at the goal was put back to the start first
    earliest = home[0].end if home else after
    following = _places(legs, i + 1)[1] if i + 1 < len(legs) else None
    visit: list[Rest] = []
    for r in seen.rests:
        if r.start < earliest or (home and r is home[0]):
            continue
        if visit and (
            (following is not None and following.holds(r.pose)) or _gone(seen, goal, leg, visit[-1].end, r.start)
        ):
            break
        if goal.holds(r.pose):
            visit.append(r)
        elif following is not None and following.holds(r.pose) and _away(r.pose, goal.pose) <= goal.xy:
            break  # it ran through this goal's heading into the next leg
    xy = leg.xy_tolerance if math.isfinite(leg.xy_tolerance) else goal.xy
    asked = _Place(goal.pose, xy, leg.yaw_tolerance)
    within = [r for r in visit if asked.holds(r.pose, SLACK)] or [
        r for r in visit if r.duration >= PAUSE or asked.holds(r.pose, ROUGH)
    ]
    if within:
        return next((r for r in within if r.duration >= rest or r.closes), within[-1])
    passed = _passed(seen, legs, i, goal, earliest)
    if visit and (passed is None or not asked.holds(passed.pose)):
        return visit[-1]  # it hardly stood there, but it came no nearer either
    return passed


def _gone(seen: Course, goal: _Place, leg: Leg, since: float, until: float) -> bool:
    """Whether the robot left its goal for good between two rests there."""
    between = seen.pose[(seen.t > since) & (seen.t < until)]
    length = _length(leg)
    far = max(LEFT, 0.5 * length if math.isfinite(length) else 0.0)
    return bool(len(between)) and float(np.hypot(*(between[:, :2] - goal.pose[:2]).T).max()) > far


def _passed(seen: Course, legs: Sequence[Leg], i: int, goal: _Place, after: float) -> Rest | None:
    """How leg i ended, if no rest parts it from the next: where the robot came nearest to the goal's pose on its first
    visit, in terms of the tolerances; outside them only if it stopped driving there. The last leg may end with the record.
    """
    leg, last = legs[i], len(seen.t) - 1
    away = np.hypot(*(seen.pose[:, :2] - leg.goal[:2]).T)
    turned = np.abs(np.nan_to_num(np.remainder(seen.pose[:, 2] - leg.goal[2] + np.pi, math.tau) - np.pi))
    short = np.maximum(away / leg.xy_tolerance, turned / leg.yaw_tolerance)
    there = (seen.t >= after) & (away <= goal.xy) & (turned <= goal.yaw)
    if i + 1 == len(legs):
        there &= (np.arange(last + 1) == last) & (short <= 1.0)
    else:
        stopped = np.zeros(last + 1, dtype=bool)
        for stand in seen.stands:
            stopped |= (seen.t >= stand.start) & (seen.t <= stand.end) & (not stand.closes)
        there &= (short <= SLACK) | (stopped if _on_the_spot(legs, i) or _on_the_spot(legs, i + 1) else False)
    visit = np.flatnonzero(there)
    if not len(visit):
        return None
    visit = visit[: np.flatnonzero(np.diff(seen.t[visit], append=math.inf) > AGAIN)[0] + 1]
    k = int(visit[np.argmin(short[visit])])
    return Rest(float(seen.t[k]), float(seen.t[k]), seen.pose[k], False, k == last)


def _on_the_spot(legs: Sequence[Leg], i: int) -> bool:
    """Whether leg i is a turn in place."""
    leg = legs[i]
    start = leg.start if np.isfinite(leg.start[:2]).all() or i == 0 else legs[i - 1].goal
    return _away(start, leg.goal) < NEAR and _turned(start, leg.goal) > leg.yaw_tolerance


def _departure(
    seen: Course, start: _Place, home: list[Rest], before: Rest | None, arrival: Rest | None, goal: _Place, rest: float
) -> tuple[float, str]:
    """When the leg began, and why."""
    until = math.inf if arrival is None else arrival.start
    standing = [r for r in home if r.start < until and r is not arrival]
    if standing:
        last = len(standing) - 1
        if arrival is None and last > 0 and standing[-1].closes:
            last -= 1  # it came back and stayed
        while last > 0 and standing[last].duration < rest:
            last -= 1
        chosen = standing[last]
        pauses = [r for r in standing[last + 1 :] if r.duration >= PAUSE]
        how = f"moved off at {chosen.end:.2f} s after {chosen.duration:.1f} s of rest"
        if before is None and np.isfinite(start.pose[:2]).all():
            how += f", {_away(chosen.pose, start.pose):.2f} m from the start"
        if pauses:
            how += f", with {len(pauses)} pause{'s' * (len(pauses) > 1)} near it"
        return chosen.end, how
    if before is not None:
        return before.end, f"moved off at {before.end:.2f} s"
    elsewhere = [r for r in seen.rests if r.end < until and not goal.holds(r.pose)]
    if not elsewhere:
        return float(seen.t[0]), f"was moving already when the record begins at {seen.t[0]:.2f} s"
    chosen = next((r for r in reversed(elsewhere) if r.duration >= rest), elsewhere[0])
    where = ""
    if np.isfinite(start.pose[:2]).all():
        where = f", {_away(chosen.pose, start.pose):.2f} m from the start, farther than looked for"
    return chosen.end, f"moved off at {chosen.end:.2f} s after {chosen.duration:.1f} s of rest{where}"


def _at_goal(arrival: Rest, leg: Leg) -> str:
    away, turned = _away(arrival.pose, leg.goal), _turned(arrival.pose, leg.goal)
    heading = f" and {turned:.2f} rad" if math.isfinite(arrival.pose[2] + leg.goal[2]) else ""
    how = f"came to rest at {arrival.start:.2f} s, {away:.2f} m{heading} from the goal"
    if arrival.duration == 0.0:
        went_on = "the record ends there, without a rest" if arrival.closes else "it went on without a rest"
        how = f"was {away:.2f} m{heading} from the goal at {arrival.start:.2f} s; {went_on}"
    if away > leg.xy_tolerance or (heading and turned > leg.yaw_tolerance):
        how += ", outside its tolerance"
    return how


def _never(seen: Course, leg: Leg, since: float) -> str:
    after = seen.pose[seen.t >= since]
    nearest = float(np.hypot(*(after[:, :2] - leg.goal[:2]).T).min())
    last = (
        f"; it rested at the end, {_away(seen.pose[-1], leg.goal):.2f} m off"
        if seen.rests[-1:] and seen.rests[-1].closes
        else ""
    )
    return f"never came to rest at the goal (nearest {nearest:.2f} m){last}; ends with the record at {seen.t[-1]:.2f} s"


def _goes(seen: Course, since: float) -> bool:
    """Whether more than a twitch happened after `since`."""
    after = seen.pose[seen.t >= since]
    if not len(after):
        return False
    moved = np.hypot(*(after[:, :2] - after[0, :2]).T).max()
    turned = np.nan_to_num(np.abs(after[:, 2] - after[0, 2])).max()
    return bool(moved + ARM * turned > MOVED)


def _by_rests(seen: Course, legs: Sequence[Leg], rest: float, untied: bool) -> list[FoundLeg]:
    """Without goals: what lies between long rests."""
    still = [r for r in seen.rests if r.duration >= rest or r.opens or r.closes]
    ends = [*([] if still and still[0].opens else [float(seen.t[0])]), *(r.end for r in still if not r.closes)]
    stops = [*(r.start for r in still if not r.opens), *([] if still and still[-1].closes else [float(seen.t[-1])])]
    drives = [(a, b) for a, b in zip(ends, stops, strict=True) if b > a and _moved(seen, a, b) > MOVED]
    if len(drives) != len(legs):
        listed = "; ".join(f"{a:.1f} s to {b:.1f} s" for a, b in drives[:8]) or "none"
        why, give = (UNTIED, "that frame") if untied else ("the goals are unknown", "their goals")
        raise ClearwayError(
            f"{why}, and between rests of {rest:g} s and more the robot drove {len(drives)} times "
            f"({listed}) where the plan has {len(legs)} legs; give {give} or their spans"
        )
    rests = {r.start for r in still}
    return [
        FoundLeg(
            i, a, b, True,  # whether it got where it should, nobody can tell
            f"moved off at {a:.2f} s; " + (f"came to rest at {b:.2f} s" if b in rests else "still moved when the record ends"),
            b in rests,
        )
        for i, (a, b) in enumerate(drives)
    ]  # fmt: skip


def _moved(seen: Course, a: float, b: float) -> float:
    pose = seen.pose[(seen.t >= a) & (seen.t <= b)]
    if not len(pose):
        return 0.0
    turned = np.nan_to_num(np.abs(pose[:, 2] - pose[0, 2]))
    return float((np.hypot(*(pose[:, :2] - pose[0, :2]).T) + ARM * turned).max())


def _sent(found: list[FoundLeg], sent: FloatArray) -> list[FoundLeg]:
    """Legs begin when their goal was sent, if that was after the last arrival and before they moved off."""
    told = []
    since = -math.inf
    for leg in found:
        fits = sent[(sent > since) & (sent <= leg.start + 0.1)]
        if len(fits):
            why = f"goal sent at {fits[-1]:.2f} s, {leg.why}"
            told.append(replace(leg, start=float(fits[-1]), why=why, unseen=(0.0, leg.unseen[1])))
        else:
            told.append(leg)
        since = leg.end - 0.5
    return told
