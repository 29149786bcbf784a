"""Who has to do what when two meet: COLREGS rules 8 and 13 to 17, for a robot among moving obstacles.

Angles as at sea: the bearing of a target counts from the own bow, positive to starboard (clockwise).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

CLEAR, OVERTAKING, HEAD_ON, GIVE_WAY, STAND_ON = 0, 1, 2, 3, 4
WORDS = ("clear", "overtaking", "head-on", "crossing give-way", "stand-on")
"""By the numbers above; a navigator in the emergency zone says `emergency` instead."""

PORT, STARBOARD = 1.0, -1.0
"""Sides as signs along the direction that points left of the line to the target."""

BOW = math.radians(15.0)
"""Rule 14: a target is ahead within this bearing."""
RECIPROCAL = math.radians(22.5)
"""Rule 14: courses are opposite within this."""
ABAFT = math.radians(112.5)
"""Rule 13: more than 22.5 degrees abaft the beam."""
DOUBT = math.radians(5.0)
"""Rule 15: a crossing target this far to port of the bow still counts as on the starboard side."""
STILL = 0.05
"""A target slower than this has no course, m/s."""

IntArray = npt.NDArray[np.int64]


@kernel
def closest_approach(rx: float, ry: float, ux: float, uy: float) -> tuple[float, float]:
    """DCPA [m] and TCPA [s] of a target at r = p_o - p that moves with u = v_o - v relative to the own robot.

    TCPA = -r.u / |u|^2, negative once it has been; DCPA = |r + u max(0, TCPA)|. Without relative motion TCPA = 0.
    """
    speed2 = ux * ux + uy * uy
    t = -(rx * ux + ry * uy) / speed2 if speed2 > 1e-18 else 0.0
    ahead = max(t, 0.0)
    return math.hypot(rx + ux * ahead, ry + uy * ahead), t


@kernel
def classify(heading: float, speed: float, rx: float, ry: float, vx: float, vy: float) -> int:
    """What an encounter is, by who sees whom where.

    Rule 13 goes before all others: a faster one that comes up from more than 112.5 degrees off the other's bow
    overtakes; a target that comes up so on the own robot has to keep clear itself, as does one that crosses from
    port (rule 17). A target without a course is kept clear of to starboard, as one that crosses.

    Args:
        heading: The robot's own, rad.
        speed: The robot's own, m/s.
        rx: To the target along x, m.
        ry: To the target along y, m.
        vx: The target's velocity along x, m/s.
        vy: The target's velocity along y, m/s.
    """
    beta = wrap(heading - math.atan2(ry, rx))
    target_speed = math.hypot(vx, vy)
    if target_speed > STILL:
        course = math.atan2(vy, vx)
        if abs(wrap(course - math.atan2(-ry, -rx))) > ABAFT and speed > target_speed and abs(beta) <= ABAFT:
            return OVERTAKING
        if abs(beta) <= BOW and abs(wrap(course - heading + math.pi)) <= RECIPROCAL:
            return HEAD_ON
    if abs(beta) > ABAFT or beta < -DOUBT:
        return STAND_ON
    return GIVE_WAY


@kernel
def side_to_pass(kind: int, rx: float, ry: float, wx: float, wy: float) -> float:
    """The side that the own robot moves to: starboard always, but for overtaking the one that w = v - v_o points to."""
    if kind == OVERTAKING and rx * wy - ry * wx > 0.0:
        return PORT
    return STARBOARD


@kernel
def follow(
    pose: FloatArray, velocity: FloatArray, targets: FloatArray, identity: IntArray, reach: float,
    known: IntArray, known_kind: IntArray, known_side: FloatArray,
) -> tuple[IntArray, FloatArray]:  # fmt: skip
    """Each target's encounter now. An encounter begins when there is a risk of collision, and what it then was it
    stays, and on the same side, until the closest approach is past (rule 8: no second thoughts; rule 13 d).

    Args:
        pose: (3,) the robot's own.
        velocity: (2,) its v [m/s] and omega [rad/s].
        targets: (n, 6) x, y, vx, vy, d_m [m], 1 if it moves, else 0.
        identity: (n,) of the targets, the same over time.
        reach: How far beyond d_m a risk counts, m.
        known: (k,) identities of those met in the period before.
        known_kind: (k,) kinds of these encounters.
        known_side: (k,) sides of these encounters.

    Returns:
        (n,) kinds (`CLEAR`: none) and (n,) sides.
    """
    n = len(targets)
    kinds, sides = np.zeros(n, np.int64), np.full(n, STARBOARD)
    own_x, own_y = velocity[0] * math.cos(pose[2]), velocity[0] * math.sin(pose[2])
    for i in range(n):
        if targets[i, 5] == 0.0:
            continue
        rx, ry = targets[i, 0] - pose[0], targets[i, 1] - pose[1]
        vx, vy, d_m = targets[i, 2], targets[i, 3], targets[i, 4]
        dcpa, tcpa = closest_approach(rx, ry, vx - own_x, vy - own_y)
        if tcpa <= 0.0:
            continue
        for j in range(len(known)):
            if known[j] == identity[i]:
                kinds[i], sides[i] = known_kind[j], known_side[j]
                break
        if kinds[i] == CLEAR and dcpa < d_m and math.hypot(rx, ry) < d_m + reach:
            kinds[i] = classify(pose[2], abs(velocity[0]), rx, ry, vx, vy)
            sides[i] = side_to_pass(kinds[i], rx, ry, own_x - vx, own_y - vy)
    return kinds, sides
