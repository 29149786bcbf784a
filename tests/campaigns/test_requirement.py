"""`clearway requirement`: the whole way on a tiny budget, what every offer makes, and what can't be asked."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from typer.testing import CliRunner

import clearway
from clearway.campaigns import requirement
from clearway.cli import app
from clearway.errors import ClearwayError
from clearway.reports.requirement import Requirement, read_requirement, write_requirement
from clearway.robots import load_robot
from clearway.scenarios.offers import OFFERS, Offer, find_offer, two_rooms, width_of
from clearway.statistics.thresholds import Block


@pytest.mark.slow
def test_the_quick_case_of_the_how_to_and_again_from_what_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "requirement.md").read_text("utf-8")
    (typed,) = re.findall("^clearway (requirement .*--navigator social-force.*)$", page, re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, [*shlex.split(typed), "--workers", "0", "--json"])
    assert told.exit_code == 0, told.output
    folder = tmp_path / "results" / "requirement-door"
    kept = json.loads((folder / "requirement.json").read_text())
    assert "width of a door, m" in (folder / "requirement.svg").read_text()
    campaigns = sorted((folder / "trials").iterdir())
    times = [(c / "campaign.json").stat().st_mtime_ns for c in campaigns]
    asked: dict[str, Any] = {
        "navigator": "social-force", "reliability": 0.5, "confidence": 0.6, "between": (0.6, 1.8), "step": 0.6, "trials": 32,
        "localisation": "truth", "workers": 0, "out": folder,
    }  # fmt: skip
    found = clearway.requirement("door", "tiago", **asked)  # the same from Python
    assert json.loads(json.dumps(found.to_json())) == kept
    assert [(c / "campaign.json").stat().st_mtime_ns for c in campaigns] == times  # nothing was run again
    assert sum(len(clearway.open_results(c)) for c in campaigns) == sum(found.trials)
    assert found.successes[0] == 0  # what wants 0.3 m to either side does not get through 0.6 m
    assert (found.fails, found.passes) == (0.6, 1.2)
    assert str(found).startswith("TIAGo with social-force needs a door of 1.2 m [0.6, 1.2] for 50 % success at 0.6 m/s")
    page = (folder / "index.html").read_text("utf-8")
    assert all(f"<strong>{word}.</strong>" in page for word in ("Tested", "Result", "Limits"))
    assert str(found)[:-1].replace(" %", "\u00a0%") in page
    told = CliRunner().invoke(app, ["requirement", str(folder), "--map", "hall", "--start=1,0", "--json"])  # and a map
    assert told.exit_code == 0, told.output
    said = json.loads(told.output)["map"]
    coloured = clearway.passable(folder, "hall", start=(1.0, 0.0))
    assert said["sentence"] == str(coloured)
    assert 0.5 < coloured.share(0.5) < coloured.share(0.0) == 1.0
    assert coloured.shown == said["shown"] == coloured.share(found.curve[1])
    assert "within: 50 % is shown" in (folder / "map.svg").read_text()
    assert coloured.reached.replace(" %", "\u00a0%") in (folder / "index.html").read_text("utf-8")


@pytest.mark.slow
def test_what_is_met_nowhere_is_told(tmp_path: Path) -> None:
    typed = ["requirement", "door", "-n", "social-force", "--reliability", "0.5", "--confidence", "0.6"]
    typed += ["--range", "0.6:0.7", "--step", "0.1", "--trials", "20", "--localisation", "truth", "--workers", "0"]
    told = CliRunner().invoke(app, [*typed, "--out", str(tmp_path / "door")])
    assert told.exit_code == 1, told.output
    assert "is not shown to reach 50 % success at 0.6 m/s" in told.output
    assert "a door of 0.6 to 0.7 m: it is never met in that range (" in told.output


def test_its_progress_ends_with_the_trials_that_it_took(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def campaign(offer: Offer, value: float, block: Block, *rest: Any) -> Any:
        return SimpleNamespace(trials=pa.table({"success_slack": [value > 1.0] * block.trials}))

    monkeypatch.setattr(requirement, "_run", campaign)
    monkeypatch.setattr(requirement, "what_happened", lambda row: "")
    told: list[tuple[int, int]] = []
    found = clearway.requirement(
        "door", reliability=0.5, confidence=0.6, between=(0.6, 1.8), step=0.6, trials=60, out=tmp_path / "door",
        progress=lambda done, total, note="": told.append((done, total)),
    )  # fmt: skip
    assert told[0] == (0, 60)
    assert told[-1] == (sum(found.trials), sum(found.trials))
    assert sum(found.trials) < 60


def test_what_was_found_is_not_taken_for_another_search(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def campaign(offer: Offer, value: float, block: Block, *rest: Any) -> Any:
        return SimpleNamespace(trials=pa.table({"success_slack": [value > 1.0] * block.trials}))

    monkeypatch.setattr(requirement, "_run", campaign)
    monkeypatch.setattr(requirement, "what_happened", lambda row: "")
    monkeypatch.chdir(tmp_path)
    typed = [
        "requirement",
        "door",
        "--reliability",
        "0.5",
        "--confidence",
        "0.6",
        "--range",
        "0.6:1.8",
        "--step",
        "0.6",
        "--trials",
        "60",
    ]
    first = CliRunner().invoke(app, [*typed, "--out", "door"])
    assert first.exit_code == 0, first.output
    assert f"page: {Path('door') / 'index.html'}" in first.output
    other = CliRunner().invoke(
        app, [*typed, "--robot", "hosbot", "--out", "mine"]
    )  # not what the folder of that name holds
    assert "HOSBOT with move-base needs a door of 1.2 m" in other.output, other.output
    told = CliRunner().invoke(app, ["requirement", "./door", "--speed", "0.3"])
    assert "speed: means nothing for the folder './door'" in told.output + str(told.exception)
    with pytest.raises(ClearwayError, match="holds another search: TIAGo with move-base needs a door of"):
        clearway.requirement("door", "hosbot", reliability=0.5, confidence=0.6, out=tmp_path / "door")


@pytest.mark.parametrize("name", sorted(OFFERS.addresses()))
def test_every_offer_makes_a_test_of_every_usual_value(name: str) -> None:
    offer, robot = find_offer(name), load_robot("tiago")
    values = offer.values(robot)
    assert (values[0] < values[-1]) == offer.eases
    for value in values:
        made = offer.make(value, robot, 0.6, f"{name}-{value:g}-1", 0)
        again = offer.make(value, robot, 0.6, f"{name}-{value:g}-1", 0)
        assert made.scenario == again.scenario
        assert made.floor_plan.a is not None
    hard, easy = (offer.make(v, robot, 0.6, "x-1", 0) for v in (values[0], values[-1]))
    assert (hard.scenario, hard.floor_plan, hard.robot) != (easy.scenario, easy.floor_plan, easy.robot)


def test_a_door_is_as_wide_as_it_says_and_people_as_dense() -> None:
    jambs = {w.name: w.box for w in two_rooms(0.83, 0.2).walls}
    assert jambs["north jamb"] is not None
    assert jambs["south jamb"] is not None
    assert jambs["north jamb"][1] - jambs["south jamb"][3] == pytest.approx(0.83)
    made = find_offer("density").make(0.5, load_robot("tiago"), 0.6, "density-0.5-1", 0)
    assert len(made.scenario.people) == round(0.5 * 6.2 * 5.0)
    assert width_of(load_robot("hosbot")) == pytest.approx(0.6)


@pytest.mark.parametrize("name", sorted(OFFERS.addresses()))
@pytest.mark.parametrize("robot", ["tiago", "hosbot", "husky"])
def test_usual_ranges_can_be_tested(name: str, robot: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="navigator"):  # all else is right
        clearway.requirement(name, robot, "nobody", workers=0, out=tmp_path / "out")


@pytest.mark.slow
def test_worse_sensors_are_of_another_robot_that_a_file_holds(tmp_path: Path) -> None:
    found = clearway.requirement(
        "lidar-noise", "hosbot", "social-force", reliability=0.3, confidence=0.5, between=(0.0, 0.3), step=0.3, trials=14,
        localisation="truth", workers=0, out=tmp_path / "noise",
    )  # fmt: skip
    assert sum(found.trials) > 0
    written = load_robot(str(tmp_path / "noise" / "tests" / "hosbot, lidar noise 0.3 m.toml"))
    assert written.lidar is not None
    assert written.lidar.sigma == 0.3
    assert written.drive == load_robot("hosbot").drive


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"offer": "dor"}, "did you mean 'door'"),
        ({"between": (1.2, 0.6)}, "1.2:0.6 is no range"),
        ({"between": (-1.0, 0.6)}, "at least 0"),
        ({"between": (0.6, 7.0)}, "has no place in a wall of 5 m"),
        ({"between": (0.3, 0.9)}, "0.3 m cannot be tested: tiago is 0.54 m wide"),
        ({"step": 0.0}, "is no step"),
        ({"step": 1e-6}, "too many"),
        ({"reliability": 95.0}, "did you mean 0.95"),
        ({"confidence": 1.0}, "must lie between 0 and 1"),
        ({"trials": 30}, "30 trials cannot show 0.95 success"),
        ({"speed": 0.0}, "no set speed"),
        ({"robot": "tiagoo"}, "unknown robot"),
        ({"navigator": "nobody"}, "unknown navigator"),
        ({"judged": "succes_self"}, "did you mean 'success_self'"),
    ],
)
def test_what_cannot_be_asked_is_one_error_before_anything_runs(
    arguments: dict[str, object], said: str, tmp_path: Path
) -> None:
    asked: dict[str, Any] = {"offer": "door", "workers": 0, "out": tmp_path / "out"} | arguments
    with pytest.raises(ClearwayError, match=said):
        clearway.requirement(**asked)
    assert not list(tmp_path.glob("out/trials/*/trials.parquet"))


def test_an_offer_of_ones_own_needs_to_be_one() -> None:
    assert isinstance(find_offer("clearway.scenarios.offers:DOOR"), Offer)
    with pytest.raises(ClearwayError, match="not an Offer"):
        find_offer("clearway.scenarios.offers:ROOM")


def test_never_met_is_said_only_where_the_easiest_value_is_shown_to_fail() -> None:
    asked: dict[str, Any] = {
        "offer": "door", "phrase": "a door of {}", "unit": " m", "quantity": "width of a door, m", "eases": True, "robot": "TIAGo",
        "navigator": "move-base", "speed": 0.6, "reliability": 0.9, "confidence": 0.9, "hardest": 0.6, "easiest": 1.4,
        "values": (0.6, 1.4), "successes": (0, 350), "trials": (10, 390), "curve": (0.0, 0.9), "estimate": None,
        "passes": None, "spent": True, "judged": "success_slack", "why": ("gave up", ""),
    }  # fmt: skip
    said = {fails: str(Requirement(**asked, fails=fails)) for fails in (None, 1.0, 1.4)}
    assert "not decided before its trials were used up (" in said[None]
    assert (
        "not decided before its trials were used up, but it is shown to fail at 1 m and what is harder (" in said[1.0]
    )
    assert "it is never met in that range (" in said[1.4]


def test_a_map_is_coloured_by_a_width_from_a_place_that_is_free(tmp_path: Path) -> None:
    door: dict[str, Any] = {
        "offer": "door", "phrase": "a door of {}", "unit": " m", "quantity": "width of a door, m", "eases": True, "robot": "TIAGo",
        "navigator": "move-base", "speed": 0.6, "reliability": 0.9, "confidence": 0.9, "hardest": 0.6, "easiest": 1.4,
        "values": (0.6, 1.0, 1.4), "successes": (0, 20, 40), "trials": (10, 40, 40), "curve": (0.0, 0.5, 1.0), "estimate": 1.4,
        "fails": 1.0, "passes": 1.4, "spent": False, "judged": "success_slack", "why": ("gave up", "gave up", ""),
    }  # fmt: skip
    write_requirement(Requirement(**door), tmp_path)
    assert read_requirement(tmp_path) == Requirement(**door)
    (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\n")
    cells = np.full((34, 66), 254, np.uint8)
    cells[[0, 1, 32, 33]] = 0
    cells[:, [0, 1, 64, 65]] = 0
    cells[:, 32:34] = 0
    cells[10:22, 32:34] = 254  # two rooms of 3 m, and a door of 1.2 m
    (tmp_path / "map.pgm").write_bytes(b"P5\n66 34\n255\n" + cells.tobytes())
    found = clearway.passable(tmp_path, tmp_path / "map.yaml", start=(1.0, 1.0))
    assert (found.width[17, 48], found.probability[17, 48]) == (
        1.0,
        0.5,
    )  # 1.4 m is what 90 % take, as the sentence says
    assert found.probability[17, 17] == 1.0
    assert found.share(1.0) == pytest.approx(0.5, abs=0.05)
    with pytest.raises(ClearwayError, match=r"start: \(1, 0.1\) is no free place of the map"):
        clearway.passable(tmp_path, tmp_path / "map.yaml", start=(1.0, 0.1))
    with pytest.raises(ClearwayError, match="a map has widths, and people per square metre is none"):
        clearway.passable(Requirement(**door | {"eases": False, "quantity": "people per square metre"}), "hall")
    with pytest.raises(ClearwayError, match=r"holds no requirement\.json"):
        clearway.passable(tmp_path / "nowhere", "hall")
    (tmp_path / "requirement.json").write_text('{"offer": "door"}')
    with pytest.raises(ClearwayError, match="not as this version's searches write it"):
        clearway.passable(tmp_path, "hall")
    told = CliRunner().invoke(app, ["requirement", "door", "--start", "1,2"])
    assert "belongs to --map" in str(told.exception)
