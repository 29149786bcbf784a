"""`clearway run --without --guarantee --disturbance`: variants beside the navigators, and what the terminal shows of them."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest
from command_line import Shell

import clearway

pytestmark = pytest.mark.slow

TRIES = f"{Path(__file__).parents[1] / 'campaigns' / 'dodging_variants.py'}:Tries"
FEW = ("sar-case2", "--seeds", "0:3", "--workers", "1")


def test_variants_run_on_the_same_seeds_and_the_ablation_is_printed(clearway: Shell, tmp_path: Path) -> None:
    out = tmp_path / "r"
    ran = clearway(
        "run", *FEW, "-n", TRIES, "-n", "move-base", "--without", "waits", "--guarantee", "none", "--no-report", "--out", out
    )  # fmt: skip
    assert ran.code == 0, ran.err
    rows = pq.read_table(out / "trials.parquet").to_pylist()
    full, variant = f"{TRIES}[guarantee=none]", f"{TRIES}[guarantee=none,without=waits]"
    assert [r["navigator"] for r in rows] == [full] * 3 + [variant] * 3 + ["move-base"] * 3
    assert [r["scenario"] for r in rows[:3]] == [r["scenario"] for r in rows[3:6]]
    assert sum(r["violations"] for r in rows[:3]) > 0 == sum(r["violations"] for r in rows[3:6])
    assert "what each ingredient brings" in ran.out
    assert "without waits" in ran.out
    assert "could have been avoided" in ran.out
    contacts = [r for r in rows if r["outcome"] == "collision"]
    assert contacts
    assert all(r["avoidable"] for r in contacts)
    assert clearway("run", "--resume", out, "--no-report").code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-n", TRIES, "--without", "wait"), "--without: unknown ingredient 'wait'; did you mean 'waits'? known: speed, waits"),
        (("--without", "waits"), "--without: none of the navigators has ingredients: move-base"),
        (("-n", TRIES, "--guarantee", "activ"), "--guarantee: unknown guarantee 'activ'; did you mean 'passive'? known: none, passive"),
        (("--guarantee", "none"), "--guarantee: none of the navigators has guarantees: move-base"),
    ],
)  # fmt: skip
def test_what_no_navigator_knows_is_refused(clearway: Shell, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    complaint = clearway.complaint("run", *FEW, *words, "--out", tmp_path / "r")
    assert complaint.startswith(f"clearway: {said}"), complaint
    assert not (tmp_path / "r").exists()


def test_the_disturbance_is_multiplied(tmp_path: Path) -> None:
    """Where the same start leads after one control period: displaced by at most 1 cm, twice as much when doubled."""
    ways = []
    for factor in (None, 2.0, 0.0):
        results = clearway.run(
            "sar-case1", seeds=(0, 1), navigators=[TRIES], disturbance=factor, workers=1, out=tmp_path / str(factor)
        )
        assert results.campaign["plan"]["selection"]["disturbance"] == factor
        ways.append(results.trial(0).pose[1:3])
    once, twice, none = ways
    assert abs(2 * (once[0] - none[0])[:2] - (twice[0] - none[0])[:2]).max() < 2e-3
    assert abs(once[0] - none[0])[:2].max() > 1e-4
