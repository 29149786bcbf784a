"""The pilot gives the navigator what it needs and no more, keyed random streams, and a limit to its thinking."""

from __future__ import annotations

import bdb
import math
import time
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from clearway.campaigns.pilot import TookTooLong, compose, guarded
from clearway.contract import Budget, Command, Diagnostics, Goal, Observation, Obstacles, Scan, Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.indicators import score_row
from clearway.perception import make_localiser, make_tracker
from clearway.robots import Robot, load_robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome
from clearway.trials.differences import first_difference
from clearway.world import simulate
from perceived import exact

ROBOT = load_robot("tiago")
GRID = OccupancyGrid(np.zeros((2, 2), np.int8), 0.05, (0.0, 0.0))
GOAL = Goal(np.zeros(3), 0.1, 0.1)
SCAN = Scan(np.ones(3), 0.0, 0.1, 0.0, 5.0, np.zeros(3))
DISCS = exact((0.0, 0.0), radius=1.0, moving=False)


class Recorder:
    """Keeps what it was told."""

    needs: frozenset[Any] = frozenset()

    def reset(self, task: Task, robot: Any, rng: np.random.Generator) -> None:
        self.task, self.drawn = task, rng.uniform(size=3)

    def step(self, observation: Observation) -> Command:
        self.seen = observation
        return Command(0.1, 0.2)


class Here:
    """A localiser that draws `draws` numbers and knows where it is."""

    def __init__(self, draws: int = 0) -> None:
        self.draws = draws

    def reset(self, task: Task, robot: Any, rng: np.random.Generator) -> None:
        self.task, self.drawn = task, rng.uniform(size=self.draws)

    def update(self, sensing: Sensing) -> np.ndarray:
        return np.array([1.0, 2.0, 3.0])


class Follows:
    """A tracker that draws, and sees the same thing always."""

    def reset(self, task: Task, robot: Any, rng: np.random.Generator) -> None:
        self.task, self.drawn = task, rng.uniform(size=3)

    def update(self, sensing: Sensing, pose: np.ndarray) -> Obstacles:
        self.pose = pose
        return DISCS


def needing(*needs: str) -> Recorder:
    recorder = Recorder()
    recorder.needs = frozenset(needs)
    return recorder


def sensing(t: float = 0.0, scan: Scan | None = SCAN, obstacles: Obstacles | None = DISCS) -> Sensing:
    return Sensing(t, np.full(3, 0.5), np.array([0.1, 0.2]), scan, obstacles, GOAL, np.full(3, 9.0))


def start(pilot: Any, seed: int = 1) -> None:
    pilot.reset(Task(0.1, 0.5, np.zeros(3), map=GRID), ROBOT, np.random.default_rng(seed))


def test_it_gives_only_what_is_needed() -> None:
    nothing, everything = needing(), needing("map", "scan", "obstacles")
    for navigator in (nothing, everything):
        localiser, tracker = Here(), Follows()
        pilot = compose(navigator, localiser, tracker=tracker)
        start(pilot)
        decision = pilot.decide(sensing())
        assert localiser.task.map is GRID  # a localiser may always have it
        assert decision.command == Command(0.1, 0.2)
        assert decision.estimate.tolist() == navigator.seen.pose.tolist() == [1.0, 2.0, 3.0]
        assert navigator.seen.velocity.tolist() == [0.1, 0.2]
        assert navigator.seen.odom_pose.tolist() == [0.5] * 3
    assert (nothing.task.map, nothing.seen.scan, nothing.seen.obstacles) == (None, None, None)
    assert everything.task.map is not None
    assert everything.task.map.data is GRID.data
    assert np.shares_memory(everything.seen.scan.ranges, SCAN.ranges)
    assert np.shares_memory(everything.seen.obstacles.position, DISCS.position)
    assert tracker.task.map is GRID  # a tracker may always have it
    assert tracker.pose.tolist() == [1.0, 2.0, 3.0]


def test_a_tracker_is_not_asked_for_nothing() -> None:
    class Breaks(Follows):
        def update(self, sensing: Sensing, pose: np.ndarray) -> Obstacles:
            raise AssertionError

    pilot = compose(needing("scan"), Here(), tracker=Breaks())
    start(pilot)
    assert pilot.decide(sensing()).command == Command(0.1, 0.2)


