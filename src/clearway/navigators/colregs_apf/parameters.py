"""Parameters of `colregs-apf`: stand-ins, as no paper prints them, unless the robot's file says otherwise."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from clearway.navigators.colregs_apf.potentials import Gains
from clearway.quantities import NonNegative, Positive, Whole
from clearway.robots import RobotTable


class Parameters(RobotTable):
    """Everything under `[navigators.colregs-apf]`; the first nine are what `benchmarks/apf_gains.py` chooses."""

    TABLE = "navigators.colregs-apf"
    STAND_INS = "colregs-apf"

    epsilon: Positive = Field(description="of the attraction")
    eta_d: NonNegative = Field(description="of the risk of moving obstacles")
    eta_e: NonNegative = Field(description="of their emergency zone")
    eta_s: NonNegative = Field(description="of static obstacles")
    rho_0: Positive = Field(description="how far beyond d_m the risk reaches, m")
    rho_s: Positive = Field(description="how far beyond contact static obstacles repel, m")
    d_safe: NonNegative = Field(description="clearance that counts as safe from moving obstacles, m")
    velocity_term: NonNegative = Field(description="weight of the risk's gradient by velocity, s")
    goal_cap: Annotated[float, Field(gt=0)] = Field(
        description="attraction and d_g stop growing at this distance from the goal, m; inf: never, as in the original"
    )
    speed: Positive | None = Field(default=None, description="along the force, m/s; default: the set speed of the test")
    turn_gain: Positive = Field(description="yaw rate by heading error, 1/s")
    horizon: Whole = Field(ge=1, le=1000, description="N^P, periods that the force is felt ahead")
    w1: float = Field(gt=0, le=1, description="weight of each further period")

    def gains(self) -> Gains:
        """The first nine, as the kernels take them."""
        return Gains(**{name: getattr(self, name) for name in Gains._fields})
