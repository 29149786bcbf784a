"""Behaviours of people beside walking by ORCA and social forces: recorded ways, people who face where they walk, a user's own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from worlds import Pilot, constant, make_robot, make_scenario, run_among

from clearway.campaigns import campaign, checks
from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.pilot import compose
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.pool import Fate
from clearway.campaigns.worker import fell
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.reports.page import write_report
from clearway.robots import load_robot
from clearway.scenarios.check import check_file
from clearway.scenarios.files import load_scenario
from clearway.scenarios.people import PersonSpec
from clearway.trials import Trial
from clearway.world.behaviours.foreign import BehaviourError, Foreign

AWAY = (0.0, -20.0, 0.0)
BENT = [(1.0, -4.0, 0.0), (4.0, -1.0, 0.0), (7.0, -1.0, 3.0), (8.0, 0.0, 3.0)]
"""A recorded way: along x, along y, along x; there from 1 s to 8 s."""


def watch(
    people: Sequence[dict[str, Any]], seconds: float = 9.0, start: Any = AWAY, pilot: Pilot | None = None
) -> Trial:
    legs = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": seconds}]
    return run_among((), pilot or constant(0.0), make_scenario(people=people, start=start, legs=legs), make_robot())


def on_track(t: FloatArray) -> FloatArray:
    times, x, y = np.array(BENT).T
    return np.column_stack([np.interp(t, times, x), np.interp(t, times, y)])


@pytest.mark.parametrize("sees", [True, False])
def test_a_recorded_person_is_where_it_was_recorded_and_when(sees: bool) -> None:
    trial = watch([{"name": "ann", "behaviour": "recorded", "track": BENT, "sees_robots": sees}])
    there = np.isfinite(trial.moving_obstacles[:, 0, 0])
    edge = np.abs(trial.t[:, None] - [1.0, 8.0]).min(axis=1) < 0.06
    assert (there == ((trial.t > 1.0) & (trial.t < 8.0)))[~edge].all()
    inner = there & (
        np.abs(trial.t[:, None] - [1.0, 4.0, 7.0, 8.0]).min(axis=1) > 0.06
    )  # corners are cut by a decision's way
    np.testing.assert_allclose(trial.moving_obstacles[inner, 0, :2], on_track(trial.t[inner]), atol=1e-9)


def test_a_recorded_person_goes_round_a_robot_in_the_way_and_back_onto_the_way() -> None:
    far = [(0.0, -6.0, 0.1), (16.0, 10.0, 0.1)]
    seen = watch([{"name": "ann", "behaviour": "recorded", "track": far}], 15.5, (0.0, 0.0, 0.0))
    assert seen.outcome == "timeout"  # nobody touched the robot
    way = seen.moving_obstacles[:, 0, :2]
    assert np.hypot(*way.T).min() > 0.5
    assert np.abs(way[seen.t < 2.0, 1] - 0.1).max() < 0.05
    assert np.abs(way[-1] - [9.5, 0.1]).max() < 0.1
    blind = watch([{"name": "ann", "behaviour": "recorded", "track": far, "sees_robots": False}], 15.5, (0.0, 0.0, 0.0))
    assert blind.outcome == "collision"


def test_who_walks_headed_faces_where_it_walks_and_turns_by_and_by() -> None:
    person = {"name": "ann", "start": (0.0, 0.0), "route": [{"at": (3.0, 0.0)}, {"at": (3.0, 4.0)}], "speed": 1.2}
    trial = watch([person | {"behaviour": "headed-social-force"}], 8.0)
    pose = trial.moving_obstacles[:, 0]
    step = np.diff(pose[:, :2], axis=0)
    moving = np.hypot(*step.T) > 0.05
    aside = np.abs(np.cos(pose[1:, 2]) * step[:, 1] - np.sin(pose[1:, 2]) * step[:, 0])[moving]
    assert aside.max() < 0.02  # of 0.12 m a step
    turns = np.abs(np.remainder(np.diff(pose[:, 2]) + math.pi, math.tau) - math.pi)
    assert 0.02 < turns.max() < 0.5
    assert pose[-1, :2] == pytest.approx([3.0, 4.0], abs=0.3)


OWN = """
import sys
import time
import numpy as np

class Wanders:
    "Walks along x at 1 m/s."
    def __init__(self, cast):
        self.speed = np.full(len(cast.people), 1.0)
        self.at = np.array([(*person.start, 0.0) for person in cast.people])

    def step(self, t, until, scene):
        self.at[:, 0] += until - t
        return self.at

class Raises(Wanders):
    def step(self, t, until, scene):
        if t > 1.0:
            raise KeyError("lost")
        return super().step(t, until, scene)

