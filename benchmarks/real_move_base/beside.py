"""The real move_base in Clearway's own worlds, over `ros1:` in lockstep, beside Clearway's: the same parameters, seeds and noise.

`build.sh` builds the real one. It is started anew for each trial, with the parameters of the robot's file put on its master
as its authors' YAML has them. Plug-ins around its planners (`recorder/`) write down what they were asked and answered, and ours
answer to the same; a command counts as the same within 1e-3 m/s and rad/s. A trial that lies in OUT already is not driven again: a run can be gone on with, and get more repetitions.

    python benchmarks/real_move_base/beside.py BUILT OUT [--repetitions 10] [--worlds 0 60 144]    # BARN's 50 official worlds
    python benchmarks/real_move_base/beside.py BUILT OUT --suite hospital --robot hosbot [--amcl]  # SO at 0.6 m/s
    python benchmarks/real_move_base/beside.py BUILT OUT --table                                   # of all that lies in OUT
    python benchmarks/real_move_base/beside.py BUILT OUT --smoke                                   # one world, once

All repetitions of a world or a configuration are drawn together for the intervals (95 %). How like two orders of worlds can be is limited
by chance in either: with four repetitions and more the real one's halves are held against each other too.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from real import FRESH_MEMORY, real
from recording import EXACT, answers, apart, plans
from scipy.ndimage import binary_dilation

import clearway
from clearway.contract import Command, Navigator, Observation, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN
from clearway.geometry.ros_map import write_map
from clearway.geometry.shapes import FloatArray
from clearway.live.line import WireError
from clearway.live.ros1.address import stack
from clearway.navigators.move_base import MoveBase
from clearway.robots import Robot, load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import Selection, load_suite
from clearway.statistics.correlation import spearman

DEADLINE = 0.2
"""s of wall clock that a period's command is waited for; while it plans, the real one gives none."""
SPEED = 0.6
"""m/s, of the hospital's tests."""
DRAWS = 2000
"""How often worlds are drawn for an interval."""
SELECTED = {
    "barn-2022": Selection(batches=("official",)),
    "hospital": Selection(batches=("SO",), speeds=(SPEED,)),
}
Row = dict[str, Any]


class Setting(NamedTuple):
    """What a line of the table is of.

    Attributes:
        suite: Its name.
        robot: Likewise.
        scoring: What the weights of TrajectoryPlanner count per, `cells` or `metres`.
        amcl: Whether the real AMCL localises the real one.
    """

    suite: str
    robot: str
    scoring: str
    amcl: bool

    @property
    def speed(self) -> float | None:
        """The set speed of its tests, m/s; None: the robot's file says it all."""
        return SPEED if self.suite == "hospital" else None

    def driver(self) -> Robot:
        """The robot, with ours reading `meter_scoring` as the real one happens to."""
        robot = load_robot(self.robot)
        if self.scoring == "cells":
            return robot
        table = dict(robot.navigators["move-base"])
        table["TrajectoryPlannerROS"] = table["TrajectoryPlannerROS"] | {
            "meter_scoring_honoured": self.scoring == "metres"
        }
        return robot.model_copy(
            update={"name": f"{self.robot}-metres", "navigators": {**robot.navigators, "move-base": table}}
        )

    def recording(self, out: Path, scenario: str) -> Path:
        """Where a trial's recording lies."""
        return out / f"{self.suite}-{self.robot}-{self.scoring}{'-amcl' if self.amcl else ''}" / f"{scenario}.bin"


def as_seen(floor_plan: str, folder: Path) -> Path:
    """A file of a floor plan's map with walls as a robot maps them, cells that touch free space. The real AMCL takes a beam's end
    within a thick wall for a perfect hit, and leans towards the walls that the robot faces."""
    known, file = load_floor_plan(floor_plan).map, folder / f"{floor_plan}.yaml"
    hidden = (known.data == OCCUPIED) & ~binary_dilation(known.data == FREE, np.ones((3, 3)))
    write_map(file, replace(known, data=np.where(hidden, UNKNOWN, known.data)))
    return file


