"""One trial never blocks a campaign: whatever a navigator says, raises or does to its process, the others run as ever.

One of each kind; `benchmarks/faults.py --only navigators --only kills` has them all, a crash or a hang for each way to it.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import misbehaving_navigators as misbehaving
import numpy as np
import pytest
from own_plans import contents, family, left_over, wait_for
from pool_calls import die, meet, stood_in

from clearway.campaigns import CampaignPlan, run_campaign
from clearway.campaigns import pool as pools
from clearway.campaigns.heartbeat import COMPILING, Heartbeat, Pulse
from clearway.campaigns.pilot import guarded
from clearway.campaigns.plain import plain_command, plain_diagnostics
from clearway.campaigns.pool import pool
from clearway.campaigns.surroundings import limits, restored, round_as_ever
from clearway.contract import Command, Diagnostics, Status
from clearway.errors import ClearwayError
from clearway.foreign import LONGEST, said, traced
from clearway.geometry.grid import OccupancyGrid
from clearway.scenarios.suites import Selection

pytestmark = pytest.mark.slow

FILE = Path(misbehaving.__file__)


def plan(*navigators: str, decision_limit: float = 0.5) -> CampaignPlan:
    return CampaignPlan(
        suites=("hospital",),
        robots=("tiago",),
        navigators=tuple(f"{FILE}:{name}" for name in navigators),
        selection=Selection(scenarios=("NO-v0.6-r1",)),
        localisation="truth",
        decision_limit=decision_limit,
    )


FATES = {
    "SegmentationFault": "was ended by SIGSEGV",
    "LoopsDeaf": "took longer than 0.5 s and could not be broken off",
    "ArrivedAtOnce": "",
    "GaveUpSurrogate": "no text that UTF-8 can hold",
    "RaisesOwn": "Own: mine, which is no Exception",
    "RaisesKeyboardInterrupt": "raised KeyboardInterrupt",
    "RaisesClearwayInReset": "my own",
    "RaisesSurrogate": r"ValueError: lost \udcff",
    "AnswersLazily": "took longer than 0.5 s for a decision",
    "PrintsBelow": "",
}
"""What is said of the trial of each, in which order they are run."""


def test_the_campaign_goes_on(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    alone = run_campaign(plan("Drives"), tmp_path / "alone", 1)
    results = run_campaign(plan(*FATES, "Drives"), tmp_path / "out", 2)
    rows = results.trials.to_pylist()
    for row, (name, says) in zip(rows, FATES.items(), strict=False):
        assert says in row["reason"], name
        assert (row["outcome"] == "navigator_failed") == bool(says), name
    crashed, hung = results.trial(0).events[0].detail, results.trial(1).events[0].detail
    assert "misbehaving_navigators.py" in crashed
    assert "in _deaf" in hung
    assert results.trial(len(FATES)).pose.tobytes() == alone.trial(0).pose.tobytes()
    differ = {"trial", "id"}
    last, only = rows[-1], alone.trials.to_pylist()[0]
    assert {k: v for k, v in last.items() if k not in differ} == {k: v for k, v in only.items() if k not in differ}
    assert capfd.readouterr().out == ""


def test_crashes_have_the_same_bytes_whatever_the_workers(tmp_path: Path) -> None:
    for workers in (1, 2):
        run_campaign(plan("ExitsQuietly", "Drives"), tmp_path / str(workers), workers)
    assert contents(tmp_path / "1") == contents(tmp_path / "2")
    assert b"the worker process ended with exit code 0" in contents(tmp_path / "1")["trials.csv"]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("InitExits", "SystemExit: 0"),
        ("ParametersOwn", "cannot read its parameters: Own"),
        ("ParametersCrash", r"was ended by SIGSEGV, File .*misbehaving_navigators.py"),
        ("NeedsText", "needs 'scan'; `needs` is a frozenset of some of map, obstacles, scan"),
        ("NeedsExits", "cannot say what it needs: SystemExit"),
    ],
)
def test_what_can_not_be_made_is_one_sentence_before_anything_runs(tmp_path: Path, name: str, says: str) -> None:
    with pytest.raises(ClearwayError, match=says) as told:
        run_campaign(plan(name, "Drives"), tmp_path / "out", 1)
    assert "\n" not in str(told.value)
    assert not (tmp_path / "out").exists()


COMMANDS: list[Callable[[], Any]] = [
    lambda: None,
    lambda: Command,
    lambda: object.__new__(Command),
    lambda: Command("fast", 0.0),  # type: ignore[arg-type]
    lambda: Command(np.zeros(2), 0.0),  # type: ignore[arg-type]
    lambda: Command(True, 0.0),
    lambda: Command(1j, 0.0),  # type: ignore[arg-type]
    lambda: Command(math.nan, 0.0),
    lambda: Command(0.0, -math.inf),
    lambda: Command(10**400, 0.0),
    lambda: Command(0.0, 0.0, arrived="yes"),  # type: ignore[arg-type]
    lambda: Command(0.0, 0.0, gave_up=3),  # type: ignore[arg-type]
    lambda: Command(0.0, 0.0, gave_up="\ud800"),
    lambda: Command(0.0, 0.0, status=None),  # type: ignore[arg-type]
    lambda: Command(0.0, 0.0, status="x" * (LONGEST + 1)),
    lambda: Command(0.0, 0.0, cut=np.ones(2, np.bool_)),  # type: ignore[arg-type]
    lambda: Command(0.0, 0.0, violated="abc"),  # type: ignore[arg-type]
    lambda: Command(0.0, 0.0, violated=itertools.repeat("x")),  # type: ignore[arg-type]
]


@pytest.mark.parametrize("answer", COMMANDS)
def test_a_command_that_is_none(answer: Callable[[], Any]) -> None:
    with pytest.raises((TypeError, ValueError, AttributeError, OverflowError)) as told:
        plain_command(answer())
    assert len(str(told.value)) < 2 * LONGEST


def test_a_command_comes_through_in_plain_types() -> None:
    class Own(Command):
        pass

    given = Own(np.float32(0.1), np.int64(1), np.True_, None, Status.TRACKING, np.False_, ["a\x00b"])  # type: ignore[arg-type]
    found = plain_command(given)
    assert found == Command(float(np.float32(0.1)), 1.0, True, None, "tracking", False, (r"a\x00b",))
    words = (found.v, found.omega, found.arrived, found.status, found.cut, found.violated)
    assert [type(x) for x in (found, *words)] == [Command, float, float, bool, str, bool, tuple]
    with pytest.raises(ValueError, match="not finite"):
        plain_command(Command(misbehaving.BadNumber(math.inf), 0.0))
    assert plain_command(Command(0.0, 0.0, gave_up=misbehaving.BadText("x"))).gave_up == "x"


SHOWN: list[Callable[[], Any]] = [
    lambda: None,
    lambda: Diagnostics({"a": np.zeros((3, 5))}),
    lambda: Diagnostics({"a": [[1.0], [1.0, 2.0]]}),  # type: ignore[dict-item]
    lambda: Diagnostics({"a": np.array([["x", "y"]])}),
    lambda: Diagnostics({"a": np.array([[1j, 2]])}),
    lambda: Diagnostics({"\udcff": np.zeros((3, 2))}),
    lambda: Diagnostics([np.zeros((3, 2))]),  # type: ignore[arg-type]
    lambda: Diagnostics({str(i): np.zeros((3, 2)) for i in range(10_001)}),
    lambda: Diagnostics({"a": np.broadcast_to(0.0, (100_000_000, 2))}),
    lambda: Diagnostics(field=OccupancyGrid(np.broadcast_to(np.int8(0), (20_000, 20_000)), 0.05, (0.0, 0.0))),
    lambda: Diagnostics(field=OccupancyGrid(np.zeros((2, 2), np.int8), math.nan, (0.0, 0.0))),
    lambda: Diagnostics(status=None),  # type: ignore[arg-type]
    lambda: Diagnostics(iterations=10**30),
    lambda: Diagnostics(iterations=math.nan),  # type: ignore[arg-type]
]


@pytest.mark.parametrize("shown", SHOWN)
def test_diagnostics_that_are_none(shown: Callable[[], Any]) -> None:
    with pytest.raises((TypeError, ValueError)):
        plain_diagnostics(shown())


def test_diagnostics_have_room_for_a_trial_only() -> None:
    shown = Diagnostics({"a": np.zeros((100, 2))})
    _, size = plain_diagnostics(shown)
    with pytest.raises(ValueError, match="more than 1e"):
        plain_diagnostics(shown, size - 1)


@pytest.mark.parametrize(
    "error", [misbehaving.Mute(), misbehaving.Leaves(), ValueError("\udcff"), ValueError("x" * 10**6)]
)
def test_any_error_can_be_told(error: Exception) -> None:
    for text in (said(error), traced(error)):
        assert text.encode()
        assert len(text) < 30_000
        assert type(error).__name__ in text


def test_a_heartbeat_is_overdue_only_while_something_is_awaited(tmp_path: Path) -> None:
    file = (tmp_path / "beat").open("w+b")
    file.truncate(8)
    heart, pulse = Heartbeat(), Pulse(file.fileno())
    heart.share(file.fileno())
    clock = itertools.count(1.0, 0.5)

    def overdue(looks: int) -> float | None:
        found = [pulse.overdue(next(clock), patience=10.0) for _ in range(looks)]
        return found[-1]

    heart.begin(1.0)
    assert overdue(7) is None  # 3 s: the worker has time to break it off itself
    assert overdue(3) == 1.0
    heart.begin(1.0)
    assert overdue(5) is None
    heart.compile(True)
    assert overdue(100) is None
    heart.compile(False)
    assert overdue(2) is None  # it goes on where it was
    assert overdue(2) == 1.0
    heart.begin(1.0)
    heart.compile(True)
    heart.compile(False)
    heart.compile(True)
    assert overdue(3600) is None
    assert overdue(3) == COMPILING  # by many or by one
    heart.compile(False)
    heart.begin(None)
    assert overdue(100) is None
    heart.end()
    assert overdue(30) is None
    assert overdue(8) == 10.0
    heart.begin(1.0)
    assert pulse.overdue(1e6, 10.0) is None
    assert pulse.overdue(2e6, 10.0) is None  # nobody was there to look: it counts as a second


def test_an_edited_module_is_imported_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    file = tmp_path / "own_module_of_the_guard.py"
    for text in ("1", "22"):
        file.write_text(f"def told() -> int:\n    return {text}\n")
        os.utime(file, (len(text), len(text)))
        sys.modules.pop(file.stem, None)
        told = __import__(file.stem).told
        with pool(1, tmp_path) as work:
            assert list(work.each(told, [()])) == [int(text)]


def test_the_pool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(FILE.parent))
    monkeypatch.setenv("MET", "here")
    with pool(2, tmp_path) as work:
        found = list(work.each(meet, [("exit",), ("a",), ("b",)], fallen=stood_in))
        assert sorted(found) == ["exit: ended with exit code 3", "here a", "here b"]
        monkeypatch.delenv("MET")
        assert list(work.each(meet, [("c",)])) == ["None c"]
        assert list(work.each(meet, [("spoil",)], fallen=stood_in)) == ["spoil: closed or spoilt its connection"]
    with pytest.raises(ClearwayError, match="refused") as told, pool(2, tmp_path) as work:
        list(work.each(meet, [("refuse",)]))
    assert told.value.field == "refuse"


def test_a_call_is_given_up_with_the_second_worker_that_dies_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(FILE.parent))
    once, always = tmp_path / "once", tmp_path / "always"
    with pool(1, tmp_path) as work:
        found = list(work.each(die, [(str(once), 1), (str(always), 9)], fallen=stood_in))
    assert found == [2, f"{always}: was ended by SIGKILL"]
    assert always.stat().st_size == 2


def test_as_many_workers_as_there_can_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, hired = pools._Worker, itertools.count()

    def one() -> Any:
        if next(hired):
            raise OSError(24, "Too many open files")
        return made()

    pools._end_idle()
    monkeypatch.setattr(pools, "_Worker", one)
    with pool(3, tmp_path) as work:
        assert sorted(work.each(abs, [(-n,) for n in range(5)])) == [0, 1, 2, 3, 4]
    pools._end_idle()
    with (
        pytest.raises(ClearwayError, match="no worker process can be started: Too many open files"),
        pool(3, tmp_path) as work,
    ):
        list(work.each(abs, [(-1,)]))


BREAKS = """
import os
from pathlib import Path
from misbehaving_navigators import Drives

