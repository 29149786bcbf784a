"""The examples of planners in other languages are built, keep to the wire, and decide alike."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from wire_scenes import begin, drive

from clearway.campaigns.checks import findings
from clearway.examples_place import example_files, examples_folder
from clearway.navigators.registry import make_navigator

FOLDER = examples_folder() / "08_wire"
LANGUAGES = ("py", "cpp", "rs")


def built(language: str, folder: Path) -> str:
    """The address of an example, compiled as the comment at its top says."""
    source = FOLDER / f"planner.{language}"
    if language == "py":
        return f"exec:{sys.executable} {source}"
    command = re.search(r"^//   (.*) && clearway check exec:./planner$", source.read_text(), re.MULTILINE)
    assert command is not None
    words = shlex.split(command[1])
    if shutil.which(words[0]) is None:
        pytest.skip(f"there is no {words[0]} on this machine")
    for file in FOLDER.iterdir():
        shutil.copy(file, folder)
    about = {
        k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MFLAGS")
    }  # rustc would look for make's job server
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, env=about)
    assert (done.returncode, done.stderr) == (0, "")
    return f"exec:{folder}/planner"


def test_they_are_short_and_shipped() -> None:
    files = [file for file in example_files() if file.parts[0] == FOLDER.name]
    assert len(files) == 5
    assert [f for f in files if len((FOLDER.parent / f).read_text().splitlines()) >= 80] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_an_example_decides_as_the_one_in_python(language: str, tmp_path: Path) -> None:
    decided = []
    for address in (built("py", tmp_path), built(language, tmp_path)):
        made = make_navigator(address)
        begin(made)
        decided.append([(c.v, c.omega) for c in drive(made, 30)])
        assert made.leave() == ""  # type: ignore[attr-defined]
    assert decided[1] == [pytest.approx(pair, abs=1e-12) for pair in decided[0]]
    assert len({omega for _, omega in decided[0]}) > 5


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
def test_an_example_passes_the_check(language: str, tmp_path: Path) -> None:
    said = list(findings(built(language, tmp_path)))
    assert [text for passed, text in said if not passed and "control period" not in text] == []
    assert len(said) > 20
