"""Nav2's parameters: a user's YAML, and what each server makes of it."""

from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.parameters.nav2_parameters import Parameters, files, read

__all__ = ["Branch", "Parameters", "files", "read"]
