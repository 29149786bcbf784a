"""The social force model once more, as its papers write it: NumPy, one person after the other, nothing left out."""

from __future__ import annotations

import numpy as np

TAU, A, GAMMA, LAMBDA, N, N_SLOW = 0.5, 4.5, 0.35, 2.0, 2.0, 3.0  # Moussaïd et al. 2009, 2010
WALL, WALL_SPAN, VISION, ATTRACTION, REPULSION, D0 = 3.0, 0.1, 4.0, 3.0, 1.0, 0.8


def angle(v):
    return np.arctan2(v[1], v[0])


def interaction(x_i, v_i, x_j, v_j):
    """f_ij of Moussaïd et al. 2009."""
    d = np.linalg.norm(x_j - x_i)
    e = (x_j - x_i) / d
    big_d = LAMBDA * (v_i - v_j) + e
    t = big_d / np.linalg.norm(big_d)
    normal = np.array((-t[1], t[0]))  # to the left
    theta = (angle(e) - angle(t) + np.pi) % (2 * np.pi) - np.pi
    b = GAMMA * np.linalg.norm(big_d)
    slower = np.exp(-d / b - (N_SLOW * b * theta) ** 2)
    aside = np.sign(theta) * np.exp(-d / b - (N * b * theta) ** 2)
    return -A * (slower * t + aside * normal)


def nearest_point(x, polygon):
    """Of the closed polygon, to x."""
    points = []
    for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True):
        s = np.clip((x - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0.0, 1.0)
        points.append(a + s * (b - a))
    return min(points, key=lambda p: np.linalg.norm(x - p))


def walls(x, radius, polygons):
    force = np.zeros(2)
    for polygon in polygons:
        away = x - nearest_point(x, np.array(polygon, float))
        d = np.linalg.norm(away)
        force += WALL * np.exp(-(d - radius) / WALL_SPAN) * away / d
    return force


def group(i, members, x, v):
    """f_group of Moussaïd et al. 2010 for `i`, one of `members`."""
    others = [m for m in members if m != i]
    centre, seen = x[members].mean(0), x[others].mean(0) - x[i]
    cosine = seen @ v[i] / np.linalg.norm(seen) / np.linalg.norm(v[i])
    force = -VISION * max(np.arccos(np.clip(cosine, -1, 1)) - np.pi / 2, 0.0) * v[i]
    if np.linalg.norm(centre - x[i]) > (len(members) - 1) / 2:
        force += ATTRACTION * (centre - x[i]) / np.linalg.norm(centre - x[i])
    for m in others:
        if np.linalg.norm(x[m] - x[i]) < D0:
            force += REPULSION * (x[i] - x[m]) / np.linalg.norm(x[i] - x[m])
    return force


def parted(a, b, polygons):
    """Whether a polygon's edge lies between two places: where the two lines meet, as shares of their lengths."""
    for polygon in polygons:
        for c, d in zip(np.array(polygon, float), np.roll(np.array(polygon, float), -1, 0), strict=True):
            across = np.array([b - a, c - d]).T
            if abs(np.linalg.det(across)) > 1e-12:
                s, t = np.linalg.solve(across, c - a)
                if 0 < s < 1 and 0 <= t <= 1:
                    return True
    return False


def forces(x, v, radius, groups, polygons):
    """(n, 2) all but the drive, m/s^2."""
    total = []
    for i in range(len(x)):
        f = sum((interaction(x[i], v[i], x[j], v[j]) for j in range(len(x)) if j != i), np.zeros(2))
        f = f + walls(x[i], radius[i], polygons)
        members = [j for j in range(len(x)) if groups[j] == groups[i] >= 0 and not parted(x[i], x[j], polygons)]
        total.append(f + (group(i, members, x, v) if len(members) > 1 else 0.0))
    return np.array(total)
