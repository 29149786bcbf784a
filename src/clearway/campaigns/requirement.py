"""What the environment must offer: campaigns of a few trials each, steered by a sequential search, until the interval is known."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.progress import ProgressCallback, silent
from clearway.errors import ClearwayError, unknown
from clearway.recordings.protocol.toml_text import toml
from clearway.reports.causes import what_happened
from clearway.reports.requirement import JUDGES, NUMBERS, Requirement, read_requirement, write_requirement
from clearway.reports.requirement_page import write_page
from clearway.robots import Robot, load_robot
from clearway.scenarios.check import check_scenario
from clearway.scenarios.files import scenarios_in
from clearway.scenarios.offers import Offer, Task
from clearway.scenarios.scenario import Scenario
from clearway.statistics.thresholds import Block, ThresholdSearch
from clearway.trials.store import Results

TESTS, TRIALS = "tests", "trials"
"""Folders of what was tested, as files that `clearway run` takes, and of what came of it."""

JUDGED = "success_slack"
"""The column that says whether a trial was a success, unless somebody says otherwise: a robot that got through and stands 1 cm beside
its goal's tolerance, as its localisation errs, is no reason for a wider door."""


def find_requirement(
    offer: Offer,
    plan: CampaignPlan,
    out: Path,
    *,
    speed: float,
    reliability: float,
    confidence: float,
    between: tuple[float, float] | None = None,
    step: float | None = None,
    trials: int = 400,
    judged: str = JUDGED,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Requirement:
    """Search for the least that an environment must offer so that success is at least `reliability`.

    Each block of trials is a campaign of its own under `out`; one that is finished is not run again, so that a search that was
    interrupted, or that is given more trials, goes on.

    Args:
        offer: What.
        plan: Which robot and navigator, the seed and the rest of a campaign; its suites are set here.
        out: A folder for the tests, their results, the figure and the numbers.
        speed: Set speed, m/s.
        reliability: R, in (0, 1).
        confidence: Of the interval, in (0, 1).
        between: Least and greatest value; None: the usual ones.
        step: Distance of neighbouring values; None: the usual one.
        trials: How many there may be.
        judged: The column that says whether a trial was a success: `success_slack`, `success` or `success_self`.
        workers: How many processes; None: one a core.
        progress: Told how far it is.

    Raises:
        ClearwayError: something that was given is wrong, before anything runs.
    """
    out = out.resolve()  # whoever goes on may stand elsewhere
    if not 0.0 < speed <= 20.0:
        raise ClearwayError(f"{speed:g} m/s is no set speed", field="speed")
    if judged not in JUDGES:
        raise unknown("kind of success", judged, JUDGES, field="success")
    if (out / "campaign.json").exists():
        raise ClearwayError("holds the results of a campaign; choose another folder", file=out)
    (which,), (navigator,) = plan.robots, plan.navigators
    robot, tell = load_robot(which), progress or silent
    values = offer.values(robot, between, step)
    _refuse_another(out, (offer.name, robot.title or robot.name, navigator, speed))
    failed: list[Counter[str]] = [Counter() for _ in values]
    search = ThresholdSearch(len(values), reliability, confidence, trials)
    for value in (values[0], values[-1]):
        _check(offer, value, plan, robot, speed, out)
    while (block := search.next()) is not None:
        done = int(search.trials.sum())
        tell(done, trials, f"{offer.quantity}: {values[block.index]:g}")
        begin = int(search.trials[block.index]) + 1
        results = _run(offer, values[block.index], block, begin, plan, robot, speed, out, workers)
        rows = results.trials.to_pylist()
        failed[block.index].update(what_happened(r) for r in rows if not r[judged])
        search.tell(block, sum(bool(r[judged]) for r in rows))
    done = int(search.trials.sum())
    tell(done, done)  # as many as it took
    found = _found(offer, values, search, robot, navigator, speed, judged, failed)
    write_requirement(found, out)
    write_page(found, out)
    return found


def _run(
    offer: Offer, value: float, block: Block, begin: int, plan: CampaignPlan, robot: Robot, speed: float, out: Path,
    workers: int | None,
) -> Results:  # fmt: skip
    """The campaign of one block, read if it was run before."""
    suite, task = _written(offer, value, block.trials, begin, plan, robot, speed, out)
    asked = dataclasses.replace(plan, suites=(str(suite),), robots=(_robot(task, robot, plan, suite.parent),))
    return run_campaign(asked, out / TRIALS / f"{suite.stem}-{block.trials}", workers, resume=True)


def _refuse_another(out: Path, asked: tuple[str, str, str, float]) -> None:
    """Refuse to write over what another search has found."""
    if not (out / NUMBERS).is_file():
        return
    there = read_requirement(out)
    if (there.offer, there.robot, there.navigator, there.speed) != asked:
        raise ClearwayError(f"holds another search: {there}; choose another folder", file=out)


def _check(offer: Offer, value: float, plan: CampaignPlan, robot: Robot, speed: float, out: Path) -> None:
    """Complain of a value that no robot like this could meet, or that nothing can be made of."""
    suite, task = _written(offer, value, 1, 1, plan, robot, speed, out)
    for scenario in scenarios_in(suite):
        for problem in check_scenario(scenario, task.robot):
            raise ClearwayError(f"{value:g}{offer.unit} cannot be tested: {problem.problem}", field="range")


def _written(
    offer: Offer, value: float, many: int, begin: int, plan: CampaignPlan, robot: Robot, speed: float, out: Path
) -> tuple[Path, Task]:
    """The file of a suite of some trials, with its floor plan beside it, and the first of them."""
    names = [f"{offer.name}-{value:g}-{begin + k}" for k in range(many)]
    tasks = [offer.make(value, robot, speed, name, plan.seed) for name in names]
    folder = out / TESTS
    folder.mkdir(parents=True, exist_ok=True)
    place = folder / f"{offer.name}-{value:g}-floor-plan.toml"
    _write(place, tasks[0].floor_plan.model_dump(mode="json", exclude_defaults=True))
    suite = folder / f"{names[0]}.toml"
    _write(suite, {"name": f"requirement-{offer.name}", "scenario": [_table(t.scenario, place.name) for t in tasks]})
    return suite, tasks[0]


def _table(scenario: Scenario, place: str) -> dict[str, Any]:
    table: dict[str, Any] = scenario.model_dump(mode="json", exclude_defaults=True)
    return table | {"floor_plan": place}


def _robot(test: Task, robot: Robot, plan: CampaignPlan, folder: Path) -> str:
    """The name of the robot of a test, or the file that was written of one that senses worse."""
    if test.robot is robot:
        return plan.robots[0]
    file = folder / f"{test.robot.name.replace(':', '-')}.toml"
    _write(file, test.robot.model_dump(mode="python", exclude_none=True, exclude={"presets"}))
    return str(file)


def _write(file: Path, table: dict[str, Any]) -> None:
    text = toml(table)
    if not file.exists() or file.read_text("utf-8") != text:  # one that is the same keeps its time of change
        file.write_text(text, "utf-8")


def _found(
    offer: Offer, values: Sequence[float], search: ThresholdSearch, robot: Robot, navigator: str, speed: float, judged: str,
    failed: Sequence[Counter[str]],
) -> Requirement:  # fmt: skip
    tried = [i for i in range(len(values)) if search.trials[i]]

    def value(index: int | None) -> float | None:
        return None if index is None else values[index]

    return Requirement(
        offer=offer.name,
        phrase=offer.phrase,
        unit=offer.unit,
        quantity=offer.quantity,
        eases=offer.eases,
        robot=robot.title,
        navigator=navigator,
        speed=speed,
        reliability=search.reliability,
        confidence=search.confidence,
        hardest=values[0],
        easiest=values[-1],
        values=tuple(values[i] for i in tried),
        successes=tuple(int(search.successes[i]) for i in tried),
        trials=tuple(int(search.trials[i]) for i in tried),
        curve=tuple(float(search.curve[i]) for i in tried),
        estimate=value(search.estimate),
        fails=value(search.fails),
        passes=value(search.passes),
        spent=search.next() is None and int(search.trials.sum()) >= search.most,
        judged=judged,
        why=tuple(next((words for words, _ in failed[i].most_common(1)), "") for i in tried),
    )
