"""Parameters come from the stand-ins, the robot's file and the options, in that order; an error names whose it is."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from pydantic import Field, model_validator

from clearway.errors import ClearwayError
from clearway.robots import RobotTable, load_robot

TIAGO = load_robot("tiago")


class Horizon(RobotTable):
    TABLE = "navigators.looks-ahead"
    RENAMED: ClassVar = {"look": "seconds"}
    seconds: float = Field(default=2.0, gt=0)
    steps: int = Field(default=10, ge=1)

    @model_validator(mode="after")
    def _fine(self) -> Horizon:
        if self.seconds / self.steps > 1.0:
            raise ValueError("its steps are longer than 1 s")
        return self


class OfStandIns(RobotTable):
    TABLE = "navigators.hl-rrt"
    STAND_INS = "task"
    size: float
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    time_limit: float
    disturbance: dict[str, float]


def robot(**table: Any) -> Any:
    return TIAGO.model_copy(update={"navigators": {"looks-ahead": table}})


def test_options_over_the_file_over_the_defaults() -> None:
    assert Horizon.read() == Horizon.read(TIAGO) == Horizon(seconds=2.0, steps=10)
    assert Horizon.read(robot(seconds=3.0, steps=5)) == Horizon(seconds=3.0, steps=5)
    assert Horizon.read(robot(seconds=3.0, steps=5), steps=7, seconds=None) == Horizon(seconds=3.0, steps=7)


def test_stand_ins_hold_where_nobody_says_otherwise() -> None:
    assert OfStandIns.read(TIAGO).size == 14.0
    assert OfStandIns.read(TIAGO, size=1.0).size == 1.0


@pytest.mark.parametrize(
    ("table", "options", "says"),
    [
        ({"seconds": -1.0}, {}, "robot tiago: navigators.looks-ahead.seconds: -1.0 is wrong: input should be greater than 0"),
        ({"seconds": 3.0}, {"seconds": -1.0}, "looks-ahead: seconds: -1.0 is wrong: input should be greater than 0"),
        ({"sceonds": 1.0}, {}, "robot tiago: navigators.looks-ahead.sceonds: unknown key; did you mean 'seconds'?"),
        ({"look": 1.0}, {}, "robot tiago: navigators.looks-ahead.look: unknown key; it is called 'seconds' now"),
        ({}, {"look": 1.0}, "looks-ahead: look: unknown key; it is called 'seconds' now"),
        ({"seconds": 99.0}, {}, "robot tiago: navigators.looks-ahead: its steps are longer than 1 s"),
        ({"seconds": 9.0}, {"steps": 2}, "looks-ahead: its steps are longer than 1 s"),
    ],
)  # fmt: skip
def test_an_error_names_whose_it_is(table: dict[str, Any], options: dict[str, Any], says: str) -> None:
    with pytest.raises(ClearwayError) as caught:
        Horizon.read(robot(**table), **options)
    assert str(caught.value) == says
