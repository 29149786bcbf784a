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

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SKIN = 2e-4
"""How far outside a disc's edge the point slides, m."""

STEP = 0.004
"""Of the integration along an edge, s."""

_FAN = 0.004  # rad between the start's rays
_EVENTS = 512  # the most new families of one


class Scene(NamedTuple):
    """What compiled code needs to know of the discs.

    Attributes:
        static: (n, 3) x, y, R [m]. moving: (T, m, 2) centres [m] every `dt` [s], NaN: absent. radii: (m,) m.
        speed: (m,) the most that each ever does, m/s. dt: s. area: (4,) x_min, y_min, x_max, y_max [m].
        goal: (3,) x, y, radius [m]. v: m/s.
    """

    static: FloatArray
    moving: FloatArray
    radii: FloatArray
    speed: FloatArray
    dt: float
    area: FloatArray
    goal: FloatArray
    v: float


class _Family(NamedTuple):
    """Rays that leave one edge: which disc, which way round (1: counter-clockwise), from when and where on it, and the
    family and time that it was reached from."""

    disc: int
    side: int
    t: float
    phi: float
    parent: int
    left: float


def fastest(
    scene: Scene, start: FloatArray, t: float, latest: float, families: int = 400, best_known: float = math.inf
) -> FloatArray | None:
    """The fastest of these ways from `start` (2,) at time `t` [s], arriving before `latest` [s].

    Args:
        families: the most to look at (the most promising first). best_known: arrival time of a way that is known.

    Returns:
        (k, 3) t, x, y, or None.
    """
    crow = (math.hypot(start[0] - scene.goal[0], start[1] - scene.goal[1]) - scene.goal[2]) / scene.v
    limit = t + 1.08 * crow + 0.3
    latest = min(latest, best_known)
    while True:  # a late arrival makes for many families: widen the limit step by step
        limit = min(limit, latest)
        way = _search(scene, start, t, limit, families)
        if way is not None or limit >= latest:
            return way
        limit = t + 1.5 * (limit - t)


def _search(scene: Scene, start: FloatArray, t: float, limit: float, families: int) -> FloatArray | None:
    known: list[_Family] = []
    queue: list[tuple[float, int]] = []
    tracks: dict[tuple[int, int], list[FloatArray]] = {}
    best, ending = limit, (-2, 0.0, 0.0, 0.0)  # family, time of leaving, direction

    def add(events: FloatArray, parent: int) -> None:
        for disc, side, when, phi, left, promise in events:
            heapq.heappush(queue, (promise, len(known)))
            known.append(_Family(int(disc), int(side), when, phi, parent, left))

    fan = np.array([(t, 0.0, a) for a in _fan(scene, start)])
    events, arrival, left, dx, dy = _expand(scene, -1, 0, start, fan, best)
    if arrival < best:
        best, ending = arrival, (-1, left, dx, dy)
    add(events, -1)
    expanded = 0
    while queue and expanded < families:
        promise, k = heapq.heappop(queue)
        if promise >= best - 1e-9:
            break
        family = known[k]
        seen = tracks.setdefault((family.disc, family.side), [])
        if _behind(family, seen):
            continue
        expanded += 1
        samples = _follow(scene, family.disc, family.side, family.t, family.phi, best)
        if len(samples) == 0:
            continue
        seen.append(samples)
        events, arrival, left, dx, dy = _expand(scene, family.disc, family.side, start, samples, best)
        if arrival < best:
            best, ending = arrival, (k, left, dx, dy)
        add(events, k)
    if ending[0] == -2:
        return None
    return _way(scene, start, t, known, ending[0], ending[1], best)


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


