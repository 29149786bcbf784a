"""The ways among moving discs that can be fastest: straight at full speed, and along a disc's edge at full speed.

Pontryagin's principle leaves nothing else where at most one disc is touched at a time: between contacts the costate is
constant, hence a straight line at full speed; in contact the point slides along the edge, again at full speed, until it
leaves in the direction that it has. So all of them form families with one parameter: the rays from the start (by
angle), and the rays that leave the edge that is being followed (by time). Where neighbours in a family differ in what
they meet, one between them grazes a disc, and a new family begins there.

Radii are taken larger by `SKIN`, so that chords of the followed edge stay clear of the disc itself.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from clearway.clairvoyant.disc_edges import SKIN, edge, follow, onward
from clearway.clairvoyant.moving_discs import Scene, centre, enter, first_hit
from clearway.clairvoyant.releases import RELEASE_STEP, approach, release_angle, releases
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

_FAN = 0.004  # rad between the start's rays
_EVENTS = 512  # the most new families of one


class _Family(NamedTuple):
    """Rays that leave one edge: the disc, which way round (1: counter-clockwise; 2, -2: see `releases`), from when,
    and where: angle on the disc and position; the family and time that it was reached from; its members if known."""

    disc: int
    side: int
    t: float
    phi: float
    x: float
    y: float
    parent: int
    left: float
    samples: FloatArray | None = None


def fastest(
    scene: Scene, start: FloatArray, t: float, latest: float, families: int = 400, waits: bool = False
) -> FloatArray | None:
    """The fastest of these ways from `start` (2,) at time `t` [s], arriving before `latest` [s].

    Args:
        families: The most to look at (the most promising first).
        waits: Whether there are also ways that wait for a fast disc to pass.

    Returns:
        (k, 3) t, x, y, or None.
    """
    crow = (math.hypot(start[0] - scene.goal[0], start[1] - scene.goal[1]) - scene.goal[2]) / scene.v
    limit = t + 1.08 * crow + 0.3
    while True:  # a late arrival makes for many families: widen the limit step by step
        limit = min(limit, latest)
        way = _Search(scene, start, t, limit, waits).run(families)
        if way is not None or limit >= latest:
            return way
        limit = t + 1.5 * (limit - t)


class _Search:
    """Best first over families, by the time that their first contact promises."""

    def __init__(self, scene: Scene, start: FloatArray, t: float, limit: float, waits: bool) -> None:
        self.scene, self.start, self.t, self.best, self.waits = scene, start, t, limit, waits
        self.known: list[_Family] = []
        self.queue: list[tuple[float, int]] = []
        self.tracks: dict[tuple[int, int], list[FloatArray]] = {}
        self.ending: tuple[int, float, float, float] | None = None  # family, time of leaving it, direction
        until = limit if len(scene.radii) == 0 else (len(scene.moving) - 1) * scene.dt
        self.released = np.zeros((len(scene.radii), 2, math.ceil(until / RELEASE_STEP) + 1), np.uint8)

    def run(self, families: int) -> FloatArray | None:
        fan = np.array([(self.t, 0.0, a) for a in _fan(self.scene, self.start)])
        self._expand(-1, -1, 0, fan)
        self._release(-1, self.start[0], self.start[1], self.t)
        expanded = 0
        while self.queue and expanded < families:
            promise, k = heapq.heappop(self.queue)
            if promise >= self.best - 1e-9:
                break
            expanded += self._look_at(k)
        return None if self.ending is None else self._way(*self.ending)

    def _look_at(self, k: int) -> bool:
        family = self.known[k]
        samples = family.samples
        if samples is None:
            seen = self.tracks.setdefault((family.disc, family.side), [])
            if _behind(family, seen):
                return False
            samples = follow(self.scene, family.disc, family.side, family.t, family.phi, self.best)
            if len(samples):
                seen.append(samples)
        if len(samples):
            self._expand(k, family.disc, family.side, samples)
        if abs(family.side) == 1:
            self._release(k, family.x, family.y, family.t)
        return True

    def _expand(self, k: int, disc: int, side: int, samples: FloatArray) -> None:
        events, arrival, left, dx, dy = _expand(self.scene, disc, side, self.start, samples, self.best)
        if arrival < self.best:
            self.best, self.ending = arrival, (k, left, dx, dy)
        for on, way_round, when, phi, x, y, gone, promise in events:
            self._add(promise, _Family(int(on), int(way_round), when, phi, x, y, k, gone))

    def _release(self, k: int, x: float, y: float, t: float) -> None:
        if not self.waits:
            return
        runs = releases(self.scene, x, y, t, self.best, self.released)
        for members in np.split(runs, np.flatnonzero(np.diff(runs[:, 5]) != 0.0) + 1) if len(runs) else []:
            disc, branch, promise = int(members[0, 3]), int(members[0, 4]), float(members[:, 6].min())
            samples = np.ascontiguousarray(members[:, :3])
            self._add(promise, _Family(disc, branch, t, 0.0, x, y, k, t, samples))

    def _add(self, promise: float, family: _Family) -> None:
        heapq.heappush(self.queue, (promise, len(self.known)))
        self.known.append(family)

    def _way(self, last: int, left: float, dx: float, dy: float) -> FloatArray:
        scene, chain = self.scene, []
        while last >= 0:
            chain.append((self.known[last], left))
            last, left = self.known[last].parent, self.known[last].left
        parts = [np.array([[self.t, self.start[0], self.start[1]]])]
        for f, leaves in reversed(chain):
            if f.samples is None:
                parts.append(edge(scene, f.disc, f.side, f.t, f.phi, leaves))
            else:
                parts.append(approach(scene, f.x, f.y, f.t, f.disc, f.side, leaves)[1])
        before = parts[-1][-1]
        reach = scene.v * (self.best - before[0])
        parts.append(np.array([[self.best, before[1] + reach * dx, before[2] + reach * dy]]))
        return np.ascontiguousarray(np.concatenate(parts))


def _fan(scene: Scene, start: FloatArray) -> FloatArray:
    """Angles of the start's rays, all around, one of them straight to the goal."""
    ahead = math.atan2(scene.goal[1] - start[1], scene.goal[0] - start[0])
    n = round(math.pi / _FAN)
    return ahead + np.linspace(-math.pi, math.pi, 2 * n + 1)


