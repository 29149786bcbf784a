"""Obstacles as perceived in, forecast out: the door of this room."""

from __future__ import annotations

from clearway import contract
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.parameters import ForecastParameters


class Forecaster:
    """Tracks what is perceived and says where it will be.

    Args:
        parameters: see there. period: control period, s. step: s between a forecast's instants. count: K, of steps.
    """

    def __init__(self, parameters: ForecastParameters, period: float, step: float, count: int) -> None:
        raise NotImplementedError

    def reset(self) -> None:
        """Forget everything."""

    def update(self, t: float, obstacles: contract.Obstacles) -> tuple[Forecast, tuple[str, ...]]:
        """What is perceived at `t` [s]: the forecast from there, and the violated assumptions, in words."""
        raise NotImplementedError


class PerfectForecaster:
    """The true future of what has been perceived so far: a reference, for privileged navigators.

    Args:
        parameters: see there. truth: time [s] -> (n, 4) x, y, radius, presence. step: s. count: K, of steps.
    """

    def __init__(self, parameters: ForecastParameters, truth: contract.Forecast, step: float, count: int) -> None:
        raise NotImplementedError

    def reset(self) -> None:
        """Forget everything."""

    def update(self, t: float, obstacles: contract.Obstacles) -> tuple[Forecast, tuple[str, ...]]:
        """As `Forecaster.update`; nothing is ever violated."""
        raise NotImplementedError