class Both:
    """The real one drives; ours is told the same in each period, with costmaps and plans of its own.

    Attributes:
        same: Periods in which both gave the same command.
        periods: All of them.
    """

    needs, drives = MoveBase.needs, MoveBase.drives

    def __init__(self, connect: Callable[[], Navigator]) -> None:
        self._connect, self._ours = connect, MoveBase()
        self._real: Any = None
        self.same = self.periods = 0

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Prepare both."""
        self._real = self._connect()
        self._real.reset(task, robot, rng)
        self._ours.reset(task, robot, rng)

    def step(self, observation: Observation) -> Command:
        """The real one's command."""
        theirs, ours = self._real.step(observation), self._ours.step(observation)
        apart = max(abs(theirs.v - ours.v), abs(theirs.omega - ours.omega), abs(theirs.v_y - ours.v_y))
        self.same += apart <= EXACT
        self.periods += 1
        return theirs

    def close(self) -> None:
        """Leave the real one's master: a node that stays looks for its publishers for ever."""
        if self._real is not None:
            self._real.close()


def drive(
    built: Path, out: Path, setting: Setting, scenario: str, repetitions: int, pace: Mapping[str, float]
) -> list[Row]:
    """One trial of the real one and one of ours; what is kept of them."""
    recording = setting.recording(out, scenario)
    recording.parent.mkdir(parents=True, exist_ok=True)
    recording.unlink(missing_ok=True)
    robot, found = setting.driver(), []
    with real(
        built,
        robot,
        out / "said.log",
        scoring=setting.scoring,
        speed=setting.speed,
        recording=recording,
        amcl=setting.amcl,
    ) as master:
        driven = []

        class Real(Both):
            """Named by its address, which is another one for each trial."""

            def __init__(self) -> None:
                super().__init__(lambda: stack(master)(localised=not setting.amcl, **pace))
                driven.append(self)

        for who, navigator in (("real", Real), ("ours", "move-base")):
            with TemporaryDirectory() as folder:
                seen = as_seen("hall", Path(folder)) if setting.amcl else None
                results = clearway.run(
                    setting.suite, map=seen, robots=[robot], navigators=[navigator], scenarios=[scenario], repetitions=repetitions, workers=0,
                    decision_limit=60.0, keep="table", out=Path(folder) / "results",
                )  # fmt: skip
                (row,) = results.trials.to_pylist()
            if who == "real":
                driven[-1].close()
            kept = {key: row[key] for key in ("outcome", "reason", "success", "success_self", "CT")}
            test = scenario.rpartition("-r")[0]
            found.append(setting._asdict() | {"scenario": scenario, "test": test, "who": who} | kept)
        found[0] |= {"same": driven[-1].same, "periods": driven[-1].periods}
    return found


def setting_of(row: Row) -> Setting:
    """Of which setting a trial is."""
    return Setting(row["suite"], row["robot"], row["scoring"], row["amcl"])


def tabled(rows: Sequence[Row], out: Path) -> None:
    """Print one table: a column for each suite, robot and localiser."""
    columns = [
        _column(setting, [row for row in rows if setting_of(row) == setting], out) for setting in _settings(rows)
    ]
    for i, name in enumerate(dict.fromkeys(name for column in columns for name in column)):
        print("| " + " | ".join((name, *(column.get(name, "–") for column in columns))) + " |")
        if i == 0:
            print("|---" * (len(columns) + 1) + "|", flush=True)


def _settings(rows: Sequence[Row]) -> list[Setting]:
    return list(dict.fromkeys(map(setting_of, rows)))


