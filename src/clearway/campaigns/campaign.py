"""Runs a campaign: checks everything first, then many trials on many cores, each kept as soon as it is finished."""

from __future__ import annotations

import datetime
import hashlib
import json
import os
import platform
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, Protocol, TypeVar

from clearway.campaigns.drawing import draw_ahead
from clearway.campaigns.plan import CampaignPlan, TrialSpec, granted_map
from clearway.campaigns.worker import Done, run_and_keep
from clearway.errors import ClearwayError
from clearway.indicators import row_schema
from clearway.navigators.registry import make_navigator
from clearway.perception import make_localiser, make_tracker
from clearway.robots import load_robot
from clearway.trials import Outcome
from clearway.trials.store import Results, TrialStore, refuse_results
from clearway.trials.store_results import how_to_go_on, read_campaign

Finished = TypeVar("Finished")


class ProgressCallback(Protocol):
    """Told how far a campaign is: trials done, of how many, and a note for people."""

    def __call__(self, done: int, total: int, note: str = "") -> None: ...


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C stopped a campaign; the message says how to go on. `path`, `done`, `total` say where it stands."""

    def __init__(self, path: Path, done: int, total: int) -> None:
        self.path, self.done, self.total = path, done, total
        super().__init__(f"stopped after {done} of {total} trials; go on with `{how_to_go_on(path)}`")


def run_campaign(
    plan: CampaignPlan,
    out: Path,
    workers: int | None = None,
    resume: bool = False,
    progress: ProgressCallback | None = None,
) -> Results:
    """Run every trial of `plan` and store the results in `out`.

    The results are the same bytes whatever the number of workers, and whether or not the campaign was interrupted;
    wall-clock figures are kept apart in timing.parquet.

    Args:
        plan: what to run. out: the results directory, made if it isn't there. workers: processes; None: one a core.
        resume: go on with a campaign in `out` that was interrupted. progress: told how far it is.

    Raises:
        ClearwayError: something in the plan is wrong (before anything runs), `out` can't be used, or the disk is full.
        CampaignInterrupted: Ctrl-C; `out` can be resumed.
    """
    tell = progress or _silent
    if workers is not None and workers < 1:
        raise ClearwayError(f"{workers} is wrong: at least 1", field="workers")
    if not resume:
        refuse_results(Path(out))
    workers = workers or os.cpu_count() or 1
    with workers_ended():
        draw_ahead(plan, workers, Path(out), tell, finished_in_turn)
    specs = plan.specs()
    check_plan(plan, specs)
    asked = _asked(plan, specs)
    run = machine() | {"started": now()}
    with TrialStore(Path(out), asked, len(specs), row_schema(), run=run, resume=resume) as store, stoppable(store):
        while missing := store.missing():
            _run_all(plan, [specs[i] for i in missing], store, workers, tell)
        return store.finish({"finished": now()})


@contextmanager
def workers_ended() -> Iterator[None]:
    """Ends the worker processes when something goes wrong in it."""
    try:
        yield
    except BaseException:
        _stop_workers()
        raise


@contextmanager
def stoppable(store: TrialStore) -> Iterator[None]:
    """Ends the workers when something goes wrong in it, and makes a `CampaignInterrupted` of Ctrl-C."""
    with _CtrlC() as ctrl_c:
        try:
            yield
        except BaseException as error:
            _stop_workers()
            if not (ctrl_c.came or isinstance(error, KeyboardInterrupt)):
                raise
            done = store.total - len(store.missing())
            raise CampaignInterrupted(store.path, done, store.total) from None


class _CtrlC:
    """Notices Ctrl-C, which reaches the workers too: what comes of that in the parent may be any exception."""

    came = False

    def __enter__(self) -> _CtrlC:
        self._main = threading.current_thread() is threading.main_thread()
        if self._main:
            self._before = signal.signal(signal.SIGINT, self._ring)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._main:
            signal.signal(signal.SIGINT, self._before)

    def _ring(self, signum: int, frame: FrameType | None) -> None:
        if not self.came:  # a second one must not break the clearing up
            self.came = True
            raise KeyboardInterrupt


def resume_campaign(out: Path, workers: int | None = None, progress: ProgressCallback | None = None) -> Results:
    """Complete the campaign in `out` by the plan that its campaign.json holds.

    Raises:
        ClearwayError: as for `run_campaign`; or `out` holds no campaign.
    """
    plan = planned(Path(out))
    return run_campaign(plan, Path(out), workers, resume=True, progress=progress)


def planned(out: Path) -> CampaignPlan:
    """The plan of the campaign in `out`, finished or not.

    Raises:
        ClearwayError: `out` holds none.
    """
    campaign = read_campaign(Path(out))
    if not isinstance(campaign.get("plan"), dict):
        raise ClearwayError("its results were not made by a campaign; there is nothing to run", file=out)
    return CampaignPlan.from_json(campaign["plan"])


def check_plan(plan: CampaignPlan, specs: Sequence[TrialSpec]) -> None:
    """Look at everything that can be wrong before the first trial runs.

    Raises:
        ClearwayError: the first thing that is wrong.
    """
    from clearway.scenarios.check import check_scenario

    seen: set[tuple[str, str, str, bool]] = set()
    checked: set[tuple[str, str]] = set()
    for spec in specs:
        scenario, robot = spec.scenario, load_robot(spec.robot)
        content = (spec.robot, scenario.model_dump_json(exclude={"name", "seed", "labels"}))  # repetitions are alike
        if content not in checked:
            checked.add(content)
            for problem in check_scenario(scenario, robot):
                file = spec.suite if spec.suite.endswith(".toml") else problem.file
                raise ClearwayError(problem.problem, file=file, field=f"{scenario.name}: {problem.field}")
        has_map = granted_map(plan.map, scenario) is not None
        combination = (spec.robot, spec.navigator, spec.localisation, has_map)
        if combination in seen:
            continue
        seen.add(combination)
        make_localiser(spec.localisation, robot)
        navigator = make_navigator(spec.navigator, **plan.options.get(spec.navigator, {}))
        needs: frozenset[str] = getattr(navigator, "needs", frozenset())
        who = f"navigator {spec.navigator!r}"
        if "obstacles" in needs:
            make_tracker(spec.tracking, robot)
        if "scan" in needs and robot.lidar is None:
            raise ClearwayError(f"{who} needs scans, and the robot {spec.robot!r} has no lidar")
        if spec.localisation == "amcl" and (robot.lidar is None or not has_map):
            lacks = f"the robot {spec.robot!r} has no lidar" if robot.lidar is None else f"{scenario.plan!r} has no map"
            raise ClearwayError(f"localisation 'amcl' cannot work: {lacks}; use 'odometry' or 'truth'")


def _run_all(
    plan: CampaignPlan, specs: Sequence[TrialSpec], store: TrialStore, workers: int, tell: ProgressCallback
) -> None:
    done, failed = store.total - len(specs), 0
    tell(done, store.total, _first_note())
    with warnings.catch_warnings(), closing(_finished(plan, specs, store, min(workers, len(specs)))) as results:
        warnings.filterwarnings("ignore", "[0-9]+ tasks which were still being processed")  # on Ctrl-C: we know
        for result in results:
            done += 1
            failed += result.outcome is Outcome.NAVIGATOR_FAILED
            tell(done, store.total, f"{failed} failed: {_one_line(result.reason)}" if failed else "")


def _finished(plan: CampaignPlan, specs: Sequence[TrialSpec], store: TrialStore, workers: int) -> Generator[Done]:
    """Every trial's outcome, in the order in which they end."""
    calls = [(run_and_keep, (plan, spec, store.partial, store.key)) for spec in specs]
    return finished_in_turn(calls, workers, store.path)


