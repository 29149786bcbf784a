"""Parameters of HP+TMPC, checked. The paper prints the prediction horizon only: the others are stand-ins.

`stand_ins.toml` holds the defaults; a robot's file may override any of them under `[navigators.hp-tmpc]`.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import Field, model_validator

from clearway.errors import unknown
from clearway.quantities import NonNegative, Positive, Whole
from clearway.robots import RobotTable

MAX_HORIZON = 40
"""Longest prediction horizon, periods: the solver's arrays and its time grow with it."""

Damping = Annotated[float, Field(ge=0, le=1)]
Pole = Annotated[float, Field(ge=0, lt=1)]
Horizon = Annotated[int, Field(ge=1, le=MAX_HORIZON)]

Solver: TypeAlias = Literal["gauss-newton", "pattern-search", "genetic"]
Planner: TypeAlias = Literal["heuristic", "exact"]
Literally: TypeAlias = Literal["1", "2", "3f", "3k"]
"""Equations of the paper whose printed form can be had: see DECISIONS.md beside this file."""


class Parameters(RobotTable):
    """Everything that HP+TMPC can be told about itself; the papers' symbols behind the colons.

    The stand-ins are for any robot; those of paper B's own, such as N^P = 5, stand in that robot's table.
    """

    TABLE = "navigators.hp-tmpc"
    STAND_INS = "hp-tmpc"

    prediction_horizon: Horizon = Field(description="N^P: periods")
    control_horizon: Horizon = Field(
        description="N^c: periods after which the inputs stay as they are; default: prediction_horizon"
    )
    planning_window: Horizon = Field(
        description="periods over which the planner predicts moving obstacles; default: prediction_horizon"
    )
    w1: float = Field(gt=0, lt=1, description="w_1 of (2): discount of the tracking error per period")
    w2: Positive = Field(description="w_2 of (2): weight of u'u beside the tracking error in m")
    heading_weight: NonNegative = Field(description="of the heading's error in (2) beside the position's, m/rad")
    safe_margin: NonNegative = Field(description="rho^safe beyond rho^rob + rho^obs, m")
    input_change: Positive = Field(description="u^smooth of (3e): norm of the change of (m/s, rad/s) in a period")
    w_rob: NonNegative = Field(description="w-bar^rob of (4): disturbance of the position in a period, m")
    w_dyn: NonNegative = Field(description="w-bar^dyn,obs of (5): error of an obstacle's perceived position, m")
    xi_rob: Damping = Field(description="xi^rob of (4)")
    xi_dyn: Damping = Field(description="xi^dyn,obs of (5)")
    tracking_threshold: Positive = Field(description="tracking error beyond which it plans anew, m")
    commitment: Whole = Field(ge=1, le=1000, description="most periods that it keeps a plan")
    pole_along: Pole = Field(description="of K's closed loop: what is left of an error along the motion after a period")
    pole_left: Pole = Field(description="the same for the error to the left (slower at low speed: gain_limit)")
    pole_heading: Pole = Field(description="the same for the heading's error")
    gain_limit: Positive = Field(description="largest correction of omega per error to the left, rad/s/m")

    scan_range: Positive = Field(description="perception radius of a robot with a lidar is at most this, m")
    side_share: float = Field(ge=0, lt=1, description="share by which the other side must be shorter to change to it")
    reference_share: float = Field(gt=0, le=1, description="v_ref as a share of v_max; paper B: one half")
    turn_beyond: Positive = Field(description="deviation of the heading from the path: beyond, turn on the spot, rad")
    turn_share: float = Field(gt=0, le=1, description="speed of that turn as a share of the largest yaw rate")
    reverse: bool = Field(description="whether it may drive backwards, as far as the robot can")

    @model_validator(mode="before")
    @classmethod
    def _followers(cls, table: Any) -> Any:
        if not isinstance(table, dict) or "prediction_horizon" not in table:
            return table
        return dict.fromkeys(("control_horizon", "planning_window"), table["prediction_horizon"]) | table

    @model_validator(mode="after")
    def _horizons(self) -> Parameters:
        if self.control_horizon > self.prediction_horizon:
            raise ValueError(
                f"control_horizon is {self.control_horizon}, beyond prediction_horizon {self.prediction_horizon};"
                " it must be at most that"
            )
        return self


def chosen_from(kind: str, value: str, choices: Any) -> str:
    """`value` if it is one of the literals `choices`.

    Raises:
        ClearwayError: it isn't; the message lists what is.
    """
    if value not in get_args(choices):
        raise unknown(kind, str(value), get_args(choices))
    return value


def literal_from(names: Collection[str] | str | int) -> frozenset[str]:
    """The equations to be taken literally, from names such as ("1", "3f") or a text such as "1+3f" (or one number).

    Raises:
        ClearwayError: there is no such reading.
    """
    if isinstance(names, int | str):
        names = str(names).replace("+", ",").split(",")
    given = [n.strip() for n in names if n.strip()]
    return frozenset(chosen_from("literal reading", str(name), Literally) for name in given)
