"""Nav2's regulated pure pursuit: drives on a circle to a point ahead on the path, slower in curves, near obstacles, at the end.

Behaviour after nav2_regulated_pure_pursuit_controller/src/regulated_pure_pursuit_controller.cpp; the arithmetic is in `pursuit`.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import make_scene
from clearway.navigators.nav2.controllers.parameters import RegulatedPurePursuitParameters
from clearway.navigators.nav2.controllers.pursuit import COLLISION, OFF_THE_MAP, Law, State, command
from clearway.navigators.nav2.seams import ControllerFailed, CostView, NoValidControl, Tolerances, Velocity

_NOWHERE: FloatArray = np.empty((0, 2))


class RegulatedPurePursuit:
    """`nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController`, a `Controller` and `Stopping`."""

    def __init__(self, parameters: RegulatedPurePursuitParameters, period: float) -> None:
        """
        Args:
            parameters: As the file has them.
            period: One over the controller server's frequency, s.
        """
        self._full_law = self._law = make_law(parameters, period)
        self._slows_down = parameters.use_cancel_deceleration
        self._trajectory = _NOWHERE
        self.reset()

    @property
    def trajectory(self) -> FloatArray:
        """See `Controller`: as far as it was looked at for obstacles."""
        return self._trajectory

    def reset(self) -> None:
        """See `Controller`."""
        self._cancelling = self._at_rest = False
        self._last = Velocity(0.0, 0.0, 0.0)
        self._trajectory = _NOWHERE

    def set_plan(self, path: FloatArray) -> None:
        """See `Controller`: it keeps nothing of it."""

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        """See `Controller`."""
        full = self._full_law.max_linear_vel
        top = full if limit == 0.0 else full * limit / 100.0 if percentage else limit
        self._law = self._full_law._replace(max_linear_vel=top)

    def cancel(self) -> bool:
        """See `Stopping`."""
        self._cancelling = self._slows_down
        return self._at_rest or not self._slows_down

    def compute(
        self,
        now: float,
        pose: FloatArray,
        velocity: Velocity,
        path: FloatArray,
        goal: FloatArray,
        tolerances: Tolerances,
        view: CostView,
    ) -> Velocity:
        """See `Controller`."""
        state = State(
            velocity.v_x,
            velocity.omega,
            tolerances.there,
            self._cancelling,
            self._last.v_x,
            self._last.omega,
            view.inscribed,
            view.circumscribed,
            view.tracks_unknown,
        )
        scene = make_scene(view.cost, view.origin, view.resolution, view.footprint)
        end, v, omega, at_rest, self._trajectory = command(self._law, state, pose, path, scene)
        self._at_rest = self._at_rest or at_rest
        if end == OFF_THE_MAP:
            raise ControllerFailed("the robot is off the local costmap")
        if end == COLLISION:
            raise NoValidControl("collision ahead")
        self._last = Velocity(v, 0.0, omega)
        return self._last


def make_law(p: RegulatedPurePursuitParameters, period: float) -> Law:
    """What the kernels need of the parameters."""
    by_cost = p.use_cost_regulated_linear_velocity_scaling and p.inflation_cost_scaling_factor > 0.0
    own = {"period": period, "max_linear_vel": p.full_speed, "use_cost_regulated_linear_velocity_scaling": by_cost}
    return Law(**{name: getattr(p, name) for name in Law._fields if name not in own} | own)
