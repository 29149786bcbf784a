"""What foreign code prints and what names hold does no harm: JSON stays JSON, SVG stays XML, a cell is no formula."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pyarrow as pa
import pytest
import typer
from command_line import Shell

from clearway.cli._options import alone, tell
from clearway.reports import theme
from clearway.reports.text import columns
from clearway.trials.csv_table import without_formulas

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_corridor.toml"

TALKER = """import atexit
import ctypes
import os
from clearway.contract import Command


class Talker:
    needs = frozenset()

    def __init__(self):
        print("made")
        atexit.register(print, "at the end")

    def reset(self, task, robot, rng):
        print("reset")
        os.write(1, b"by the file descriptor")
        ctypes.CDLL(None).printf(b"by a C library, which keeps it back")

    def step(self, observation):
        print("step")
        return Command(0.0, 0.0)
"""


def shell(*words: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own."""
    code = "import sys; sys.argv[0] = 'clearway'; from clearway.cli import main; main()"
    said = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(said, capture_output=True, text=True, timeout=120, env=os.environ | environment, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["check", "run"])
def test_json_stands_alone_whatever_a_navigator_prints(tmp_path: Path, verb: str) -> None:
    (tmp_path / "talker.py").write_text(TALKER)
    navigator = f"{tmp_path / 'talker.py'}:Talker"
    words: tuple[object, ...] = ("check", navigator, "--json")
    if verb == "run":
        words = (
            "run",
            "sar-case1",
            "--scenario",
            "case-1-scenario-1-v1-r1",
            "-n",
            navigator,
            "--no-report",
            "--workers",
            1,
        )
        words = (*words, "--out", tmp_path / "out", "--json")
    said = shell(*words)
    assert isinstance(json.loads(said.stdout), dict)
    assert "by the file descriptor" in said.stderr
    assert verb == "run" or ("at the end" in said.stderr and "by a C library" in said.stderr)  # workers end at once


def test_json_holds_only_what_json_knows(capsys: pytest.CaptureFixture[str]) -> None:
    @alone
    def verb(as_json: bool) -> None:
        print("not this")
        tell({"a": [math.nan, (math.inf, 1.5)], "b": {"c": -math.inf}, "d": "x"})
        raise typer.Exit(1)

    with pytest.raises(typer.Exit):
        verb(as_json=True)
    said = capsys.readouterr()
    assert json.loads(said.out, parse_constant=pytest.fail) == {"a": [None, [None, 1.5]], "b": {"c": None}, "d": "x"}
    assert "not this" in said.err


@pytest.mark.parametrize("words", [("check", EXAMPLE), ("run", EXAMPLE, "--robot", "tiago")])
def test_without_the_compiler_one_sentence_is_said(words: tuple[object, ...]) -> None:
    said = shell(*words, NUMBA_DISABLE_JIT="1")
    assert said.returncode == 2
    assert said.stderr.startswith("clearway: NUMBA_DISABLE_JIT is set")
    assert len(said.stderr.splitlines()) == 1


def test_a_figure_of_any_name_is_xml() -> None:
    figure = theme.new_figure(2, 2)
    figure.text(0.1, 0.5, "bell \x07, escape \x1b[31m, NUL \0, $x^{, <b>, a page \x0c, \ufffe")
    tree = ElementTree.fromstring(theme.to_svg(figure, "figure\x01"))
    assert "bell \ufffd, escape \ufffd[31m, NUL \ufffd, $x^{, <b>, a page \ufffd, \ufffd" in "".join(tree.itertext())


def test_a_table_in_the_terminal_does_not_steer_it() -> None:
    assert columns(["name"], [["a\x1b[31m\x07b"]]).splitlines() == ["name", r"a\x1b[31m\x07b"]


def test_no_cell_of_a_table_is_a_formula() -> None:
    names = ["=1+1", "+1", "-1", "@x", "\t=1", "a=1", "", None]
    told = without_formulas(pa.table({"name": names, "number": [-1.0] * 8}))
    assert told["name"].to_pylist() == ["'=1+1", "'+1", "'-1", "'@x", "'\t=1", "a=1", "", None]
    assert told["number"].to_pylist() == [-1.0] * 8


@pytest.mark.parametrize(
    "words", [("--speed", "0.6"), ("--robot", "tiago"), ("--seed", "0"), ("-n", "hp-st"), ("--official",)]
)
def test_options_beside_resume_are_not_ignored(clearway: Shell, tmp_path: Path, words: tuple[str, ...]) -> None:
    told = clearway.complaint("run", "--resume", tmp_path, *words)
    assert "has no effect beside --resume DIR" in told
    assert words[0] in told or "--navigator" in told
    assert "leave out --out" in clearway.complaint("run", "--resume", tmp_path, "--out", tmp_path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--repetitions", "1000000000"), "at most 1,000,000 trials"),
        (("--decision-limit", "nan"), "decision_limit: nan s is no limit on a decision"),
        (("--decision-limit", "-1"), "decision_limit: -1 s is no limit on a decision"),
        (("--floor-plan", ""), "'' is the name of no floor plan"),
        (("--map", "x" * 5000), "File name too long"),
        (("--navigator", f"hp-st[x={'9' * 900}]"), "x: unknown key"),
        (("--navigator", f"hp-st[x={'9' * 5000}]"), "has more than 1000 characters"),
    ],
)
def test_what_nobody_can_mean_is_refused(clearway: Shell, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    hospital = ("run", "hospital", "--robot", "tiago", "--batch", "NO", "--speed", "0.6", "--out", tmp_path / "out")
    told = clearway.complaint(*hospital, *(() if words[0] == "--repetitions" else ("--repetitions", "1")), *words)
    assert said in told
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "seeds", ["0:1000000000000", "0:" + "9" * 5000, "5:1", "\u0661:\u0665", "0:9223372036854775809"]
)
def test_ranges_of_seeds_that_are_refused(clearway: Shell, tmp_path: Path, seeds: str) -> None:
    told = clearway.complaint("run", "sar-case1", "--seeds", seeds, "--out", tmp_path / "out")
    assert "is no range of seeds" in told or "at most 1,000,000 trials" in told
    assert len(told) < 1000
