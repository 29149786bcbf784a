"""A day in the lab, recordings coming in one by one: each is scored, the next is announced, and the end is that of one go."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from itertools import takewhile
from pathlib import Path

import pytest
from tests.recordings.test_score_resumed import contents, write

import clearway
from clearway.campaigns.watching import Round, watch
from clearway.cli._day import page_of, told
from clearway.errors import ClearwayError

PLAN = """
test.ticks = "ticks.csv"
sources.capture = { format = "tum", files = "captures/{number}.tum", frame.same = true }
robot.track = "trajectory"
[[trial]]
speed = 0.5
[[trial]]
speed = 0.8
"""
AGAIN = ["clearway", "score", "plan.toml", "--watch", "captures", "--out", "out"]
Step = Callable[[], object]


def day(folder: Path, *steps: Step) -> list[Round]:
    """What is told while one thing after another happens, each after three looks."""
    looks = iter(steps)
    count = 0

    def pause(seconds: float) -> None:
        nonlocal count
        count += 1
        if count % 3 == 0 and (step := next(looks, None)) is not None:
            step()
        assert count < 60, "nothing comes any more"

    return list(watch(folder / "plan.toml", folder / "captures", folder / "out", workers=1, pause=pause))


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    (tmp_path / "captures").mkdir()
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    (tmp_path / "ticks.csv").write_text("trial,touched\n", encoding="utf-8")
    return tmp_path


def test_a_day(lab: Path):
    def grow() -> None:
        (lab / "plan.toml").write_text(PLAN + "[[trial]]\nspeed = 1.0\n", encoding="utf-8")

    rounds = day(
        lab,
        lambda: write(lab / "captures/1.tum", 2.0),
        grow,
        lambda: (lab / "captures/2.tum").write_text("garbage", encoding="utf-8"),
        lambda: write(lab / "captures/2.tum", 2.5),
        lambda: (lab / "ticks.csv").write_text("trial,touched\n1,x\n", encoding="utf-8"),
        lambda: write(lab / "captures/3.tum", 3.0),
    )
    assert [(r.done, r.trials) for r in rounds] == [(0, 2), (1, 2), (1, 3), (2, 3), (2, 3), (2, 3), (3, 3)]
    assert [r.coming.partition(":")[0] for r in rounds] == ["no. 1", "no. 2", "no. 2", "no. 3", "no. 3", "no. 3", ""]
    assert rounds[1].coming == "no. 2: own, 0.8 m/s, repetition 1, captures/2.tum"
    assert [list(r.repeat) for r in rounds] == [[], [], [], [2], [], [], []]
    assert "1 collision" in told(rounds[5])[0]
    assert [r.finished for r in rounds] == [False] * 6 + [True]
    assert told(rounds[3])[1].startswith("repeat   no. 2: ")
    clearway.score(lab / "plan.toml", out=lab / "whole", workers=1)
    assert contents(lab / "out") == contents(lab / "whole")


def test_a_file_that_is_still_written_waits(lab: Path):
    ready = lab / "ready.tum"
    write(ready, 2.0)
    lines = ready.read_text(encoding="utf-8").splitlines(keepends=True)
    looks, seen = 0, []

    def pause(seconds: float) -> None:
        nonlocal looks
        looks += 1
        if looks < 6:  # a part more at each look
            (lab / "captures/1.tum").write_text("".join(lines[: 30 * looks]), encoding="utf-8")
        elif looks == 6:
            shutil.copy(ready, lab / "captures/1.tum")
        assert looks < 20

    for now in watch(lab / "plan.toml", lab / "captures", lab / "out", workers=1, pause=pause):
        seen.append((looks, now.done))
        if now.done:
            break
    assert seen == [(1, 0), (7, 1)]
    assert now.results is not None
    assert now.results.trials["duration"][0].as_py() == pytest.approx(7.95)


def test_a_plan_that_is_broken_meanwhile_is_told_and_waited_for(lab: Path):
    rounds = day(
        lab,
        lambda: (lab / "plan.toml").write_text("[[trial", encoding="utf-8"),
        lambda: (lab / "plan.toml").write_text(PLAN.partition("[[trial]]")[0] + "[[trial]]\n", encoding="utf-8"),
        lambda: write(lab / "captures/1.tum", 2.0),
    )
    assert [bool(r.problem) for r in rounds] == [False, True, False, False]
    assert "plan.toml" in told(rounds[1])[0]
    assert rounds[-1].finished


def test_what_its_writer_has_not_completed_waits(lab: Path):
    text = PLAN.replace('format = "tum", files = "captures/{number}.tum"', 'files = "captures/{number}*"')
    (lab / "plan.toml").write_text(text, encoding="utf-8")
    (lab / "captures/1").mkdir()
    (lab / "captures/1/1_0.mcap").write_bytes(b"")
    (lab / "captures/2.bag.active").write_bytes(b"")
    now = next(watch(lab / "plan.toml", lab / "captures", lab / "out", workers=1, pause=lambda _: None))
    assert (now.done, now.waits) == (0, ("1", "2.bag.active"))
    assert told(now)[1:3] == ["waiting  for 1", "waiting  for 2.bag.active"]


def test_ticks_may_come_after_the_first_recording(lab: Path):
    (lab / "ticks.csv").unlink()
    write(lab / "captures/1.tum", 2.0)
    rounds = watch(lab / "plan.toml", lab / "captures", lab / "out", workers=1, pause=lambda _: None)
    now = next(rounds)
    assert (now.done, now.waits, now.problem) == (1, ("ticks.csv",), "")
    (lab / "ticks.csv").write_text("trial,touched\n1,x\n", encoding="utf-8")
    now = next(rounds)
    assert "1 collision" in told(now)[0]
    assert now.waits == ()


@pytest.mark.slow
def test_ctrl_c_says_how_to_go_on(lab: Path):
    write(lab / "captures/1.tum", 2.0)
    command = [sys.executable, "-m", *AGAIN, "--workers", "1", "--no-report"]
    at_work = subprocess.Popen(
        command, cwd=lab, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # who runs in a shell's background ignores it, and so do its children
    )  # fmt: skip
    assert at_work.stderr is not None
    heard = list(takewhile(lambda line: not line.startswith("next "), iter(at_work.stderr.readline, "")))
    assert f"page     {Path('out/live.html')}\n" in heard
    at_work.send_signal(signal.SIGINT)
    out, err = at_work.communicate(timeout=120)
    assert (at_work.returncode, out) == (130, "")
    assert err == f"clearway: stopped; what is scored stays, go on with `{' '.join(AGAIN)}`\n"
    assert "next" in (lab / "out/live.html").read_text(encoding="utf-8")


def test_a_recording_that_ends_too_early_is_asked_about(lab: Path):
    text = PLAN.replace("[[trial]]\nspeed = 0.5\n", 'legs = [{ name = "a", goal = [2.0, 0.0, 0.0] }]\n[[trial]]\n')
    text = text.replace("test.ticks", "test.xy_tolerance = 0.1\ntest.ticks")
    (lab / "plan.toml").write_text(text, encoding="utf-8")
    write(lab / "captures/2.tum", 2.0)
    rounds = day(
        lab,
        lambda: write(lab / "captures/1.tum", 1.0),
        lambda: (lab / "ticks.csv").write_text("trial,aborted\n1,x\n", encoding="utf-8"),
    )
    assert [list(r.unclear) for r in rounds] == [[], [1], []]
    assert told(rounds[1])[1].startswith("unclear  no. 1: leg a was not finished; tick why")
    assert [r.finished for r in rounds] == [False, False, True]


def test_no_such_folder(tmp_path: Path):
    with pytest.raises(ClearwayError, match="no such folder"):
        next(watch(tmp_path / "plan.toml", tmp_path / "captures", tmp_path / "out"))


def test_the_page_loads_itself_anew_until_the_end():
    during = page_of(["next     no. 2: a <b>"], finished=False, report=True)
    assert 'http-equiv="refresh"' in during
    assert "a &lt;b&gt;" in during
    assert 'href="index.html"' in during
    after = page_of([], finished=True, report=False)
    assert 'http-equiv="refresh"' not in after
    assert "index.html" not in after
