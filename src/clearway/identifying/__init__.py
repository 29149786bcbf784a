"""A robot's own recording tells how its base answers commands: the door of this room."""

from clearway.identifying.files import Findings, identify_recording
from clearway.identifying.fit import Answered, Estimate, Identified, identify

__all__ = ["Answered", "Estimate", "Findings", "Identified", "identify", "identify_recording"]