def test_a_navigator_that_needs_obstacles_gets_them_from_the_lidar_where_there_is_no_camera() -> None:
    navigator = needing("obstacles")
    pilot = compose(navigator, Here(), tracker=make_tracker("kalman", ROBOT))
    start(pilot)
    pilot.decide(sensing(obstacles=None))
    seen = navigator.seen.obstacles
    assert len(seen) > 0
    assert np.isfinite(seen.velocity).all()
    gap = np.hypot(*(seen.position - [1.0, 2.0]).T) - seen.radius  # the scan's three returns lie 1 m away
    assert gap.min() == pytest.approx(1.0, abs=0.1)


def test_what_is_needed_and_not_there_is_an_error() -> None:
    with pytest.raises(ClearwayError, match="needs obstacles"):
        compose(needing("obstacles"), Here())
    pilot = compose(needing("scan"), Here())
    start(pilot)
    with pytest.raises(ClearwayError, match="needs scans"):
        pilot.decide(sensing(scan=None))


def test_random_streams_are_keyed_by_name() -> None:
    """The localiser's draws don't move the navigator's, and the two streams differ."""
    draws = []
    for n in (1, 7):
        navigator, localiser, tracker = needing("obstacles"), Here(n), Follows()
        start(compose(navigator, localiser, tracker=tracker))
        draws.append(navigator.drawn.tolist())
        assert len({navigator.drawn[0], localiser.drawn[0], tracker.drawn[0]}) == 3
    assert draws[0] == draws[1]
    other = needing()
    start(compose(other, Here()), seed=2)
    assert other.drawn.tolist() != draws[0]


def test_diagnostics_are_asked_for_every_half_second() -> None:
    class Shows(Recorder):
        def diagnostics(self) -> Diagnostics:
            return Diagnostics(status="on")

    pilot = compose(Shows(), Here())
    for _ in range(2):  # a new trial begins anew
        start(pilot)
        shown = [i for i in range(21) if pilot.decide(sensing(0.1 * i)).diagnostics is not None]
        assert shown == [0, 5, 10, 15, 20]


def test_diagnostics_are_copied_to_the_millimetre_and_checked() -> None:
    class Shows(Recorder):
        plan = np.array([[0.12345, 1.0], [2.0, 3.0]])

        def diagnostics(self) -> Diagnostics:
            return Diagnostics(polylines={"plan": self.plan}, tube=self.tube)

    navigator = Shows()
    navigator.tube = None
    pilot = compose(navigator, Here())
    start(pilot)
    shown = pilot.decide(sensing()).diagnostics
    assert shown is not None
    navigator.plan[:] = 9.0  # it goes on using its array
    assert shown.polylines["plan"].tolist() == [[0.123, 1.0], [2.0, 3.0]]
    navigator.tube = np.zeros((4, 2))
    with pytest.raises(ValueError, match=r"shape \(4, 2\) where \(n, 3\)"):
        pilot.decide(sensing(1.0))


def test_a_decision_that_hangs_is_broken_off() -> None:
    class Hangs(Recorder):
        def step(self, observation: Observation) -> Command:
            try:
                while True:
                    time.sleep(0.01)
            except Exception:  # a navigator that swallows everything can't swallow this
                return Command(0.0, 0.0)

    pilot = compose(Hangs(), Here(), decision_limit=0.1)
    start(pilot)
    began = time.perf_counter()
    with pytest.raises(TookTooLong, match=r"took longer than 0.1 s"):
        pilot.decide(sensing())
    assert time.perf_counter() - began < 2.0
    time.sleep(0.15)  # no alarm is left behind


