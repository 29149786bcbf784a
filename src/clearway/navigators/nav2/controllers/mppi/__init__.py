"""Model predictive path integral control as Nav2 does it (nav2_mppi_controller)."""

from clearway.navigators.nav2.controllers.mppi.controller import MPPIController
from clearway.navigators.nav2.controllers.mppi.parameters import MPPIParameters

__all__ = ["MPPIController", "MPPIParameters"]
