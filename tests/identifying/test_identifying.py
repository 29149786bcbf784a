"""How a base answers, found again: by a second reading of the model, in the world's own robots, and from bags."""

from __future__ import annotations

import json
import math
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1] / "recordings"))
sys.path.insert(0, str(Path(__file__).parents[1] / "world"))

from made_bags import START, Robot, write_mcap
from worlds import DRIVE, Pilot, constant, make_robot, make_scenario, run

from clearway.cli import main
from clearway.contract import Command
from clearway.errors import ClearwayError
from clearway.geometry.motion import ramp
from clearway.geometry.shapes import FloatArray
from clearway.identifying import Findings, fit, identify, identify_recording
from clearway.identifying.response import Response, answer
from clearway.recordings import formats
from clearway.recordings.exports.export import export
from clearway.recordings.recording import Want

STEPS = [(0.8, 0.0), (0.0, 0.0), (0.0, 0.9), (0.0, 0.0), (-0.5, 0.0), (0.4, 0.6), (0.0, -0.9), (0.0, 0.0)]
"""m/s and rad/s, each for two seconds."""


@pytest.fixture(autouse=True)
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that it is quick; the intervals are those of fewer draws."""
    monkeypatch.setattr(fit, "DRAWS", 12)


def plainly(when: FloatArray, told: FloatArray, response: Response, at: FloatArray) -> FloatArray:
    """The same in steps of a millisecond."""
    aim = wheels = 0.0
    now, out = min(at[0], when[0] + response.latency), []
    for t in at:
        n = max(1, math.ceil((t - now) / 1e-3))
        h = (t - now) / n
        for k in range(n if h > 0.0 else 0):
            row = int(np.searchsorted(when + response.latency, now + (k + 0.5) * h)) - 1
            goal = told[row] if row >= 0 else 0.0
            aim, mean = ramp(aim, goal, response.acceleration, response.deceleration, h)
            wheels = mean + (wheels - mean) * math.exp(-h / response.lag)
        now = t
        out.append(wheels)
    return np.array(out)


speeds = st.floats(-2.0, 2.0).map(lambda x: round(x, 2))


@given(
    told=st.lists(speeds, min_size=1, max_size=5),
    gaps=st.lists(st.floats(0.05, 1.0), min_size=5, max_size=5),
    latency=st.floats(-0.2, 0.6),
    lag=st.floats(0.005, 1.0),
    up=st.floats(0.3, 20.0),
    down=st.floats(0.3, 20.0),
)
@settings(max_examples=40)
def test_an_answer_against_a_second_reading(
    told: list[float], gaps: list[float], latency: float, lag: float, up: float, down: float
) -> None:
    when, response = np.cumsum(gaps)[: len(told)], Response(latency, lag, up, down)
    at, found = np.arange(0.0, 5.0, 0.033), np.empty(152)
    answer(when, np.array(told), response, at, found)
    assert found == pytest.approx(plainly(when, np.array(told), response, at), abs=0.02)


def drive(seconds: float = 2.0, latency: float = 0.0, noise: float = 0.0, **changes: Any) -> tuple[FloatArray, ...]:
    """When what was commanded, and when what was measured, in the world: `STEPS` three times."""
    pilot, each = constant(0.0), round(seconds / 0.1)
    plan = [Command(v, omega) for v, omega in STEPS] * 3
    pilot.rule = lambda _: plan[min((len(pilot.seen) - 1) // each, len(plan) - 1)]
    legs = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": seconds * len(plan)}]
    robot = make_robot(drive=DRIVE | changes, **({"latency": {"command": latency}} if latency else {}))
    trial = run(pilot, scenario=make_scenario(legs=legs, speed=9.0), robot=robot)
    assert trial.velocity is not None
    measured = trial.velocity[:, :2] + noise * np.random.default_rng(1).normal(size=(len(trial.t), 2))
    return trial.t[: len(trial.command)], trial.command[:, :2].copy(), trial.t, measured


@pytest.mark.parametrize(
    ("lag", "latency"),
    [pytest.param(0.0, 0.0, marks=pytest.mark.slow), (0.25, 0.12), pytest.param(0.06, 0.3, marks=pytest.mark.slow)],
)
def test_a_robots_own_values_are_found_again(lag: float, latency: float) -> None:
    found = identify(*drive(lag=lag, latency=latency, noise=0.005))
    assert found.latency.low - 0.005 <= latency <= found.latency.high + 0.005
    assert found.latency.value == pytest.approx(latency, abs=0.02)
    if lag:
        assert found.lag is not None
        assert found.lag.value == pytest.approx(lag, abs=0.02)
    else:
        assert found.lag is None or found.lag.value < 0.02
    v, omega = found.answers
    assert v.acceleration is not None
    assert v.acceleration.value == pytest.approx(DRIVE["acceleration"], rel=0.05)
    assert v.deceleration is not None
    assert v.deceleration.value == pytest.approx(DRIVE["deceleration"], rel=0.15)
    assert omega.acceleration is not None
    assert omega.acceleration.value == pytest.approx(1.0, rel=0.1)
    assert v.error < 0.01 < 0.05 < v.error_at_once


def test_a_base_that_can_do_less_than_it_is_told_has_levels_of_its_own() -> None:
    when, commands, at, measured = drive(lag=0.2, v_max=0.3, v_min=-0.3)
    found = identify(when, commands, at, measured)
    reached = {(v, omega): level for v, omega, level in found.answers[0].reached}
    assert reached[0.8, 0.0] == pytest.approx(0.3, abs=0.005)
    assert reached[-0.5, 0.0] == pytest.approx(-0.3, abs=0.005)
    assert found.lag is not None
    assert found.lag.value == pytest.approx(0.2, abs=0.02)


@pytest.mark.slow
def test_a_files_answer_is_judged_beside() -> None:
    when, commands, at, measured = drive(lag=0.2, latency=0.1)
    right, wrong = Response(0.1, 0.2, 0.5, 2.0), Response(0.0, 0.001, 0.5, 2.0)
    turning = Response(0.1, 0.2, 1.0, 4.0)
    good, bad = (identify(when, commands, at, measured, (own, turning)).answers[0] for own in (right, wrong))
    assert good.error_of_robot is not None
    assert good.error_of_robot < 0.005
    assert bad.error_of_robot is not None
    assert bad.error_of_robot > 0.02


@pytest.mark.slow
def test_readings_that_were_not_taken_change_nothing() -> None:
    when, commands, at, measured = drive(lag=0.2, noise=0.005)
    measured[::7] = np.nan
    found = identify(when, commands, at, measured)
    assert found.lag is not None
    assert found.lag.value == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize("what", ["stands", "too short", "nothing after", "no commands"])
def test_a_robot_that_moves_too_little_is_refused(what: str) -> None:
    when, commands, at, measured = drive()
    match what:
        case "stands":
            commands, measured = 0.0 * commands, 0.0 * measured
        case "too short":
            when, commands, at, measured = when[:150], commands[:150], at[:150], measured[:150]
        case "nothing after":
            at = at - 1e4
        case _:
            when, commands = when[:0], commands[:0]
    with pytest.raises(ClearwayError, match=r"6 are needed|nothing is measured"):
        identify(when, commands, at, measured)


def bag(folder: Path, stamped: bool = False, twist: bool = True, topics: tuple[str, ...] = ("/cmd_vel",)) -> Path:
    """A bag of what `drive` gives."""
    r, lines = Robot(2), []
    when, commands, at, measured = drive(lag=0.2, latency=0.1)
    for t, (v, omega) in zip(when, commands, strict=True):
        ns = START + round(t * 1e9)
        m = r.make("geometry_msgs/msg/Twist", r.vector(v, 0.0, 0.0), r.vector(0.0, 0.0, omega))
        kind, late = "geometry_msgs/msg/Twist", 0
        if stamped:  # recorded late, stamped right
            kind, m, late = (
                "geometry_msgs/msg/TwistStamped",
                r.make("geometry_msgs/msg/TwistStamped", r.header(ns, ""), m),
                40_000_000,
            )
        lines += [(topic, kind, ns + late, m) for topic in topics]
    x = 0.0
    for t, (v, omega) in zip(at, measured, strict=True):
        ns, x = START + round(t * 1e9), x + 0.1 * v
        o = r.odometry(ns, x, 0.0, 0.0)
        o.twist.twist.linear.x, o.twist.twist.angular.z = (v, omega) if twist else (0.0, 0.0)
        lines.append(("/odom", "nav_msgs/msg/Odometry", ns, o))
    path = folder / 'a "run".mcap'
    write_mcap(path, sorted(lines, key=lambda line: line[2]))
    return path


@pytest.mark.parametrize("stamped", [pytest.param(False, marks=pytest.mark.slow), True])
def test_a_bag_tells_it_in_lines_of_a_robots_file(
    stamped: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = bag(tmp_path, stamped)
    assert {e.name: e.kind for e in formats.look(path).entries} == {"/cmd_vel": "command", "/odom": "odometry"}
    monkeypatch.setattr(sys, "argv", ["clearway", "identify", str(path), "--robot", "hosbot"])
    with pytest.raises(SystemExit, match="0"):
        main()
    said = capsys.readouterr().out
    lines = tomllib.loads(said[said.index("[drive]") :])
    assert lines["drive"]["lag"] == pytest.approx(0.2, abs=0.02)
    assert lines["drive"]["acceleration"] == pytest.approx(0.5, rel=0.05)
    assert lines["latency"]["command"] == pytest.approx(0.1, abs=0.02)
    assert set(lines["sources"]) == {f"{table}.{name}" for table in ("drive", "latency") for name in lines[table]}
    assert "as hosbot's file has it" in said
    monkeypatch.setattr(sys, "argv", ["clearway", "identify", str(path), "--json"])
    with pytest.raises(SystemExit, match="0"):
        main()
    told = json.loads(capsys.readouterr().out)
    assert told["identified"]["lag"]["value"] == pytest.approx(lines["drive"]["lag"], rel=0.01)


def test_of_a_car_the_speed_alone_is_told(tmp_path: Path) -> None:
    assert [a.velocity for a in identify_recording(bag(tmp_path), robot="f1tenth").identified.answers] == ["v"]


def test_a_latency_below_zero_goes_into_no_file(tmp_path: Path) -> None:
    when, commands, at, measured = drive(lag=0.2)
    found = identify(when + 0.3, commands, at, measured)
    assert found.latency.value == pytest.approx(-0.3, abs=0.02)
    assert "[latency]" not in Findings(tmp_path / "a.mcap", "/cmd_vel", "/odom", "", found, ()).toml()


@pytest.mark.slow
def test_a_trial_that_was_exported_is_identified(tmp_path: Path) -> None:
    """What the world did comes back through a bag of its own."""
    pilot: Pilot = constant(0.0)
    plan = [Command(v, omega) for v, omega in STEPS] * 2
    pilot.rule = lambda _: plan[min((len(pilot.seen) - 1) // 20, len(plan) - 1)]
    legs = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 2.0 * len(plan)}]
    robot = make_robot(drive=DRIVE | {"lag": 0.15}, latency={"command": 0.08})
    trial = run(pilot, scenario=make_scenario(legs=legs, speed=9.0), robot=robot)
    (path,) = export(trial, "mcap", tmp_path / "run.mcap", scans=False)
    found = identify_recording(path).identified
    assert found.lag is not None
    assert found.lag.value == pytest.approx(0.15, abs=0.01)
    assert found.latency.value == pytest.approx(0.08, abs=0.01)


def test_bad_bags_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="no measured velocities"):
        identify_recording(bag(tmp_path, twist=False))
    with pytest.raises(ClearwayError, match="has 2 topics of command"):
        identify_recording(bag(tmp_path, topics=("/cmd_vel", "/cmd_vel_nav")))
    assert (
        identify_recording(bag(tmp_path, topics=("/cmd_vel", "/cmd_vel_nav")), command="/cmd_vel").command == "/cmd_vel"
    )
    with pytest.raises(ClearwayError, match="/cmd_vel"):
        identify_recording(bag(tmp_path), command="/cmd_vle")


def test_commands_that_are_none_are_left_out(tmp_path: Path) -> None:
    r = Robot(2)
    lines = []
    for k, v in enumerate((0.1, math.nan, 0.3, math.inf, 0.5)):
        twist = r.make("geometry_msgs/msg/Twist", r.vector(v, 0.2, 0.0), r.vector(0.0, 0.0, -v))
        lines.append(("/cmd_vel", "geometry_msgs/msg/Twist", START + k * 10**8, twist))
    path = tmp_path / "run.mcap"
    write_mcap(path, lines)
    read = formats.read(path, Want(frozenset({"/cmd_vel"})))
    told = read.commands["/cmd_vel"]
    assert told.t == pytest.approx([0.0, 0.2, 0.4])
    assert told.velocity == pytest.approx(np.array([[0.1, 0.2, -0.1], [0.3, 0.2, -0.3], [0.5, 0.2, -0.5]]))
    assert any("2 commands are no velocities" in note for note in read.notes)
    assert not formats.read(path, Want()).commands  # by name only
