"""Which assumptions about the robot itself did not hold in the period that has passed, in words.

The bounds here are the triangle inequality's: no cleverness, so that a text is never a false alarm, and so that a robot
whose disturbance is a disc of known radius is told of each excess. What obstacles do beyond their bounds is the
forecasts' to tell, what appears where it should have been seen before the sight monitor's.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.hp_st.guarantee.tube import drive
from clearway.robots import Odometry
from clearway.robots.drive_limits import DriveLimits

ROUNDING = 1e-9
"""A bound counts as exceeded from here on, m, rad, s."""

SIGMAS = 5.0
"""So many standard deviations of a measured velocity are its error at most: 1 of 1.7 million lies beyond."""


class AssumptionMonitor:
    """Compares where the robot is, and how fast, with what it was told a period ago.

    Args:
        limits: Limits of the base.
        period: Control period in seconds.
        disturbance: (5,) bounds, see `tube.tube`.
        start: (3,) bounds on the error of the perceived pose, see `tube.tube`.
        odometry: How the measured velocities err.
        ahead: What was commanded before, where it is followed late or told late; None: at once.
    """

    def __init__(
        self,
        limits: DriveLimits,
        period: float,
        disturbance: FloatArray,
        start: FloatArray,
        odometry: Odometry,
        ahead: Ahead | None = None,
    ) -> None:
        self._ahead = ahead if ahead is not None and ahead.time > 0.0 else None
        self.limits, self.period, self.odometry = limits, period, odometry
        self.disturbance, self.start = disturbance, start
        self.reset()

    def reset(self, t: float = 0.0) -> None:
        """Begin a new trial at time `t` [s]: the robot stands."""
        self._velocity = np.zeros(2)
        self._rested = True
        self._t = t
        self._pose: FloatArray | None = None
        self._command = (0.0, 0.0)

    def told(self, t: float, pose: FloatArray, v: float, omega: float) -> None:
        """At time `t` [s], perceived at `pose` (3,), the base was told `v` [m/s] and `omega` [rad/s] for a period."""
        self._t, self._pose, self._command = t, np.array(pose, dtype=np.float64), (v, omega)

    def seen(self, t: float, pose: FloatArray, velocity: FloatArray) -> tuple[str, ...]:
        """What `pose` (3,) and `velocity` (2,) at time `t` show to be untrue, one text each; nothing before `told`."""
        if self._pose is None:
            return ()
        told = self._velocity
        expected, self._velocity, inputs, swings = self._expected(self._pose, t)
        v, omega = self._fastest(told, t)
        off = math.hypot(pose[0] - expected[0], pose[1] - expected[1])
        turned = abs(turn_between(expected[2], pose[2]))
        most, most_turned = self._bounds(inputs, swings)
        self._pose = None
        self._rested = not (told.any() or inputs.any() or swings.any())
        if abs(t - self._t - self.period) > ROUNDING + 1e-6 * self.period:
            return (f"period: {t - self._t:.4g} s since the last command, assumed {self.period:.4g} s",)
        texts = []
        if not off <= most + ROUNDING:
            texts.append(f"disturbance: ended {off:.4f} m from where it was commanded, assumed at most {most:.4f}")
        if not turned <= most_turned + ROUNDING:
            texts.append(f"disturbance: turned {turned:.4f} rad off its command, assumed at most {most_turned:.4f}")
        errors = self.odometry.velocity_errors(v, omega, self.period)
        for i, (name, unit) in enumerate((("v", "m/s"), ("omega", "rad/s"))):
            allowed = SIGMAS * errors[i] + float(self.disturbance[2 + i])
            if not abs(velocity[i] - self._velocity[i]) <= allowed + ROUNDING:
                texts.append(
                    f"command: {name} is {velocity[i]:.4f} {unit}, should be {self._velocity[i]:.4f}"
                    f" within {allowed:.4f}"
                )
        return tuple(texts)

    def _expected(self, pose: FloatArray, t: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Where the robot should be at time `t` [s] if it was at `pose` (3,), how fast (2,), how fast it drove (2,), and by how
        much that changed (2,)."""
        if self._ahead is not None:
            way = self._ahead.way(pose, self._t, t)
            return way.pose, way.velocity, np.maximum(np.abs(way.low), np.abs(way.high)), way.high - way.low
        state = np.concatenate([pose, self._velocity])
        plan = drive(state, np.array([self._command], dtype=np.float64), self.limits, self.period)
        return plan.states[1], plan.velocities[1], plan.inputs[0], plan.swings[0]

    def _fastest(self, before: FloatArray, t: float) -> tuple[float, float]:
        """How fast it drove at most where the velocities that are told at time `t` [s] may have been measured, from `before`
        (2,) on; what is told late was measured in a period that goes on beyond."""
        most = np.maximum(np.abs(before), np.abs(self._velocity))
        if self._ahead is not None:
            way = self._ahead.way(np.zeros(3), self._t - self.period, t + self.period)
            most = np.maximum(most, np.maximum(np.abs(way.low), np.abs(way.high)))
        return float(most[0]), float(most[1])

    def _bounds(self, inputs: FloatArray, swings: FloatArray) -> tuple[float, float]:
        """How far the perceived pose may be from the end of the arc of `inputs` (2,), in metres and radians."""
        c = self.period
        position, heading, slip, spin, at_rest = self.disturbance.tolist()
        if self._rested and not (inputs.any() or swings.any() or at_rest):
            position = heading = slip = spin = 0.0
        v, w, dv, dw = abs(inputs[0]), abs(inputs[1]), swings[0], swings[1]
        bent = c * c * (dv * (w + spin) + (v + slip + dv) * dw) / 8.0
        misplaced = 2.0 * math.hypot(self.start[0], self.start[1]) + v * c * self.start[2]
        return position + misplaced + c * slip + 0.5 * c * c * v * spin + bent, heading + 2.0 * self.start[2] + c * spin
