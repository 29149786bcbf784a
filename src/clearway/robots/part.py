"""What the tables of a robot's file have in common."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Part(BaseModel):
    """A table: frozen, without keys that nobody knows."""

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="strings")
