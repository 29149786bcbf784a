"""Everything that a user can get wrong is answered with one line that names it, exit code 2, and nothing lost."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from command_line import Shell

import clearway as clearway_package

SCENARIO = """
name = "corridor"
floor_plan = "hall"
start = [{start}]
speed = {speed}
localisation = "truth"
{more}

[[legs]]
name = "forth"
goal = [{goal}]
time_limit = 60.0

{obstacles}
"""


def scenario(
    folder: Path, *, start: str = "", goal: str = "", speed: str = "0.6", more: str = "", obstacles: str = ""
) -> Path:
    """A scenario's file on A-B of the hall, with one thing changed."""
    from clearway.scenarios.floorplan import load_floor_plan

    hall = load_floor_plan("hall")
    assert hall.a is not None
    assert hall.b is not None
    a, b = (", ".join(f"{v:.3f}" for v in pose) for pose in (hall.a, hall.b))
    text = SCENARIO.format(start=start or a, goal=goal or b, speed=speed, more=more, obstacles=obstacles)
    path = folder / "corridor.toml"
    path.write_text(text)
    return path


def middle() -> str:
    from clearway.scenarios.floorplan import load_floor_plan

    hall = load_floor_plan("hall")
    assert hall.a is not None
    assert hall.b is not None
    return ", ".join(f"{v:.3f}" for v in (hall.a + hall.b) / 2)


def square(name: str, pose: str, edge: float = 0.3) -> str:
    return f'[[obstacles]]\nname = "{name}"\nshape = {{ kind = "square", edge = {edge} }}\npose = [{pose}]\n'


class TestNames:
    @pytest.mark.parametrize(
        ("words", "what", "right"),
        [
            (["hospitl"], "unknown suite 'hospitl'", "'hospital'"),
            (["hospital", "--robot", "tiagoo"], "unknown robot 'tiagoo'", "'tiago'"),
            (["hospital", "--robot", "hosbot:vendr"], "unknown preset 'vendr'", "'vendor'"),
            (["hospital", "--navigator", "move-bse"], "unknown navigator 'move-bse'", "'move-base'"),
            (["hospital", "--batch", "S0"], "'S0'", "SO"),
            (["hospital", "--configuration", "paralel"], "'paralel'", "'parallel'"),
            (["hospital", "--speed", "0.7"], "0.7", "0.6"),
            (["hospital", "--floor-plan", "wardd"], "'wardd'", "'ward'"),
            (["hospital", "--official"], "'hospital' has no official set", "barn has"),
            (["barn", "--worlds", "1"], "world 1", "even numbers"),
        ],
    )
    def test_unknown_names_are_named_with_the_closest(self, clearway: Shell, tmp_path: Path, words, what, right):
        said = clearway.complaint("run", *words, "--out", tmp_path / "out")
        assert what in said
        assert right in said
        assert not (tmp_path / "out").exists()

    def test_unknown_localisation(self, clearway: Shell, tmp_path: Path):
        said = clearway.complaint("run", "hospital", "--localisation", "gps", "--out", tmp_path / "out")
        assert "'gps'" in said
        assert "amcl" in said

    def test_list_of_nothing_known(self, clearway: Shell):
        assert "'robots'" in clearway.complaint("list", "robts")


