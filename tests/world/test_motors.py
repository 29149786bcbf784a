"""Motors that lag and wheels that slip, against formulas and a second reading in plain Python."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from test_bases import CAR, OMNI, commands, plainly
from worlds import DRIVE, SILENT, Pilot, body, constant, make_robot, make_scenario, run

from clearway.contract import Command, Latency
from clearway.geometry.shapes import rectangle
from clearway.robots.ideal import ideal
from clearway.trials import Trial

AT_ONCE = DRIVE | {"acceleration": math.inf, "deceleration": math.inf,
                   "angular_acceleration": math.inf, "angular_deceleration": math.inf}  # fmt: skip
FAR = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 4.0}]

lags = st.floats(0.02, 1.0)


def driven(drive: dict[str, Any], plan: list[Command], pilot: Pilot | None = None, **changes: Any) -> Trial:
    """Each command of `plan` for half a second, the last one to the end, decided by whoever `pilot` is."""
    pilot = pilot or constant(0.0)
    pilot.rule = lambda _: plan[min((len(pilot.seen) - 1) // 5, len(plan) - 1)]
    return run(pilot, scenario=make_scenario(legs=FAR, speed=9.0), robot=make_robot(drive=drive, **changes))


@given(
    lag=lags, v=st.floats(0.1, 2.0), omega=st.floats(-2.0, 2.0), slip=st.floats(0.0, 0.5), turn_slip=st.floats(0.0, 0.5)
)
@settings(max_examples=15)
def test_a_step_is_followed_by_first_order(lag: float, v: float, omega: float, slip: float, turn_slip: float) -> None:
    """From rest, without other limits: v (1 - exp(-t / lag)), and the way that belongs to it, less what slips."""
    trial = driven(AT_ONCE | {"lag": lag, "slip_ratio": slip, "turn_slip_ratio": turn_slip}, [Command(v, omega)])
    assert trial.velocity is not None
    share, grip = 1.0 - np.exp(-trial.t / lag), 1.0 - turn_slip
    assert trial.velocity[:, 0] == pytest.approx((1.0 - slip) * v * share, abs=1e-9)
    assert trial.velocity[:, 1] == pytest.approx(grip * omega * share, abs=1e-9)
    assert np.unwrap(trial.pose[:, 2]) == pytest.approx(grip * omega * (trial.t - lag * share), abs=1e-9)


@given(plan=commands, lag=lags, drive=st.sampled_from([DRIVE, OMNI, CAR]))
@settings(max_examples=25)
def test_lag_and_limits_against_a_second_reading(
    plan: list[tuple[float, float, float]], lag: float, drive: dict[str, Any]
) -> None:
    told = plan if drive is OMNI else [(v, omega, 0.0) for v, omega, _ in plan]
    trial = driven(drive | {"lag": lag}, [Command(v, omega, v_y=v_y) for v, omega, v_y in told])
    x, y, theta = plainly(drive, told, float(trial.t[-1]), lag)
    assert trial.pose[-1, :2] == pytest.approx((x, y), abs=0.02)
    assert math.remainder(trial.pose[-1, 2] - theta, math.tau) == pytest.approx(0.0, abs=0.02)


@given(lag=lags, v=st.floats(0.2, 2.0), brake=st.floats(0.5, 10.0))
@settings(max_examples=15)
def test_who_brakes_ends_where_one_does_that_brakes_later_by_the_lag(lag: float, v: float, brake: float) -> None:
    """So lag counts as latency for who plans: a braking base is never ahead of one whose command is followed so much later."""
    base = AT_ONCE | {"deceleration": brake, "v_max": 2.0}
    scenario = make_scenario(legs=[{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 16.0}], speed=9.0)

    def braking(drive: dict[str, Any], command: float) -> Trial:
        pilot = Pilot(lambda s: Command(v if s.t < 4.95 else 0.0, 0.0))
        return run(pilot, scenario=scenario, robot=make_robot(drive=drive, latency={"command": command}))

    lagging, late = braking(base | {"lag": lag}, 0.0), braking(base, lag)
    gone = v * lag * math.exp(-5.0 / lag)  # what it was still slower than v when it began to brake
    assert lagging.pose[-1, 0] == pytest.approx(late.pose[-1, 0], abs=2e-3 + gone)
    braked = lagging.t > 4.95
    assert (lagging.pose[braked, 0] <= late.pose[braked, 0] + gone + 1e-9).all()


def test_it_comes_to_stand() -> None:
    """Friction holds what has become slower than a millimetre a second: else it would creep for ever."""
    trial = driven(DRIVE | {"lag": 0.3}, [Command(1.0, 0.5), Command(0.0, 0.0)])
    assert trial.velocity is not None
    assert not trial.velocity[-1].any()
    assert trial.velocity[8].all()


def test_the_instant_of_a_contact_while_it_lags() -> None:
    """1 m/s with a lag of 0.5 s: t - 0.5 (1 - exp(-2 t)) m are driven; the wall is 1 m away."""
    scenario = make_scenario(legs=FAR, speed=1.0)
    trial = run(constant(1.0), [body(rectangle(1, 1), 1.75, 0)], scenario, make_robot(drive=AT_ONCE | {"lag": 0.5}))
    assert trial.velocity is not None
    assert trial.pose[-1, 0] == pytest.approx(1.0, abs=2e-5)
    t = float(trial.t[-1])
    assert t - 0.5 * (1.0 - math.exp(-2.0 * t)) == pytest.approx(1.0, abs=5e-5)
    assert trial.velocity[-1, 0] == pytest.approx(1.0 - math.exp(-2.0 * t), abs=1e-4)


@given(plan=commands, lag=lags)
@settings(max_examples=10)
def test_other_bases_lag_within_what_they_can_do(plan: list[tuple[float, float, float]], lag: float) -> None:
    told = [Command(v, omega, v_y=v_y) for v, omega, v_y in plan]
    car, omni = driven(CAR | {"lag": lag}, told), driven(OMNI | {"lag": lag, "speed_max": 1.1}, told)
    assert car.velocity is not None
    assert omni.velocity is not None
    curved = np.abs(car.velocity[:, 1]) - np.abs(car.velocity[:, 0]) * math.tan(CAR["steering_max"]) / CAR["wheelbase"]
    assert curved.max() < 1e-9
    assert np.hypot(omni.velocity[:, 0], omni.velocity[:, 2]).max() < 1.1 + 1e-9


@pytest.mark.parametrize("sensing", [0.0, 0.13])
@pytest.mark.parametrize("lag", [0.0, 0.2])
@pytest.mark.parametrize("drive", [DRIVE, OMNI, CAR])
def test_odometry_tells_what_the_wheels_of_a_slipping_base_do(
    drive: dict[str, Any], lag: float, sensing: float
) -> None:
    """The same as where nothing slips, however late it is told, while it speeds up and brakes on a bend; the base falls behind."""
    side = 0.4 if drive is OMNI else 0.0
    plan = [Command(0.8, 0.5, v_y=side), Command(0.8, 0.5, v_y=side), Command(0.2, -0.4), Command(0.0, 0.0)]
    told, firmly = Pilot(lambda s: plan[0]), Pilot(lambda s: plan[0])
    late = {"latency": {"sensing": sensing}}
    slips = driven(drive | {"lag": lag, "slip_ratio": 0.1, "turn_slip_ratio": 0.3}, plan, told, **late)
    firm = driven(drive | {"lag": lag}, plan, firmly, **late)
    for seen, expected in zip(told.seen, firmly.seen, strict=True):
        assert seen.odom_pose == pytest.approx(expected.odom_pose, abs=1e-9)
        assert seen.odom_velocity == pytest.approx(expected.odom_velocity, abs=1e-9)
    assert slips.velocity is not None
    assert firm.velocity is not None
    assert slips.velocity[:, 0] == pytest.approx(0.9 * firm.velocity[:, 0], abs=2e-4)  # but for where it sticks
    assert slips.velocity[:, 1] == pytest.approx(0.7 * firm.velocity[:, 1], abs=2e-4)
    assert np.abs(firm.velocity).max(axis=0).min() > 0.2


def test_a_gyroscope_tells_how_far_a_slipping_base_turned() -> None:
    pilot, odometry = constant(0.5, 1.0), SILENT | {"gyro": True}
    robot = make_robot(
        drive=DRIVE | {"slip_ratio": 0.1, "turn_slip_ratio": 0.3}, odometry=odometry, latency={"sensing": 0.07}
    )
    trial = run(pilot, scenario=make_scenario(legs=FAR, speed=9.0), robot=robot)
    turned, told = np.unwrap(trial.pose[:, 2]), np.array([seen.odom_pose[2] for seen in pilot.seen])
    late = np.interp(trial.t - 0.07, trial.t, turned)
    assert np.unwrap(told)[5:] == pytest.approx(late[5:], abs=1e-3)
    assert turned[-1] > 1.5
    assert trial.velocity is not None
    assert pilot.seen[-1].odom_velocity == pytest.approx((trial.velocity[-1, 0] / 0.9, trial.velocity[-1, 1]), abs=1e-9)


def test_lag_is_told_as_latency_and_left_out_by_its_name() -> None:
    """`--ideal lag` takes it away, `--latency 0` doesn't; the task says what holds."""
    robot = make_robot(
        drive=DRIVE | {"lag": 0.3, "slip_ratio": 0.1, "turn_slip_ratio": 0.2}, latency={"sensing": 0.1, "command": 0.05}
    )
    for left_out, factor, expected in (
        ((), 1.0, Latency(0.1, 0.05, 0.0, 0.3)), (("lag",), 1.0, Latency(0.1, 0.05)), ((), 0.0, Latency(lag=0.3)),
    ):  # fmt: skip
        pilot = constant(0.5)
        run(pilot, scenario=make_scenario(legs=FAR, ideal=left_out, latency=factor), robot=robot)
        assert pilot.task.latency == expected
    assert Latency(0.1, 0.05, 0.02, 0.3).expected == pytest.approx(0.45)
    assert ideal(robot, ("slip",)).drive == robot.drive.model_copy(update={"slip_ratio": 0.0, "turn_slip_ratio": 0.0})
    assert ideal(robot, ("all",)).drive == make_robot().drive


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("lag", -0.1),
        ("lag", 3.0),
        ("lag", math.nan),
        ("slip_ratio", 1.0),
        ("turn_slip_ratio", -0.1),
        ("slip_ratio", "much"),
    ],
)
def test_what_no_motor_does_is_refused(field: str, value: Any) -> None:
    with pytest.raises(ValidationError, match=field):
        make_robot(drive=DRIVE | {field: value})
