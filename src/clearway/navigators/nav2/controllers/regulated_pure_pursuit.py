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
    """What the compiled part needs of the parameters."""
    return Law(
        period=period,
        max_linear_vel=p.full_speed,
        min_linear_vel=p.min_linear_vel,
        max_angular_vel=p.max_angular_vel,
        min_angular_vel=p.min_angular_vel,
        max_linear_accel=p.max_linear_accel,
        max_linear_decel=p.max_linear_decel,
        max_angular_accel=p.max_angular_accel,
        max_angular_decel=p.max_angular_decel,
        use_dynamic_window=p.use_dynamic_window,
        lookahead_dist=p.lookahead_dist,
        use_velocity_scaled_lookahead_dist=p.use_velocity_scaled_lookahead_dist,
        min_lookahead_dist=p.min_lookahead_dist,
        max_lookahead_dist=p.max_lookahead_dist,
        lookahead_time=p.lookahead_time,
        use_fixed_curvature_lookahead=p.use_fixed_curvature_lookahead,
        curvature_lookahead_dist=p.curvature_lookahead_dist,
        beyond=p.interpolate_curvature_after_goal,
        by_curvature=p.use_regulated_linear_velocity_scaling,
        least_radius=p.regulated_linear_scaling_min_radius,
        least_speed=p.regulated_linear_scaling_min_speed,
        by_cost=p.use_cost_regulated_linear_velocity_scaling and p.inflation_cost_scaling_factor > 0.0,
        cost_scaling_dist=p.cost_scaling_dist,
        cost_scaling_gain=p.cost_scaling_gain,
        inflation=p.inflation_cost_scaling_factor,
        min_approach_linear_velocity=p.min_approach_linear_velocity,
        approach_velocity_scaling_dist=p.approach_velocity_scaling_dist,
        use_rotate_to_heading=p.use_rotate_to_heading,
        rotate_to_heading_angular_vel=p.rotate_to_heading_angular_vel,
        rotate_to_heading_min_angle=p.rotate_to_heading_min_angle,
        allow_reversing=p.allow_reversing,
        cancel_deceleration=p.cancel_deceleration,
        use_collision_detection=p.use_collision_detection,
        collision_time=p.max_allowed_time_to_collision_up_to_carrot,
        min_distance_to_obstacle=p.min_distance_to_obstacle,
        beyond_goal=p.allow_obstacle_checking_beyond_goal,
    )
