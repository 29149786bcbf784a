"""Hostile and mutated files of every kind, as `benchmarks/faults.py` has them: a sentence each, never a traceback."""

from pathlib import Path
from typing import Any

import pytest

from clearway.campaigns.checks import check_file
from clearway.recordings.formats import formats
from clearway.robots import load_robot

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
QUICK = 20_000
"""Characters of a file that is checked here; the larger ones are the benchmark's."""
KINDS = {
    "scenarios",
    "people, tracks and robots",
    "suites",
    "robots",
    "floor plans",
    "test plans",
    "maps",
    "kinds of file",
}


@pytest.fixture
def sections(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import fault_sections.fuzz
    import fault_sections.hostile
    import fault_sections.recordings

    return fault_sections


def test_mutated_files_are_read_or_refused(sections: Any, tmp_path: Path) -> None:
    fuzz = sections.fuzz
    counts = sections.in_turn(fuzz.SEEDS, fuzz.Target(tmp_path).try_one, 400, 10**6)
    assert [wrong for count in counts for wrong in count.fallen] == []


def test_mutated_recordings_are_read_or_refused(sections: Any, tmp_path: Path) -> None:
    recordings = sections.recordings
    counts = sections.in_turn(recordings.SEEDS, recordings.Target(tmp_path).try_one, 138, 10**6)
    assert [wrong for count in counts for wrong in count.fallen] == []


def test_what_is_mutated_is_a_recording_of_every_format(sections: Any, tmp_path: Path) -> None:
    found = sections.recordings.good(tmp_path)
    assert {r.format for r in found.values()} >= formats().keys() - {"motive-z-up", "trc-y-up"}
    for kind, recording in found.items():
        assert recording.points is not None or recording.tracks, kind


def test_hostile_files_are_told(sections: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, tried = load_robot("tiago"), 0
    for number, (fault, name, lay, codes) in enumerate(sections.hostile.attacks()):
        if fault not in KINDS or codes != sections.hostile.REFUSED:
            continue
        folder = tmp_path / str(number)
        folder.mkdir()
        line = lay(folder)
        size = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file() and not f.is_symlink())
        if line[0] != "check" or size > QUICK:
            continue
        monkeypatch.chdir(folder)
        assert check_file(Path(line[1]), robot), f"{fault}: {name}"
        tried += 1
    assert tried > 200
