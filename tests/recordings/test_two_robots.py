"""Two robots under test in one capture: a plan each, the same file, and each is an obstacle to the other."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import clearway

TABLE = 'id = "who"\ntime = { column = "t" }\n[bodies.each]\nx = "x"\ny = "y"\n'
PLAN = """
sources.capture = {{ table = "table.toml", frame.same = true }}
robot = {{ track = "{me}", shape = {{ kind = "disc", radius = {mine} }} }}
bodies.{other} = {{ track = "{other}", shape = {{ kind = "disc", radius = {its} }} }}
[[trial]]
file = "both.csv"
obstacles = [{{ body = "{other}" }}]
"""


RADIUS = {"jackal": 0.3, "turtlebot": 0.2}


def eased(t: float, start: float, lasts: float) -> float:
    return 1 - math.cos(math.pi * min(max((t - start) / lasts, 0.0), 1.0))


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    rows = ["t,who,x,y"]
    for i in range(300):
        t = 0.05 * i
        rows.append(f"{t:.3f},jackal,{2 * eased(t, 2.0, 8.0):.6f},0.0")
        rows.append(f"{t:.3f},turtlebot,{4 - 2 * eased(t, 3.0, 6.0):.6f},1.0")
    (tmp_path / "both.csv").write_text("\n".join(rows), encoding="utf-8")
    (tmp_path / "table.toml").write_text(TABLE, encoding="utf-8")
    return tmp_path


def test_each_has_its_trial_and_its_own_path(lab: Path):
    rows = []
    for me, other in (("jackal", "turtlebot"), ("turtlebot", "jackal")):
        text = PLAN.format(me=me, other=other, mine=RADIUS[me], its=RADIUS[other])
        (lab / f"{me}.toml").write_text(text, encoding="utf-8")
        results = clearway.score(lab / f"{me}.toml", out=lab / me, workers=1)
        assert [b.name for b in results.trial(0).attempt.bodies] == [other]
        rows.append(results.trials.to_pylist()[0])
    jackal, turtlebot = rows
    assert jackal["PL"] == pytest.approx(4.0, abs=0.01)
    assert turtlebot["PL"] == pytest.approx(4.0, abs=0.01)
    assert jackal["CT"] > turtlebot["CT"] + 1.0
    assert jackal["MDO"] == pytest.approx(1.0 - 0.3 - 0.2, abs=1e-3)
    assert turtlebot["MDO"] == pytest.approx(jackal["MDO"], abs=1e-6)
