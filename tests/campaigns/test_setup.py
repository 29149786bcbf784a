"""Set-ups: what can be written, what it means, and that the name that results keep says all of it."""

from __future__ import annotations

import pytest

from clearway.campaigns.thinking_budget import read_thinking_budget
from clearway.contract import Budget
from clearway.errors import ClearwayError


@pytest.mark.parametrize(
    ("text", "name", "budget"),
    [
        ("1", "1", Budget(seconds=0.15)),
        ("2", "2", Budget()),
        ("0.05s", "0.05 s", Budget(seconds=0.05)),
        (" 1e-3 s", "0.001 s", Budget(seconds=0.001)),
        ("0.1234567 s", "0.1234567 s", Budget(seconds=0.1234567)),
        ("400iterations", "400 iterations", Budget(iterations=400)),
        ("1 iteration", "1 iterations", Budget(iterations=1)),
        ("1234567 iterations", "1234567 iterations", Budget(iterations=1234567)),
    ],
)
def test_what_it_means(text: str, name: str, budget: Budget) -> None:
    setup = read_thinking_budget(text)
    assert (setup.name, setup.budget) == (name, budget)
    assert read_thinking_budget(name) == setup


@pytest.mark.parametrize("text", ["real-time", "real time", " real-time "])
def test_real_time_has_no_bound_and_depends_on_the_machine(text: str) -> None:
    setup = read_thinking_budget(text)
    assert (setup.name, setup.budget, setup.real_time, setup.clocked) == ("real time", Budget(), True, True)
    assert [read_thinking_budget(t).clocked for t in ("2", "400 iterations", "1")] == [False, False, True]


@pytest.mark.parametrize(
    "text", ["", "3", "0 s", "-1s", "nan s", "inf s", "1e9 s", "1.5 iterations", ". s", "0.15", "1 ms"]
)
def test_what_is_none(text: str) -> None:
    with pytest.raises(ClearwayError, match="is no set-up; write 1 or 2") as found:
        read_thinking_budget(text)
    assert found.value.field == "setup"
