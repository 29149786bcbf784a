"""A campaign that was stopped goes on, whatever stopped it, and with nothing that has changed meanwhile."""

from __future__ import annotations

import dataclasses
import importlib
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from own_plans import LONE, OWN, contents, left_over, plan, robot_file, wait_for

from clearway.campaigns import CampaignPlan, planned, resume_campaign, run_campaign, source
from clearway.campaigns.provenance import asked_of_plan
from clearway.errors import ClearwayError
from clearway.scenarios.suites import Selection


def test_what_is_in_a_floor_plan_counts_on_resuming(tmp_path: Path) -> None:
    """The same scenario among other walls is another task."""
    floor, own = tmp_path / "own.toml", tmp_path / "scenario.toml"
    wall = '[[walls]]\nname = "wall"\nbox = [0.0, {}, 8.0, 4.1]\n'
    floor.write_text('name = "own"\n' + wall.format(4.0))
    legs = '[[legs]]\nname = "forth"\ngoal = [6.0, 2.0, 0.0]\ntime_limit = 60.0\n'
    own.write_text(
        f'name = "x"\nfloor_plan = "own.toml"\nstart = [1.0, 2.0, 0.0]\nspeed = 0.6\nlocalisation = "truth"\n{legs}'
    )
    asked = CampaignPlan((str(own),), robots=("tiago",), navigators=(f"{OWN}:Drives",))
    before = asked_of_plan(asked, asked.specs())
    assert before == asked_of_plan(asked, asked.specs())
    time.sleep(0.01)
    floor.write_text('name = "own"\n' + wall.format(3.9))
    after = asked_of_plan(asked, asked.specs())
    assert list(before["tasks"]) == ["scenario/x-v0.6-r1/tiago"]
    assert {name for name in before if before[name] != after[name]} == {"floor_plans"}


def test_the_body_of_a_robot_that_an_obstacle_has_counts_on_resuming(tmp_path: Path) -> None:
    own, file = tmp_path / "scenario.toml", robot_file(tmp_path, name="mine")
    bodies = "".join(
        f'[[obstacles]]\nname = "{which}"\npose = [0.0, {y}, 0.0]\nshape = {{ kind = "robot", robot = "{which}" }}\n'
        for which, y in (("mine.toml", 1.5), ("hosbot", 3.0))
    )
    own.write_text(LONE + bodies)
    asked = CampaignPlan((str(own),), robots=("tiago",), navigators=(f"{OWN}:Drives",))
    before = asked_of_plan(asked, asked.specs())
    assert list(before["bodies"]) == [str(file)]
    time.sleep(0.01)
    robot_file(tmp_path, name="mine", d_base=0.6)
    after = asked_of_plan(asked, asked.specs())
    assert {name for name in before if before[name] != after[name]} == {"bodies"}


def test_resuming_takes_the_plan_along_and_keeps_what_is_done(tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    run_campaign(plan(), whole, 1)
    out = tmp_path / "out"

    def stop(done: int, total: int, note: str = "") -> None:
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match=r"stopped after 1 of 2 trials; go on with `clearway run --resume"):
        run_campaign(plan(), out, 1, progress=stop)
    assert planned(out) == plan()
    with pytest.raises(ClearwayError, match=r"differs in plan\.seed: it has 0, now 1"):
        run_campaign(plan(seed=1), out, 1, resume=True)
    told: list[int] = []
    resume_campaign(out, 1, progress=lambda done, *_: told.append(done))
    assert told == [1, 2]
    assert contents(out) == contents(whole)
    assert len(resume_campaign(out)) == 2  # finished already


SCRIPT = """
import sys
from pathlib import Path
sys.path[:0] = [{folder!r}]
from own_plans import plan
from clearway.campaigns import run_campaign, CampaignInterrupted
try:
    run_campaign(plan("Slow", repetitions=10), Path(sys.argv[1]), 2, resume=True,
                 progress=lambda done, *_: print(done, flush=True))
except CampaignInterrupted as stopped:
    print(stopped)
    sys.exit(130)
"""