def _way(
    scene: Scene, start: FloatArray, t: float, known: list[_Family], last: int, left: float, arrival: float
) -> FloatArray:
    chain = []
    while last >= 0:
        chain.append((known[last], left))
        last, left = known[last].parent, known[last].left
    parts = [np.array([[t, start[0], start[1]]])]
    for family, leaves in reversed(chain):
        parts.append(_edge(scene, family.disc, family.side, family.t, family.phi, leaves))
    before = parts[-1][-1]
    gap = scene.goal[:2] - before[1:]
    reach = scene.v * (arrival - before[0])
    # the last ray ends where it enters the goal's circle: on the line to the centre, or beside it (see _expand)
    direction = gap / max(float(np.hypot(gap[0], gap[1])), 1e-12)
    parts.append(np.array([[arrival, *(before[1:] + reach * direction)]]))
    return np.ascontiguousarray(np.concatenate(parts))


@kernel
def centre(scene: Scene, disc: int, t: float) -> tuple[float, float, float, float, float]:
    """Where a disc is at time t, its velocity (after a kink: the new one) and its radius. NaN where it is absent."""
    n = scene.static.shape[0]
    if disc < n:
        return scene.static[disc, 0], scene.static[disc, 1], 0.0, 0.0, scene.static[disc, 2]
    j = disc - n
    k = min(max(int(math.floor(t / scene.dt + 1e-9)), 0), scene.moving.shape[0] - 2)
    ux = (scene.moving[k + 1, j, 0] - scene.moving[k, j, 0]) / scene.dt
    uy = (scene.moving[k + 1, j, 1] - scene.moving[k, j, 1]) / scene.dt
    s = t - k * scene.dt
    return scene.moving[k, j, 0] + ux * s, scene.moving[k, j, 1] + uy * s, ux, uy, scene.radii[j]


@kernel
def clear(scene: Scene, points: FloatArray) -> bool:
    """Whether the way (k, 3) t, x, y, straight between its points, keeps out of all discs, between points too."""
    for k in range(points.shape[0] - 1):
        duration = points[k + 1, 0] - points[k, 0]
        if duration > 0.0:
            vx, vy = (points[k + 1, 1] - points[k, 1]) / duration, (points[k + 1, 2] - points[k, 2]) / duration
            hit, _ = first_hit(scene, points[k, 1], points[k, 2], points[k, 0], vx, vy, duration, -1, 0.0)
            if hit >= 0:
                return False
    return True


@kernel
def first_hit(
    scene: Scene, x: float, y: float, t: float, vx: float, vy: float, duration: float, own: int, skin: float
) -> tuple[int, float]:
    """What a point first comes within R + skin of that moves from (x, y) at time t with (vx, vy) for `duration` [s].

    `own` is the disc whose edge it leaves: for that one the skin is halved, so that rounding is no contact.

    Returns:
        The disc (static ones first; -1: none) and after how long, s.
    """
    found, best = -1, duration
    n = scene.static.shape[0]
    speed2 = vx * vx + vy * vy
    for i in range(n):
        r = scene.static[i, 2] + (0.5 * skin if i == own else skin)
        wx, wy = x - scene.static[i, 0], y - scene.static[i, 1]
        s = _enter(wx, wy, vx, vy, speed2, r)
        if s <= best and s < math.inf:
            found, best = i, s
    own_speed = math.sqrt(speed2)
    last = scene.moving.shape[0] - 1
    for j in range(scene.radii.shape[0]):
        r = scene.radii[j] + (0.5 * skin if n + j == own else skin)
        s = 0.0
        closing = own_speed + scene.speed[j]
        while s < best:
            k = int(math.floor((t + s) / scene.dt + 1e-9))
            if k >= last:
                break
            end = (k + 1) * scene.dt - t
            ax, ay = scene.moving[k, j, 0], scene.moving[k, j, 1]
            ux, uy = (scene.moving[k + 1, j, 0] - ax) / scene.dt, (scene.moving[k + 1, j, 1] - ay) / scene.dt
            if math.isnan(ux):
                s = end
                continue
            ago = t + s - k * scene.dt
            wx, wy = x + vx * s - ax - ux * ago, y + vy * s - ay - uy * ago
            free = (math.sqrt(wx * wx + wy * wy) - r) / max(closing, 1e-12)
            if free > end - s and closing < math.inf:
                s += free * (1.0 - 1e-12)
                continue
            rx, ry = vx - ux, vy - uy
            into = _enter(wx, wy, rx, ry, rx * rx + ry * ry, r)
            if s + into <= end:
                if s + into <= best:
                    found, best = n + j, s + into
                break
            s = end
    return found, best