class Vanishes(Wanders):
    def step(self, t, until, scene):
        return super().step(t, until, scene) * (np.nan if t > 1.0 else 1.0)

class Jumps(Wanders):
    def step(self, t, until, scene):
        self.at[:, 1] += 2.0 * (t > 1.0)
        return super().step(t, until, scene)

class Forgets(Wanders):
    def step(self, t, until, scene):
        return self.at[:1]

class Leaves(Wanders):
    def step(self, t, until, scene):
        sys.exit(0)

class Meddles(Wanders):
    "The same, but it writes into all that it is shown."
    def __init__(self, cast):
        super().__init__(cast)
        self.cast = cast

    def step(self, t, until, scene):
        for array in (scene.moving, scene.before, self.cast.radius, self.cast.walls.vertex, self.cast.room.clearance):
            array += 0.3
        for robot in scene.robots:
            robot.track.knots[:, 1:] += 0.3
            robot.shape.radius[:] = 0.0
        self.cast.things.of[:] = 0
        for person in self.cast.people:
            object.__setattr__(person, "radius", 1.0)
        return super().step(t, until, scene)

class Lonely(Wanders):
    def step(self, t, until, scene):
        if not scene.robots:
            raise KeyError("nobody")
        return super().step(t, until, scene)

class Hangs(Wanders):
    def step(self, t, until, scene):
        while t > 1.0:
            time.sleep(0.1)
        return super().step(t, until, scene)

class NoSpeed:
    def __init__(self, cast):
        self.speed = None
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path / "own.py"


def two(behaviour: str) -> list[dict[str, Any]]:
    return [{"name": name, "start": (0.0, y), "behaviour": behaviour} for name, y in (("ann", 0.0), ("bob", 2.0))]


def test_a_behaviour_of_ones_own_moves_its_people(own: Path) -> None:
    trial = watch(two(f"{own}:Wanders"), 3.0)
    np.testing.assert_allclose(trial.moving_obstacles[:, 1, 0], trial.t, atol=1e-9)
    np.testing.assert_array_equal(trial.moving_obstacles[:, 1, 1], np.full(len(trial.t), 2.0))


def test_a_behaviour_moves_nobody_but_its_own_people(own: Path) -> None:
    """Who writes into what it is shown fools only itself."""
    walker = {"name": "eve", "start": (2.0, 1.0), "route": [{"at": (-3.0, 0.5)}], "behaviour": "social-force"}
    ways = [
        watch([*two(f"{own}:{name}"), walker], 3.0, (0.0, -1.0, 0.0)).moving_obstacles
        for name in ("Wanders", "Meddles")
    ]
    np.testing.assert_array_equal(*ways)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Raises", "failed at 1.05 s: KeyError: 'lost'"),
        ("Vanishes", "put 'ann' at [nan, nan, nan] at 1.05 s"),
        ("Jumps", "moved 'ann' at 40.01 m/s at 1.05 s; it says 1 m/s is the most"),
        ("Forgets", "answered poses of shape (1, 3) at 0.00 s; (2, 3) are asked"),
        ("Leaves", "failed at 0.00 s: SystemExit: 0"),
        ("NoSpeed", "is its speed; one for each of its people is"),
    ],
)
def test_what_a_behaviour_of_ones_own_does_wrong_is_said(own: Path, name: str, says: str) -> None:
    with pytest.raises(BehaviourError) as caught:
        watch(two(f"{own}:{name}"), 3.0)
    assert says in str(caught.value)
    assert f"{own}:{name}" in str(caught.value)


SCENE = """
name = "own"
floor_plan = "arena"
start = [2.0, 7.0, 0.0]
speed = 0.6
localisation = "truth"
[[legs]]
name = "there"
goal = [4.0, 7.0, 0.0]
time_limit = 20.0
[[people]]
name = "ann"
start = [2.0, 3.0]
behaviour = "own.py:Wanders"
"""


def test_a_behaviour_that_fails_ends_its_trial_and_no_other(own: Path, tmp_path: Path) -> None:
    for name in ("Wanders", "Raises"):
        (tmp_path / f"{name}.toml").write_text(SCENE.replace("Wanders", name).replace('"own"', f'"{name}"'))
    drives = f"{Path(__file__).parents[1] / 'campaigns' / 'own_navigators.py'}:Drives"
    plan = CampaignPlan(
        suites=(str(tmp_path / "Raises.toml"), str(tmp_path / "Wanders.toml")), robots=("tiago",), navigators=(drives,)
    )
    results = run_campaign(plan, tmp_path / "out", 1)
    bad, good = results.trials.to_pylist()
    assert good["outcome"] == "reached"
    assert (bad["outcome"], bad["success"]) == ("scenario_failed", None)  # it tells nothing of the navigator
    assert "Raises' failed at 1.05 s: KeyError: 'lost'" in bad["reason"]
    assert any(name.endswith("own.py:Raises") for name in results.campaign["code"])
    said = write_report(results.path).read_text("utf-8")
    assert {bad[name] for name in ("contacts", "MDO", "CT")} == {None}
    assert (
        "In 1 trial the scenario failed, by a behaviour of its people or as it was built; they count neither as" in said
    )