def _behind(family: _Family, seen: list[FloatArray]) -> bool:
    """Whether one that slides the same way round the same disc is ahead of it (or level)."""
    for samples in seen:
        if samples[0, 0] - 1e-9 <= family.t <= samples[-1, 0]:
            phi = float(np.interp(family.t, samples[:, 0], samples[:, 1]))
            ahead = math.remainder(phi - family.phi, math.tau) * family.side
            if ahead >= -1e-7:
                return True
    return False


@kernel
def _ray(
    scene: Scene, x: float, y: float, t: float, dx: float, dy: float, own: int, limit: float
) -> tuple[int, float, float]:
    """What a ray at full speed meets (-1: nothing worth while), after how long, and when it reaches the goal (or inf)."""
    v, gx, gy, reach = scene.v, scene.goal[0] - x, scene.goal[1] - y, scene.goal[2]
    slack = v * (limit - t) + reach
    ahead = gx * dx + gy * dy
    gap2 = gx * gx + gy * gy
    if slack <= ahead or slack * slack <= gap2:
        return -1, 0.0, math.inf
    duration = min(
        (slack * slack - gap2) / (2.0 * v * (slack - ahead)), limit - t
    )  # then the goal is too far to make it
    into = enter(-gx, -gy, v * dx, v * dy, v * v, reach)
    duration = min(duration, into)
    if dx != 0.0:
        duration = min(duration, max(((scene.area[2] if dx > 0.0 else scene.area[0]) - x) / (v * dx), 0.0))
    if dy != 0.0:
        duration = min(duration, max(((scene.area[3] if dy > 0.0 else scene.area[1]) - y) / (v * dy), 0.0))
    disc, s = first_hit(scene, x, y, t, v * dx, v * dy, duration, own, SKIN)
    if disc >= 0:
        return disc, s, math.inf
    return -1, s, (t + into if into <= duration else math.inf)


@kernel
def _member(
    scene: Scene, disc: int, side: int, start: FloatArray, samples: FloatArray, s: float
) -> tuple[float, float, float, float, float, float]:
    """A member of a family: x, y, t, dx, dy, phi. `s` counts samples."""
    k = min(max(int(s), 0), samples.shape[0] - 1)
    part = s - k
    t, phi, angle = samples[k, 0], samples[k, 1], samples[k, 2]
    if part > 0.0 and k + 1 < samples.shape[0]:
        angle += part * (samples[k + 1, 2] - angle)
        later = t + part * (samples[k + 1, 0] - t)
        if abs(side) == 1 and later > t:
            phi = onward(scene, disc, side, t, phi, later)
        t = later
    if disc < 0:
        return start[0], start[1], t, math.cos(angle), math.sin(angle), phi
    x, y, ux, uy, radius = centre(scene, disc, t)
    if abs(side) == 2:
        phi = release_angle(ux, uy, scene.v, side)
        angle = phi + math.pi
    x, y = x + (radius + SKIN) * math.cos(phi), y + (radius + SKIN) * math.sin(phi)
    return x, y, t, math.cos(angle), math.sin(angle), phi