@kernel
def _enter(wx: float, wy: float, vx: float, vy: float, speed2: float, r: float) -> float:
    """When a point at w with velocity v enters the circle of radius r around 0: 0 if it is inside and goes on inwards."""
    b, c = wx * vx + wy * vy, wx * wx + wy * wy - r * r
    if b >= 0.0 or speed2 == 0.0:
        return 0.0 if c < -1e-9 else math.inf
    if c <= 0.0:
        return 0.0
    root = b * b - speed2 * c
    if root <= 0.0:
        return math.inf
    return c / (-b + math.sqrt(root))


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
    into = _enter(-gx, -gy, v * dx, v * dy, v * v, reach)
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
def _slide(scene: Scene, disc: int, side: int, t: float, phi: float) -> tuple[float, float, float]:
    """How a point slides along an edge at full speed: d phi / dt, and its direction. NaN: the disc is faster."""
    _, _, ux, uy, radius = centre(scene, disc, t)
    nx, ny = math.cos(phi), math.sin(phi)
    along = ux * nx + uy * ny
    rest = scene.v * scene.v - along * along
    if not rest > 0.0:
        return math.nan, 0.0, 0.0
    root = side * math.sqrt(rest)
    dx, dy = along * nx - root * ny, along * ny + root * nx
    return (root - (uy * nx - ux * ny)) / (radius + SKIN), dx / scene.v, dy / scene.v


@kernel
def _onward(scene: Scene, disc: int, side: int, t: float, phi: float, until: float) -> float:
    """phi at `until`, sliding on from (t, phi): midpoint steps that end at the kinks of the disc's motion."""
    moving = disc >= scene.static.shape[0]
    while t < until - 1e-12:
        h = min(until - t, STEP)
        if moving:
            kink = (math.floor(t / scene.dt + 1e-9) + 1.0) * scene.dt
            h = min(h, kink - t)
        rate, _, _ = _slide(scene, disc, side, t, phi)
        rate, _, _ = _slide(scene, disc, side, t, phi + 0.5 * h * rate)
        phi += h * rate
        t += h
    return phi


@kernel
def _edge(scene: Scene, disc: int, side: int, t: float, phi: float, until: float) -> FloatArray:
    """The way along an edge as points (k, 3) t, x, y."""
    n = int(math.ceil(max(until - t, 0.0) / STEP - 1e-9)) + 1
    kinks = int((until - t) / scene.dt) + 2
    points = np.empty((n + kinks, 3))
    k = 0
    while True:
        x, y, _, _, radius = centre(scene, disc, t)
        points[k, 0] = t
        points[k, 1] = x + (radius + SKIN) * math.cos(phi)
        points[k, 2] = y + (radius + SKIN) * math.sin(phi)
        k += 1
        if t >= until - 1e-12 or k >= points.shape[0]:
            break
        after = min(t + STEP, until)
        if disc >= scene.static.shape[0]:
            after = min(after, (math.floor(t / scene.dt + 1e-9) + 1.0) * scene.dt)
        phi = _onward(scene, disc, side, t, phi, after)
        t = after
    return points[:k]


