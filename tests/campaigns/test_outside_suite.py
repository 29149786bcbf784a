"""A suite from outside the package: one file and one line of registration, or its address; run, stored and reported."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from clearway import registry
from clearway.campaigns import CampaignPlan, run_campaign
from clearway.errors import ClearwayError
from clearway.reports import write_report
from clearway.reports.findings import Findings
from clearway.scenarios import floorplan
from clearway.scenarios.suite import Section
from clearway.scenarios.suites import load_suite, suite_names

pytestmark = pytest.mark.slow

DRIVES = f"{Path(__file__).with_name('own_navigators.py')}:Drives"
SUITE = """
from clearway.robots import Robot
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import DisturbanceSpec, LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import Section, Selection, Suite, scenario_seed


def yard():
    return FloorPlan("our-yard", "An empty yard", (), None, None, None, None, (-1.0, -3.0, 6.0, 3.0))


def make(robot, selection, seed):
    leg = LegSpec(name="across", goal=(4.0, 0.0, 0.0), time_limit=30.0)
    return [
        Scenario(
            name=f"across-r{i}", floor_plan="our-yard", start=(0.0, 0.0, 0.0), legs=(leg,), speed=0.6, localisation="truth",
            labels=LabelSpec(batch="yard", configuration="across", repetition=i), seed=scenario_seed(seed, f"across-r{i}"),
            disturbance=DisturbanceSpec(position=0.003, velocity=0.01),
        )
        for i in range(1, (selection.repetitions or 2) + 1)
    ]


YARD = Suite(
    "yard", "Crossing our yard", "nothing but a yard", ("yard",), ("across",), make,
    robots=("tiago",), report=(Section.RESCUE,), floor_plans={"our-yard": yard},
)
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    path = tmp_path / "outside" / "our_suites.py"
    path.parent.mkdir()
    path.write_text(SUITE)
    monkeypatch.syspath_prepend(str(path.parent))
    yield path
    registry._points.cache_clear()
    floorplan._of_a_suite.cache_clear()


def register(file: Path, line: str) -> None:
    """What installing a package leaves behind."""
    about = file.parent / "our_suites-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: our-suites\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[clearway.suites]\n{line}\n")
    registry._points.cache_clear()


@pytest.mark.parametrize(("which", "workers"), [("yard", 1), ("{file}:YARD", 2)])
def test_it_is_run_and_reported(file: Path, tmp_path: Path, which: str, workers: int) -> None:
    if which == "yard":
        register(file, "yard = our_suites:YARD")
        assert "yard" in suite_names()
    results = run_campaign(
        CampaignPlan((which.format(file=file),), navigators=(DRIVES,)), tmp_path / "out", workers=workers
    )
    rows = results.trials.to_pylist()
    assert [r["robot"] for r in rows] == ["tiago", "tiago"]  # its usual one
    assert {(r["suite"], r["floor_plan"], r["outcome"]) for r in rows} == {("yard", "our-yard", "reached")}
    f = Findings(results)
    assert f.asked(Section.RESCUE) == ["yard"]
    assert f.asked(Section.MANOEUVRING_SPACE) == []
    if workers > 1:
        return  # its page is no other one
    page = write_report(results.path).read_text()
    assert "<h1>Crossing our yard</h1>" in page
    assert "Crossing our yard: successes with the exact 95 % interval" in page  # the section that it asked for
    assert "rough: it moves the robot by at most 0.003 m and 0.01 m/s a control period" in page
    assert "Space that manoeuvring takes" not in page


def test_what_is_wrong_with_one_is_said(file: Path) -> None:
    register(file, "garden = our_suites:YARD")
    with pytest.raises(ClearwayError, match="registered as 'garden' calls itself 'yard'"):
        load_suite("garden")
    with pytest.raises(ClearwayError, match="is a function, not a suite"):
        load_suite(f"{file}:make")
    with pytest.raises(ClearwayError, match="did you mean 'YARD'"):
        load_suite(f"{file}:YARDS")
