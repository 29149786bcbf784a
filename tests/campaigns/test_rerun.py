"""A trial that is run again goes as before, to the last bit, and when it doesn't, the first difference is told."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clearway.robots
from clearway.campaigns import CampaignPlan, resume_campaign, run_campaign
from clearway.campaigns.rerun import rerun
from clearway.campaigns.scoring import score_plan
from clearway.errors import ClearwayError
from clearway.scenarios.suites import Selection
from clearway.trials import Outcome
from clearway.trials.store import Results, open_results

pytestmark = pytest.mark.slow

OWN = Path(__file__).with_name("own_navigators.py")
EXAMPLE = Path(__file__).parents[2] / "examples" / "06_score_recordings" / "plan.toml"
SCENARIO = """
name = "x"
floor_plan = "hall"
start = [-2.5, 0.0, 0.0]
speed = 0.6
localisation = "truth"

[[legs]]
name = "forth"
goal = [0.0, 0.0, 0.0]
time_limit = 60.0

[[obstacles]]
name = "box"
shape = { kind = "square", edge = 0.3 }
pose = [0.0, 2.0, 0.0]
"""


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Navigators of our own, in a file that a test may change."""
    return Path(shutil.copy(OWN, tmp_path_factory.mktemp("own") / "own.py"))


@pytest.fixture(scope="module")
def results(own: Path, tmp_path_factory: pytest.TempPathFactory) -> Results:
    plan = CampaignPlan(
        ("hospital",),
        robots=("tiago",),
        navigators=(f"{own}:Drives", f"{own}:Raises"),
        selection=Selection(batches=("NO",), speeds=(0.6,), repetitions=2),
        localisation="truth",
    )
    return run_campaign(plan, tmp_path_factory.mktemp("rerun") / "out", 1)


@pytest.fixture
def slower(own: Path) -> Any:
    """Makes the navigators of `own` slower after three seconds, of which what they are told is 0.138 s old; mends them again."""
    text = own.read_text()
    own.write_text(text.replace("return Command(v,", "return Command(v if o.t < 2.9 else 0.9 * v,"))
    yield
    own.write_text(text)


@pytest.mark.parametrize("number", [1, 2])
def test_the_same_bits_again(results: Results, number: int) -> None:
    """Of a trial that arrived, and of one whose navigator failed."""
    again = rerun(results, number)
    assert again.difference is None
    assert again.changed == {}
    assert again.id == results.trials["id"][number].as_py()
    assert again.now.pose.tobytes() == results.trial(number).pose.tobytes()
    assert str(again).startswith(f"trial {number} ({again.id}): the same bits again; ")


@pytest.mark.usefixtures("slower")
def test_a_changed_navigator_shows_where_it_went_another_way(results: Results) -> None:
    again = rerun(results, 1)
    first = int(np.flatnonzero(again.before.t > 3.05)[0])
    assert again.difference is not None
    assert (again.difference.t, again.difference.what) == (again.before.t[first], "cmd_v")
    assert again.difference.first == again.before.command[first, 0]  # type: ignore[index]
    assert again.difference.second == pytest.approx(0.9 * again.difference.first)
    assert "not the same bits. The first difference is cmd_v at 3.1 s: 0.5999" in str(again)
    assert re.search(
        r" m/s now \(the code of .*own.py:Drives, or a file that it is given, has changed since\)$", str(again)
    )
    before, now = again.changed["CT"]
    assert now > before == results.trials["CT"][1].as_py()


@pytest.mark.usefixtures("slower")
def test_other_versions_are_told_beside_a_difference(results: Results) -> None:
    older = Results(results.path, results.campaign | {"versions": results.campaign["versions"] | {"numpy": "1.26"}})
    assert f" now (made with numpy 1.26, this is {np.__version__}; the code of" in str(rerun(older, 1))


def test_another_navigator_meets_the_very_same(results: Results, own: Path) -> None:
    again = rerun(results, 1, navigator=f"{own}:Slow")  # which decides as Drives does
    assert not again.same_navigator
    assert again.difference is None
    assert again.now.attempt.navigator == f"{own}:Slow"
    assert again.now.pose.tobytes() == again.before.pose.tobytes()
    assert f"before; with {own}:Slow reached after" in str(again)


def test_a_results_directory_of_one_trial(results: Results, tmp_path: Path) -> None:
    again = rerun(results, 1, out=tmp_path / "one")
    assert again.results is not None
    one = open_results(tmp_path / "one")
    assert one.trials["id"].to_pylist() == [again.id]
    assert one.campaign["plan"]["selection"]["scenarios"] == ["NO-v0.6-r2"]
    assert one.campaign["run"]["rerun"] == {"results": str(results.path), "trial": 1}
    assert rerun(one, 0).difference is None  # and it can be rerun itself
    with pytest.raises(ClearwayError, match="already holds the results"):
        rerun(results, 0, out=tmp_path / "one")