@kernel
def _follow(scene: Scene, disc: int, side: int, t: float, phi: float, limit: float) -> FloatArray:
    """Samples (k, 3) t, phi, angle of the leaving ray, as long as sliding on is possible and may be worth while.

    At a kink of the disc's motion away from the point, rays leave in all directions between those before and after.
    """
    out = np.empty((2000, 3))
    k, fine = 0, 5.0 * STEP
    moving = disc >= scene.static.shape[0]
    began = phi
    before = math.nan
    while k < out.shape[0] - 12:
        x, y, _, _, radius = centre(scene, disc, t)
        px, py = x + (radius + SKIN) * math.cos(phi), y + (radius + SKIN) * math.sin(phi)
        if math.isnan(px) or not (scene.area[0] <= px <= scene.area[2] and scene.area[1] <= py <= scene.area[3]):
            break
        far = math.hypot(scene.goal[0] - px, scene.goal[1] - py) - scene.goal[2]
        if t + far / scene.v >= limit or abs(phi - began) > math.tau:
            break
        if moving and t >= (scene.moving.shape[0] - 1) * scene.dt - 1e-9:
            break
        hit, _ = first_hit(scene, px, py, t, 0.0, 0.0, 1e-12, disc, 0.0)
        rate, dx, dy = _slide(scene, disc, side, t, phi)
        if (hit >= 0 and hit != disc) or math.isnan(rate):
            break
        angle = math.atan2(dy, dx)
        if not math.isnan(before):
            turn = wrap(angle - before)
            angle = before + turn
            if turn * side > 0.0:  # towards the disc
                pieces = min(int(abs(turn) / 0.01), 8)
                for i in range(pieces):
                    out[k] = t, phi, before + turn * i / pieces
                    k += 1
        out[k] = t, phi, angle
        k += 1
        step = fine
        kink = (math.floor(t / scene.dt + 1e-9) + 1.0) * scene.dt if moving else math.inf
        while True:  # short steps where the direction turns fast: where a fast disc's rear goes by
            after = min(t + step, kink)
            later = _onward(scene, disc, side, t, phi, after)
            before, lost = angle, False
            if moving:  # the direction just before the kink
                rate, dx, dy = _slide(scene, disc, side, max(after - 1e-7, t), later)
                lost = math.isnan(rate) or math.isnan(later)
                before = angle + wrap(math.atan2(dy, dx) - angle)
            if step < 1e-6 or not (lost or abs(before - angle) > 0.03):
                break
            step *= 0.5
        if lost:
            break
        phi = later
        if moving:
            out[k] = max(after - 1e-7, t), phi, before
            k += 1
        t = after
    return out[:k]


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
        if disc >= 0 and later > t:
            phi = _onward(scene, disc, side, t, phi, later)
        t = later
    if disc < 0:
        return start[0], start[1], t, math.cos(angle), math.sin(angle), phi
    x, y, _, _, radius = centre(scene, disc, t)
    x, y = x + (radius + SKIN) * math.cos(phi), y + (radius + SKIN) * math.sin(phi)
    return x, y, t, math.cos(angle), math.sin(angle), phi


@kernel
def _expand(
    scene: Scene, disc: int, side: int, start: FloatArray, samples: FloatArray, limit: float
) -> tuple[FloatArray, float, float, float, float]:
    """The families that begin where members of this one graze a disc, and the best arrival of a member.

    Returns:
        (k, 6) disc, side, time, phi, time of leaving this family, promised arrival; arrival (inf: none), the time of
        leaving for it, and the direction.
    """
    events = np.empty((_EVENTS, 6))
    count = 0
    best, best_left, best_dx, best_dy = math.inf, 0.0, 0.0, 0.0
    stack = np.empty((128, 2))
    codes = np.empty((128, 2), np.int64)
    last_code, last_side = -1, 0.0
    for k in range(samples.shape[0]):
        x, y, t, dx, dy, _ = _member(scene, disc, side, start, samples, float(k))
        code, _, _ = _ray(scene, x, y, t, dx, dy, disc, limit)
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
                events[count, 4] = ta
                far = math.hypot(scene.goal[0] - hx, scene.goal[1] - hy) - scene.goal[2]
                events[count, 5] = when + max(far, 0.0) / scene.v
                count += 1
        last_code, last_side = code, offside
    return events[:count], best, best_left, best_dx, best_dy