@pytest.mark.slow
def test_one_that_hangs_is_told_from_a_navigator_that_does(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.replace("Wanders", "Hangs"))
    monkeypatch.setattr(campaign, "patience_of", lambda plan: 5.0)
    drives = f"{Path(__file__).parents[1] / 'campaigns' / 'own_navigators.py'}:Drives"
    plan = CampaignPlan((str(tmp_path / "scene.toml"),), robots=("tiago",), navigators=(drives,))
    results = run_campaign(plan, tmp_path / "out", 1)
    (row,) = results.trials.to_pylist()
    assert (row["outcome"], row["success"]) == ("scenario_failed", None)
    assert row["reason"] == f"the behaviour '{own}:Hangs' took longer than 5 s and could not be broken off"
    assert "own.py" in results.trial(0).events[0].detail  # where it was


def test_who_was_asked_first_fell() -> None:
    """A navigator may play its own people in its head."""
    scenario = make_scenario(people=[{"name": "ann", "start": (0.0, 0.0), "behaviour": "own.py:Wanders"}])
    lines = [f'  File "{asks.__code__.co_filename}", line 1 in ask' for asks in (compose, Foreign.step)]
    for stack, outcome in ((lines, "navigator_failed"), (lines[::-1], "scenario_failed"), ([], "navigator_failed")):
        assert fell(Fate("took longer than 60 s", "\n".join(stack)), scenario)[0] == outcome
    assert fell(Fate("was ended", lines[1]), scenario)[1] == "the behaviour 'own.py:Wanders' was ended"


def test_one_that_fails_where_no_robot_drives_leaves_the_trial_as_it_was(own: Path, tmp_path: Path) -> None:
    """Somebody else, who walks to a place, is delayed by the robot or not: for that they walk once more without it."""
    other = '[[people]]\nname = "bob"\nstart = [7.0, 7.0]\nroute = [{ at = [7.5, 7.0] }]\n'
    (tmp_path / "Lonely.toml").write_text(SCENE.replace("Wanders", "Lonely") + other)
    drives = f"{Path(__file__).parents[1] / 'campaigns' / 'own_navigators.py'}:Drives"
    plan = CampaignPlan(suites=(str(tmp_path / "Lonely.toml"),), robots=("tiago",), navigators=(drives,))
    (row,) = run_campaign(plan, tmp_path / "out", 1).trials.to_pylist()
    assert (row["outcome"], row["success"], row["people_delay"]) == ("reached", True, None)
    assert "nobody knows how people walk there without robots" in row["not_computable"]


def test_a_behaviour_that_is_not_there_is_told_before_anything_runs(own: Path, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.replace("Wanders", "Wonders"))
    plan = CampaignPlan(suites=(str(tmp_path / "scene.toml"),), robots=("tiago",), navigators=("move-base",))
    with pytest.raises(ClearwayError, match="did you mean 'Wanders'"):
        run_campaign(plan, tmp_path / "out", 0)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("named", "says"),
    [
        ("own.py:Wonders", "did you mean 'Wanders'"),
        ("else.py:X", "no such file"),
        ("own.py:np", "is a module, not a class"),
    ],
)
def test_checking_a_scenario_finds_that_a_behaviour_is_not_there(
    own: Path, tmp_path: Path, named: str, says: str
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.replace("own.py:Wanders", named))
    (problem,) = checks.check_file(tmp_path / "scene.toml", load_robot("tiago"))
    assert problem.field == "people.0.behaviour"
    assert says in problem.problem


