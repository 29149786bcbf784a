"""The Python interface: cheap to import, typed, and the same directory behind it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import clearway
from clearway.errors import ClearwayError

OWN = Path(__file__).parent / "campaigns" / "own_navigators.py"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> clearway.Results:
    return clearway.run(
        "hospital",
        robots=["tiago"],
        navigators=[f"{OWN}:Drives"],
        batches="NO",
        speeds=[0.6],
        repetitions=2,
        localisation="truth",
        workers=1,
        out=tmp_path_factory.mktemp("api") / "out",
    )


def test_a_run_gives_a_table_and_trials(results: clearway.Results) -> None:
    assert len(results) == 2
    frame = results.to_pandas()
    assert list(frame["batch"]) == ["NO", "NO"]
    assert frame["CT"].between(15, 25).all()  # 2 x 5 m at 0.6 m/s, minus tolerances
    assert results.to_polars()["CT"].to_list() == list(frame["CT"])
    assert results.trials.schema.field("CT").metadata[b"unit"] == b"s"
    trial = results.trial(1)
    assert trial.t[-1] == frame["duration"][1]
    assert trial.attempt.legs[0].name == "forth"


def test_the_same_directory_is_behind_it(results: clearway.Results) -> None:
    again = clearway.open_results(results.path)
    assert type(again) is clearway.Results
    assert again.trials.equals(results.trials)
    assert again.campaign["plan"]["selection"]["batches"] == ["NO"]
    assert clearway.resume(results.path).path == results.path
    assert "2 trials" in repr(again)


def test_nothing_is_overwritten(results: clearway.Results) -> None:
    with pytest.raises(ClearwayError, match="already holds the results"):
        clearway.run("hospital", robots=["tiago"], out=results.path)


def test_results_go_where_nothing_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from clearway.api.arguments import free_directory

    monkeypatch.chdir(tmp_path)
    assert free_directory(["hospital", "own/wards.toml"]) == Path("results/hospital-wards")
    Path("results/hospital-2").mkdir(parents=True)
    Path("results/hospital").mkdir()
    assert free_directory(["hospital"]) == Path("results/hospital-3")


def test_importing_clearway_is_cheap() -> None:
    heavy = "numba", "numpy", "pyarrow", "pydantic", "matplotlib", "scipy"
    code = f"import sys, clearway; clearway.__version__; print([m for m in {heavy!r} if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
    with pytest.raises(AttributeError, match="no attribute 'ran'"):
        clearway.ran  # noqa: B018
    assert set(clearway.__all__) <= set(dir(clearway))