@pytest.mark.parametrize("quits", ["import bdb; raise bdb.BdbQuit", "raise SystemExit(1)"])
def test_leaving_the_debugger_is_no_failure_of_the_navigator(quits: str) -> None:
    """`q` in a debugger that stopped within the navigator; newer versions of Python leave by sys.exit."""

    class Debugged(Recorder):
        def step(self, observation: Observation) -> Command:
            exec(quits, {"__name__": "pdb"})
            raise AssertionError

    pilot = compose(Debugged(), Here(), decision_limit=None)
    start(pilot)
    with pytest.raises(KeyboardInterrupt):
        pilot.decide(sensing())
    watched = compose(Debugged(), Here(), decision_limit=60.0)
    start(watched)
    with pytest.raises((bdb.BdbQuit, RuntimeError)):
        watched.decide(sensing())


def test_compiling_does_not_count_as_hanging() -> None:
    class Compiles(Recorder):
        def step(self, observation: Observation) -> Command:
            @numba.njit
            def slow(x: float) -> float:
                for i in range(3):
                    x += np.linalg.norm(np.full(i + 1, x))
                return x

            return Command(float(slow(0.0)), 0.0)

    pilot = compose(Compiles(), Here(), decision_limit=0.05)
    start(pilot)
    began = time.perf_counter()
    assert pilot.decide(sensing()).command.v == 0.0
    assert time.perf_counter() - began > 0.05  # or it proves nothing


class Answered(NamedTuple):
    where: np.ndarray
    sum: float


@numba.njit
def long(n: int, where: np.ndarray) -> Answered:
    total = 0.0
    for i in range(n):
        total = math.sqrt(total + i)
    return Answered(where, total)


def test_an_alarm_never_rings_while_a_kernel_makes_objects_of_its_answer() -> None:
    """Numba calls Python there without looking at errors: one that came then crashed the process."""
    long(1, np.zeros(2))
    with pytest.raises(TookTooLong):
        guarded(0.05, "for a decision", long, 50_000_000, np.zeros(2))
    assert guarded(60.0, "for a decision", long, 1, np.zeros(2)).sum == 0.0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_alarm_that_python_drops_is_rung_again() -> None:
    class Lingers:
        def __del__(self) -> None:
            time.sleep(0.3)  # what is raised meanwhile is dropped, as in a callback of a weak reference

    class Drops(Recorder):
        def step(self, observation: Observation) -> Command:
            Lingers()
            time.sleep(10.0)
            return Command(0.0, 0.0)

    pilot = compose(Drops(), Here(), decision_limit=0.1)
    start(pilot)
    with pytest.raises(TookTooLong):
        pilot.decide(sensing())


