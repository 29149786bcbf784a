"""Tuning: what is refused before anything runs, how parameters are written, and that a search finds what is known to be better."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pyarrow as pa
import pytest
from typer.testing import CliRunner

from clearway.campaigns.tuning import tuned_by_files
from clearway.cli import app
from clearway.errors import ClearwayError
from clearway.improving.objective import FAILED, Answers, read_objective
from clearway.improving.search import Record, Values, best, refuse_little
from clearway.improving.settings import InRobotFile, InYaml, with_options
from clearway.improving.task import Search, Task, Variable, read_task
from clearway.improving.trials import refuse_overlap
from clearway.improving.tune import _gain, tune
from clearway.improving.tuning import Gain, Tuning, doubts
from clearway.improving.yaml_text import changed
from clearway.robots import load_robot
from clearway.statistics import Comparison
from clearway.trials.store import Results, open_results
from clearway.tuning import TunedOn

TASK = """
navigator = "move-base"
robot = "hosbot"
objective = ["maximise success", "minimise CT"]
constraints = ["min MDO >= 0.02"]
[parameters.DWAPlannerROS]
sim_time = [1.0, 3.5]
[training]
suite = "hospital"
batches = ["MO"]
speeds = [0.6]
repetitions = 1
[held_out]
suite = "hospital-held-out"
batches = ["MO"]
repetitions = 1
[search]
method = "halving"
"""
DRAWN = """
navigator = "hp-st"
robot = "rescue"
objective = ["maximise success"]
[parameters]
margin = [0.01, 0.1]
[training]
suite = "sar-case1"
seeds = "0:4"
[held_out]
suite = "sar-case1"
seeds = "4:8"
"""


def _written(folder: Path, old: str = "", new: str = "", task: str = TASK) -> Path:
    file = folder / "task.toml"
    assert old in task
    file.write_text(task.replace(old, new) if old else task)
    return file


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[1.0, 3.5]", "[3.5, 1.0]", "upside down"),
        ("[1.0, 3.5]", '{ range = [0.0, 1.0], scale = "log" }', "begins above 0"),
        ("[1.0, 3.5]", "3", "is no range"),
        ("maximise success", "maximise sucess", "did you mean 'success'?"),
        ("maximise success", "more success", "is no objective"),
        ("minimise CT", "maximise CT", "'maximise CT' is upside down: CT is the better the lower; write 'minimise CT'"),
        ("maximise success", "minimise success", "success is the better the higher; write 'maximise success'"),
        ("min MDO >= 0.02", "success >= 1.2", "can never hold"),
        ("sim_time", "simtime", "did you mean 'sim_time'?"),
        ("[1.0, 3.5]", "[-1.0, 3.5]", "-1.0 is refused"),
        ('method = "halving"', 'method = "halving"\ntrials = 12', "12 trials are too few"),
        ("[parameters.DWAPlannerROS]\nsim_time = [1.0, 3.5]", "", "nothing is to be tuned"),
    ],
)
def test_what_is_wrong_is_told_before_anything_runs(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(ClearwayError) as error:
        tune(_written(tmp_path, old, new), tmp_path / "out", workers=0)
    assert said in str(error.value)
    assert "task.toml" in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ('seeds = "3:8"', "3:8 overlaps with training's 0:4, seed 3 is in both; 4:9 has as many seeds, and none of"),
        ('seeds = "0:4"\nseed = 3', "0:4 overlaps with training's 0:4, seeds 0 to 3 are in both; 4:8 has as many"),
    ],
)
def test_seeds_that_overlap_are_refused(tmp_path: Path, new: str, said: str) -> None:
    with pytest.raises(ClearwayError, match=f"held_out.seeds: {said}"):
        tune(_written(tmp_path, 'seeds = "4:8"', new, DRAWN), tmp_path / "out", workers=0)


@pytest.mark.parametrize("there", ["before", "candidates.csv", "index.html", "hosbot-tuned.toml"])
def test_a_folder_with_what_would_be_written_is_refused_before_anything_runs(tmp_path: Path, there: str) -> None:
    taken = tmp_path / "out" / there
    taken.mkdir(parents=True)
    with pytest.raises(ClearwayError, match="is already there, and a tuning overwrites nothing") as error:
        tune(_written(tmp_path), tmp_path / "out", workers=0)
    assert error.value.file == str(taken)
    assert list((tmp_path / "out").iterdir()) == [taken]


def test_check_knows_a_task_and_says_what_tune_would(tmp_path: Path) -> None:
    said = CliRunner().invoke(app, ["check", str(_written(tmp_path))])
    assert (said.exit_code, "DWAPlannerROS.sim_time is 1.7" in said.output) == (0, True), said.output
    for old, new, problem in (
        ("[1.0, 3.5]", "[3.5, 1.0]", "upside down"),
        ("[1.0, 3.5]", "[-1.0, 3.5]", "-1.0 is refused"),
    ):
        said = CliRunner().invoke(app, ["check", str(_written(tmp_path, old, new))])
        assert (said.exit_code, problem in said.output) == (1, True), said.output


@pytest.mark.parametrize(
    ("changes", "fields"),
    [
        (
            {
                "sim_time = [1.0, 3.5]": "sim_time = [3.5, 1.0]\nmax_vel_x = [3.5, 1.0]", "minimise CT": "minimise CTT",
                "min MDO >= 0.02": "MDO", '"hospital"\nbatches = ["MO"]': '"hospital"\nbatches = ["MMO"]', "held-out": "held",
            },
            ("parameters.DWAPlannerROS.sim_time", "parameters.DWAPlannerROS.max_vel_x", "objective", "constraints", "training",
             "held_out"),
        ),
        (
            {"sim_time = [1.0, 3.5]": "sim_tim = [1.0, 3.5]\nsim_time = [-1.0, 2.0]"},
            ("parameters.DWAPlannerROS.sim_tim", "parameters.DWAPlannerROS.sim_time"),
        ),
        (
            {"suite": "sweet", "repetitions = 1": "repetitions = 0.5", "halving": "halve"},
            ("training.sweet", "held_out.sweet", "training.suite", "training.repetitions", "held_out.suite", "held_out.repetitions",
             "search.method"),
        ),
        (
            {"batches": "repetitions = 2\nbatches", "repetitions = 1\n": "", "halving": "halving\"\ntrials = 5 #", "-held-out": ""},
            ("held_out", "search.trials"),
        ),
    ],
)  # fmt: skip
def test_check_tells_all_that_is_wrong_at_once(
    tmp_path: Path, changes: dict[str, str], fields: tuple[str, ...]
) -> None:
    file = _written(tmp_path)
    text = file.read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    said = CliRunner().invoke(app, ["check", str(file), "--json"])
    assert said.exit_code == 1, said.output
    told = json.loads(said.stdout)["problems"]
    assert [problem.removeprefix(f"{file}: ").partition(": ")[0] for problem in told] == list(fields)
    with pytest.raises(ClearwayError) as error:
        tune(file, tmp_path / "out", workers=0)
    assert str(error.value) == told[0]


def test_frozen_scenarios_may_be_held_out_and_the_same_may_not(tmp_path: Path) -> None:
    task = read_task(_written(tmp_path, 'seeds = "4:8"', "", DRAWN))
    assert refuse_overlap(task.training, task.held_out, "task.toml") is False
    with pytest.raises(ClearwayError, match="in training too"):
        refuse_overlap(task.held_out, task.held_out, "task.toml")


def test_a_hair_makes_no_other_trial(tmp_path: Path) -> None:
    def asked(held_out: str) -> Task:
        old = 'suite = "hospital-held-out"\nbatches = ["MO"]'
        return read_task(_written(tmp_path, old, f'suite = "hospital"\nbatches = ["MO"]\n{held_out}'))

    for hair in ("latency = 1.000001", "latency = 2.0"):
        task = asked(hair)
        ways = r"hold out with another seed \(seed = 1\), or other scenarios, or the suite 'hospital-held-out'"
        with pytest.raises(ClearwayError, match=f"in training too; {ways}"):
            refuse_overlap(task.training, task.held_out, "task.toml")
    task = asked("latency = 1.000001\nseed = 1")
    assert refuse_overlap(task.training, task.held_out, "task.toml") is True  # and a warning says so


def test_a_robots_file_is_kept_and_has_a_preset_that_says_on_what_it_was_tuned(tmp_path: Path) -> None:
    settings = InRobotFile("hosbot:melodic", "move-base")
    names = ["DWAPlannerROS.path_distance_bias", "DWAPlannerROS.sim_time", "DWAPlannerROS.vx_samples"]
    before = settings.before(names)
    assert before[names[0]] == 0.6  # of the preset, not of the file's table
    assert before[names[1]] == 1.7  # ROS's default, as the file is silent
    said = TunedOn("hospital", draws=range(20), seeds=(3,), note="two")
    written = settings.write({names[0]: 2.5, names[2]: 7}, tmp_path, "mine", [said])
    text = written.files[0].read_text()
    assert text.startswith("# HOSBOT (Robotnik RB-1")
    assert "= 2.5  # was 0.6" in text
    table = load_robot(written.robot).navigators["move-base"]["DWAPlannerROS"]
    assert (table["path_distance_bias"], table["goal_distance_bias"], table["vx_samples"]) == (2.5, 0.8, 7)
    again = InRobotFile(written.robot, "move-base")  # which reads it: `tuned_on` is no unknown key
    assert again.before(names)[names[2]] == 7
    assert tuned_by_files("move-base", load_robot(written.robot)) == (said,)
    assert tuned_by_files("move-base", load_robot("hosbot")) == ()


def test_in_yaml_only_the_values_change(tmp_path: Path) -> None:
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "controller_server:\n  ros__parameters:\n    # how fast\n    FollowPath:\n      vx_max: 0.5  # m/s\n      batch: 1000\n      tiny: 1e-3\n"
        "other:\n  ros__parameters: {a: 1, b.c: x}\n"
    )
    text = changed(file, {"controller_server.FollowPath.vx_max": 0.7, "other.b.c": "y"}, "# head")
    assert text == "# head\n" + file.read_text().replace("0.5", "0.7").replace("b.c: x", 'b.c: "y"')
    settings = InYaml("turtlebot", f"nav2[params={file}]")
    assert settings.before(["controller_server.FollowPath.batch"]) == {"controller_server.FollowPath.batch": 1000}
    assert settings.before(["controller_server.FollowPath.tiny"]) == {
        "controller_server.FollowPath.tiny": 0.001
    }  # as rcl reads it
    with pytest.raises(ClearwayError, match=r"did you mean 'controller_server\.FollowPath\.vx_max'"):
        settings.before(["controller_server.FollowPath.vxmax"])
    said = TunedOn("barn", note="vx_max")
    written = settings.write({"controller_server.FollowPath.vx_max": 0.7}, tmp_path, "tuned", [said])
    assert written.navigator == f"nav2[params={tmp_path / 'tuned.yaml'}]"
    assert tuned_by_files(written.navigator, load_robot("hosbot")) == (said,)


def test_options_replace_those_of_their_name() -> None:
    assert with_options("hp-st[guarantee=none,margin=0.1]", {"margin": 0.2}) == "hp-st[guarantee=none,margin=0.2]"


def test_an_objective_is_sorted_by_constraints_first_and_then_in_its_order() -> None:
    objective = read_objective(["maximise success", "minimise CT"], ["min MDO >= 0.1"], "t")
    slow: list[Answers] = [{"success": 1.0, "CT": 30.0, "MDO": 0.2}]
    fast: list[Answers] = [{"success": 1.0, "CT": 20.0, "MDO": 0.2}]
    near: list[Answers] = [{"success": 1.0, "CT": 10.0, "MDO": 0.05}]
    failed: list[Answers] = [{"success": None, "CT": None, "MDO": None, FAILED: 1.0}]
    half: list[Answers] = [{"success": 1.0, "CT": 5.0, "MDO": 0.2}, {"success": 0.0, "CT": None, "MDO": 0.2}]
    orders = [objective.score(a).order for a in (fast, slow, half, near, failed)]
    assert orders == sorted(orders)
    assert objective.score(near).excess == pytest.approx(0.5)


@pytest.mark.parametrize("asked", [["minimise CT"], ["minimise CT", "maximise success"]])
def test_nothing_gains_by_failing_what_is_hard(asked: list[str]) -> None:
    objective = read_objective(asked, [], "t")
    assert [str(goal) for goal in objective.goals] == ["maximise success", "minimise CT"]
    assert objective.indicators == ("success", "CT")
    every: list[Answers] = [{"success": 1.0, "CT": 10.0}, {"success": 1.0, "CT": 30.0}]
    easy: list[Answers] = [{"success": 1.0, "CT": 9.0}, {"success": 0.0, "CT": None}]
    assert objective.score(every).order < objective.score(easy).order
    assert not objective.dominated(objective.score(every), objective.score(easy))


@pytest.mark.parametrize("method", ["cma", "halving"])
def test_a_search_finds_a_known_optimum_among_noise_within_its_budget(method: Any) -> None:
    if method == "cma":
        pytest.importorskip("cma")
    variables = [Variable("a", False, 0.0, 10.0), Variable("b", False, 0.01, 1.0, log=True)]
    noise = np.random.default_rng(1).normal(0.0, 1.0, 24)  # of the trial, the same for all: they are paired

    def attempt(asked: Any) -> dict[tuple[int, int], Answers]:
        def cost(v: Values) -> float:
            return (float(v["a"]) - 7.0) ** 2 + np.log10(float(v["b"]) / 0.1) ** 2 * 20

        return {(n, t): {"CT": cost(v) + noise[t]} for n, v, trials in asked for t in trials}

    search = Search(method=method, trials=600)
    record = Record(read_objective(["minimise CT"], [], "t"), attempt, 600, [{"a": 2.0, "b": 0.5}])
    refuse_little(search, 24, "t")
    ranked = best(record, variables, search, 24)
    assert len(record.answers) <= 600
    found = record.values[ranked[0]]
    assert abs(float(found["a"]) - 7.0) < 1.0
    assert 0.03 < float(found["b"]) < 0.3
    assert ranked[-1] == 0 or 0 in ranked


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [("max CT <= 60", "min MDO >= 0.0", "constraints"), ("minimise CT", "maximise MDO", "objective")],
)
def test_what_no_trial_can_tell_is_refused(tmp_path: Path, old: str, new: str, field: str) -> None:
    task = tmp_path / "task.toml"
    example = Path(__file__).parents[2] / "examples" / "tune_hosbot.toml"
    task.write_text(example.read_text().replace(old, new))  # no obstacles are there
    with pytest.raises(ClearwayError, match=f"{field}: 'MDO' can be computed of none of the first 1 training trials"):
        tune(task, tmp_path / "out", workers=0)


def test_a_gain_of_what_no_trial_had_is_told_in_words() -> None:
    nan = math.nan
    assert str(Gain("CT", "s", nan, 17.2, nan, nan, nan, 0)) == (
        "CT: none -> 17.2 s, no pair of which both have one; no difference is shown"
    )
    assert str(Gain("CT", "s", 17.2, nan, nan, nan, nan, 0)).startswith("CT: 17.2 -> none, no pair")
    assert str(Gain("CT", "s", 20.0, 17.2, -2.8, -4.0, -1.6, 1)) == (
        "CT: 20 -> 17.2 s, paired difference -2.8 [-4, -1.6]; better, shown"
    )


def test_a_gain_without_an_interval_is_not_shown() -> None:
    row = {"batch": None, "indicator": "CT", "mean_difference": -1.233, "boot_low": None, "boot_high": None}
    found = SimpleNamespace(differences=pa.Table.from_pylist([row | {"p_holm": 0.03}]))
    sides = (SimpleNamespace(trials=pa.table({"CT": [ct] * 6})) for ct in (20.0, 18.767))
    gain = _gain("CT", 1, cast(Comparison, found), *(cast(Results, side) for side in sides))
    assert str(gain) == (
        "CT: 20 -> 18.77 s, paired difference -1.233, no interval: fewer than 8 pairs; no difference is shown"
    )


def _told(tmp_path: Path, *verdicts: int, holds: bool = True) -> Tuning:
    gains = tuple(
        Gain(name, unit, 1.0, 0.5, -0.5, -0.6, -0.4, verdict)
        for (name, unit), verdict in zip((("success", ""), ("CT", "s")), verdicts, strict=True)
    )
    limits, pairs = (("min MDO >= 0.02", 0.1, 0.0, holds),), cast(Comparison, SimpleNamespace(pairs=20))
    return Tuning(
        tmp_path, None, "hosbot", "mine[scale=1.0]", {"scale": 0.5}, {"scale": 1.0}, 130, (), gains, limits, pairs,
        tuple(doubts(gains, limits, 20)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("verdicts", "warned"),
    [
        ((-1, 1), "it is shown to be worse in success, which counts first; keep what came in"),
        ((0, -1), "it is shown to be worse in CT, the first in which a difference is shown; keep what came in"),
        ((1, -1), "it is shown to be worse in CT, which counts less"),
        ((0, 0), "no gain is shown on the 20 held-out pairs: what was found may be what fitted the training trials by chance"),
        ((0, 1), ""),
    ],
)  # fmt: skip
def test_a_loss_that_is_shown_is_no_chance_and_nothing_to_use(
    tmp_path: Path, verdicts: tuple[int, int], warned: str
) -> None:
    found = _told(tmp_path, *verdicts)
    assert found.warnings == ((warned,) if warned else ())
    worse = "keep what came in" in warned
    assert ("to use it: clearway run SUITE" in str(found)) is not worse
    assert found.better is (1 in verdicts and not worse)


def test_a_constraint_that_is_broken_is_told_beside(tmp_path: Path) -> None:
    found = _told(tmp_path, 1, 0, holds=False)
    assert (found.better, found.warnings) == (False, ("on the held-out trials a constraint is broken; see above",))


@pytest.mark.slow
def test_the_example_runs_and_what_it_finds_says_on_what_it_was_tuned(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples" / "tune_hosbot.toml"
    found = tune(example, tmp_path / "out", workers=0)
    assert found.trials <= 20
    assert (tmp_path / "out" / "candidates.csv").read_text().startswith("candidate,DWAPlannerROS.sim_time,")
    assert found.front
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert all(f"<strong>{word}.</strong>" in page for word in ("Tested", "Result", "Limits"))
    assert "Pareto front" in (tmp_path / "out" / "front.svg").read_text("utf-8")
    if found.comparison is None:
        assert "nothing better" in str(found)
        return
    assert not found.better or found.gains[1].verdict == 1  # three pairs can't show a success
    assert set(open_results(tmp_path / "out" / "after").trials["tuned"].to_pylist()) == {"no"}
    assert open_results(tmp_path / "out" / "after").campaign["tuned_on"]["move-base"][-1].startswith("hospital, seed 0")


ROS_1 = {
    "costmap_common_params.yaml": "obstacle_range: 3.0\nraytrace_range: 3.5\nrobot_radius: 0.27\ninflation_radius: 0.6\n"
    "observation_sources: scan\nscan: {data_type: LaserScan, topic: scan, marking: true, clearing: true}\n",
    "local_costmap_params.yaml": "local_costmap: {global_frame: odom, static_map: false, rolling_window: true, width: 3, height: 3}\n",
    "global_costmap_params.yaml": "global_costmap: {global_frame: map, static_map: true}\n",
    "move_base_params.yaml": "controller_frequency: 10.0\n",
    "dwa_local_planner_params.yaml": "# how fast\nDWAPlannerROS:\n  max_vel_x:   0.25  # m/s; slow\n  max_vel_trans: 0.6\n"
    "  xy_goal_tolerance: 0.2\n  yaw_goal_tolerance: 0.2\n",
}
NAV2 = Path(__file__).parents[1] / "navigators" / "nav2" / "nav2_pursuit.yaml"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("navigator", "name", "changed_in"),
    [
        ("move-base", "DWAPlannerROS.max_vel_x", "dwa_local_planner_params.yaml"),
        ("nav2", "controller_server.FollowPath.max_linear_vel", "params.yaml"),
    ],
)
def test_a_file_in_the_format_that_came_in_from_end_to_end(
    tmp_path: Path, navigator: str, name: str, changed_in: str
) -> None:
    place = tmp_path / "mine"
    place.mkdir()
    if navigator == "nav2":
        text = NAV2.read_text("utf-8").replace("max_linear_vel: 0.6", "max_linear_vel:   0.25  # m/s; slow")
        (place / changed_in).write_text(text, "utf-8")
    else:
        for file, text in ROS_1.items():
            (place / file).write_text(text, "utf-8")
    params = place / changed_in if navigator == "nav2" else place
    task = tmp_path / "task.toml"
    task.write_text(
        f"""
