"""HP-ST as a navigator: whole trials in the real world, what each ingredient changes, and what it says to wrong options."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from space_time_scenes import OTHER, OWN, PERIOD, begun, drive, goal, line, observation, obstacles

from clearway.campaigns.conformance import check_navigator
from clearway.campaigns.pilot import compose
from clearway.contract import Status, Task
from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st import HpSt, HpStForesight
from clearway.navigators.hp_st.decision import EVADING, STATUSES, STORED
from clearway.navigators.registry import make_navigator
from clearway.perception import make_localiser, make_tracker
from clearway.robots import LatencySpec, load_robot
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome, Trial
from clearway.world import simulate

RESCUE = load_robot("rescue")
TRIALS = (("sar-case1", 0), ("sar-case1", 4), ("sar-case2", 1), ("sar-case3", 0))


@cache
def trial(suite: str, index: int, guarantee: str, factor: float | None = None) -> Trial:
    """A frozen scenario of a suite, driven as a run does it."""
    navigator = HpSt(guarantee)
    pilot = compose(navigator, make_localiser("truth", RESCUE), tracker=make_tracker("difference", RESCUE))
    scenario = load_suite(suite).build(RESCUE, Selection(disturbance=factor))[index]
    return simulate(scenario, RESCUE, pilot, navigator="hp-st", localisation="truth", map=None)


def said(trial: Trial, kind: str) -> set[str]:
    return {e.detail for e in trial.events if e.kind == kind}


@pytest.mark.slow
@pytest.mark.parametrize("guarantee", HpSt.GUARANTEES)
@pytest.mark.parametrize(("suite", "index"), TRIALS)
def test_whole_trials(suite: str, index: int, guarantee: str) -> None:
    ran = trial(suite, index, guarantee)
    assert ran.outcome in (Outcome.REACHED, Outcome.COLLISION)
    assert ran.velocity is not None
    assert np.abs(ran.velocity[:, 0]).max() > 0.9 * ran.attempt.speed_limit  # it has driven
    assert said(ran, "status") <= {*STATUSES, Status.ARRIVING}  # the suites' goals leave the heading free
    if guarantee == "passive":
        # the suites push a robot that stands, too, which isn't assumed of them
        assert all(text.endswith("assumed at most 0.0000") for text in said(ran, "assumption"))
        assert all(text.endswith("robot at 0.000 m/s") for text in said(ran, "contact"))


@pytest.mark.parametrize("guarantee", HpSt.GUARANTEES)
@pytest.mark.parametrize("index", [0, 4, 7])
@pytest.mark.parametrize("suite", ["sar-case1", "sar-case2", "sar-case3", "sar-stress"])
def test_nothing_is_said_while_the_assumptions_hold(suite: str, index: int, guarantee: str) -> None:
    assert said(trial(suite, index, guarantee), "assumption") == set()


@pytest.mark.parametrize(("suite", "index"), [("sar-case1", 2), ("sar-misspecified", 0), ("sar-misspecified", 2)])
def test_evasive_gets_out_of_the_way_where_passive_stands_and_is_hit(suite: str, index: int) -> None:
    stood, went = trial(suite, index, "passive"), trial(suite, index, "evasive")
    assert all(text.endswith("robot at 0.000 m/s") for text in said(stood, "contact"))
    assert stood.outcome is Outcome.COLLISION
    assert went.outcome is Outcome.REACHED
    assert STATUSES[EVADING] in said(went, "status")
    assert STATUSES[EVADING] not in said(stood, "status")


@pytest.mark.parametrize(("suite", "index"), [("sar-case1", 0), ("sar-case1", 4)])
def test_evasive_is_passive_where_nobody_would_hit_it(suite: str, index: int) -> None:
    stood, went = trial(suite, index, "passive"), trial(suite, index, "evasive")
    assert STATUSES[EVADING] not in said(went, "status")
    assert np.array_equal(went.pose, stood.pose)


@pytest.mark.parametrize("latency", [{"sensing": 0.05}, {"sensing": 0.037, "command": 0.15}, {"command": 0.1}])
@pytest.mark.parametrize(("suite", "index"), [("sar-stress", 0), ("sar-stress", 3), ("sar-case2", 1)])
def test_one_that_senses_and_acts_late_keeps_the_guarantee(suite: str, index: int, latency: dict[str, float]) -> None:
    robot = RESCUE.model_copy(update={"latency": LatencySpec(**latency)})
    navigator = HpSt("passive")
    pilot = compose(navigator, make_localiser("truth", robot), tracker=make_tracker("difference", robot))
    scenario = load_suite(suite).build(robot, Selection())[index]
    ran = simulate(scenario, robot, pilot, navigator="hp-st", localisation="truth", map=None)
    assert ran.velocity is not None
    assert np.abs(ran.velocity[:, 0]).max() > 0.5 * ran.attempt.speed_limit  # it has driven
    assert all(text.endswith("assumed at most 0.0000") for text in said(ran, "assumption"))
    assert all(text.endswith("robot at 0.000 m/s") for text in said(ran, "contact"))


def test_the_same_seed_the_same_trial() -> None:
    ran, again = (run("sar-case3", 0, "passive") for run in (trial, trial.__wrapped__))
    assert np.array_equal(again.pose, ran.pose)
    assert np.array_equal(again.command, ran.command)


def test_most_of_them_arrive_about_as_fast_as_a_clairvoyant() -> None:
    ran = [trial(*which, guarantee) for which in TRIALS for guarantee in HpSt.GUARANTEES]
    reached = [r for r in ran if r.outcome is Outcome.REACHED]
    assert len(reached) >= 7
    shares = [r.t[-1] / r.attempt.optimal_time for r in reached if r.attempt.optimal_time is not None]
    assert min(shares) >= 0.99
    assert np.median(shares) < 1.12


def test_twice_the_disturbance_is_said() -> None:
    texts = said(trial("sar-case1", 0, "passive", 2.0), "assumption")
    assert texts
    assert any(text.startswith("disturbance: ended 0.01") for text in texts)


@pytest.mark.parametrize(
    ("robot", "guarantee"),
    [
        ("rescue", "none"),
        pytest.param("rescue", "passive", marks=pytest.mark.slow),
        pytest.param("hosbot", "none", marks=pytest.mark.slow),
    ],
)
def test_it_conforms(robot: str, guarantee: str) -> None:
    """With the default, `passive`, tests/conformance asks it of a robot of the hospital; the other two by `-m slow`."""
    findings = list(check_navigator(lambda: HpSt(guarantee), load_robot(robot)))
    unmet = [f"{f.name}: {f.detail}" for f in findings if not f.passed]
    assert [u for u in unmet if "control period" not in u] == []


def crossing(t: float, pose: Any) -> Any:
    return obstacles([line(2.5, -2.2, 0.0, 0.8)(t), line(3.6, 2.6, 0.0, -0.7)(t)])


@pytest.mark.parametrize("without", ["", *HpSt.INGREDIENTS, "+".join(HpSt.INGREDIENTS)])
def test_it_runs_without_each_ingredient(without: str) -> None:
    went = drive(begun(without=without, within=(-2.0, -4.0, 8.0, 4.0)), (5.0, 0.0), crossing, 60, push=0.005)
    assert all(math.isfinite(c.v) and math.isfinite(c.omega) for c in went.commands)
    assert went.poses[-1][0] > 1.0


def test_without_reverse_no_command_is_negative() -> None:
    behind = (-3.0, 0.0)
    assert min(c.v for c in drive(begun(), behind, periods=20).commands) == -1.0
    assert min(c.v for c in drive(begun(without="reverse"), behind, periods=20).commands) >= 0.0


def test_without_horizon_it_looks_a_third_as_far() -> None:
    def looks(without: str) -> int:
        navigator = begun(without=without)
        navigator.step(observation(0.0, (0.0, 0.0, 0.0), goal(9.0, 0.0), obstacles()))
        return len(navigator.diagnostics().polylines["plan"]) - 1

    assert looks("") * PERIOD == pytest.approx(3.0)
    assert looks("horizon") * PERIOD == pytest.approx(0.9)


def test_without_candidates_there_is_one_way() -> None:
    def ways(without: str) -> int:
        navigator = begun(without=without)
        seen = obstacles([(1.5, 0.05)], moving=False, error=0.0)
        navigator.step(observation(0.0, (0.0, 0.0, 0.0), goal(4.0, 0.0), seen))
        return sum(name.startswith("way") for name in navigator.diagnostics().polylines)

    assert ways("") >= 2
    assert ways("candidates") == 1


def test_without_time_to_go_it_tracks_half_the_speed() -> None:
    """As paper B's reference does, 3 m: with it, all but the goal's radius at 1 m/s."""
    seconds = {w: PERIOD * len(drive(begun(without=w), (3.0, 0.0)).commands) for w in ("", "time-to-go")}
    assert seconds[""] < 3.3
    assert 4.5 < seconds["time-to-go"] < 6.6


def test_without_a_certificate_it_drives_where_with_one_it_waits() -> None:
    """Something near has just come into view: it may rest, or come at 4.4 m/s."""

    def first(**options: Any) -> tuple[float, float]:
        command = begun(**options).step(observation(0.0, (0.0, 0.0, 0.0), goal(4.0, 0.0), obstacles([(0.8, 0.0)])))
        return command.v, command.omega

    assert first() == (0.0, 0.0)
    assert first(without="certificate") == first(guarantee="none") != (0.0, 0.0)


def test_what_nobody_knew_of_cuts_a_lidar_s_plan_short() -> None:
    """TIAGo drives in the open; then somebody shows in its way who comes at a walk: it brakes at once, as hard as it can."""
    robot = load_robot("tiago")
    navigator, aim = begun(robot, 0.6, guarantee="passive", obstacle_acceleration=2.0), goal(9.0, 0.0)
    pose, velocity, t, ahead = np.zeros(3), np.zeros(2), 0.0, []
    for k in range(25):
        seen = obstacles([(pose[0] + 1.4, 0.0)], 0.25, (-1.3, 0.0), 0.05) if k >= 20 else obstacles()
        command = navigator.step(observation(t, pose, aim, seen, velocity))
        limits = robot.limits(0.6)
        dv = np.clip(command.v - velocity[0], -limits.deceleration * robot.period, limits.acceleration * robot.period)
        velocity = np.array([velocity[0] + dv, command.omega])
        pose = pose + np.array([velocity[0] * robot.period, 0.0, 0.0])
        ahead.append((command.v, command.status))
        t += robot.period
    assert min(v for v, _ in ahead[15:20]) > 0.5
    assert ahead[20:22] == [(0.0, STATUSES[STORED])] * 2


def test_without_forecast_a_swing_is_a_straight_line() -> None:
    """The plan's end differs once an oscillation has been seen long enough."""

    def plans(without: str) -> Any:
        navigator = begun(without=without, guarantee="none")
        for k in range(20):
            at = 1.2 * math.cos(0.7 * k * PERIOD)
            navigator.step(observation(k * PERIOD, (0.0, 0.0, 0.0), goal(6.0, 0.0), obstacles([(2.2, at)])))
        return navigator.diagnostics().circles["forecast"]

    known, straight = plans(""), plans("forecast")
    assert not np.allclose(known, straight)
    steps = np.diff(straight[:, :2], axis=0)  # equal steps: constant velocity
    assert steps[0] == pytest.approx(steps[1], abs=1e-9)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"guarantee": "pasive"}, "guarantee: unknown guarantee 'pasive'; did you mean 'passive'?"),
        ({"without": "revers"}, "without: unknown ingredient 'revers'; did you mean 'reverse'?"),
        ({"without": "reverse+horizn"}, "without: unknown ingredient 'horizn'; did you mean 'horizon'?"),
        ({"layers": 0}, "hp-st: layers: "),
        ({"layers": 2.5}, "hp-st: layers: "),
        ({"contact_cost": math.nan}, "hp-st: contact_cost: "),
        ({"discount": 1.5}, "hp-st: discount: "),
        ({"margins": 0.1}, "hp-st: margins: "),
        ({"reverse": "perhaps"}, "hp-st: reverse: "),
        ({"obstacle_speed": -1.0}, "hp-st: obstacle_speed: "),
    ],
)
def test_wrong_options(options: dict[str, Any], says: str) -> None:
    with pytest.raises(ClearwayError) as raised:
        make_navigator("hp-st", **options)
    assert str(raised.value).startswith(says)
    value = next(iter(options.values()))
    assert says.startswith("hp-st: margins") or str(value).split("+")[-1] in str(raised.value)


