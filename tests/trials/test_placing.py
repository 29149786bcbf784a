"""Files are there whole or not at all, whatever ends the writing of them, and on the disk for good once they are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from made_trials import make_row, make_trial

from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.ros_map import write_map
from clearway.placing import placed, working_folder
from clearway.recordings.exports.export import TARGETS, export
from clearway.trials.store import TrialStore, write_partial


def test_what_is_begun_and_fails_leaves_nothing(tmp_path: Path) -> None:
    new = tmp_path / "new"
    with placed(new) as folder:
        (folder / "a").write_text("whole")

    def full(folder: Path) -> None:
        write_map(folder / "map.yaml", OccupancyGrid(np.zeros((2, 2), np.int8), 0.05, (0.0, 0.0)))
        raise OSError(28, "No space left on device")

    with pytest.raises(ClearwayError, match=r"new: cannot be written: No space left on device"), placed(new) as folder:
        full(folder)
    with pytest.raises(ClearwayError, match=r"new/b\.csv: cannot be") as told, placed(new) as folder:
        raise ClearwayError("cannot be", file=folder / "b.csv")
    assert ".writing" not in str(told.value)
    assert [p.name for p in new.iterdir()] == ["a"]
    with pytest.raises(ClearwayError, match="cannot be"), placed(new / "one" / "two") as folder:
        full(folder)
    assert [p.name for p in new.iterdir()] == ["a"]  # no folder that was made for it either


def test_what_can_not_be_begun_leaves_nothing_to_go_on_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(ClearwayError, match=r"out: cannot be written: No space left on device$"):
            TrialStore(tmp_path / "out", {}, 1, pa.schema([]))
    assert list((tmp_path / "out").iterdir()) == []
    (tmp_path / "out" / ".partial-campaign.json-7").write_text("half of it, by one that was killed")
    TrialStore(tmp_path / "out", {}, 1, pa.schema([])).close()
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [".partial", "campaign.json"]


KILLED = """
import os, signal, sys
from pathlib import Path
from clearway.placing import working_folder
with working_folder(Path(sys.argv[1]), "report") as new:
    (new / "half").write_text("x")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_has_left_goes_with_the_next(tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert [p.name for p in tmp_path.glob(".report-*/*")] == ["half"]
    with working_folder(tmp_path, "report") as one, working_folder(tmp_path, "report") as other:
        assert sorted(tmp_path.iterdir()) == sorted([one, other])  # who lives is left alone
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("to", ["csv", "tum", "mcap", "trc"])
def test_an_export_on_a_full_disk_leaves_nothing(tmp_path: Path, to: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ClearwayError, match="No space left"):
        export(make_trial(0), to, tmp_path / f"out{TARGETS[to]}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc to see what is synced")
def test_what_counts_is_on_the_disk_before_the_next_step_counts_on_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a loss of power a name that was not synced with its folder may be gone."""
    steps: list[tuple[str, str]] = []
    fsync, replace = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        steps.append(("sync", os.path.relpath(os.readlink(f"/proc/self/fd/{descriptor}"), tmp_path)))
        fsync(descriptor)

    def replaced(a: Path, b: Path) -> None:
        steps.append(("put", os.path.relpath(b, tmp_path)))
        replace(a, b)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", replaced)
    with TrialStore(
        tmp_path / "new" / "out", {}, 1, pa.schema([pa.field(n, pa.string()) for n in make_row(0)])
    ) as store:
        write_partial(store.partial, store.key, 0, make_trial(0), dict.fromkeys(make_row(0), "x"))
        (journal,) = store.partial.glob("*.trials")
        assert steps[-2:] == [("sync", f"new/out/.partial/{journal.name}"), ("sync", "new/out/.partial")]
        store.finish()
    put = [(i, name) for i, (what, name) in enumerate(steps) if what == "put"]
    assert {("sync", "."), ("sync", "new")} <= set(steps[: put[0][0]])  # by which the directory itself has its name
    assert [name for _, name in put[-2:]] == ["new/out/campaign.json", "new/out/.finished"]
    for i, name in put:
        assert ("sync", os.path.dirname(name)) in steps[i:]
        if name in ("new/out/campaign.json", "new/out/.finished"):  # all that was put before is there by then
            assert {("sync", os.path.dirname(other)) for k, other in put if k < i} <= set(steps[:i])
