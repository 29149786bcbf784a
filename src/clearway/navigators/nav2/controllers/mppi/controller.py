"""`nav2_mppi_controller::MPPIController` (src/controller.cpp)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.controllers.mppi.optimizer import Optimizer
from clearway.navigators.nav2.controllers.mppi.parameters import MPPIParameters, motion_model_of
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.seams import CostView, Tolerances, Velocity


class MPPIController:
    """Follows a path by sampling control sequences about the last one and taking their mean, the better the heavier."""

    def __init__(
        self, parameters: MPPIParameters, spaces: Mapping[str, Group], frequency: float, rng: np.random.Generator
    ) -> None:
        """
        Args:
            parameters: Its own.
            spaces: Those of the namespaces inside it, by name, as `MPPIParameters.children` asks for them.
            frequency: Of the controller server, Hz.
            rng: Gives the key of its random numbers.

        Raises:
            ClearwayError: a control period is longer than a time step.
        """
        self._silence = parameters.reset_period
        self._called: float | None = None
        key = np.uint64(rng.integers(2**32))
        self._optimizer = Optimizer(parameters, spaces, motion_model_of(parameters, spaces), frequency, key)

    @property
    def trajectory(self) -> FloatArray:
        """(k, 2) where the control sequence leads."""
        return self._optimizer.trajectory[:, :2].astype(np.float64)

    def reset(self) -> None:
        """See `Controller`; a speed limit stays, as in the source."""
        self._optimizer.reset()
        self._called = None

    def set_plan(self, path: FloatArray) -> None:
        """A new path came: nothing to be done."""

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        """Cap the speed at `limit` m/s, or per cent of the greatest; 0 takes the cap off."""
        self._optimizer.set_speed_limit(limit, percentage)

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
        """The command for one control period; see `Controller.compute`.

        Raises:
            NoValidControl: all samples collide, or what comes of them does.
        """
        if self._silence is not None and self._called is not None and now - self._called > self._silence:
            self._optimizer.reset()
        self._called = now
        return self._optimizer.decide(pose, velocity, path, tolerances, view)
