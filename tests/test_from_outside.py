"""What another package adds without touching Clearway: an indicator, a navigator, a suite and a format, a line each."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

pytestmark = pytest.mark.slow

PACKAGE = '''
import numpy as np

from clearway.contract import Command
from clearway.indicators import Indicator
from clearway.indicators.indicator import Value
from clearway.recordings.formats.format import Format
from clearway.recordings.recording import Recording, Track, contents_of
from clearway.scenarios.scenario import LabelSpec, LegSpec, Scenario
from clearway.scenarios.suite import Suite, scenario_seed


def samples(trial):
    return Value(float(len(trial.t)))


SAMPLES = Indicator("samples", "number of samples", "", "our own", "neither", samples)


class Ahead:
    """Drives ahead and says after a second that this will do."""

    needs = frozenset()

    def reset(self, task, robot, rng):
        self.speed = task.speed_limit

    def step(self, observation):
        done = observation.t >= 1.0
        return Command(0.0 if done else self.speed, 0.0, arrived=done)


def make(robot, selection, seed):
    leg = LegSpec(name="across", goal=(3.0, 0.0, 0.0), time_limit=5.0)
    labels = LabelSpec(batch="yard", configuration="across")
    return [Scenario(name="across", floor_plan="arena", start=(1.0, 1.0, 0.0), legs=(leg,), speed=0.5, labels=labels,
                     localisation="truth", seed=scenario_seed(seed, "across"))]


YARD = Suite("yard", "Crossing our yard", "nothing but a yard", ("yard",), ("across",), make, robots=("tiago",))


def read(path, want):
    t, x, y = np.loadtxt(path, skiprows=1, unpack=True)
    position = np.column_stack([x, y, np.zeros(len(t))])
    return Recording(path, "walk", tracks={"walker": Track("body", "", "", t, position)})


WALK = Format("walk", "Our walks", (".walk",), lambda path, head: head.startswith(b"walk"), read,
              lambda path: contents_of(read(path, None)))
'''
POINTS = """
[clearway.indicators]
samples = our_things:SAMPLES
[clearway.navigators]
ahead = our_things:Ahead
[clearway.suites]
yard = our_things:YARD
[clearway.formats]
walk = our_things:WALK
"""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """What installing the package leaves behind."""
    about = tmp_path / "site" / "our_things-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: our-things\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(POINTS)
    (about.parent / "our_things.py").write_text(PACKAGE)
    return about.parent


def clearway(site: Path, *arguments: str) -> str:
    start = f"import sys; sys.path.insert(0, {str(site)!r}); from clearway.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", start, *arguments], capture_output=True, text=True, cwd=site.parent, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_all_four_are_used_by_their_names(site: Path) -> None:
    (site.parent / "one.walk").write_text("walk\n0.0 0.0 0.0\n0.5 0.2 0.0\n1.0 0.4 0.0\n")
    known = json.loads(clearway(site, "list", "--json"))
    assert "yard" in str(known["suites"])
    assert "ahead" in str(known["navigators"])
    assert "samples" in str(known["indicators"])
    assert "walk" in str(known["formats"])
    clearway(site, "run", "yard", "--navigator", "ahead", "--workers", "1", "--no-report", "--out", "out")
    (row,) = pq.read_table(site.parent / "out" / "trials.parquet").to_pylist()
    assert (row["suite"], row["navigator"], row["robot"]) == ("yard", "ahead", "tiago")
    assert row["samples"] == pq.read_metadata(site.parent / "out" / "trajectories" / "robot.parquet").num_rows > 10
    assert "walker" in clearway(site, "import", "one.walk", "--list")


def test_one_that_bears_another_name_is_refused(site: Path) -> None:
    (site / "our_things-1.0.dist-info" / "entry_points.txt").write_text(
        "[clearway.indicators]\nsteps = our_things:SAMPLES\n"
    )
    start = f"import sys; sys.path.insert(0, {str(site)!r}); from clearway.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", start, "list", "indicators"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "the indicator that is registered as 'steps' calls itself 'samples'; name it alike" in done.stderr
    assert "Traceback" not in done.stderr