def _column(setting: Setting, rows: Sequence[Row], out: Path) -> dict[str, str]:
    """What a setting's trials say, by the name of the line."""
    tests = list(dict.fromkeys(row["test"] for row in rows))
    reached = _by_test(rows, tests, lambda row: float(row["outcome"] == "reached"))
    success = _by_test(rows, tests, lambda row: float(row["success"]))
    times = _by_test([row for row in rows if row["outcome"] == "reached"], tests, lambda row: row["CT"])
    times = times[np.isfinite(times).all(axis=1)]
    own = [row for row in rows if "periods" in row]
    owned = np.array(
        [[sum(row[key] for row in own if row["test"] == test) for key in ("same", "periods")] for test in tests]
    )
    scoring = f", weights per {'cell' if setting.scoring == 'cells' else 'metre'}" if setting.robot == "jackal" else ""
    return {
        "": f"{setting.suite}, {setting.robot}{', the real AMCL' if setting.amcl else ''}{scoring}",
        "worlds or configurations, trials of each side": f"{len(tests)}, {sum(row['who'] == 'real' for row in rows)}",
        "reached: real, ours": f"{reached[:, 0].mean():.3f}, {reached[:, 1].mean():.3f}",
        "difference": _drawn(reached, _difference, "+.3f"),
        "success by the true pose: real, ours": f"{success[:, 0].mean():.3f}, {success[:, 1].mean():.3f}",
        "its difference": _drawn(success, _difference, "+.3f"),
        "mean time where both reached: real, ours (s)": f"{times[:, 0].mean():.1f}, {times[:, 1].mean():.1f}",
        "ours by the real one's": _drawn(times, lambda s: float(s[:, 1].mean() / s[:, 0].mean()), ".3f"),
        "rank correlation by world: reached": _ranked(reached),
        "of the time": _ranked(times),
        "of half of the real one's times with its other half, with ours": _halved(
            [row for row in rows if row["outcome"] == "reached"], tests
        ),
        **_commands(out, setting, rows, tests),
        "periods, ours with costmaps and plans of its own": f"{owned[:, 1].sum():,}",
        "the same command, on its own": _drawn(owned, _share, ".3f") if own else "–",
    }


def _difference(table: FloatArray) -> float:
    return float(table[:, 1].mean() - table[:, 0].mean())


def _share(table: FloatArray) -> float:
    return float(table[:, 0].sum() / max(table[:, 1].sum(), 1))


def _by_test(rows: Iterable[Row], tests: Sequence[str], value: Callable[[Row], float]) -> FloatArray:
    """The mean of a value by test: (n, 2), of the real one and of ours; NaN where there is none."""
    found: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        found.setdefault((row["test"], row["who"]), []).append(value(row))
    return np.array([[np.mean(found.get((test, who), [np.nan])) for who in ("real", "ours")] for test in tests])


def _commands(out: Path, setting: Setting, rows: Sequence[Row], tests: Sequence[str]) -> dict[str, str]:
    """How many commands and plans were the same."""
    robot = setting.driver()
    equal, near, planned = (np.zeros((len(tests), 2)) for _ in range(3))
    for row in rows:
        if row["who"] != "real":
            continue
        file, i = setting.recording(out, row["scenario"]), tests.index(row["test"])
        for one in answers(file, robot, setting.speed):
            equal[i] += one.same, 1
            near[i] += one.near, 1
        for theirs, ours, cell in plans(file, robot):
            planned[i] += apart(theirs, ours) <= cell, 1
    return {
        "periods, ours with the real one's costmap and plan": f"{equal[:, 1].sum():,.0f}",
        "the same command, given these": _drawn(equal, _share, ".4f"),
        "within a sample of each other": _drawn(near, _share, ".4f"),
        "global plans": f"{planned[:, 1].sum():,.0f}",
        "within a cell of each other": _drawn(planned, _share, ".4f"),
    }


def _drawn(table: FloatArray, value: Callable[[FloatArray], float], form: str) -> str:
    """A value of a table of tests with its interval, by drawing tests."""
    rng = np.random.default_rng(0)
    drawn = [value(table[rng.integers(0, len(table), len(table))]) for _ in range(DRAWS)]
    low, high = np.nanpercentile(drawn, (2.5, 97.5))
    return f"{value(table):{form}} [{low:{form}}, {high:{form}}]"