if Path(__file__).with_name("broken").exists():
    raise OSError("the device is gone")

class Breaks(Drives):
    def reset(self, *_):
        Path(__file__).with_name("broken").touch()
        os._exit(3)
"""


def test_a_module_that_can_be_imported_no_more_fails_its_own_trial_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(FILE.parent))
    (tmp_path / "breaks.py").write_text(BREAKS)
    asked = dataclasses.replace(plan("Drives"), navigators=(f"{tmp_path / 'breaks.py'}:Breaks", f"{FILE}:Drives"))
    rows = run_campaign(asked, tmp_path / "out", 1).trials.to_pylist()
    assert [row["outcome"] for row in rows] == ["navigator_failed", "reached"]
    assert "the device is gone" in rows[0]["reason"]


def test_what_a_navigator_changes_is_put_back() -> None:
    before, mask = limits(), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    with restored():
        for deed in ("LimitsFiles", "RingsLater", "ChangesFolder", "MasksPermissions"):
            misbehaving.LEFT[deed]()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
    assert limits() == before
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == mask
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)


def test_numbers_are_rounded_as_ever_after_each_call() -> None:
    one, three = np.array(1.0), np.array(3.0)
    usual = float(one / three)
    try:
        misbehaving.rounds_up()
        assert float(one / three) > usual  # or it proves nothing
        guarded(None, "", misbehaving.rounds_up)
        assert float(one / three) == usual
    finally:
        round_as_ever()


STARTS = """
import os, sys
sys.path[:0] = [{folder!r}]
from test_guard import plan
from pathlib import Path
from clearway.campaigns import run_campaign
print(0, flush=True)
run_campaign(plan("LoopsBlockingTheAlarm", "LoopsCompiled", decision_limit=1000.0), Path(sys.argv[1]), 2)
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to look for left-over processes")
@pytest.mark.parametrize(("number", "after"), [(signal.SIGTERM, 0.0), (signal.SIGKILL, 3.0)])
def test_workers_end_with_their_parent(tmp_path: Path, number: int, after: float) -> None:
    """While they start, and in the middle of a loop."""
    script = STARTS.format(folder=str(FILE.parent))
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for(process, 0)
    while len(family(process.pid)) < 2:
        time.sleep(0.005)
    time.sleep(after)
    process.send_signal(number)
    process.wait()
    began = time.monotonic()
    assert left_over(process.pid) == []
    assert time.monotonic() - began < 5.0


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to look for left-over processes")
def test_workers_that_compile_end_with_their_parent(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-c", STARTS.format(folder=str(FILE.parent)), str(tmp_path / "out")],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache)}, start_new_session=True,
    )  # fmt: skip
    alone = compiled = 0
    while compiled == alone:  # by the parent, until there are others
        assert process.poll() is None
        time.sleep(0.01)
        compiled = len(list(cache.rglob("*.nbc")))
        if len(family(process.pid)) < 2:
            alone = compiled
    process.terminate()
    process.wait()
    began = time.monotonic()
    assert left_over(process.pid) == []
    assert time.monotonic() - began < 5.0


def test_a_number_beyond_all_floats_is_no_speed() -> None:
    with pytest.raises(ValueError, match="v is a whole number too large for any speed"):
        plain_command(Command(10**400, 0.0))
