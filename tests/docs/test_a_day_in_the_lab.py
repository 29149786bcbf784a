"""The how-to of a day in the lab, command by command as it stands there, with made-up captures that come in one by one."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from tests.cli.command_line import Shell
from tests.recordings.test_score_resumed import contents
from tests.reports.synthetic_results import write_campaign

from clearway.scenarios.suites import Selection

pytestmark = pytest.mark.slow

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "a-day-in-the-lab.md").read_text(encoding="utf-8")
COMMANDS = [line for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.M | re.S) for line in block.splitlines()]


def command(start: str) -> list[str]:
    """The one command of the page that begins so, in words."""
    (found,) = (c for c in COMMANDS if c.startswith(start))
    return shlex.split(found)


class Watch:
    """`clearway score --watch`, in a process of its own, with what it tells."""

    def __init__(self, words: list[str]) -> None:
        call = [sys.executable, "-m", *words, "--workers", "1"]
        self.process = subprocess.Popen(call, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines: list[str] = []
        self._news = threading.Condition()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            with self._news:
                self.lines.append(line.rstrip("\n"))
                self._news.notify()

    def until(self, text: str) -> bool:
        with self._news:
            return self._news.wait_for(lambda: any(text in line for line in self.lines), timeout=120)


@pytest.fixture
def clearway(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Shell:
    monkeypatch.chdir(tmp_path)
    return Shell(monkeypatch, capsys)


def filled_in(text: str, markers: str) -> str:
    """The plan with what the page and the export say instead of its own source and robot."""
    (block,) = (b for b in re.findall(r"^```toml\n(.*?)^```", PAGE, re.M | re.S) if "frame =" in b)
    robot = markers[markers.index("[robot]") : markers.index("[bodies]")]
    head, rest = text.split("[sources.capture]\n")
    return head + block + robot + rest[rest.index("# Obstacles.") :]


def test_the_page_from_the_plan_to_the_verdict(clearway: Shell, tmp_path: Path):
    assert clearway(*command("clearway protocol hospital")[1:]).code == 0
    words = command("clearway run")
    part = Selection(batches=("SO",), configurations=("single",), sizes=(0.3,), speeds=(0.6,))
    assert words[words.index("run") + 1 : -2] == command("clearway protocol hospital")[2:-6]
    write_campaign(Path(words[-1]), robots=("tiago",), selection=part)  # the simulation itself has its own tests
    assert clearway(*command("clearway export")[1:]).code == 0
    subprocess.run(command("mkdir"), check=True)
    plan = Path("plan.toml")
    plan.write_text(filled_in(plan.read_text(), next(Path("made").glob("*.toml")).read_text()), encoding="utf-8")
    assert clearway(*command("clearway check")[1:]).code == 0
    watch = Watch(command("clearway score plan.toml --watch"))
    try:
        assert watch.until("next     no. 1: SO single, edge 0.3 m, 0.6 m/s, repetition 1, captures/001*")
        for number, copy in enumerate((c for c in COMMANDS if c.startswith("cp ")), 1):
            subprocess.run(copy, shell=True, check=True)
            assert watch.until(f"scored   {number} of 3: ")
        assert watch.until("next     nothing: every trial was driven")
        assert "waiting  for ticks.json" in watch.lines
        Path("ticks.json").write_text('[{"trial": 1, "touched": "no"}]', encoding="utf-8")
        assert watch.process.wait(60) == 0
    finally:
        watch.process.kill()
    assert "http-equiv" not in Path("results/day/live.html").read_text(encoding="utf-8")
    assert Path("results/day/report/index.html").exists()
    (again,) = (c for c in COMMANDS if c.endswith("--out results/again"))
    assert clearway(*shlex.split(again)[1:], "--workers", 1, "--no-report").code == 0
    for path in ("results/day/report", "results/day/live.html"):
        shutil.rmtree(path) if Path(path).is_dir() else Path(path).unlink()
    assert contents(Path("results/day")) == contents(Path("results/again"))
    assert clearway(*command("clearway compare")[1:]).code == 0
    (more,) = re.findall(r"`clearway (protocol plan.toml [^`]*)`", PAGE)
    assert clearway(*shlex.split(more)).code == 0