def _ranked(table: FloatArray) -> str:
    found = spearman(table[:, 0], table[:, 1])
    return f"{found.r:.2f} [{found.low:.2f}, {found.high:.2f}]" if found.r is not None and np.isfinite(found.r) else "–"


def _halved(rows: Sequence[Row], tests: Sequence[str]) -> str:
    """The rank correlation that chance leaves: of the real one's times in half of the repetitions with those in the other half; and with ours there."""
    names = list(dict.fromkeys(row["scenario"].rpartition("-r")[2] for row in rows))
    if len(names) < 4:
        return "–"
    times = np.full((2, len(tests), len(names)), np.nan)
    for row in rows:
        repetition = names.index(row["scenario"].rpartition("-r")[2])
        times[int(row["who"] == "ours"), tests.index(row["test"]), repetition] = row["CT"]
    rng, found = np.random.default_rng(0), []
    for _ in range(DRAWS):
        first, second = np.array_split(rng.permutation(len(names)), 2)
        real, again, ours = (
            np.ma.masked_invalid(half).mean(axis=1) for half in (times[0][:, first], *times[:, :, second])
        )
        known = ~np.ma.getmaskarray(real + again + ours)
        found.append([spearman(real[known].data, other[known].data).r for other in (again, ours)])
    return ", ".join(f"{r:.2f}" for r in np.mean(np.array(found, float), axis=0))


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("built", type=Path, help="where build.sh has built it")
    parser.add_argument("out", type=Path, help="where trials and recordings are kept")
    parser.add_argument("--suite", choices=tuple(SELECTED), default="barn-2022")
    parser.add_argument("--robot", default="jackal")
    parser.add_argument("--worlds", type=int, nargs="+", help="of BARN; default: the 50 official ones")
    parser.add_argument("--repetitions", type=int, default=1)
    parser.add_argument("--scoring", choices=tuple(FRESH_MEMORY), default="cells", help="see FRESH_MEMORY in real.py")
    parser.add_argument("--amcl", action="store_true", help="hospital: the real AMCL localises it")
    parser.add_argument("--fastest", type=float, default=2.0, help="times real time that /clock goes at most")
    parser.add_argument("--table", action="store_true", help="drive nothing")
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    if not (asked.built / "install_isolated" / "lib" / "move_base" / "move_base").is_file():
        sys.exit(f"{asked.built}: no move_base is built there; benchmarks/real_move_base/build.sh does it")
    asked.out.mkdir(parents=True, exist_ok=True)
    trials = asked.out / "trials.jsonl"
    rows = [json.loads(line) for line in trials.read_text().splitlines()] if trials.exists() else []
    done = {(setting_of(row), row["scenario"]) for row in rows}
    setting = Setting(asked.suite, asked.robot, asked.scoring, asked.amcl)
    pace = {"deadline": DEADLINE, "fastest": asked.fastest, "patience": 30.0}
    worlds = (60,) if asked.smoke else tuple(asked.worlds or ())
    for repetition in () if asked.table else range(1, asked.repetitions + 1):
        chosen = replace(SELECTED[asked.suite], worlds=worlds, repetitions=repetition)
        for scenario in load_suite(asked.suite).build(load_robot(asked.robot), chosen):
            if not scenario.name.endswith(f"-r{repetition}") or (setting, scenario.name) in done:
                continue
            began = time.monotonic()
            try:
                found = drive(asked.built.resolve(), asked.out.resolve(), setting, scenario.name, repetition, pace)
            except (ClearwayError, WireError) as error:
                print(f"{scenario.name}: {error}; left out, and driven the next time", file=sys.stderr, flush=True)
                continue
            with trials.open("a") as file:
                file.writelines(json.dumps(row) + "\n" for row in found)
            rows += found
            said = ", ".join(f"{row['who']} {row['outcome']} {row['CT'] or 0:.1f} s" for row in found)
            print(f"{scenario.name}: {said} ({time.monotonic() - began:.0f} s)", file=sys.stderr, flush=True)
    tabled(rows, asked.out)


if __name__ == "__main__":
    main()
