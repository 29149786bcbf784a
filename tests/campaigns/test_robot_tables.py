"""What a robot's file holds for navigators, localisers and the mapper is looked at before the first trial runs."""

from __future__ import annotations

from pathlib import Path

import pytest

import clearway.robots
from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.checks import check_file
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.robot_tables import table_problems
from clearway.errors import ClearwayError
from clearway.robots import load_robot, robot_names

OWN = Path(__file__).with_name("own_navigators.py")


def written(folder: Path, line: str) -> Path:
    """TIAGo's file with one more line in its table of hp-st; or with a table and its line, as in `[table]; line`."""
    text = (
        (Path(clearway.robots.__file__).parent / "tiago.toml")
        .read_text(encoding="utf-8")
        .replace('"tiago"', '"mine"', 1)
    )
    place = "[navigators.hp-st]"
    assert place in text
    path = folder / "mine.toml"
    if line.startswith("["):
        path.write_text("\n".join((text, *line.split("; "))), encoding="utf-8")
    else:
        path.write_text(text.replace(place, f"{place}\n{line}\n", 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "name", [name + preset for name in robot_names() for preset in ["", *(f":{p}" for p in load_robot(name).presets)]]
)
def test_every_shipped_robot_is_right(name: str) -> None:
    assert list(table_problems(load_robot(name))) == []


WRONG = [
    ("fear = 3", "hp-st", "navigators.hp-st.fear: unknown key; it is called 'contact_cost' now"),
    ("nonsense = 3", "hp-st", "navigators.hp-st.nonsense: unknown key"),
    ("halt_cost = -1", "hp-st-foresight", "navigators.hp-st.halt_cost: -1 is wrong"),
    ("[navigators.hl-rrt]; step = 9.0", "hl-rrt", "navigators.hl-rrt: spacing, step and horizon are 0.1, 9 and 3 m"),
    ("[navigators.colregs-apf]; eta_d = 'big'", "colregs-apf-retuned", "navigators.colregs-apf.eta_d: 'big' is wrong"),
    ("[navigators.hp-tmpc]; w1 = 1.0", "hp-tmpc", "navigators.hp-tmpc.w1: 1.0 is wrong"),
    ("[navigators.move_base]; planner_frequency = 1.0", "hp-st", "navigators.move_base: unknown navigator 'move_base'; did you mean 'move-base'?"),
    ("[localisation.gps]; sigma = 1.0", "hp-st", "localisation.gps: unknown localisation 'gps'"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "navigator", "says"), WRONG)
def test_check_and_run_say_what_is_wrong_in_a_robots_file(
    tmp_path: Path, wrong: str, navigator: str, says: str
) -> None:
    file = written(tmp_path, wrong)
    (problem,) = check_file(file, load_robot("tiago"))
    assert str(problem).startswith(f"{file}: {says}")
    plan = CampaignPlan(("hospital",), robots=(str(file),), navigators=(navigator,))
    with pytest.raises(ClearwayError) as caught:
        run_campaign(plan, tmp_path / "out", 1)
    assert str(caught.value) == str(problem)
    assert not (tmp_path / "out").exists()


def test_a_preset_is_looked_at_by_its_name(tmp_path: Path) -> None:
    file = written(tmp_path, "[presets.hasty.navigators.hp-st]; layers = 0")
    (problem,) = check_file(file, load_robot("tiago"))
    assert str(problem).startswith(f"{file}: presets.hasty.navigators.hp-st.layers: 0 is wrong")


def test_a_table_that_its_navigator_does_not_read(tmp_path: Path) -> None:
    file = written(tmp_path, "[navigators.hp-st-foresight]; layers = 3")
    (problem,) = check_file(file, load_robot("tiago"))
    assert str(problem).endswith(
        "navigators.hp-st-foresight: nobody reads it: 'hp-st-foresight' reads [navigators.hp-st]"
    )


@pytest.mark.parametrize(
    ("navigator", "says"), [("Particular", "mine: braveness: 2 is wrong"), ("Careless", "cannot read its parameters")]
)
def test_a_users_own_navigator_is_asked_too(tmp_path: Path, navigator: str, says: str) -> None:
    plan = CampaignPlan(("hospital",), robots=("tiago",), navigators=(f"{OWN}:{navigator}",))
    with pytest.raises(ClearwayError, match=says):
        run_campaign(plan, tmp_path / "out", 1)
    assert not (tmp_path / "out").exists()
