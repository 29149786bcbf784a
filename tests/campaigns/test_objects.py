"""What a Python program hands over instead of names: it runs in workers, its results say so, and nobody takes it for what it is not."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from own_navigators import Drives

import clearway
from clearway import given
from clearway.api import simulate
from clearway.contract import Command, Observation
from clearway.errors import ClearwayError
from clearway.robots import Robot, load_robot
from clearway.scenarios.scenario import LegSpec, Scenario

HALL = Scenario(
    name="short", floor_plan="hall", start=(-1.0, 0.0, 0.0), speed=0.5, localisation="truth",
    legs=(LegSpec(name="forth", goal=(1.0, 0.0, 0.0), time_limit=20.0),),
)  # fmt: skip


def own_class(pace: float = 0.5) -> Any:
    """A class that no other process finds by its name, as those of a notebook."""

    class Straight:
        needs = frozenset({"map"})

        def reset(self, task: Any, robot: Robot, rng: np.random.Generator) -> None:
            self.robot = robot.name

        def step(self, o: Observation) -> Command:
            return Command(pace if math.dist(o.pose[:2], o.goal.pose[:2]) > 0.05 else 0.0, 0.0)

    return Straight


def cart() -> Robot:
    return load_robot("tiago").model_copy(update={"name": "cart", "title": "A cart"})


@pytest.fixture(autouse=True)
def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(given, "_GIVEN", {})
    monkeypatch.setattr(given, "_packed", None)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> clearway.Results:
    out = tmp_path_factory.mktemp("objects") / "out"
    return clearway.run(HALL, robots=[cart()], navigators=[own_class(), "move-base"], workers=1, out=out)


def test_a_class_a_robot_and_a_scenario_run_in_a_worker(results: clearway.Results) -> None:
    straight = results.trials.to_pylist()[0]
    assert straight["id"] == "short/short-v0.5-r1/object:cart/object:own_class.<locals>.Straight"
    assert straight["robot"] == "cart"
    assert straight["success"]
    assert results.campaign["robots"]["cart"]["title"] == "A cart"


def test_its_trial_in_this_process_has_the_same_bits(results: clearway.Results) -> None:
    trial = simulate(HALL, cart(), own_class())
    assert np.array_equal(trial.pose, results.trial(0).pose)


def test_results_say_that_it_was_an_object(results: clearway.Results) -> None:
    with pytest.raises(ClearwayError, match="'object:cart' was an object of a Python program"):
        clearway.rerun(results, 0)


def test_handed_over_again_it_is_run_again(results: clearway.Results) -> None:
    navigators = [own_class(), own_class(0.3)]
    given.give("cart", cart())
    with pytest.raises(ClearwayError, match="was an object"):
        clearway.rerun(results, 0, navigator=navigators[0])
    simulate(HALL, cart(), navigators[0])  # hands all three over
    again = clearway.rerun(results, 0, navigator=navigators[0])
    assert again.same_navigator
    assert again.difference is None
    assert clearway.rerun(results, 0, navigator=navigators[1]).difference is not None


def test_a_class_of_a_module_goes_by_its_address() -> None:
    assert given.address_of(Drives) == "own_navigators:Drives"
    assert given.address_of(own_class()) is None


def test_what_raises_is_raised() -> None:
    class Raises(own_class()):  # type: ignore[misc]
        def step(self, o: Observation) -> Command:
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        simulate(HALL, "tiago", Raises)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"navigators": [own_class()()]}, "give the class"),
        ({"robots": [3]}, "robots: 3 is neither a name nor a Robot"),
        ({"team": ["tiago", 3]}, "team: 3 is neither a name nor a Robot"),
        ({"workers": "two"}, "workers: 'two' is wrong: a whole number, at least 0"),
        ({"robots": [cart().model_copy(update={"name": "tiago"})]}, "give it a name of its own"),
    ],
)
def test_what_is_no_such_thing(arguments: dict[str, Any], says: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=says):
        clearway.run(HALL, **({"robots": ["tiago"], "workers": 0, "out": tmp_path / "out"} | arguments))


def test_one_scenario_of_a_suite_has_to_be_named() -> None:
    with pytest.raises(ClearwayError, match="say which one"):
        simulate("hospital", "tiago")


def test_what_cannot_be_taken_along_is_said(tmp_path: Path) -> None:
    held = (i for i in ())

    class Holds(own_class()):  # type: ignore[misc]
        kept = held

    with pytest.raises(ClearwayError, match="workers=0"):
        clearway.run(HALL, robots=["tiago"], navigators=[Holds], workers=1, out=tmp_path / "out")


def test_a_summary_has_a_row_a_system(results: clearway.Results) -> None:
    rows = results.summary().to_pylist()
    assert [row["navigator"] for row in rows] == ["object:own_class.<locals>.Straight", "move-base"]
    assert (rows[0]["n"], rows[0]["SR"], rows[0]["SR_low"]) == (1, 100.0, pytest.approx(2.5))
    assert rows[0]["CT"] == results.trials["CT"][0].as_py()
    shown = results._repr_html_()
    assert "own_class.&lt;locals&gt;.Straight" in shown
    assert shown.count("<tr>") == 3


def test_figures_are_listed_and_a_wrong_trial_is_our_error(results: clearway.Results) -> None:
    assert results.figures()["trial"].startswith("figure('trial', trial=17): ")
    with pytest.raises(ClearwayError, match="'a' is no trial's number; 0 to 1 are"):
        results.trial("a")  # type: ignore[arg-type]
    assert results.trial(np.int64(1)).attempt.navigator == "move-base"


def test_the_systems_of_one_directory_are_compared_with_a_page(results: clearway.Results, tmp_path: Path) -> None:
    (found,) = clearway.compare(results, out=tmp_path / "page")
    assert {found.a, found.b} == {"move-base", "object:own_class.<locals>.Straight"}
    assert found.pairs == 1
    page = (tmp_path / "page" / "index.html").read_text()
    assert "<svg" in page
    assert [page.count(f"<strong>{word}.</strong>") for word in ("Tested", "Result", "Limits")] == [1, 1, 1]
    assert ": 1 test in common." in page
    assert "script-src &#39;none&#39;" in page
    assert (tmp_path / "page" / "differences-1.svg").exists()
    assert (tmp_path / "page" / "differences.csv").read_text().startswith("a,b,batch,indicator")
    with pytest.raises(ClearwayError, match="unknown system 'hp-st'"):
        clearway.compare(results, between=["hp-st"])
    with pytest.raises(ClearwayError, match=r"between: leaves a single system; name another one too: object:own_class"):
        clearway.compare(results, between=["move-base"])
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "thesis.tex").touch()
    with pytest.raises(ClearwayError, match="holds no comparison"):
        clearway.compare(results, out=tmp_path / "own")