class TestScenarioFiles:
    """`check` says what is wrong, and `run` refuses the same file."""

    def wrong(self, clearway: Shell, path: Path) -> str:
        said = clearway("check", path)
        assert said.code == 1
        complaint = clearway.complaint("run", path, "--robot", "tiago", "--out", path.parent / "out")
        assert not (path.parent / "out").exists()
        assert path.name in said.err
        assert path.name in complaint
        return said.err

    def test_a_right_one_passes(self, clearway: Shell, tmp_path: Path):
        said = clearway("check", scenario(tmp_path, obstacles=square("box", middle())))
        assert (said.code, said.err) == (0, "")

    def test_syntax_error(self, clearway: Shell, tmp_path: Path):
        path = scenario(tmp_path)
        path.write_text(path.read_text().replace("speed = 0.6", "speed = = 0.6"))
        assert "line" in self.wrong(clearway, path)

    def test_unknown_key(self, clearway: Shell, tmp_path: Path):
        said = self.wrong(clearway, scenario(tmp_path, more="localization = 'amcl'"))
        assert "localization" in said
        assert "'localisation'" in said

    def test_negative_speed(self, clearway: Shell, tmp_path: Path):
        said = self.wrong(clearway, scenario(tmp_path, speed="-0.6"))
        assert "speed" in said
        assert "-0.6" in said
        assert "greater than 0" in said

    def test_start_in_a_wall(self, clearway: Shell, tmp_path: Path):
        from clearway.scenarios.floorplan import load_floor_plan

        wall = next(f for f in load_floor_plan("hall").fixtures if f.kind == "wall")
        vertices = wall.shape.array
        x, y = wall.pose[:2] + vertices.mean(0)
        said = self.wrong(clearway, scenario(tmp_path, start=f"{x:.3f}, {y:.3f}, 0.0"))
        assert "start" in said
        assert wall.name in said

    def test_goal_outside(self, clearway: Shell, tmp_path: Path):
        said = self.wrong(clearway, scenario(tmp_path, goal="99.0, 0.0, 0.0"))
        assert "goal" in said
        assert "99" in said

    def test_overlapping_obstacles(self, clearway: Shell, tmp_path: Path):
        said = self.wrong(clearway, scenario(tmp_path, obstacles=square("one", middle()) + square("two", middle())))
        assert "one" in said
        assert "two" in said

    def test_robot_wider_than_its_way(self, clearway: Shell, tmp_path: Path):
        """A plan of our own: a corridor of 0.4 m between A and B."""
        plan = tmp_path / "narrow.toml"
        walls = [(0, 0, 8, 0.1), (0, 3.9, 8, 4), (0, 0, 0.1, 4), (7.9, 0, 8, 4), (3.5, 0, 4.5, 1.8), (3.5, 2.2, 4.5, 4)]
        boxes = "".join(f'[[walls]]\nname = "wall {i}"\nbox = {list(map(float, box))}\n' for i, box in enumerate(walls))
        plan.write_text('name = "narrow"\ntitle = "A narrow place"\n' + boxes)
        path = scenario(tmp_path, start="1.5, 2.0, 0.0", goal="6.5, 2.0, 0.0")
        path.write_text(path.read_text().replace('floor_plan = "hall"', f'floor_plan = "{plan}"'))
        said = self.wrong(clearway, path)
        assert "wide" in said or "way" in said


