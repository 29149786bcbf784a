"""Trials on the workers of a dask.distributed scheduler: the same bytes, and one clear error when it goes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from campaigns.own_plans import contents
from campaigns.own_plans import plan as of_hospital
from campaigns.test_shards import plan
from clearway.campaigns import on_dask, resume_campaign, run_campaign
from clearway.errors import ClearwayError


class Cluster:
    """A scheduler of dask and its workers, processes of this machine."""

    def __init__(self, folder: Path) -> None:
        self._folder, self.file = folder, folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(self.file))
        until = time.monotonic() + 60.0
        while not self.file.exists() or not self.file.stat().st_size:  # it is there before it is written
            assert time.monotonic() < until
            time.sleep(0.1)
        from distributed.utils import json

        self.address = json.loads(self.file.read_text())["address"]
        self.workers: list[subprocess.Popen[bytes]] = []

    def hire(self, **environment: str) -> None:
        """One more worker, of one thread."""
        self.workers.append(
            self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", **environment)
        )

    def _start(self, verb: str, *arguments: str, **environment: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", verb, *arguments],
            cwd=self._folder, env=os.environ | environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def end(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    made = Cluster(tmp_path)
    try:
        yield made
    finally:
        made.end()


def test_a_scheduler_that_is_not_there_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_dask, "_ANSWERS", 1.0)
    with (
        pytest.raises(
            ClearwayError, match=r"scheduler: no scheduler of dask answers at 'tcp://127\.0\.0\.1:9'"
        ) as caught,
        on_dask._client("tcp://127.0.0.1:9"),
    ):
        pass
    assert "\n" not in str(caught.value)
    with pytest.raises(ClearwayError, match=r"no scheduler of dask answers at 'nonsense'"), on_dask._client("nonsense"):
        pass


def test_a_worker_of_another_version_refuses(tmp_path: Path) -> None:
    expected = on_dask.about() | {"numpy": "1.0"}
    with pytest.raises(ClearwayError, match=r"a worker of dask has another numpy than this process: .*, not 1\.0"):
        on_dask.run_there(of_hospital(), [], {}, "", None, "", b"", expected)


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_nothing(tmp_path: Path, cluster: Cluster) -> None:
    cluster.hire()
    cluster.hire()
    killed: list[int] = []

    def kill(done: int, total: int, note: str = "") -> None:
        if 0 < done < total and not killed:
            killed.append(done)
            cluster.workers[0].send_signal(signal.SIGKILL)

    asked = of_hospital("Drives", "Raises", "Hangs", repetitions=3, decision_limit=3.0)
    run_campaign(asked, tmp_path / "dask", scheduler=cluster.address, progress=kill)
    assert killed
    assert cluster.workers[0].wait(10) == -signal.SIGKILL
    assert cluster.workers[1].poll() is None
    run_campaign(asked, tmp_path / "here", 1)
    assert contents(tmp_path / "dask") == contents(tmp_path / "here")


@pytest.mark.slow
def test_a_scheduler_that_dies_is_one_clear_error_and_nothing_is_lost(
    tmp_path: Path, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(on_dask, "_ANSWERS", 5.0)
    cluster.hire()
    told: list[int] = []

    def kill(done: int, total: int, note: str = "") -> None:
        told.append(done)
        if done == 2:
            cluster.scheduler.kill()

    with pytest.raises(ClearwayError, match=r"has gone; what is finished is kept, --resume goes on") as caught:
        run_campaign(plan(tmp_path), tmp_path / "dask", scheduler=cluster.address, progress=kill)
    assert "\n" not in str(caught.value)
    assert max(told) < 6
    again: list[int] = []

    def note(done: int, *_: Any) -> None:
        again.append(done)

    resume_campaign(tmp_path / "dask", 1, note)
    assert again[0] == max(told)
    run_campaign(plan(tmp_path), tmp_path / "here", 1)
    assert contents(tmp_path / "dask") == contents(tmp_path / "here")


@pytest.mark.slow
def test_a_scheduler_without_workers_is_one_clear_error(
    tmp_path: Path, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(on_dask, "_ABSENT", 2.0)
    with pytest.raises(ClearwayError, match="has no workers; `dask worker tcp://"):
        run_campaign(plan(tmp_path), tmp_path / "dask", 1, scheduler=cluster.address)
