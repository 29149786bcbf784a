"""What `mppi-forecast` samples and what samples cost, read plainly: one sample at a time, in float64, without shortcuts."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import norm

from clearway.geometry.shapes import Polygon


def controls_of(drawn, hold, plan, go, limits, steps, batch):
    """(3, T, B) sampled controls, before what the base makes of them."""
    out = np.zeros((3, steps, batch))
    for axis, noise in enumerate((drawn.v, drawn.v_y, drawn.omega)):
        if axis == 1 and limits.v_y_max == 0.0:
            continue
        points = np.arange(len(noise)) * hold
        for b in range(batch):
            out[axis, :, b] = plan[axis] + np.interp(np.arange(steps), points, noise[:, b])
        out[axis, :, 0], out[axis, :, 1], out[axis, :, 2] = plan[axis], 0.0, go[axis]
    return out


def drive(controls, start, speed, limits, dt):
    """Velocities (T + 1, 3) and poses (T, 3) of one sample with `controls` (T, 3): v, v_y, omega."""
    rates = (
        (limits.acceleration, limits.deceleration),
        (limits.lateral_acceleration, limits.lateral_deceleration),
        (limits.angular_acceleration, limits.angular_deceleration),
    )
    velocity, (x, y, yaw) = [np.array(speed, float)], start
    poses = []
    for v, v_y, omega in controls:
        wanted = np.clip((v, v_y, omega), (limits.v_min, -limits.v_y_max, -limits.omega_max),
                         (limits.v_max, limits.v_y_max, limits.omega_max))  # fmt: skip
        if limits.v_y_max > 0.0 and math.hypot(*wanted[:2]) > limits.speed_max:
            wanted[:2] *= limits.speed_max / math.hypot(*wanted[:2])
        now = velocity[-1].copy()
        for k, (faster, slower) in enumerate(rates):
            down, up = (slower, faster) if now[k] > 0.0 else (faster, slower)
            now[k] = min(max(wanted[k], now[k] - down * dt), now[k] + up * dt)
        velocity.append(now)
        middle = yaw + 0.5 * dt * now[2]
        x += dt * (now[0] * math.cos(middle) - now[1] * math.sin(middle))
        y += dt * (now[0] * math.sin(middle) + now[1] * math.cos(middle))
        yaw += dt * now[2]
        poses.append((x, y, yaw))
    return np.array(velocity), np.array(poses)


def chance_of_contact(before, pose, people, t, shape):
    """Probability of contact in step `t`, between the places `before` and `pose` (3,)."""
    nobody = 1.0
    for who in np.unique(people.obstacle):
        hit = 0.0
        for m in np.flatnonzero(people.obstacle == who):
            begin = people.at[t, m] - before[:2]
            end = people.at[t + 1, m] - pose[:2]
            if (length := float((end - begin) @ (end - begin))) > 1e-12:
                share = min(max(float(-begin @ (end - begin)) / length, 0.0), 1.0)
            else:
                share = 0.0
            room = _from_outline(begin + share * (end - begin), pose[2], shape) - people.radius[m]
            sigma = people.spread[t + 1, m]
            hit += people.chance[m] * (norm.cdf(-room / sigma) if room < 3.5 * sigma else 0.0)
        nobody *= max(1.0 - hit, 0.0)
    return 1.0 - nobody


def _from_outline(point, yaw, shape):
    """Signed distance of a point to the outline of a robot at the origin."""
    if not isinstance(shape, Polygon):
        return float(np.hypot(*point)) - shape.radius
    c, s = math.cos(yaw), math.sin(yaw)
    corners = np.array(shape.vertices) @ np.array(((c, s), (-s, c)))
    nearest, inside = math.inf, True
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        nearest = min(nearest, float(np.hypot(*(a + along * (b - a) - point))))
        inside &= bool((b - a)[0] * (point - a)[1] - (b - a)[1] * (point - a)[0] >= 0.0)
    return -nearest if inside else nearest


def between(values, floor, point):
    """Bilinear, without cells that have no finite value."""
    rows, columns = values.shape
    a, b = (np.asarray(point) - floor.origin) / floor.resolution - 0.5
    a, b = min(max(a, 0.0), columns - 1.001), min(max(b, 0.0), rows - 1.001)
    j, i = int(a), int(b)
    shares = np.outer((1.0 - (b - i), b - i), (1.0 - (a - j), a - j))
    found = values[i : i + 2, j : j + 2]
    good = np.isfinite(found)
    if shares[good].sum() <= 1e-9:
        return 1e3
    return float((shares[good] * found[good]).sum() / shares[good].sum())


def cost(velocity, poses, start, people, floor, body, weights, shape):
    """Of one sample, in seconds."""
    total, arrived, before = 0.0, False, np.asarray(start)
    for t, pose in enumerate(poses):
        v, v_y = velocity[t + 1, :2]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        room = between(floor.clearance, floor, pose[:2]) - body.foot.circumscribed
        if len(body.rim) > 1 and room < weights.soft:
            room = min(
                between(floor.clearance, floor, pose[:2] + np.array(((c, -s), (s, c))) @ p) for p in body.rim
            ) - body.foot.radius  # fmt: skip
        risk = chance_of_contact(before, pose, people, t, shape)
        x0, y0, x1, y1 = floor.area
        if room < weights.margin or not (x0 <= pose[0] <= x1 and y0 <= pose[1] <= y1):
            risk = 1.0
        total += weights.dt * weights.contact * weights.discount ** (weights.dt * (t + 1)) * risk
        total += weights.dt * weights.near * max(0.0, 1.0 - max(room, 0.0) / weights.soft) ** 2
        total += weights.dt * weights.reverse * (v < 0.0)
        change = (velocity[t + 1] - velocity[t]) / weights.deviation
        total += weights.dt * weights.effort * float(change @ change)
        if not arrived:
            total += weights.dt
            rest = pose[:2] + 0.5 * np.array(((c, -s), (s, c))) @ (
                v * abs(v) / body.deceleration, v_y * abs(v_y) / body.lateral_deceleration
            )  # fmt: skip
            arrived = float(np.hypot(*(rest - floor.goal))) <= weights.reach
        before = pose
    if not arrived:
        total += max(between(floor.distance, floor, before[:2]) - weights.reach, 0.0) / body.top
    return total