class TestMaps:
    def test_missing_image(self, clearway: Shell, tmp_path: Path):
        path = tmp_path / "map.yaml"
        path.write_text(
            "image: gone.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )
        said = clearway("check", path)
        assert said.code == 1
        assert "gone.pgm" in said.err
        complaint = clearway.complaint("run", "hospital", "--batch", "NO", "--map", path, "--out", tmp_path / "out")
        assert "gone.pgm" in complaint

    def test_a_map_of_another_place(self, clearway: Shell, tmp_path: Path) -> None:
        hall = Path(clearway_package.__file__).parent / "scenarios" / "plans" / "hall.yaml"
        legs = '[[legs]]\nname = "on"\ngoal = [8.0, 0.0, 0.0]\ntime_limit = 30.0\n'
        test = tmp_path / "short.toml"
        test.write_text(f'name = "short"\nfloor_plan = "ward"\nstart = [5.5, 0.0, 0.0]\nspeed = 0.6\n{legs}')
        asked = ("run", test, "--robot", "tiago", "--navigator", "orca", "--map", hall, "--out", tmp_path / "out")
        complaint = clearway.complaint(*asked)
        assert str(hall) in complaint
        assert "the goal of leg 'on' of the scenario 'short-v0.6-r1', (8, 0), is outside this map" in complaint
        assert not (tmp_path / "out").exists()


class TestResultsDirectories:
    """One tiny campaign, then damaged in several ways."""

    @pytest.fixture
    def results(self, clearway: Shell, tmp_path: Path) -> Path:
        out = tmp_path / "results"
        said = clearway(
            "run", scenario(tmp_path), "--robot", "tiago", "--navigator", _navigator(tmp_path, GOOD), "--workers", 1,
            "--out", out, "--no-report",
        )  # fmt: skip
        assert said.code == 0, said.err
        return out

    @pytest.mark.parametrize("verb", ["report", "compare", "replay"])
    def test_damaged(self, clearway: Shell, results: Path, verb: str):
        whole = shutil.copytree(results, results.with_name("whole"))
        table = results / "trials.parquet"
        table.write_bytes(table.read_bytes()[:-20])
        words = {"compare": [results, whole], "replay": [results, "--trial", "0"]}.get(verb, [results])
        assert "trials.parquet" in clearway.complaint(verb, *words)

    def test_from_a_newer_version(self, clearway: Shell, results: Path):
        path = results / "campaign.json"
        campaign = json.loads(path.read_text())
        key = next(k for k in campaign if k in ("schema", "format", "version", "results_version"))
        campaign[key] = 999
        path.write_text(json.dumps(campaign))
        assert "newer" in clearway.complaint("report", results)

    def test_not_ours(self, clearway: Shell, tmp_path: Path):
        folder = tmp_path / "holiday"
        folder.mkdir()
        (folder / "photo.txt").write_text("sea")
        assert str(folder) in clearway.complaint("report", folder)
        said = clearway.complaint("run", scenario(tmp_path), "--robot", "tiago", "--out", folder)
        assert str(folder) in said
        assert (folder / "photo.txt").read_text() == "sea"

    def test_missing(self, clearway: Shell, tmp_path: Path):
        assert "nowhere" in clearway.complaint("report", tmp_path / "nowhere")

    def test_never_overwritten(self, clearway: Shell, results: Path, tmp_path: Path):
        before = (results / "trials.parquet").read_bytes()
        clearway.complaint("run", scenario(tmp_path), "--robot", "tiago", "--out", results)
        assert (results / "trials.parquet").read_bytes() == before

    def test_trial_that_is_not_there(self, clearway: Shell, results: Path):
        assert "7" in clearway.complaint("replay", results, "--trial", "7")

    def test_compare_needs_two(self, clearway: Shell, results: Path):
        assert "two" in clearway.complaint("compare", results)


GOOD = "return Command(0.3, 0.0)"
NAN = "return Command(float('nan'), 0.0)"
RAISES = "raise ValueError('lost my way')"
SLOW = "import time; time.sleep(30)"


def _navigator(folder: Path, body: str) -> str:
    path = folder / "theirs.py"
    path.write_text(
        "from clearway.contract import Command\n\n\nclass Theirs:\n    needs = frozenset()\n\n"
        "    def reset(self, task, robot, rng):\n        pass\n\n"
        f"    def step(self, observation):\n        {body}\n"
    )
    return f"{path}:Theirs"


class TestNavigatorsThatFail:
    @pytest.mark.parametrize(("body", "why"), [(NAN, "nan"), (RAISES, "lost my way"), (SLOW, "longer than")])
    def test_is_recorded_and_the_campaign_goes_on(self, clearway: Shell, tmp_path: Path, body: str, why: str):
        from clearway.trials.store import open_results

        out = tmp_path / "out"
        said = clearway(
            "run", scenario(tmp_path), "--robot", "tiago", "--navigator", _navigator(tmp_path, body), "--workers", 1,
            "--decision-limit", 0.5, "--out", out, "--no-report",
        )  # fmt: skip
        assert said.code == 1
        assert "1 of 1" in said.err
        trials = open_results(out).trials.to_pylist()
        assert [t["outcome"] for t in trials] == ["navigator_failed"]
        assert why in trials[0]["reason"].lower()

    @pytest.mark.parametrize(
        ("address", "right"),
        [("nowhere_pkg:Nav", "nowhere_pkg"), ("json:NoSuchClass", "NoSuchClass"), ("json:loads", "loads")],
    )
    def test_that_cannot_be_made(self, clearway: Shell, address: str, right: str):
        assert right in clearway.complaint("check", address)
