"""The one way in which parameters are read: those of a navigator, of a localiser, of the mapper.

class Parameters(RobotTable):
    TABLE = "navigators.my-navigator"
    horizon: float = Field(default=2.0, gt=0, description="s")

Parameters.read(robot, horizon=3.0)
"""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from clearway.errors import ClearwayError
from clearway.robots.robot import Robot
from clearway.stand_ins import stand_ins
from clearway.validation import first_problem

TUNED_ON = "tuned_on"
"""The key of a navigator's table that says on what its values were chosen: no parameter of its own."""


class RobotTable(BaseModel):
    """A table of a robot's file that is read by somebody else than the robot; an unknown key in it is an error.

    What it is read for, a `Robot` or None, is the context of its validators: a table may fill in what another one says.

    A subclass may also have `RENAMED`, old key -> new key: whoever still writes the old one is told the new one.

    Attributes:
        TABLE: Where it stands in a robot's file, such as `navigators.hp-st`, `localisation.amcl` or `mapping`.
        STAND_INS: The table of `stand_ins.toml` whose values hold where neither the robot's file nor an option says
            otherwise; None: the fields' own defaults hold.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    TABLE: ClassVar[str]
    STAND_INS: ClassVar[str | None] = None

    @classmethod
    def read(cls, robot: Robot | None = None, /, **options: Any) -> Self:
        """The stand-ins, overridden by the robot's file, overridden by the `options` that are not None.

        Args:
            robot: Whose file is asked; None: none is.
            options: What the navigator's constructor was given, by the fields' names.

        Raises:
            ClearwayError: One of them is wrong; the message names the robot (or the navigator, of an option), the field
                and the value, and says what would be right.
        """
        usual = stand_ins(cls.STAND_INS) if cls.STAND_INS else {}
        written = _table(robot, cls.TABLE) if robot is not None else {}
        chosen = {name: value for name, value in options.items() if value is not None}
        try:
            return cls.model_validate(usual | written | chosen, context=robot)
        except ValidationError as error:
            problem = first_problem(error, cls)
            name = (problem.field or "").partition(".")[0]  # empty: what is wrong is how several values go together
            by_option, by_robot = (name in given if name else bool(given) for given in (chosen, written))
            if robot is None or by_option or not by_robot:
                raise ClearwayError(problem.problem, file=_owner(cls.TABLE), field=problem.field) from error
            field = f"{cls.TABLE}.{problem.field}" if problem.field else cls.TABLE
            raise ClearwayError(problem.problem, file=f"robot {robot.name}", field=field) from error


def _table(robot: Robot, where: str) -> dict[str, Any]:
    group, _, name = where.partition(".")
    tables: dict[str, Any] = getattr(robot, group)
    table = tables.get(name, {}) if name else tables
    return {key: value for key, value in table.items() if key != TUNED_ON} if isinstance(table, dict) else table


def _owner(where: str) -> str:
    return where.rpartition(".")[2]
