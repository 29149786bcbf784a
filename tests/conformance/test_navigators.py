"""Every registered navigator keeps the contract that a user's own is held to.

By default those that tests compile anyway, with one of the two robots of the hospital each; all of them by `make slow`, those that
drive holonomic bases alone with a holonomic one that is told its obstacles.
"""

from __future__ import annotations

import pytest

from clearway.campaigns.conformance import check_navigator
from clearway.navigators.registry import drives_of, make_navigator, navigator_class, navigator_names
from clearway.robots import load_robot

ROBOTS, HOLONOMIC = ("tiago", "hosbot"), ("crowdnav-disc",)
LEARNT = {"ppo": ("tiago", "crowdnav-disc")}  # those that it was trained for
OFTEN = {("move-base", "tiago"), ("orca", "hosbot"), ("ppo", "tiago"), ("ppo", "crowdnav-disc")}


def robots_of(name: str) -> tuple[str, ...]:
    if name in LEARNT:
        return LEARNT[name]
    return ROBOTS if "differential" in drives_of(name, navigator_class(name)) else HOLONOMIC


@pytest.mark.parametrize(
    ("name", "robot"),
    [
        pytest.param(name, robot, marks=[] if (name, robot) in OFTEN else [pytest.mark.slow])
        for name in navigator_names()
        for robot in robots_of(name)
    ],
)
def test_it_conforms(name: str, robot: str) -> None:
    findings = list(check_navigator(lambda: make_navigator(name), load_robot(robot)))
    unmet = [f"{f.name}: {f.detail}" for f in findings if not f.passed]
    assert [u for u in unmet if "control period" not in u] == []  # a busy test machine is no fault of the navigator
