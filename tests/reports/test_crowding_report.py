"""People and fleets in the report: its tables' numbers are those of the trials, its curves those of the numbers of people."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clearway.reports import crowding, encounters, fleets
from clearway.reports.selection import System, system_of
from clearway.statistics import mean_interval

SYSTEM = System("tiago", "orca", None)


def row(trial: int, **more: Any) -> dict[str, Any]:
    return {
        "trial": trial, "robot": "tiago", "navigator": "orca", "setup": None, "suite": "ward-day", "batch": "people-5",
        "configuration": "pharmacy", "success": True, "people": 5, "other_robots": 0, "touched": "", "CT": 20.0,
    } | more  # fmt: skip


def found(rows: list[dict[str, Any]], **more: Any) -> Any:
    of = lambda system: [r for r in rows if system_of(r) == system]  # noqa: E731
    return SimpleNamespace(
        rows=rows, systems=[SYSTEM], of=of, name=lambda s: s.navigator, batch=lambda r: str(r["batch"]), **more
    )


def test_the_table_of_people_has_means_intervals_and_the_worst() -> None:
    distances, delays = [0.4, 0.9, 0.6], [1.0, None, -0.5]
    rows = [row(k, person_distance=d, people_delay=s) for k, (d, s) in enumerate(zip(distances, delays, strict=True))]
    rows.append(row(3, person_distance=None, touched="person", success=False))
    near, cost = encounters.people(found(rows))
    assert [c.name for c in near.columns] == ["Robot", "Batch", "n", "touched", "distance (m)"]
    cells = near.rows[0]
    assert [c.text for c in cells] == ["orca", "people-5", "4", "1", "0.63"]
    interval = mean_interval(np.array(distances), bounds=(0.0, np.inf))
    assert interval is not None
    assert cells[4].small.split("\n") == [f"[{interval.low:.2f}, {interval.high:.2f}]", "worst 0.40", "of 3"]
    assert [c.text for c in cost.rows[0]][4:] == ["0.25"]
    assert cost.rows[0][4].small.endswith("worst 1.00\nof 2")
    assert "A delay below 0" in cost.caption
    assert "A delay below 0" not in encounters.people(found([row(0, people_delay=0.5)]))[0].caption
    assert encounters.people(found([row(0, people=0)])) == []


def test_who_moved_at_contact_is_counted_where_it_is_known() -> None:
    kinds = ["robot", "both", "obstacle", "obstacle", "neither", "", ""]
    rows = [row(k, moved_at_contact=who, contacts=int(bool(who)), jerk=1.0 + k) for k, who in enumerate(kinds)]
    table = encounters.driving(found(rows))
    assert table is not None
    assert [c.name for c in table.columns][3:] == [
        "contacts: robot moved",
        "both",
        "the other",
        "neither",
        "mean jerk (m/s³)",
    ]
    assert [c.text for c in table.rows[0]][2:] == ["7", "1", "1", "2", "1", "4.00"]
    unknown = encounters.driving(found([*rows[2:3], row(9, moved_at_contact="", contacts=None)]))
    assert unknown is not None
    assert [c.text for c in unknown.rows[0]][3:7] == ["–", "–", "1", "–"]
    assert encounters.driving(found([row(0, contacts=0)])) is None


def test_the_share_of_trials_that_stayed_so_far_from_people() -> None:
    rows = [row(k, person_distance=d) for k, d in enumerate([0.5, 0.2, 0.9, 1.4, 0.7])]
    figure = crowding.distances(found(rows))
    assert figure is not None
    line = figure.axes[0].lines[0]
    x, y = line.get_xdata(), line.get_ydata()
    for reach, share in ((0.1, 100.0), (0.45, 80.0), (0.8, 40.0), (1.0, 20.0)):
        assert y[np.searchsorted(x, reach)] == pytest.approx(share)
    assert crowding.distances(found(rows[:3])) is None


def test_curves_by_the_number_of_people() -> None:
    rows = [
        row(k, people=n, success=k % 2 == 0 or n == 0, people_delay=0.1 * n * k) for k in range(8) for n in (0, 5, 10)
    ]
    figure = crowding.by_number(found(rows), "ward-day", "people")
    assert figure is not None
    success, delay, ct = figure.axes
    assert success.containers[0].lines[0].get_ydata().tolist() == [100.0, 50.0, 50.0]
    assert delay.containers[0].lines[0].get_ydata() == pytest.approx([0.0, 1.75, 3.5])
    assert (success.get_ylabel(), ct.get_ylabel()) == ("success (%)", "completion time (s)")
    assert crowding.by_number(found(rows), "ward-day", "other_robots") is None
    assert crowding.by_number(found(rows), "another", "people") is None


def test_the_table_of_fleets() -> None:
    def run(
        trial: int, makespan: float | None, deadlocks: float, waiting: dict[tuple[str, str], float], *others: System
    ) -> fleets.Run:
        values = {
            "makespan": makespan,
            "sum_of_times": makespan and 2 * makespan,
            "contacts": 1.0,
            "deadlocks": deadlocks,
        }
        known = {name: fleets.Value(v) for name, v in values.items()}
        return fleets.Run(row(trial), (SYSTEM, *others), 2, known, waiting)

    there = [
        run(0, 10.0, 0.0, {("a", "b"): 3.0}),
        run(2, 14.0, 0.0, {}),
        run(4, None, 1.0, {("b", "a"): 9.0, ("a", "b"): 6.0}),
        run(6, 20.0, 0.0, {}, System("hosbot", "hp-st", None)),
    ]
    table = fleets.fleets(found([]), there)
    assert table is not None
    cells, mixed = table.rows
    assert [c.text for c in cells] == ["orca", "people-5, pharmacy", "2", "3", "2", "12.0", "24.0", "3", "1", "6.0"]
    assert (cells[-1].small, cells[-1].trials) == ("b for a, 9.0 s", (4,))
    assert [c.text for c in mixed][:4] == ["orca and hp-st", "people-5, pharmacy", "2", "1"]
    assert fleets.fleets(found([]), []) is None
