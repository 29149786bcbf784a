"""Parameters of `social-force`: Moussaïd et al.'s for people, unless the robot's file says otherwise."""

from __future__ import annotations

from pydantic import Field

from clearway.crowds.social_force import MOUSSAID, SocialForce
from clearway.navigators.common.crowd_navigator import CrowdParameters
from clearway.quantities import NonNegative, Positive


class Parameters(CrowdParameters):
    """Everything under `[navigators.social-force]`."""

    TABLE = "navigators.social-force"

    relaxation: Positive = Field(default=MOUSSAID.relaxation, description="tau, s")
    strength: NonNegative = Field(default=MOUSSAID.strength, description="A, of the force between two, m/s^2")
    span: Positive = Field(default=MOUSSAID.span, description="gamma: that force falls by 1/e on gamma |D|, m")
    foresight: NonNegative = Field(default=MOUSSAID.foresight, description="lambda, of relative velocity in D, s/m")
    turning: NonNegative = Field(default=MOUSSAID.turning, description="n, of the force aside")
    slowing: NonNegative = Field(default=MOUSSAID.slowing, description="n', of the force against the motion")
    wall_strength: NonNegative = Field(
        default=MOUSSAID.wall_strength, description="of the map's walls and what stands, m/s^2"
    )
    wall_span: Positive = Field(default=MOUSSAID.wall_span, description="on which that falls by 1/e, m")

    def model(self) -> SocialForce:
        """Its own eight, as the kernels take them."""
        names = type(self).model_fields.keys() & SocialForce._fields
        return MOUSSAID._replace(**{name: getattr(self, name) for name in names})