def test_foresight_needs_the_truth() -> None:
    with pytest.raises(ClearwayError, match="hp-st-foresight"):
        HpStForesight().reset(Task(PERIOD, 1.0, np.zeros(3)), RESCUE, np.random.default_rng(0))


def test_foresight_knows_of_a_turn_that_nobody_could_expect() -> None:
    """It comes straight at the way, and goes back before it: whoever knows drives on at full speed."""

    def at(t: float) -> tuple[float, float]:
        return 3.0, -2.2 + (1.2 * t if t < 1.0 else 1.2 - 1.2 * (t - 1.0))

    def truth(t: float) -> Any:
        return np.array([[*at(t), OTHER, 1.0]])

    times = []
    for navigator in (HpSt("none"), HpStForesight("none")):
        task = Task(PERIOD, 1.0, np.zeros(3), obstacle_oracle=truth)
        navigator.reset(task, load_robot("rescue:unlimited"), np.random.default_rng(0))
        went = drive(navigator, (5.0, 0.0), lambda t, pose: obstacles([at(t)]), 80)
        assert went.arrived
        times.append(len(went.commands))
    assert times[1] * PERIOD < 5.2
    assert times[1] <= times[0]


def test_it_keeps_to_what_its_certificate_asks() -> None:
    """Where it did not, each other period at full speed was refused, and it braked beside what stands within the tube."""
    gap = [(2.0, OWN + OTHER + 0.08), (2.0, -OWN - OTHER - 0.08)]
    went, bold = (
        drive(
            begun(RESCUE, guarantee=guarantee, pose_error=0.04), (5.0, 0.0), lambda t, pose: obstacles(gap, moving=False), 120
        )
        for guarantee in ("passive", "none")
    )  # fmt: skip
    assert went.arrived
    assert STATUSES[STORED] not in {c.status for c in went.commands}
    assert 0.8 < max(c.v for c in went.commands) < 0.96
    assert max(c.v for c in bold.commands) > 0.99
    rooms = [min(math.dist(p[:2], o) for p in w.poses for o in gap) - OWN - OTHER for w in (went, bold)]
    assert rooms[0] > 0.1, "around the gap"
    assert rooms[1] < 0.085, "through it"