navigator = "{navigator}[params={params}]"
robot = "tiago"
objective = ["minimise CT"]
localisation = "truth"
[parameters]
"{name}" = [0.28, 0.34]
[training]
suite = "hospital"
batches = ["NO"]
speeds = [0.6]
repetitions = 1
[held_out]
suite = "hospital-held-out"
batches = ["NO"]
speeds = [0.8]
repetitions = 1
[search]
method = "halving"
trials = 10
population = 4
first = 1
finalists = 1
""",
        "utf-8",
    )
    found = tune(task, tmp_path / "out", workers=0)
    assert found.comparison is not None  # what came in was slow
    assert 0.28 <= float(found.after[name]) <= 0.34
    new = tmp_path / "out" / "tiago-tuned"
    new = new.with_suffix(".yaml") if navigator == "nav2" else new / changed_in
    head, _, rest = new.read_text("utf-8").partition("\n")
    assert head.startswith("# clearway: tuned on ")
    assert rest == (place / changed_in).read_text("utf-8").replace(
        "0.25  # m/s; slow", f"{found.after[name]}  # m/s; slow"
    )
    if navigator == "move-base":
        others = set(ROS_1) - {changed_in}
        assert {f.name: f.read_text("utf-8") for f in new.parent.iterdir() if f != new} == {f: ROS_1[f] for f in others}
    after = open_results(tmp_path / "out" / "after")
    assert found.navigator in after.trials["navigator"].to_pylist()  # which is how `clearway run` takes it
    assert after.trials["CT"].to_pylist()[0] < open_results(tmp_path / "out" / "before").trials["CT"].to_pylist()[0]
    assert tuned_by_files(found.navigator, load_robot("tiago"))[0].note == name
