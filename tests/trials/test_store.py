"""A results directory: the same bytes however it came about, and a clear word where something is wrong with it."""

from __future__ import annotations

import errno
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from made_trials import SCHEMA, make_row, make_trial

from clearway.errors import ClearwayError
from clearway.trials import Trial, assembly, journal
from clearway.trials.store import Results, TrialStore, open_results, write_partial
from clearway.trials.store_tables import FILES

TOTAL = 40  # more than a row group
ASKED = {"clearway": "0.1.0", "plan": {"seed": 1, "suites": ["made"]}}


def store(path: Path, total: int = TOTAL, asked: dict[str, Any] | None = None, **options: Any) -> TrialStore:
    return TrialStore(path, asked or ASKED, total, SCHEMA, **options)


def write(path: Path, total: int = TOTAL, order: list[int] | None = None) -> Results:
    with store(path, total) as open_store:
        for i in order or range(total):
            write_partial(open_store.partial, open_store.key, i, make_trial(i), make_row(i))
        return open_store.finish()


def contents(path: Path) -> dict[str, bytes]:
    """Every file but the wall clock's."""
    return {
        str(p.relative_to(path)): p.read_bytes()
        for p in sorted(path.rglob("*"))
        if p.is_file() and p.name not in ("timing.parquet", "thinking.parquet")
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "out"
    write(path)
    return path


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small"
    write(path, 3)
    return path


def test_the_layout_is_as_designed(whole: Path) -> None:
    names = {"campaign.json", "trials.parquet", "trials.csv", *(f.path for f in FILES.values())}
    assert {str(p.relative_to(whole)) for p in whole.rglob("*") if p.is_file()} == names
    table = open_results(whole).trials
    assert table.column_names == ["trial", "id", "scenario", "speed", "success", "duration"]
    assert table.column("trial").to_pylist() == list(range(TOTAL))
    assert table.column("duration")[0].as_py() == pytest.approx(3.9)
    assert table.schema.field("speed").metadata == {b"unit": b"m/s"}
    robot = pq.read_table(whole / "trajectories/robot.parquet")
    assert robot.num_rows == 40 * TOTAL
    assert robot.schema.field("cmd_omega").metadata == {b"unit": b"rad/s"}
    assert pq.read_metadata(whole / "trajectories/robot.parquet").num_row_groups == 2
    assert (whole / "trials.csv").read_text().splitlines()[1] == '0,"made/0","made-0",0.6,false,3.9000000000000004'
    assert pq.read_table(whole / "trajectories/fixtures.parquet").num_rows == 1  # one floor plan, stored once


def test_the_order_of_the_trials_leaves_no_trace(whole: Path, tmp_path: Path) -> None:
    order = list(range(TOTAL))
    random.Random(3).shuffle(order)
    write(tmp_path / "out", order=order)
    assert contents(tmp_path / "out") == contents(whole)


def test_no_trials_are_results_too(tmp_path: Path) -> None:
    assert list(write(tmp_path / "out", 0)) == []


class _Crash(BaseException):
    pass


@pytest.mark.slow
def test_a_crash_at_any_step_is_made_good(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every call that changes the disk crashes once, before it or after it."""
    real = {name: getattr(os, name) for name in ("replace", "fsync", "mkdir", "unlink", "rmdir")}
    real["fsync"] = lambda descriptor: None  # the machine does not go down here, and hundreds of them take long
    state = {"left": 0, "after": False}

    def breaking(name: str) -> Any:
        def call(*args: Any, **kwargs: Any) -> Any:
            state["left"] -= 1
            if state["left"] == 0 and not state["after"]:
                raise _Crash
            try:
                return real[name](*args, **kwargs)
            finally:
                if state["left"] == 0:
                    raise _Crash

        return call

    for name in real:
        monkeypatch.setattr(os, name, breaking(name))
    crashes = 0
    for step in range(1, 200):
        before = crashes
        for after in (False, True):
            out = tmp_path / f"{step}-{after}"
            state.update(left=step, after=after)
            try:
                write(out, 3)
            except _Crash:
                crashes += 1
            state["left"] = 0
            with store(out, 3, resume=True) as again:
                for i in again.missing():
                    write_partial(again.partial, again.key, i, make_trial(i), make_row(i))
                again.finish()
            assert contents(out) == contents(small), f"step {step}"
            assert not (out / ".partial").exists()
        if crashes == before:
            break
    assert crashes > 40


WRITER = """
import sys
sys.path[:0] = [{folder!r}]
from pathlib import Path
from made_trials import *
from clearway.trials.store import TrialStore, write_partial
import json
with TrialStore(Path(sys.argv[1]), json.loads(sys.argv[2]), 40, SCHEMA, resume=True) as store:
    print("begun", flush=True)
    for i in store.missing():
        write_partial(store.partial, store.key, i, make_trial(i), make_row(i))
    store.finish()
"""


@pytest.mark.slow
def test_sigkill_at_random_moments_is_made_good(whole: Path, tmp_path: Path) -> None:
    moments, killed = random.Random(7), 0
    command = [sys.executable, "-c", WRITER.format(folder=str(Path(__file__).parent)), str(tmp_path / "out")]
    for _ in range(2):
        process = subprocess.Popen([*command, json.dumps(ASKED)], stdout=subprocess.PIPE)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(moments.uniform(0.0, 0.1))
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        process.stdout.close()
    subprocess.run([*command, json.dumps(ASKED)], check=True, stdout=subprocess.DEVNULL)
    assert killed
    assert contents(tmp_path / "out") == contents(whole)
    assert not (tmp_path / "out" / ".partial").exists()


@pytest.mark.parametrize("harm", ["cut", "flip", "head", "size", "empty", "gone", "swap", "twice"])
def test_a_damaged_journal_is_made_good(tmp_path: Path, small: Path, harm: str) -> None:
    out, ends = tmp_path / "out", [0]
    with store(out, 3) as open_store:
        for i in range(3):
            write_partial(open_store.partial, open_store.key, i, make_trial(i), make_row(i))
            (file,) = open_store.partial.glob("*.trials")
            ends.append(file.stat().st_size)
    raw = bytearray(file.read_bytes())
    first, second, third = (raw[a:b] for a, b in itertools.pairwise(ends))
    lost = {"cut": [2], "empty": [0, 1, 2], "gone": [0, 1, 2], "twice": []}.get(harm, [1])
    if harm == "cut":
        raw = raw[:-7]
    elif harm == "flip":
        raw[ends[2] - 100] ^= 1
    elif harm == "head":
        raw[ends[1]] ^= 1
    elif harm == "size":
        raw[ends[1] + 24] ^= 1
    elif harm == "swap":
        raw = first + first + third
    elif harm == "twice":
        raw += second
    else:
        raw = bytearray()
    file.write_bytes(raw)
    if harm == "gone":
        file.unlink()
    with store(out, 3, resume=True) as again:
        assert again.missing() == lost
        for i in lost:
            write_partial(again.partial, again.key, i, make_trial(i), make_row(i))
        assert again.missing() == []
        again.finish()
    assert contents(out) == contents(small)


def test_what_is_damaged_is_told_before_it_is_put_together(tmp_path: Path, small: Path) -> None:
    out = tmp_path / "out"
    with store(out, 3) as open_store:
        for i in range(3):
            write_partial(open_store.partial, open_store.key, i, make_trial(i), make_row(i))
        (file,) = open_store.partial.glob("*.trials")
        raw = bytearray(file.read_bytes())
        raw[-100] ^= 1
        file.write_bytes(raw)
        with pytest.raises(ClearwayError, match="trial 2 is missing or damaged; run the campaign again with --resume"):
            open_store.finish()
        write_partial(open_store.partial, open_store.key, 2, make_trial(2), make_row(2))
        open_store.finish()
    assert contents(out) == contents(small)


def test_journals_of_another_campaign_are_left_out(tmp_path: Path, small: Path) -> None:
    with store(tmp_path / "out", 3) as open_store:
        for i in range(3):
            write_partial(open_store.partial, "another", i, make_trial(7), make_row(7))
            write_partial(open_store.partial, open_store.key, i, make_trial(i), make_row(i))
            write_partial(open_store.partial, "another", i, make_trial(7), make_row(7))
        assert open_store.done() == 3
        open_store.finish()
    assert contents(tmp_path / "out") == contents(small)


def test_a_second_process_is_refused(tmp_path: Path) -> None:
    with store(tmp_path), pytest.raises(ClearwayError, match="another process is writing"):
        store(tmp_path, resume=True)
    store(tmp_path, resume=True).close()  # the lock goes with its holder


def test_results_are_never_overwritten(small: Path, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="already holds the results of a campaign"):
        store(small, 3)
    store(tmp_path / "half").close()
    with pytest.raises(ClearwayError, match=r"unfinished campaign; complete it with `clearway run --resume"):
        store(tmp_path / "half")
    with store(small, 3, resume=True) as finished:
        assert finished.missing() == []
        assert len(finished.finish()) == 3


def test_resuming_something_else_says_what_differs(tmp_path: Path) -> None:
    store(tmp_path).close()
    with pytest.raises(ClearwayError, match=r"differs in plan\.seed: it has 1, now 2 is asked"):
        store(tmp_path, asked={**ASKED, "plan": {"seed": 2, "suites": ["made"]}}, resume=True)
    with pytest.raises(ClearwayError, match=r"differs in trials: it has 40, now 41"):
        store(tmp_path, 41, resume=True)


def test_a_full_directory_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("important")
    with pytest.raises(ClearwayError, match=r"thesis\.tex is there"):
        store(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(ClearwayError, match="File exists"):
        store(tmp_path / "file")


@pytest.mark.parametrize("when", ["while adding", "while finishing"])
def test_a_full_disk_is_one_line_and_loses_nothing(
    tmp_path: Path, small: Path, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    out = tmp_path / "out"
    with store(out, 3) as open_store:
        for i in range(2 if when == "while adding" else 3):
            write_partial(open_store.partial, open_store.key, i, make_trial(i), make_row(i))
        work = (
            partial(write_partial, open_store.partial, open_store.key, 2, make_trial(2), make_row(2))
            if when == "while adding"
            else open_store.finish
        )
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(ClearwayError, match=r"No space left on device; what is finished is kept") as caught:
                work()
        assert "\n" not in str(caught.value)
        assert not [p for p in open_store.partial.iterdir() if p.suffix not in (".trials", "")]
    with store(out, 3, resume=True) as again:
        for i in again.missing():
            write_partial(again.partial, again.key, i, make_trial(i), make_row(i))
        again.finish()
    assert contents(out) == contents(small)


def test_unfinished_results_say_how_to_finish(tmp_path: Path) -> None:
    with store(tmp_path) as half:
        write_partial(half.partial, half.key, 0, make_trial(0), make_row(0))
    with pytest.raises(ClearwayError, match=r"1 of 40 trials are done; complete it with `clearway run --resume"):
        open_results(tmp_path)
    with store(tmp_path, resume=True) as half, pytest.raises(ClearwayError, match=r"trial 1 is missing"):
        half.finish()


def _campaign(path: Path, **change: Any) -> None:
    file = path / "campaign.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))


@pytest.mark.parametrize(
    ("harm", "says"),
    [
        (
            lambda p: _campaign(p, schema=99, clearway="7.0"),
            "campaign.json: was written by a newer Clearway .7.0, schema",
        ),
        (lambda p: (p / "campaign.json").write_text("{"), "campaign.json: is damaged"),
        (lambda p: (p / "campaign.json").write_text("[1]"), "campaign.json: was not written by Clearway"),
        (lambda p: (p / "campaign.json").unlink(), "is not a Clearway results directory"),
        (lambda p: _campaign(p, trials=4), "campaign.json: was edited"),
        (lambda p: _campaign(p, trials=None), "campaign.json: is damaged"),
        (lambda p: (p / "timing.parquet").unlink(), "timing.parquet: is missing"),
        *(
            (lambda p, f=f: (p / f).write_bytes((p / f).read_bytes()[:-9]), f"{Path(f).name}: is damaged")
            for f in ("trials.parquet", *(file.path for file in FILES.values()))
        ),
    ],
)
def test_what_is_wrong_with_a_directory_is_named(small: Path, harm: Any, says: str) -> None:
    harm(small)
    with pytest.raises(ClearwayError, match=says) as caught:
        open_results(small)
    assert "\n" not in str(caught.value)


def test_one_flipped_bit_is_told_wherever_it_is(small: Path) -> None:
    rng = random.Random(0)
    files = [p for p in small.rglob("*") if p.is_file() and p.suffix in (".parquet", ".json")]
    assert len(files) > len(FILES)
    for file in files:
        whole = file.read_bytes()
        for bit in rng.sample(range(8 * len(whole)), 20):
            raw = bytearray(whole)
            raw[bit // 8] ^= 1 << bit % 8
            file.write_bytes(raw)
            with pytest.raises(ClearwayError, match=rf"{file.name}: " if file.suffix == ".parquet" else str(small)):
                open_results(small)
        file.write_bytes(whole)
    open_results(small)


def test_pages_are_checked_too(small: Path) -> None:
    """A file that changes while it is open."""
    results = open_results(small)
    file = small / "trajectories/robot.parquet"
    raw = bytearray(file.read_bytes())
    raw[4:2000] = bytes(1996)
    file.write_bytes(raw)
    with pytest.raises(ClearwayError, match=r"robot\.parquet: is damaged"):
        results.trial(0)


def test_an_edited_campaign_is_told(small: Path) -> None:
    file = small / "campaign.json"
    campaign = json.loads(file.read_text())
    campaign["run"]["finished"] = "yesterday"
    file.write_text(json.dumps(campaign))
    with pytest.raises(ClearwayError, match=r"campaign\.json: was edited"):
        open_results(small)


def test_there_is_no_trial_beyond_the_last(small: Path) -> None:
    with pytest.raises(ClearwayError, match="no trial 3; it holds 0 to 2"):
        open_results(small).trial(3)


def test_a_directory_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="no such directory"):
        open_results(tmp_path / "none")


def test_trials_are_read_one_by_one(whole: Path) -> None:
    results: Iterator[Trial] = iter(open_results(whole))
    assert [t.attempt.seed for t in results] == list(range(TOTAL))


def test_each_trial_is_read_twice_and_no_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    body = journal.Journals._body

    def counting(journals: journal.Journals, index: int) -> Any:
        read.append(index)
        return body(journals, index)

    monkeypatch.setattr(journal.Journals, "_body", counting)
    with store(tmp_path / "out") as opened:
        assert len(opened.missing()) == TOTAL
        for i in range(TOTAL):
            write_partial(opened.partial, opened.key, i, make_trial(i), make_row(i))
            assert opened.done() == i + 1
        assert opened.missing() == opened.missing() == []
        opened.finish()
    assert sorted(read) == sorted([*range(TOTAL)] * 2)


def test_a_large_campaign_has_few_row_groups(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounded is what a file says of its row groups, and how large they are."""
    monkeypatch.setattr(assembly, "TRIALS_A_GROUP", 1)
    for most, large, groups in ((4, 1 << 18, 4), (1000, 1 << 18, TOTAL), (4, 150, 10)):  # a trial has 40 samples
        monkeypatch.setattr(assembly, "MOST_GROUPS", most)
        monkeypatch.setattr(assembly, "LARGE", large)
        results = write(tmp_path / f"{most}-{large}")
        assert pq.read_metadata(results.path / "trajectories/robot.parquet").num_row_groups == groups
        assert (results.path / "trials.csv").read_bytes() == (whole / "trials.csv").read_bytes()
        assert all(np.array_equal(results.trial(i).pose, make_trial(i).pose) for i in (39, 0, 11, 12))


def test_the_table_of_trials_is_written_in_blocks(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assembly, "ROWS_A_GROUP", assembly.TRIALS_A_GROUP)
    results = write(tmp_path / "out")
    assert pq.ParquetFile(tmp_path / "out/trials.parquet").num_row_groups == 2
    assert results.trials.equals(open_results(whole).trials)
    assert (tmp_path / "out/trials.csv").read_bytes() == (whole / "trials.csv").read_bytes()
    for i in (39, 0, 32, 31):
        assert results.trial(i).reason == make_trial(i).reason
        assert np.array_equal(results.trial(i).pose, make_trial(i).pose)
