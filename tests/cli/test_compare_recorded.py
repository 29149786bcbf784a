"""`clearway compare SIM REAL`, and before against after: what was matched how, and what is said of it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Shell

from clearway.geometry.shapes import Circle
from clearway.indicators import row_schema, score_row
from clearway.reports.grid import span
from clearway.trials import Attempt, Labels, Leg, Outcome, Span, Trial
from clearway.trials.store import TrialStore, write_partial


def straight(
    source: str, configuration: str, repetition: int, seconds: float, off: float = 0.05, legs: Sequence[str] = ()
) -> Trial:
    """5 m in so many seconds, ending `off` metres short."""
    t = np.linspace(0.0, seconds, 51)
    pose = np.stack([(5 - off) * t / seconds, 0 * t, 0 * t], axis=1)
    real = source == "recorded"
    attempt = Attempt(
        Labels("hospital", "NO", configuration, 0.6, repetition=repetition), "tiago", "recorded" if real else "move-base",
        "recorded", Circle(0.27), (Leg("forth", np.zeros(3), np.array([5.0, 0.0, 0.0]), 0.1, np.inf),), (), 0.6, seconds / 50,
        scenario=None if real else f"{configuration}-{repetition}", source=source,  # type: ignore[arg-type]
    )  # fmt: skip
    return Trial(
        attempt, t, pose, np.stack([np.full(51, 5 / seconds), 0 * t], axis=1), None, None, np.zeros(51, np.int64), np.empty((51, 0, 3)),
        (Span(0, 0.0, seconds, True),), (), Outcome.REACHED, sigma=np.full((51, 1, 2), 0.001) if real else None,
        provenance={"legs": list(legs)},
    )  # fmt: skip


def write(
    out: Path, source: str, times: dict[str, list[float]], off: float = 0.05, robots: dict[str, Any] | None = None,
    legs: Sequence[str] = (), **attempted: Any,
) -> Path:  # fmt: skip
    trials = [straight(source, c, k + 1, s, off, legs) for c, every in times.items() for k, s in enumerate(every)]
    trials = [replace(trial, attempt=replace(trial.attempt, **attempted)) for trial in trials]
    with TrialStore(out, {"clearway": "test", "robots": robots or {}}, len(trials), row_schema()) as store:
        for i, trial in enumerate(trials):
            write_partial(store.partial, store.key, i, trial, score_row(trial))
        store.finish()
    return out


@pytest.fixture
def sim(tmp_path: Path) -> Path:
    return write(tmp_path / "sim", "simulated", {"line": [10.0, 10.0, 10.0], "ramp": [12.0, 12.0, 12.0]})


@pytest.fixture
def real(tmp_path: Path) -> Path:
    return write(
        tmp_path / "real", "recorded", {"line": [11.0, 13.0], "ramp": [14.0, 16.0], "stairs": [99.0]}, off=0.12
    )


def test_sim_to_real(clearway: Shell, sim: Path, real: Path) -> None:
    said = clearway("compare", sim, real)
    assert said.code == 0, said.err
    assert "sim-to-real difference: 2 configurations in common, 0 + 1 without a partner" in said.out
    assert "matched by suite, batch, configuration, speed, obstacle_speed, size, gap, robot" in said.out
    assert f"{sim}: 6 trials, 3 of each configuration" in said.out
    assert f"{real}: 4 trials, 2 of each configuration" in said.out
    assert "success NO: 0 of 4 against 6 of 6, difference -100.0 points" in said.out
    ct = next(line for line in said.out.splitlines() if line.startswith("NO") and "CT [s]" in line)
    assert "+2.5" in ct

    [found] = json.loads(clearway("compare", sim, real, "--json").out)
    assert (found["kind"], found["source_a"], found["source_b"]) == ("sim-to-real difference", "simulated", "recorded")
    assert found["repetitions_b"] == {"trials": 4, "fewest": 2, "most": 2}
    assert (found["legs_by_motion_a"], found["legs_by_motion_b"]) == (0, 0)
    assert (found["configurations"], found["only_a"], found["only_b"]) == (2, 0, 1)
    rows = {r["indicator"]: r for r in found["differences"] if r["batch"] is None}
    assert rows["CT"]["mean_difference"] == pytest.approx(2.5)
    assert (rows["DE"]["mean_difference"], rows["DE"]["u_b"]) == (pytest.approx(0.07), pytest.approx(0.002))
    assert found["success"]["all"]["successes_b"] == 0


def test_the_page_says_how_a_simulation_and_a_recording_were_matched(
    clearway: Shell, sim: Path, tmp_path: Path
) -> None:
    real = write(tmp_path / "real", "recorded", {"line": [11.0, 13.0], "ramp": [14.0, 16.0]}, legs=["forth: departure"])
    assert clearway("compare", sim, real, "--out", tmp_path / "page").code == 0
    html = (tmp_path / "page" / "index.html").read_text()
    page = unescape(re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", html, flags=re.DOTALL)))
    for said in (
        "Clearway comparison Sim-to-real difference Tested.",
        f"{real} (recorded) against {sim} (simulated), sim-to-real difference over 2 configurations in common",
        "so few can show no difference in any indicator",
        "the smallest p that can come out is 0.50, 1.00 after Holm's correction",
        f"the repetitions of a configuration are averaged first; {sim}: 6 trials, 3 of each configuration",
        "part of the difference in the times, marked *, is how they were taken",
        f"* {real}: the legs of 4 trials were found by the robot's motion.",
        "CT* (s) 2 4 : 6 13.500 11.000 2.500 [",
        "over repetitions U p (Holm) better",
    ):
        assert said in page, said
    [found] = json.loads(clearway("compare", sim, real, "--json").out)
    [ct] = [r for r in found["differences"] if r["batch"] is None and r["indicator"] == "CT"]
    assert span(ct["rep_low"], ct["rep_high"], 3) in page
    assert "no difference shown" not in page.partition("Indicators")[2]
    one = write(tmp_path / "one", "recorded", {"line": [11.0]})
    clearway("compare", sim, one, "--out", tmp_path / "other")
    other = (tmp_path / "other" / "index.html").read_text()
    assert "over 1 configuration in common" in other
    assert "CT (s)" in other


def test_before_and_after(clearway: Shell, real: Path, tmp_path: Path) -> None:
    after = write(tmp_path / "after", "recorded", {"line": [10.0, 12.0], "ramp": [13.0, 15.0]})
    said = clearway("compare", real, after)
    assert "difference: 2 configurations in common, 1 + 0 without a partner" in said.out
    assert "sim-to-real" not in said.out
    [found] = json.loads(clearway("compare", real, after, "--json").out)
    assert next(r for r in found["differences"] if r["indicator"] == "CT")["mean_difference"] == pytest.approx(-1.0)
    assert found["matched_by"][-2:] == ["robot", "navigator"]


def test_simulations_are_still_paired_test_by_test(clearway: Shell, sim: Path, tmp_path: Path) -> None:
    other = write(tmp_path / "other", "simulated", {"line": [11.0] * 3, "ramp": [13.0] * 3})
    [found] = json.loads(clearway("compare", sim, other, "--json").out)
    tuned = {"tuned_a", "tuned_b"}
    assert (
        set(found)
        == {"a", "b", "other_robots", "pairs", "differ_in", "only_a", "only_b", "differences", "success"} | tuned
    )
    assert (found["pairs"], found["differ_in"]) == (6, [])
    assert "rep_low" not in found["differences"][0]


def test_nothing_in_common(clearway: Shell, sim: Path, tmp_path: Path) -> None:
    elsewhere = write(tmp_path / "elsewhere", "recorded", {"stairs": [9.0]})
    said = clearway.complaint("compare", sim, elsewhere)
    assert "no configuration in common" in said
    assert "configuration stairs" in said


def test_robots_of_one_name_that_are_not_the_same_are_told(clearway: Shell, tmp_path: Path) -> None:
    one, two = (
        str(write(tmp_path / name, "simulated", {"line": [10.0]}, robots={"tiago": {"drive": {"v_max": v}}}))
        for name, v in (("one", 1.0), ("two", 0.9))
    )
    told = "Not the same robot in both: tiago.drive.v_max is 1.0 and 0.9."
    assert told in clearway("compare", one, two).out
    assert json.loads(clearway("compare", one, two, "--json").out)[0]["other_robots"] == [told]


def test_pairs_under_other_circumstances_are_told(clearway: Shell, tmp_path: Path) -> None:
    times = {"line": [10.0] * 2}
    one = write(tmp_path / "one", "simulated", times, localisation="truth", seed=0, tracking="", floor_plan="hall")
    two = write(
        tmp_path / "two", "simulated", times, localisation="odometry", seed=1, tracking="kalman", floor_plan="hall"
    )
    told = ["seed (0, 1)", "localisation (truth, odometry)"]  # who asks for no tracking is no other test
    said = clearway("compare", one, two, "--out", tmp_path / "page").out
    assert "the pairs differ in seed (0, 1) and in localisation (truth, odometry)" in said
    assert "the pairs differ in seed (0, 1) and in localisation" in (tmp_path / "page" / "index.html").read_text(
        "utf-8"
    )
    assert json.loads(clearway("compare", one, two, "--json").out)[0]["differ_in"] == told
