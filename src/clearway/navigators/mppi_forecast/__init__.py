"""The navigator `mppi-forecast`: model predictive path integral control among forecasts of who moves."""

from __future__ import annotations

from clearway.navigators.mppi_forecast.navigator import MppiForecast

__all__ = ["MppiForecast"]
