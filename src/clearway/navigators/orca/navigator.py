"""The navigator `orca`: ORCA among obstacles and the map's walls, on the way that the map gives.

Van den Berg, Guy, Lin, Manocha 2011, for bases that are not holonomic by Alonso-Mora, Breitenmoser, Rufli, Beardsley, Siegwart 2013
("Optimal reciprocal collision avoidance for multiple non-holonomic robots"). No budget: a decision takes well under a millisecond.
"""

from __future__ import annotations

import math

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.crowd_navigator import CrowdNavigator
from clearway.navigators.common.route import Seen, with_others
from clearway.navigators.orca.decision import Rules, choose
from clearway.navigators.orca.parameters import Parameters
from clearway.robots import DriveLimits


class Orca(CrowdNavigator[Parameters]):
    """Navigates by optimal reciprocal collision avoidance.

    Args:
        options: Any field of `Parameters`, which overrides the robot's file.

    Raises:
        ClearwayError: An option is wrong.
    """

    parameters = Parameters

    def _prepare(self, limits: DriveLimits, period: float) -> None:
        p = self._parameters
        self._rules = Rules(
            p.distance, p.neighbours, p.horizon, p.wall_horizon, p.tracking_error, p.tracking_time,
            limits.v_max, limits.omega_max, period, limits.kind == "omnidirectional",
        )  # fmt: skip

    def _velocity(self, pose: FloatArray, velocity: FloatArray, others: Seen, wish: FloatArray) -> tuple[float, float]:
        p = self._parameters
        bodies = with_others(pose, velocity, self._radius, others, p.share)
        goal = self._approach.goal
        if p.arrival_time > 0.0 and goal is not None:
            (x, y, _), speed = goal.pose, math.hypot(wish[0], wish[1])
            wish = wish * min(1.0, math.hypot(x - pose[0], y - pose[1]) / max(p.arrival_time * speed, 1e-9))
        return choose(pose[2], wish[0], wish[1], bodies, self._walls, self._rules)