@pytest.mark.parametrize(
    ("named", "says"),
    [('"hb-st"', "did you mean 'hp-st'"), ('"orca[foo=1]"', "foo: unknown key"), ('"nav2[params=gone.yaml]"', "gone.yaml: no such file"),
     ('"orca"\nrobot = "f1tenth"', "that of the robot 'f1tenth' is ackermann")],
)  # fmt: skip
def test_checking_a_scenario_finds_that_another_robots_navigator_cannot_drive_it(
    own: Path, tmp_path: Path, named: str, says: str
) -> None:
    robot = f'[[robots]]\nname = "r"\nrole = "other"\nstart = [7.0, 7.0, 0.0]\nnavigator = {named}\n'
    legs = 'legs = [{ name = "on", goal = [8.0, 7.0, 0.0], time_limit = 60.0 }]\n'
    (tmp_path / "scene.toml").write_text(SCENE + robot + legs)
    (problem,) = checks.check_file(tmp_path / "scene.toml", load_robot("tiago"))
    assert problem.field == "robots.0.navigator"
    assert says in problem.problem


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"behaviour": "orka"}, "did you mean 'orca'"),
        ({"behaviour": "still", "speed": 1.0}, "'speed' means nothing to somebody whose behaviour is 'still'"),
        ({"behaviour": "orca", "group": "friends"}, "'group' means nothing to somebody whose behaviour is 'orca'"),
        ({"behaviour": "orca", "yields_at": 1.0}, "'yields_at' means nothing"),
        ({"behaviour": "orca", "track": BENT}, "'track' means nothing"),
        ({"behaviour": "recorded", "track": BENT[:1]}, "at least two points"),
        ({"behaviour": "recorded", "track": [BENT[0], BENT[0]]}, "do not rise"),
        ({"behaviour": "recorded", "track": [(0.0, 0.0, 0.0), (1.0, 9.0, 0.0)]}, "9.0 m/s at 0 s"),
        ({"behaviour": "recorded", "track": BENT, "start": (0.0, 0.0)}, "is not where the track begins"),
        ({"behaviour": "recorded", "track": 3}, "track"),
    ],
)
def test_what_a_person_cannot_be_is_one_error(fields: dict[str, Any], says: str) -> None:
    start = {} if "track" in fields else {"start": (0.0, 0.0)}
    with pytest.raises(ValidationError) as caught:
        PersonSpec.model_validate({"name": "ann", **start, **fields})
    assert says in str(caught.value)


def test_a_track_comes_from_a_csv_file_beside_the_scenario(tmp_path: Path) -> None:
    head = SCENE[: SCENE.index("start = [2.0, 3.0]")]
    (tmp_path / "walk.csv").write_text("who,t,x,y\n" + "".join(f"ann,{t},{x + 6},{y + 2}\n" for t, x, y in BENT))
    (tmp_path / "scene.toml").write_text(head + 'behaviour = "recorded"\ntrack = "walk.csv"\n')
    (person,) = load_scenario(tmp_path / "scene.toml").people
    assert person.start == (2.0, 2.0)
    assert person.track == tuple((t, x + 6, y + 2) for t, x, y in BENT)
    assert check_file(tmp_path / "scene.toml") == []


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "walk.csv"),
        ("", "has no column 't'"),
        ("t,x\n0,1\n", "has no column 'y'"),
        ("t,x,y\n0,1,2\n1,1,far\n", "row 2, y: 'far' is no number"),
        ("t,x,y\n0,1\n", "row 1, y: '' is no number"),
        ("t,x,y\n0,nan,1\n1,0,0\n", "finite"),
        ("t,x,y\n" + "0,1,2\n" * 10_001, "10,001 rows"),
        ("t,x,y,x\n0,1,2,3\n", "more than one column 'x'"),
        ("t,x,y," + "z" * 10_000, "line 1: has 10,006 characters"),
        ("t,x,y\n0,1," + "9" * 9_000 + "x\n", "is no number"),
    ],
)
def test_a_wrong_csv_file_is_one_error_that_names_it(tmp_path: Path, content: str | None, says: str) -> None:
    head = SCENE[: SCENE.index("start = [2.0, 3.0]")]
    if content is not None:
        (tmp_path / "walk.csv").write_text(content)
    (tmp_path / "scene.toml").write_text(head + 'behaviour = "recorded"\ntrack = "walk.csv"\n')
    problems = check_file(tmp_path / "scene.toml")
    assert any(says in str(problem) for problem in problems), problems


def test_tracks_have_room_together(tmp_path: Path) -> None:
    """A file of 2 MB may name one of 10,000 rows 30,000 times."""
    (tmp_path / "walk.csv").write_text("\ufefft,x,y\n" + "".join(f"{k},2,2\n" for k in range(10_000)))
    head = SCENE[: SCENE.index("[[people]]")]
    people = [f'[[people]]\nname = "p{k}"\nbehaviour = "recorded"\ntrack = "walk.csv"\n' for k in range(21)]
    (tmp_path / "scene.toml").write_text(head + "".join(people[:20]))
    assert len(load_scenario(tmp_path / "scene.toml").people) == 20
    (tmp_path / "scene.toml").write_text(head + "".join(people))
    (problem,) = check_file(tmp_path / "scene.toml")
    assert "people: its people have tracks of more than 200,000 samples together" in str(problem)
