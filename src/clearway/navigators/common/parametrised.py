"""What navigators share all of whose numbers stand in one table: they are read from the robot's file and from options."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from clearway.robots import Robot, RobotTable

P = TypeVar("P", bound=RobotTable)


class Parametrised(Generic[P]):
    """Reads its parameters.

    Args:
        options: Any of the table's fields, which overrides the robot's file.

    Attributes:
        parameters: The table; a subclass names its own.

    Raises:
        ClearwayError: An option is wrong.
    """

    parameters: type[P]

    def __init__(self, **options: Any) -> None:
        self._options = options
        self.read_parameters(None)  # a wrong one is told at once

    def read_parameters(self, robot: Robot | None) -> P:
        """What it would drive `robot` with; None: any.

        Raises:
            ClearwayError: One of them is wrong, in the robot's file or among the options.
        """
        return self.parameters.read(robot, **self._options)
