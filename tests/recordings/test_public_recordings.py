"""The plans by which `benchmarks/public_recordings.py` scores other people's recordings; the recordings aren't here."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from benchmark_modules import load_benchmark
from clearway.recordings.formats.beside import load
from clearway.recordings.formats.table_spec import TableSpec
from clearway.recordings.lab.plan_file import load_test_plan


@pytest.fixture(scope="module")
def benchmark() -> Any:
    return load_benchmark("public_recordings")


def test_every_plan_is_one_and_names_every_file(benchmark: Any, tmp_path: Path) -> None:
    for source in benchmark.SOURCES:
        plan = load_test_plan(benchmark.write_plan(source, tmp_path, tmp_path / source.name))
        named = {f for trial in plan.trials for f in (trial.file, *trial.files.values())}
        there = {str(f) for f in source.files(tmp_path)}
        folders = {str(Path(f).parent) for f in there}
        assert named <= there | folders
        assert len(named) == len(there) or named <= folders  # a bag is named by its folder
        for name in source.tables:
            load(tmp_path / source.name / name, TableSpec)


def test_where_they_are_is_exact(benchmark: Any) -> None:
    for source in benchmark.SOURCES:
        assert re.fullmatch(r"[0-9a-f]{40}", source.commit)
        assert f"checkout {source.commit} -- '{source.paths[0]}'" in benchmark.fetched(source)
