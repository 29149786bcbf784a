"""The Python interface: cheap to import, typed, and the same directory behind it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway.errors import ClearwayError
from clearway.scenarios.selecting import selection_of
from clearway.scenarios.suite import Selection

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


@pytest.mark.parametrize(
    ("field", "given"),
    [
        *((name, "x") for name in ("speeds", "sizes", "gaps", "obstacle_speeds", "worlds", "seed", "disturbance", "latency")),
        *((name, 0.6) for name in ("batches", "configurations", "scenarios", "setups", "without", "worlds", "floor_plan", "keep")),
        ("speeds", [0.6, "b"]), ("speeds", True), ("seeds", (0, "b")), ("seeds", 3), ("seeds", (0, 1, 2)), ("repetitions", 1.5),
        ("decision_limit", "x"), ("localisation", 3), ("people", "x"), ("options", "orca"), ("options", {"orca": 3}),
    ],
)  # fmt: skip
def test_what_is_of_another_type_is_told_by_its_field(tmp_path: Path, field: str, given: object) -> None:
    with pytest.raises(ClearwayError) as error:
        clearway.run("hospital", robots="tiago", navigators="orca", out=tmp_path / "out", **{field: given})
    assert error.value.field == field
    assert not (tmp_path / "out").exists()


def test_one_number_stands_for_itself() -> None:
    numbers = {"speeds": 0.6, "sizes": np.float64(0.3), "gaps": 2, "obstacle_speeds": 1.0}
    made = selection_of({**numbers, "worlds": np.int64(3), "batches": "NO", "seeds": [0, 3], "repetitions": 2})
    assert made == Selection(
        batches=("NO",), speeds=(0.6,), sizes=(0.3,), gaps=(2.0,), obstacle_speeds=(1.0,), repetitions=2, worlds=(3,), seeds=(0, 3),
    )  # fmt: skip
    assert {type(value) for value in (*made.sizes, *made.gaps)} == {float}
    assert type(made.worlds[0]) is int


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