def finished_in_turn(
    calls: Sequence[tuple[Callable[..., Finished], tuple[Any, ...]]], workers: int, out: Path
) -> Generator[Finished]:
    """What each call returns, in the order in which they end.

    Args:
        calls: function and arguments; in another process it is also given `parent`, the one to end with.
        workers: processes; 1: this one. out: named if a worker dies.

    Raises:
        ClearwayError: a worker process died.
    """
    if workers == 1:
        for function, arguments in calls:
            yield function(*arguments)
        return
    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    parallel = Parallel(n_jobs=workers, backend="loky", batch_size=1, return_as="generator_unordered", max_nbytes=None)
    try:
        yield from parallel(delayed(function)(*arguments, os.getpid()) for function, arguments in calls)
    except BrokenProcessPool as error:
        raise ClearwayError(
            "a worker process died: a navigator crashed it, or memory ran out; what is finished is kept, --resume goes "
            "on from there, with --workers 1 up to the trial that does it",
            file=out,
        ) from error


def _stop_workers() -> None:
    """End the worker processes now, wherever they are: what they have finished is on the disk."""
    if "joblib.externals.loky.reusable_executor" in sys.modules:
        from joblib.externals.loky import reusable_executor

        if reusable_executor._executor is not None:
            reusable_executor._executor.shutdown(wait=True, kill_workers=True)


def _asked(plan: CampaignPlan, specs: Sequence[TrialSpec]) -> dict[str, Any]:
    """What campaign.json holds and resuming compares: the plan, and everything that decides the bits."""
    robots = {name: json.loads(load_robot(name).model_dump_json()) for name in plan.robots}  # JSON knows no infinity
    seen = hashlib.sha256()
    for spec in specs:
        seen.update(spec.id.encode("utf-8", "backslashreplace"))
        seen.update(spec.scenario.model_dump_json().encode())
    grid = None if plan.map in (None, "true") else granted_map(plan.map, specs[0].scenario)
    if grid is not None:
        seen.update(grid.data.tobytes())
    return asked_of(robots) | {"plan": json.loads(json.dumps(plan.to_json())), "scenarios": seen.hexdigest()}


def asked_of(robots: Mapping[str, Any]) -> dict[str, Any]:
    """What every campaign.json holds: versions, and the robots in full."""
    return {
        "clearway": _version("clearway"),
        "versions": {"python": platform.python_version()} | {n: _version(n) for n in ("numba", "numpy", "scipy")},
        "robots": dict(robots),
    }


def machine() -> dict[str, Any]:
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def _first_note() -> str:
    """Says so when the kernels have yet to be compiled."""
    from clearway.geometry import compiled

    package = Path(compiled.__file__).parent.parent
    return "" if any(package.glob("world/__pycache__/*.nbi")) else "compiling once, about a minute"


def _one_line(text: str) -> str:
    return text.strip().splitlines()[-1][:120] if text.strip() else ""


def _silent(done: int, total: int, note: str = "") -> None:
    pass