def begin(out: Path) -> subprocess.Popen[str]:
    script = SCRIPT.format(folder=str(OWN.parent))
    return subprocess.Popen(
        [sys.executable, "-c", script, str(out)], stdout=subprocess.PIPE, text=True, start_new_session=True
    )


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to look for left-over processes")
def test_a_campaign_survives_sigkill_and_ctrl_c(tmp_path: Path) -> None:
    out, whole, moments = tmp_path / "out", tmp_path / "whole", random.Random(5)
    for round_ in range(2):
        process = begin(out)
        wait_for(process, 1 + 2 * round_)
        time.sleep(moments.uniform(0.0, 1.0))
        process.kill()
        assert process.wait() == -signal.SIGKILL
        assert left_over(process.pid) == []
    process = begin(out)
    wait_for(process, 5)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does on Ctrl-C
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 130
    assert f"go on with `clearway run --resume {out}`" in said
    assert left_over(process.pid) == []
    resume_campaign(out, 2)
    run_campaign(plan("Slow", repetitions=10), whole, 1)
    assert contents(out) == contents(whole)


def test_an_edited_navigator_is_told_on_resuming(tmp_path: Path) -> None:
    own, helper = tmp_path / "own.py", tmp_path / "beside.py"
    helper.write_text("SPEED = 0.3\n")
    own.write_text(
        "import sys\nfrom pathlib import Path\nsys.path.insert(0, str(Path(__file__).parent))\nfrom beside import SPEED\n"
        f"sys.path.insert(0, {str(OWN.parent)!r})\nfrom {OWN.stem} import Drives\n\nclass Mine(Drives):\n    speed = SPEED\n"
    )
    asked = dataclasses.replace(plan(), navigators=(f"{own}:Mine",))
    before = asked_of_plan(asked, asked.specs())["code"]
    assert list(before) == ["clearway", f"{own}:Mine"]
    helper.write_text("SPEED = 0.4\n")
    after = asked_of_plan(asked, asked.specs())["code"]
    assert {name for name in before if before[name] != after[name]} == {f"{own}:Mine"}


def test_a_file_that_a_navigator_is_given_counts_on_resuming(tmp_path: Path) -> None:
    own, params = tmp_path / "own.py", tmp_path / "params.yaml"
    params.write_text("speed: 0.3\n")
    own.write_text(
        f"import sys\nfrom pathlib import Path\nsys.path.insert(0, {str(OWN.parent)!r})\nfrom {OWN.stem} import Drives\n\n"
        "class Mine(Drives):\n    def __init__(self, params=None):\n        pass\n\n"
        "    @classmethod\n    def files(cls, params=None):\n        return () if params is None else (Path(params),)\n"
    )
    names = (f"{own}:Mine", f"{own}:Mine[params={params}]")
    asked = dataclasses.replace(plan(), navigators=names)
    by_option = dataclasses.replace(plan(), navigators=names[:1], options={names[0]: {"params": str(params)}})
    before, option_before = (asked_of_plan(p, p.specs())["code"] for p in (asked, by_option))
    assert option_before[names[0]] == before[names[1]] != before[names[0]]
    params.write_text("speed: 0.4\n")
    after, option_after = (asked_of_plan(p, p.specs())["code"] for p in (asked, by_option))
    assert {name for name in before if before[name] != after[name]} == {names[1]}
    assert option_after[names[0]] == after[names[1]]
    params.unlink()
    with pytest.raises(ClearwayError, match=r"params\.yaml: no such file"):
        asked_of_plan(asked, asked.specs())


def test_a_package_counts_with_its_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "learnt_package"
    package.mkdir()
    (package / "__init__.py").write_text("class Learnt:\n    pass\n")
    (package / "weights.npz").write_bytes(b"1")
    monkeypatch.syspath_prepend(str(tmp_path))
    learnt = importlib.import_module("learnt_package").Learnt
    before = source.of_object(learnt)
    for folder in ("__pycache__", ".git", "out"):
        (package / folder).mkdir(exist_ok=True)
        (package / folder / "campaign.json").write_text("")
        (package / folder / "else").write_text("")
    assert source.of_object(learnt) == before
    (package / "weights.npz").write_bytes(b"2")
    assert source.of_object(learnt) != before


def test_a_navigator_and_a_behaviour_of_one_name_both_count() -> None:
    """They may be registered by different packages."""
    asked = CampaignPlan(("people",), ("tiago",), (f"{OWN}:Drives",), Selection(repetitions=1))
    specs = asked.specs()
    named = [p.model_copy(update={"behaviour": f"{OWN}:Drives"}) for p in specs[0].scenario.people]
    spec = dataclasses.replace(specs[0], scenario=specs[0].scenario.model_copy(update={"people": tuple(named)}))
    assert list(asked_of_plan(asked, [spec])["code"]) == ["clearway", f"{OWN}:Drives", f"behaviour {OWN}:Drives"]