def test_an_error_is_raised_for_a_debugger_and_leaves_nothing_behind(results: Results, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="lost"):
        rerun(results, 2, out=tmp_path / "out", raise_errors=True)
    assert not (tmp_path / "out").exists()


def test_what_cannot_be_rerun(results: Results, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="there is no trial 4; it holds 0 to 3"):
        rerun(results, 4)
    with pytest.raises(ClearwayError, match="unknown navigator 'move_base'; did you mean 'move-base'"):
        rerun(results, 0, navigator="move_base")
    recorded = score_plan(EXAMPLE, tmp_path / "lab", workers=1)
    with pytest.raises(ClearwayError, match="trial 0 was recorded with a real robot and cannot be rerun"):
        rerun(recorded, 0)


def test_what_has_changed_since_is_told(tmp_path: Path) -> None:
    robot, scenario = tmp_path / "robot.toml", tmp_path / "scenario.toml"
    tiago = (
        (Path(clearway.robots.__file__).parent / "tiago.toml")
        .read_text(encoding="utf-8")
        .replace('name = "tiago"', 'name = "mine"')
    )
    robot.write_text(tiago, encoding="utf-8")
    scenario.write_text(SCENARIO)
    plan = CampaignPlan((str(scenario),), robots=(str(robot),), navigators=(f"{OWN}:Drives",))
    results = run_campaign(plan, tmp_path / "out", 1)

    def complaint() -> str:
        with pytest.raises(ClearwayError) as told:
            rerun(results, 0)
        return str(told.value)

    robot.write_text(tiago.replace("v_max = 1.0", "v_max = 0.9"), encoding="utf-8")
    assert "robots.mine.drive.v_max was 1.0 and is 0.9; put that back first" in complaint()
    robot.write_text(tiago.replace('name = "mine"', 'name = "other"'), encoding="utf-8")
    assert "robots.other" in complaint()
    robot.write_text(tiago.replace("planner_frequency = 1.0", "planner_frequency = 0.5"), encoding="utf-8")
    (remark,) = rerun(results, 0).remarks
    assert remark == "robots.mine.navigators.move-base.move_base.planner_frequency was 1.0 and is 0.5"
    robot.write_text(tiago, encoding="utf-8")
    scenario.write_text(SCENARIO.replace("[0.0, 2.0, 0.0]", "[0.0, 2.1, 0.0]"))
    assert "the scenario 'x-v0.6-r1' is not what it was; put that back" in complaint()
    scenario.write_text(SCENARIO.replace('name = "x"', 'name = "y"'))
    assert "has the name 'x-v0.6-r1'; did you mean 'y-v0.6-r1'?" in complaint()
    scenario.write_text(SCENARIO)
    assert rerun(results, 0).difference is None


TIMED = """

class Timed(Drives):
    def step(self, o):
        assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
        return super().step(o)
"""


def test_no_workers_is_this_process_without_an_alarm(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text(OWN.read_text().replace("import time\n", "import signal\nimport time\n") + TIMED)
    plan = CampaignPlan(
        ("hospital",),
        robots=("tiago",),
        navigators=(f"{own}:Timed",),
        selection=Selection(batches=("NO",), speeds=(1.0,), repetitions=1),
        localisation="truth",
    )
    here = run_campaign(plan, tmp_path / "here", 0)
    assert here.trial(0).outcome is Outcome.REACHED
    watched = run_campaign(plan, tmp_path / "watched", 1)
    assert watched.trial(0).outcome is Outcome.NAVIGATOR_FAILED
    assert here.campaign["plan"] == watched.campaign["plan"]
    assert rerun(watched, 0).now.outcome is Outcome.REACHED


def test_no_workers_raises_what_a_navigator_raises_and_can_be_gone_on_with(tmp_path: Path) -> None:
    own = Path(shutil.copy(OWN, tmp_path / "own.py"))
    plan = CampaignPlan(
        ("hospital",),
        robots=("tiago",),
        navigators=(f"{own}:Drives", f"{own}:Raises"),
        selection=Selection(batches=("NO",), speeds=(1.0,), repetitions=1),
        localisation="truth",
    )
    with pytest.raises(RuntimeError, match="lost") as raised:
        run_campaign(plan, tmp_path / "out", 0)
    (note,) = raised.value.__notes__
    assert note == (
        f"1 of 2 trials are finished; `clearway run --resume {tmp_path / 'out'}` goes on, as long as no code is edited"
    )
    as_it_was = own.read_text()
    own.write_text(as_it_was.replace("raise RuntimeError", "str"))  # mended
    with pytest.raises(ClearwayError, match=r"cannot resume: its campaign differs in code.*own.py:Drives"):
        resume_campaign(tmp_path / "out", 1)
    own.write_text(as_it_was)
    assert [t.outcome for t in resume_campaign(tmp_path / "out", 1)] == [Outcome.REACHED, Outcome.NAVIGATOR_FAILED]