@pytest.mark.parametrize("guarantee", HpSt.GUARANTEES)
def test_beside_who_moves_it_is_no_faster_than_headway_lets_it_be(guarantee: str) -> None:
    beside = (2.5, 1.0)

    def passes(**options: Any) -> tuple[FloatArray, FloatArray]:
        """The speed that it is told, and the room that there is then."""
        went = drive(
            begun(guarantee=guarantee, obstacle_speed=0.1, obstacle_acceleration=0.1, unseen_speed=0.0, **options), (5.0, 0.0),
            lambda t, pose: obstacles([beside]), 200,
        )  # fmt: skip
        assert went.arrived
        rooms = [math.dist(p[:2], beside) - OWN - OTHER for p in went.poses[: len(went.commands)]]
        return np.array([c.v for c in went.commands]), np.array(rooms)

    speed, room = passes()
    assert (speed > 0.2 + room).any()
    speed, room = passes(headway=1.0, creep=0.2)
    assert (np.abs(speed) <= 0.2 + room + 0.02).all()  # it errs about who moves
    assert speed.max() > 0.9, "while nobody is near"


@pytest.mark.parametrize("guarantee", HpSt.GUARANTEES)
def test_it_is_not_slow_where_it_would_be_hit_if_it_stood(guarantee: str) -> None:
    """Somebody comes from behind, faster than it may drive beside who moves."""
    went = drive(
        begun(guarantee=guarantee, headway=4.0, creep=0.1), (8.0, 0.0),
        lambda t, pose: obstacles([(-1.5 + 0.6 * t, 0.0)]), 100,
    )  # fmt: skip
    assert went.arrived
    assert went.contact is None


def test_a_wide_margin_is_kept_whatever_nearness_costs() -> None:
    """What stands farther than `soft` is passed over, so that has to reach as far as the margin."""
    costs = begun(RESCUE, pose_error=0.04)._wishes
    assert costs.margin > 0.1
    assert costs.soft >= costs.margin