@kernel
def _expand(
    scene: Scene, disc: int, side: int, start: FloatArray, samples: FloatArray, limit: float
) -> tuple[FloatArray, float, float, float, float]:
    """The families that begin where members of this one graze a disc, and the best arrival of a member.

    Returns:
        (k, 8) disc, side, time, phi, x, y, time of leaving this family, promised arrival; arrival (inf: none), the time of
        leaving for it, and the direction.
    """
    events = np.empty((_EVENTS, 8))
    count = 0
    best, best_left, best_dx, best_dy = math.inf, 0.0, 0.0, 0.0
    stack = np.empty((128, 2))
    codes = np.empty((128, 2), np.int64)
    last_code, last_side = -1, 0.0
    for k in range(samples.shape[0]):
        x, y, t, dx, dy, _ = _member(scene, disc, side, start, samples, float(k))
        code, _, arrival = _ray(scene, x, y, t, dx, dy, disc, limit)
        if arrival < min(best, limit):
            best, best_left, best_dx, best_dy = arrival, t, dx, dy
        offside = dx * (scene.goal[1] - y) - dy * (scene.goal[0] - x)
        ahead = dx * (scene.goal[0] - x) + dy * (scene.goal[1] - y)
        aimed = ahead > 0.0 and (offside == 0.0 or (k > 0 and last_side * offside < 0.0))
        if aimed:  # a member between the last and this one heads for the goal's centre
            a, b = max(k - 1.0, 0.0), float(k)
            for _ in range(50):
                middle = 0.5 * (a + b)
                mx, my, mt, mdx, mdy, _ = _member(scene, disc, side, start, samples, middle)
                if (mdx * (scene.goal[1] - my) - mdy * (scene.goal[0] - mx)) * last_side > 0.0:
                    a = middle
                else:
                    b = middle
            mx, my, mt, mdx, mdy, _ = _member(scene, disc, side, start, samples, b)
            ex, ey = scene.goal[0] - mx, scene.goal[1] - my
            far = max(math.hypot(ex, ey), 1e-12)
            _, _, arrival = _ray(scene, mx, my, mt, ex / far, ey / far, disc, limit)
            if arrival < min(best, limit):
                best, best_left, best_dx, best_dy = arrival, mt, ex / far, ey / far
        if k > 0 and code != last_code:
            size = 1
            stack[0, 0], stack[0, 1] = k - 1.0, float(k)
            codes[0, 0], codes[0, 1] = last_code, code
            while size > 0:
                size -= 1
                a, b = stack[size, 0], stack[size, 1]
                ca, cb = codes[size, 0], codes[size, 1]
                if ca == cb:
                    continue
                middle = 0.5 * (a + b)
                if b - a > 1e-10 * samples.shape[0] and a < middle < b and size < 126:
                    x, y, t, dx, dy, _ = _member(scene, disc, side, start, samples, middle)
                    cm, _, _ = _ray(scene, x, y, t, dx, dy, disc, limit)
                    stack[size, 0], stack[size, 1] = a, middle
                    codes[size, 0], codes[size, 1] = ca, cm
                    stack[size + 1, 0], stack[size + 1, 1] = middle, b
                    codes[size + 1, 0], codes[size + 1, 1] = cm, cb
                    size += 2
                    continue
                xa, ya, ta, dxa, dya, _ = _member(scene, disc, side, start, samples, a)
                _, sa, _ = _ray(scene, xa, ya, ta, dxa, dya, disc, limit)
                xb, yb, tb, dxb, dyb, _ = _member(scene, disc, side, start, samples, b)
                _, sb, _ = _ray(scene, xb, yb, tb, dxb, dyb, disc, limit)
                if cb >= 0 and (ca < 0 or sb < sa):
                    xa, ya, ta, dxa, dya, sa, ca = xb, yb, tb, dxb, dyb, sb, cb
                if count >= _EVENTS:
                    continue
                hx, hy, when = xa + scene.v * dxa * sa, ya + scene.v * dya * sa, ta + sa
                cx, cy, _, _, _ = centre(scene, ca, when)
                nx, ny = hx - cx, hy - cy
                turn = nx * dya - ny * dxa
                events[count, 0] = ca
                events[count, 1] = 1.0 if turn > 0.0 else -1.0
                events[count, 2] = when
                events[count, 3] = math.atan2(ny, nx)
                events[count, 4], events[count, 5], events[count, 6] = hx, hy, ta
                far = math.hypot(scene.goal[0] - hx, scene.goal[1] - hy) - scene.goal[2]
                events[count, 7] = when + max(far, 0.0) / scene.v
                count += 1
        last_code, last_side = code, offside
    return events[:count], best, best_left, best_dx, best_dy