def arrays(thing: Any, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Every array in it, by the name of its field."""
    if isinstance(thing, np.ndarray):
        yield name, thing
    elif is_dataclass(thing):
        for field in fields(thing):
            yield from arrays(getattr(thing, field.name), f"{name}.{field.name}")


def refused(array: np.ndarray) -> bool:
    """Whether an attempt to write into it fails."""
    try:
        array[...] = array + 1
    except ValueError:
        return True
    return False


class Scribbler:
    """Drives straight on, tries to write into everything that it is given, and tells what it could write into."""

    needs: frozenset[Any] = frozenset({"map", "scan", "obstacles"})

    def __init__(self) -> None:
        self.tried, self.written = set[str](), set[str]()

    def reset(self, task: Task, robot: Any, rng: np.random.Generator) -> None:
        self._try(task)
        for table in (robot.navigators, robot.localisation, robot.mapping, robot.conditions, robot.sources):
            table.clear()

    def step(self, observation: Observation) -> Command:
        self._try(observation)
        return Command(0.1, 0.0)

    def _try(self, thing: Any) -> None:
        found = dict(arrays(thing, type(thing).__name__))
        self.tried |= set(found)
        self.written |= {name for name, array in found.items() if len(array) and not refused(array)}


def test_nothing_that_a_navigator_is_given_can_be_written() -> None:
    robot = load_robot("tiago")
    suite = load_suite("hospital").build(robot, Selection(batches=("MO",), speeds=(0.2,), repetitions=1), 0)
    grid = load_floor_plan("hall").map
    assert grid is not None
    cells, tables = grid.data.copy(), robot.model_dump()
    for localisation in ("truth", "amcl"):
        navigator = Scribbler()
        pilot = compose(navigator, make_localiser(localisation, robot), tracker=make_tracker("kalman", robot))
        legs = (suite[0].legs[0].model_copy(update={"time_limit": 1.0}), *suite[0].legs[1:])
        short = suite[0].model_copy(update={"legs": legs})
        trial = simulate(short, robot, pilot, navigator="scribbler", localisation=localisation, map=grid)
        assert trial.outcome is Outcome.TIMEOUT
        assert navigator.tried == {
            "Task.start", "Task.map.data", "Observation.pose", "Observation.velocity", "Observation.odom_pose",
            "Observation.goal.pose", "Observation.scan.ranges", "Observation.scan.mount",
            *(f"Observation.obstacles.{f.name}" for f in fields(Obstacles)),
        }  # fmt: skip
        assert not navigator.written
    assert (grid.data == cells).all()
    assert robot.model_dump() == tables
    with pytest.raises(ValueError, match="WRITEABLE"):
        grid.data.flags.writeable = True


class Honest(Recorder):
    """Turns on the spot, faster and faster."""

    needs = frozenset({"map"})

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.count = 0

    def step(self, observation: Observation) -> Command:
        self.count += 1
        return Command(0.0, 0.02 * self.count)


class Forger(Honest):
    """The same, but it changes whatever it is told, frozen or not."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        super().reset(task, robot, rng)
        assert task.map is not None
        forged = [(task.latency, f.name, 0.0) for f in fields(task.latency)]
        forged += [(task.budget, "iterations", None), (task.map, "data", np.zeros((1, 1), np.int8))]
        forged += [(robot.drive, "v_max", 9.0), (robot.latency, "command", 0.0)]
        forged += [(task, f.name, None) for f in fields(task)]
        for thing, name, value in forged:
            object.__setattr__(thing, name, value)
        for table in (robot.navigators, robot.localisation):
            table.clear()


def test_what_a_navigator_is_told_is_its_own() -> None:
    """Its latency, its budget, the map: who forges them meets the same world as who does not, and so does whoever comes next."""
    robot = load_robot("tiago")
    leg = {"name": "forth", "goal": (2.0, 0.0, 0.0), "time_limit": 2.0}
    values = {"name": "x", "floor_plan": "hall", "start": (-2.0, 0.0, 0.0), "speed": 0.5, "legs": [leg]}
    scenario = Scenario.model_validate(values)
    grid = load_floor_plan("hall").map
    assert grid is not None
    shared, budget = grid.read_only(), Budget(iterations=7)
    cells, trials = shared.data.copy(), []
    for navigator in (Honest(), Forger(), Honest()):
        pilot = compose(navigator, make_localiser("amcl", robot))
        trials.append(
            simulate(
                scenario,
                robot,
                pilot,
                navigator="own",
                localisation="amcl",
                map=shared,
                budget=budget,
                privileged=False,
            )
        )
    assert robot.latency.command > 0.0
    for trial in trials[1:]:
        assert first_difference(trials[0], trial) is None
    np.testing.assert_array_equal(shared.data, cells)
    assert budget.iterations == 7


def test_the_goal_that_it_is_judged_by_is_not_the_navigators() -> None:
    """Who gets it wrong is told where; who gets round it moves a goal that nobody judges by."""

    class Careless(Recorder):
        def step(self, observation: Observation) -> Command:
            away = observation.goal.pose
            away -= observation.pose
            return Command(0.0, 0.0, arrived=True)

    class Cheat(Recorder):
        def step(self, observation: Observation) -> Command:
            object.__setattr__(observation.goal, "pose", observation.pose.copy())
            return Command(0.0, 0.0, arrived=True)

    robot = load_robot("hosbot")
    scenario = load_suite("hospital").build(robot, Selection(batches=("NO",), repetitions=1), 0)[0]
    for navigator in (Careless(), Cheat()):
        pilot = compose(navigator, make_localiser("truth", robot))
        trial = simulate(scenario, robot, pilot, navigator="own", localisation="truth", map=None)
        row = score_row(trial)
        assert not row["success"]
        if isinstance(navigator, Careless):
            assert trial.outcome is Outcome.NAVIGATOR_FAILED
            assert "copy first" in trial.reason
            assert "test_pilot.py:" in trial.reason
        else:
            assert row["DE"] > 2.0
