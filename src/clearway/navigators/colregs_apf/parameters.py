"""Parameters of `colregs-apf`: stand-ins, as no paper prints them, unless the robot's file says otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from clearway.errors import ClearwayError
from clearway.navigators.colregs_apf.potentials import Gains
from clearway.robots import Robot
from clearway.stand_ins import stand_ins
from clearway.validation import first_problem

NAVIGATOR = "colregs-apf"

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Parameters(BaseModel):
    """Everything under `[navigators.colregs-apf]`; the first nine are what `benchmarks/apf_gains.py` chooses."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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
    horizon: int = Field(ge=1, le=1000, description="N^P, periods that the force is felt ahead")
    w1: float = Field(gt=0, le=1, description="weight of each further period")

    def gains(self) -> Gains:
        """The first nine, as the kernels take them."""
        return Gains(**{name: getattr(self, name) for name in Gains._fields})


def parameters_of(robot: Robot, gains: Mapping[str, Any] | None = None) -> Parameters:
    """The stand-ins, overridden by the robot's file, overridden by `gains`.

    Raises:
        ClearwayError: one of them is wrong; the message names the robot, the field and the value.
    """
    own = robot.navigators.get(NAVIGATOR, {})
    parameters = _checked(stand_ins(NAVIGATOR) | own, f"robot {robot.name}", f"navigators.{NAVIGATOR}.")
    return with_gains(parameters, gains) if gains else parameters


def with_gains(parameters: Parameters, gains: Mapping[str, Any]) -> Parameters:
    """`parameters` with some of them replaced, as given in the option `gains`.

    Raises:
        ClearwayError: an unknown name or a wrong value.
    """
    return _checked(parameters.model_dump() | dict(gains), f"navigator {NAVIGATOR}", "gains.")


def _checked(table: Mapping[str, Any], file: str, prefix: str) -> Parameters:
    try:
        return Parameters.model_validate(table)
    except ValidationError as error:
        problem = first_problem(error, Parameters)
        raise ClearwayError(problem.problem, file=file, field=prefix + (problem.field or "")) from error
