"""Time left is told from the pace of the work, not of the compiling before it."""

from __future__ import annotations

import pytest

from clearway.cli import _progress


def test_time_left_leaves_compiling_and_earlier_work_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    clock = iter([0.0, 0.0, 60.0, 80.0])
    monkeypatch.setattr(_progress.time, "monotonic", lambda: next(clock))
    progress = _progress.Progress("trials")
    progress(100, 200, "compiling")  # resumed: 100 were done before
    progress(101, 200)  # the first took a minute, most of it compiling
    progress(111, 200)  # ten more in 20 s: 89 are left
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "trials: 100/200  compiling"
    assert said[-1] == "trials: 111/200, 2 min 58 s left"


def test_other_work_has_a_pace_of_its_own(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    clock = iter([0.0, 20.0, 40.0, 60.0, 100.0, 110.0, 130.0])
    monkeypatch.setattr(_progress.time, "monotonic", lambda: next(clock))
    progress = _progress.Progress("trials")
    for done in (1, 2, 3):
        progress(done, 3, "drawing scenarios")
    for done in (0, 1, 3):
        progress(done, 6)
    said = capsys.readouterr().err.splitlines()
    assert said[:3] == [f"trials: {k}/3  drawing scenarios" for k in (1, 2, 3)]
    assert said[-1] == "trials: 3/6, 30 s left"  # two in 20 s


def test_a_sentence_stands_on_a_line_of_its_own(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(_progress.sys.stderr, "isatty", lambda: True, raising=False)
    with _progress.Progress("trials") as progress:
        progress.say("a robot is slow")
        progress(0, 3)
    assert "\ra robot is slow\n\rtrials: 0/3" in capsys.readouterr().err
