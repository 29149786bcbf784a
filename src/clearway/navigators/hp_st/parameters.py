"""Parameters of HP-ST, checked. `stand_ins.toml` holds the defaults; a robot's file may override any of them under
`[navigators.hp-st]`."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, ClassVar

from pydantic import Field

from clearway.errors import unknown
from clearway.forecasts.parameters import Rules
from clearway.quantities import NonNegative, Positive, Whole
from clearway.robots import RobotTable

INGREDIENTS = ("time-aware", "candidates", "horizon", "forecast", "certificate", "reverse", "time-to-go")
"""What it can be run without, to see what each brings."""

GUARANTEES = ("passive", "evasive", "none")

Share = Annotated[float, Field(gt=0, le=1)]


class Parameters(RobotTable):
    """Everything that HP-ST can be told about itself."""

    TABLE = "navigators.hp-st"
    STAND_INS = "hp-st"
    RENAMED: ClassVar = {
        "calm": "low_cost_threshold",
        "fear": "contact_cost",
        "fade": "discount",
        "swing": "yaw_change_cost",
        "back": "reverse_cost",
    }

    layers: Whole = Field(ge=1, le=40, description="of the search")
    step: Positive = Field(description="between two layers, s; rounded to control periods")
    short: Whole = Field(ge=1, le=40, description="layers of the search without the ingredient `horizon`")
    narrow: Whole = Field(ge=1, le=2000, description="nodes kept in a layer at first")
    wide: Whole = Field(ge=1, le=2000, description="nodes kept where the narrow search finds no way of low cost")
    low_cost_threshold: NonNegative = Field(description="a way that costs no more than this is not searched on, s")
    contact_cost: Positive = Field(description="cost of a certain contact, s")
    headway: NonNegative = Field(
        description="beside who moves it drives no faster than would take it all the room between them in this time, s, unless it would be hit if it stood; 0: as fast as anywhere"
    )
    creep: Positive = Field(description="but so fast it may always drive, m/s")
    halt_cost: NonNegative = Field(
        description="with a certificate: cost of being where it couldn't brake to rest in time, s/s"
    )
    hit: Share = Field(
        description="risk of contact in a period, if it stood, from which on `headway` doesn't hold; with `evasive`, in any plan that is certified, from which on it evades"
    )
    proceed: NonNegative = Field(
        le=1,
        description="with `evasive`, where nothing has a certificate: risk of contact in a period up to which it drives on",
    )
    proceed_horizon: Positive = Field(
        description="`proceed` is asked of the plan's periods within that time, s; what comes later it decides anew"
    )
    discount: Share = Field(description="factor on that for each second ahead")
    margin: NonNegative = Field(description="kept from what stands, m")
    soft: Positive = Field(description="from this distance on nearness to what stands costs, m")
    near: NonNegative = Field(description="what it costs at no distance, s/s")
    yaw_change_cost: NonNegative = Field(description="cost of a change of the yaw rate, s per rad/s")
    reverse_cost: NonNegative = Field(description="cost of reversing, s/s")
    own_spread: Positive = Field(description="standard deviation of the own position about the plan, m")
    own_growth: NonNegative = Field(description="its growth, m/s")
    most_spread: Positive = Field(description="no forecast counts as less certain than that, m")
    candidates: Whole = Field(ge=1, le=8, description="ways of distinct topology that are tracked and compared")
    apart: Positive = Field(
        description="two ways whose bearings of an obstacle turn by more than that apart differ, rad"
    )
    keep: NonNegative = Field(description="another plan has to be better than the last one by this, s")
    rounds: Whole = Field(ge=0, le=20, description="linearisations of the tracking problem, at most")
    effort: Positive = Field(description="w_2 of the tracking problem")
    heading_weight: NonNegative = Field(description="of the heading's error beside the position's, m/rad")
    reverse: bool = Field(description="whether it may drive backwards, where the base can")
    obstacle_speed: Positive = Field(description="assumed bound of the obstacles' speed, m/s")
    obstacle_acceleration: Positive = Field(description="assumed bound of the obstacles' acceleration, m/s^2")
    avoidance: Rules = Field(
        description="by which rules obstacles may avoid each other, of orca and social-force; true: by orca"
    )
    oscillation: NonNegative = Field(
        lt=1, description="probability at first that an obstacle oscillates about a point, as those of paper B"
    )
    memory: NonNegative = Field(description="an obstacle out of view for longer is forgotten, s")
    disturbance_position: NonNegative = Field(description="assumed bound of the displacement in a period, m")
    disturbance_heading: NonNegative = Field(description="the same of the heading, rad")
    disturbance_velocity: NonNegative = Field(description="the same of v, m/s")
    disturbance_turn: NonNegative = Field(description="the same of omega, rad/s")
    disturbed_at_rest: bool = Field(description="whether a robot that stands is disturbed too")
    pose_error: NonNegative = Field(description="assumed bound of the estimated position's error, m")
    heading_error: NonNegative = Field(description="the same of the heading, rad")
    turning_rests: bool = Field(description="whether a round base that turns on the spot counts as one that stands")
    unseen_speed: NonNegative = Field(description="speed at which something unseen may enter the perceived circle, m/s")
    scan_range: Positive = Field(description="perception radius of a robot with a lidar is at most this, m")


def ingredients_from(names: Collection[str] | str) -> frozenset[str]:
    """Ingredients to leave out, from names or from a text such as reverse+candidates.

    Raises:
        ClearwayError: there is no such ingredient.
    """
    given = [n.strip() for n in (names.split("+") if isinstance(names, str) else names) if n.strip()]
    for name in given:
        if name not in INGREDIENTS:
            raise unknown("ingredient", name, INGREDIENTS, field="without")
    return frozenset(given)


def guarantee_from(name: str) -> str:
    """`name` if it is one of `GUARANTEES`.

    Raises:
        ClearwayError: it isn't.
    """
    if name not in GUARANTEES:
        raise unknown("guarantee", str(name), GUARANTEES, field="guarantee")
    return name
