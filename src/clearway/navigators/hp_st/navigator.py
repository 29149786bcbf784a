"""The navigator `hp-st`: forecast, search through space and time, track, certify; once per period."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Collection
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Task
from clearway.errors import ClearwayError
from clearway.forecasts.forecast import Forecast, later
from clearway.forecasts.forecaster import Forecaster, PerfectForecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray, inscribed_radius
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.common.arrival import BEGIN, HEADING, Approach
from clearway.navigators.common.frame import OdometryFrame
from clearway.navigators.common.inputs import NOTHING, finite
from clearway.navigators.common.motion import stop_and_turn
from clearway.navigators.common.parametrised import Parametrised
from clearway.navigators.hp_st.assembly import assemble
from clearway.navigators.hp_st.decision import (
    EVADING,
    KEPT,
    PLANNED,
    STATUSES,
    STOPPED,
    STORED,
    Decision,
    choose,
    decide,
    evade,
)
from clearway.navigators.hp_st.environment.contact import slowed
from clearway.navigators.hp_st.environment.cooperation import Cooperation
from clearway.navigators.hp_st.environment.field import Field
from clearway.navigators.hp_st.environment.goal_distance import GoalDistance
from clearway.navigators.hp_st.environment.sight import Sight, hidden_within, looked_at
from clearway.navigators.hp_st.guarantee.assumption_monitor import AssumptionMonitor
from clearway.navigators.hp_st.guarantee.certificate import longest_certified, stopped_after
from clearway.navigators.hp_st.guarantee.sight_monitor import SightMonitor
from clearway.navigators.hp_st.guarantee.tube import Plan, Tube, drive, room, tube
from clearway.navigators.hp_st.parameters import (
    GUARANTEES,
    INGREDIENTS,
    Parameters,
    guarantee_from,
    ingredients_from,
)
from clearway.navigators.hp_st.search.costs import SearchCosts
from clearway.navigators.hp_st.search.manoeuvres import manoeuvres_of
from clearway.navigators.hp_st.ways import Memory, beside_who_moves, find, gather, pose_scene, widen
from clearway.robots import DriveKind, Robot, possible
from clearway.tuning import HOSPITAL, TunedOn

REACH = 0.6
"""Share of the goal's distance tolerance within which it plans to come: true poses err."""

CLOSE = 0.15
"""The same of a robot that stops at its goal, and share within which it begins to turn: DE is one of the indicators."""

FACED = 0.3
"""Share of the heading's tolerance within which its turn ends: the estimate errs by up to the whole of it."""

REFRESH = 0.3
"""What a lidar shows of what stands changes with every scan: so often the distances to the goal are made anew, s."""

IMMINENT = 2.0
"""Where those around make room a contact counts within that time, s: who comes later makes room until then."""

SURE = 0.2
"""They do where the probability that nobody makes room is less than that."""

LOOK = 0.3
"""For so long a lidar's tracker has to have somebody in view to tell that they move, s: it drives only where it has looked for that long."""

_LOOK_NOTE = "that it drives only where it has looked for a while"
_HEADWAY_NOTE = "how slowly it drives beside who moves"
_PROCEED_NOTE = "what it risks where nothing has a certificate"
_ROOM_NOTE = "how far ahead a contact counts where those around make room"
_EVERY_NOTE = "that it has the values of TIAGo and HOSBOT for the ward"


class HpSt(Parametrised[Parameters]):
    """Heuristic plan through space and time, tracked by a tube MPC, with a certificate before each step.

    Args:
        guarantee: With `evasive`, the default, what is certified is driven, and something else only where the robot would be
            hit, or nothing is certified and the risk of contact is at most `proceed`; with `passive` nothing else ever, so that it never moves at a contact while the assumptions hold
            (docs/guarantee.md); with `none` nothing is certified.
        without: Ingredients to leave out (INGREDIENTS), such as reverse+candidates.
        parameters: Any field of `parameters.Parameters`.

    Raises:
        ClearwayError: An option does not exist, or a parameter is out of its range.
    """

    parameters = Parameters
    needs: ClassVar[frozenset[Need]] = frozenset({"map", "obstacles"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional", "ackermann"})
    privileged: ClassVar[bool] = False
    tuned_on: tuple[TunedOn, ...] = (
        *(
            TunedOn(suite, ("rescue",), draws=draws)
            for suite, draws in (
                ("sar-case1", range(300)),
                ("sar-case2", range(300)),
                ("sar-case3", range(300)),
                ("sar-stress", range(300)),
                ("sar-confined", range(200, 230)),
            )
        ),
        TunedOn(
            "crowd",
            ("crowdnav-disc",),
            draws=range(200),
            note="how far ahead it looks, how sure forecasts are taken to be",
        ),
        *(TunedOn(suite, ("tiago", "hosbot", "jackal"), "hall", seeds=(3,)) for suite in HOSPITAL),
        *(TunedOn(suite, ("tiago", "hosbot"), "hall", seeds=(7,), note="the cost of nearness") for suite in HOSPITAL),
        TunedOn(
            "ward-day",
            ("tiago",),
            draws=range(3),
            note="the cost of contact, and for how long who is out of view is remembered",
        ),
        *(
            TunedOn(
                "ward-day", ("tiago",), draws=draws, note="what counts in a certificate, and when it brakes at once"
            )
            for draws in (range(1), range(10, 14), range(30, 34), range(50, 54))
        ),
        TunedOn("ward-day", ("tiago",), draws=range(20, 44), note=f"{_LOOK_NOTE}; how what is pushed is told"),
        TunedOn("ward-day-held-out", ("tiago",), draws=range(70, 73), note=_LOOK_NOTE),
        TunedOn("ward-day", ("tiago",), draws=range(120, 156), note=_HEADWAY_NOTE),
        TunedOn("ward-day-held-out", ("tiago",), draws=range(100, 106), note=_HEADWAY_NOTE),
        TunedOn("ward-day", ("tiago", "hosbot"), draws=range(120, 156), note=_PROCEED_NOTE),
        TunedOn("ward-day", ("tiago", "hosbot"), draws=range(160, 166), note=_PROCEED_NOTE),
        *(
            TunedOn("ward-day", ("tiago",), draws=draws, note=_ROOM_NOTE)
            for draws in (range(70, 74), range(120, 138), range(160, 178))
        ),
        TunedOn("ward-day", ("turtlebot4", "pepper"), draws=range(160, 164), note=_EVERY_NOTE),
        TunedOn(
            "ward-day",
            ("tiago-omni", "turtlebot3-waffle", "mir100", "husky", "whill"),
            draws=range(160, 162),
            note=_EVERY_NOTE,
        ),
        TunedOn(
            "hospital-blind",
            ("tiago", "hosbot", "tiago-omni", "turtlebot4"),
            "hall",
            speeds=(0.6,),
            note=_HEADWAY_NOTE,
        ),
        TunedOn(
            "hospital-held-out-blind",
            ("tiago", "hosbot", "turtlebot4", "tiago-omni", "pepper"),
            note=f"{_HEADWAY_NOTE}, and evades",
        ),
    )
    INGREDIENTS: ClassVar[tuple[str, ...]] = INGREDIENTS
    GUARANTEES: ClassVar[tuple[str, ...]] = GUARANTEES

    def __init__(self, guarantee: str = "evasive", without: Collection[str] | str = (), **parameters: float) -> None:
        self._guarantee, self._without = guarantee_from(guarantee), ingredients_from(without)
        if guarantee == "evasive":
            self.tuned_on = (*_EVASIVE, *self.tuned_on)
        super().__init__(**parameters)
        self._decision: Decision | None = None

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial.

        Raises:
            ClearwayError: A parameter in the robot's file is wrong.
        """
        p = self.read_parameters(robot)
        made = assemble(p, task, robot, self._guarantee, self._without)
        self._settings, self._base, self._wishes, self._safety, self._rules, self._evasion = made
        sight, car = self._rules.sight, made.base.limits.kind == "ackermann"
        self._sight, self._headings = sight, deque[tuple[float, float]]()
        start = np.array((p.pose_error, p.pose_error, p.heading_error))
        self._uncovered: tuple[str, ...] = (_UNCOVERED,) if car and self._guarantee != "none" else ()
        self._car = car
        self._table = manoeuvres_of(robot.limits(task.speed_limit), p.reverse_cost if p.reverse else math.inf)
        self._p, self._period, self._area = p, task.period, self._rules.area
        self._ahead = Ahead(task.latency, self._safety.limits)
        self._drifts = robot.camera is None and task.area is None
        self._base_link = robot.drive.base_link
        self._watch = AssumptionMonitor(
            self._safety.limits, task.period, self._safety.disturbance, start, robot.odometry, self._ahead
        )
        self._looks = SightMonitor(sight, p.unseen_speed, start, p.memory, robot.camera is None)
        known = ForecastParameters(
            speed=p.obstacle_speed, acceleration=p.obstacle_acceleration, memory=p.memory,
            constant_velocity_only="forecast" in self._without, velocities=robot.camera is None, avoidance=p.avoidance,
            oscillation=p.oscillation,
        )  # fmt: skip
        periods, late = self._settings.periods, self._ahead.time
        self._forecaster = self._make_forecaster(task, known, periods + math.ceil(late / task.period - 1e-9))
        self._memory = Memory(np.zeros((periods, 2)), np.zeros(2), np.zeros(3))
        self._field: Field | None = None
        self._distance = GoalDistance(
            task, self._area, self._base.foot.circumscribed + self._wishes.margin, self._base.limits, periods * task.period,
            1 if robot.camera else max(1, round(REFRESH / task.period)), None if robot.camera else sight,
        )  # fmt: skip
        self._decision = None
        self._cooperation = Cooperation(inscribed_radius(robot.shape), task.period, p.own_spread)
        self._soon = max(1, min(self._settings.periods, round(IMMINENT / task.period)))
        self._forecast: Forecast | None = None
        self._counted: Forecast | None = None
        self._seconds = task.budget.seconds
        begin, faced = (BEGIN, HEADING) if car else (CLOSE if self._wishes.stop else BEGIN, FACED)
        self._approach = Approach(self._base.limits, task.period, begin, faced, not car)
        self._stored: tuple[Plan, Tube, int] | None = None
        self._frame = OdometryFrame(np.zeros(3), np.zeros(3))

    def _make_forecaster(
        self, task: Task, parameters: ForecastParameters, count: int
    ) -> Forecaster | PerfectForecaster:
        return Forecaster(parameters, task.period, task.period, count)

    def step(self, observation: Observation) -> Command:
        """Decide for one control period: for the instant from which on it is followed.

        Raises:
            ValueError: The pose or the goal is not finite.
        """
        began = time.perf_counter()
        given, aim = finite("pose", observation.pose), finite("goal.pose", observation.goal.pose)
        seen = NOTHING if observation.obstacles is None else observation.obstacles
        pose, goal = given, aim
        if self._drifts:
            pose = self._base_link(finite("odom_pose", observation.odom_pose))
            self._frame = OdometryFrame(given, pose)
            goal, seen = self._frame.into(aim), self._frame.obstacles(seen)
        memory, cut = self._memory, False
        if self._approach.set_out(observation.goal):
            memory.age[1] = 0.0
        violated, self._uncovered = self._uncovered, ()
        if not self._car:
            violated += self._watch.seen(observation.t, pose, observation.velocity)
        now, more = self._forecaster.update(observation.t, seen)
        violated += self._looks.seen(observation.t, pose, seen, now)
        perceived = pose
        if self._drifts:
            self._rules = self._rules._replace(sight=self._looked(observation.t, float(pose[2])))
        if self._ahead.time > 0.0:
            given, pose = (self._ahead.pose(observation.t, p, observation.velocity) for p in (given, pose))
            self._rules = self._rules._replace(eye=perceived)
        self._forecast = later(now, self._ahead.time, self._p.obstacle_acceleration)
        self._counted = self._count(self._forecast, perceived, pose)
        if self._p.headway > 0.0:
            self._cooperation.look(pose, self._forecast)
            imminent = self._soon if self._cooperation.doubt < SURE else self._settings.periods
            self._settings = self._settings._replace(imminent=imminent)
            self._evasion = self._evasion._replace(settings=self._evasion.settings._replace(imminent=imminent))
        arrived = self._approach.reached(given, memory.velocity)
        if self._approach.stopping:
            v, omega, status = self._turn(self._approach.turn, pose)
            arrived = arrived and status != STATUSES[STORED]  # else it evades
        else:
            self._field = self._distance.update(observation, self._frame, pose, goal, self._forecast.still, perceived)
            share = CLOSE if self._wishes.stop and not self._car else REACH * (0.5 if self._car else 1.0)
            costs = self._wishes._replace(reach=share * observation.goal.xy_tolerance)
            if self._car:
                costs = self._poised(costs, goal, observation.goal)
            decision = self._decision = self._think(costs, pose, began)
            cut = decision.cut
            v, omega = self._commit(decision, pose)
            status = STATUSES[decision.status]
        moved = memory.velocity.any() or v != 0.0 or omega != 0.0
        memory.age[0] = 0.0 if moved else memory.age[0] + 1.0
        before = memory.velocity.copy()
        memory.velocity[:] = self._drive(pose, v, omega).velocities[1]
        self._ahead.decided(observation.t, before, v, omega)
        self._watch.told(observation.t, perceived, v, omega)
        return Command(v, omega, arrived, status=status, cut=cut, violated=violated + more)

    def _poised(self, costs: SearchCosts, goal: FloatArray, told: Goal) -> SearchCosts:
        """What a car weighs, which has to come to `goal` (3,) with its heading: it can't turn there."""
        if told.yaw_tolerance >= math.pi:
            return costs
        return costs._replace(heading=float(goal[2]), turn=0.8 * HEADING * told.yaw_tolerance, manoeuvres=self._table)

    def _think(self, costs: SearchCosts, pose: FloatArray, began: float) -> Decision:
        """Decide; where there is a deadline, what comes after the first search is left out once it is over."""
        assert self._forecast is not None
        assert self._counted is not None
        assert self._field is not None
        settings, memory, forecast, counted = self._settings, self._memory, self._forecast, self._counted
        slow = slowed(self._base, self._fastest_beside(forecast, pose))
        evasion = self._evasion._replace(costs=self._evasion.costs._replace(reach=costs.reach))
        if self._seconds is None:
            return decide(
                settings, self._base, slow, memory, forecast, counted, self._field, self._area, costs, self._rules, self._safety,
                evasion, pose,
            )  # fmt: skip
        scene = pose_scene(settings, self._base, memory, forecast, self._field, self._area, costs, self._safety, pose)
        scene = beside_who_moves(scene, slow, memory)
        found, end = find(scene, memory, settings.narrow, 0, math.inf), began + self._seconds
        late = time.perf_counter() >= end
        if late:
            found = found._replace(cut=found.cut or not found.low_cost)
        else:
            found = widen(scene, memory, found)
            late = time.perf_counter() >= end
        ways = gather(scene, memory, found, 0 if late else settings.rounds)
        decision = choose(scene, memory, counted, self._rules, found._replace(cut=found.cut or late), ways)
        return decision if late else evade(scene, memory, evasion, ways, decision)

    def _fastest_beside(self, forecast: Forecast, pose: FloatArray) -> float:
        """The speed up to which it drives at `pose` (3,) beside who moves, m/s (`headway`): those make room for it, and where it doesn't look
        it knows of them late."""
        if self._p.headway == 0.0 or not len(forecast.centre):
            return math.inf
        away = np.hypot(forecast.centre[:, 0, 0] - pose[0], forecast.centre[:, 0, 1] - pose[1]) - forecast.radius
        return self._p.creep + max(float(away.min()) - self._base.foot.circumscribed, 0.0) / self._p.headway

    def _looked(self, t: float, heading: float) -> Sight:
        """What has been in sight for `LOOK` at time `t` [s]; the robot's `heading` is in the odometry's frame."""
        self._headings.append((t, heading))
        while self._headings[0][0] < t - LOOK - 1e-9:
            self._headings.popleft()
        return looked_at(self._sight, [math.remainder(heading - before, 2.0 * math.pi) for _, before in self._headings])

    def _count(self, forecast: Forecast, eye: FloatArray, pose: FloatArray) -> Forecast:
        """Of `forecast` what certificates count with: all but who is out of view, beside the sector that is seen from `eye` (3,), and
        by now may touch the robot at `pose` (3,). Nothing could be certified against those, as against whoever else is there unseen."""
        sight = self._sight
        if sight.half >= math.pi:
            return forecast
        outline = self._base.foot.circumscribed + forecast.reach[:, 0] + forecast.radius
        gone = hidden_within(sight, eye, pose, forecast.centre, outline)
        if not gone.any():
            return forecast
        return forecast._replace(**{name: getattr(forecast, name)[~gone] for name in Forecast._fields[2:]})

    def _drive(self, pose: FloatArray, v: float, omega: float) -> Plan:
        """A period of motion from `pose`, as the base moves now."""
        start = np.concatenate((pose, self._memory.velocity))
        return drive(start, np.array([[v, omega]]), self._safety.limits, self._period)

    def _turn(self, error: float, pose: FloatArray) -> tuple[float, float, str]:
        """Brake at the goal and turn to its heading on the spot, where that is certified."""
        memory, base = self._memory, self._base
        before = memory.velocity
        error = 0.0 if self._car else error
        v, omega = stop_and_turn(error, float(before[0]), float(before[1]), base.limits, self._period)
        if base.limits.kind == "omnidirectional":
            v, omega, _ = possible(base.limits, v, omega, 0.0)
        memory.age[1], self._decision = 0.0, None
        if self._settings.certified:
            assert self._counted is not None
            certified, plan, about = longest_certified(
                self._drive(pose, v, omega), base.foot, self._counted, self._rules, self._safety,
                bool(memory.age[0] >= 2.0), 1,
            )  # fmt: skip
            if certified < 1:
                return *self._remainder(pose), STATUSES[STORED]
            self._stored = plan, about, 1
        return v, omega, self._approach.status

    def _commit(self, decision: Decision, pose: FloatArray) -> tuple[float, float]:
        """The command of this period, and what is remembered for the next."""
        memory = self._memory
        memory.age[2] = 0.0 if decision.status in (PLANNED, KEPT) else memory.age[2] + 1.0
        if decision.status in (STORED, STOPPED):
            memory.age[1] = 0.0
            return self._remainder(pose)
        if decision.status == EVADING:
            self._stored = None
        elif self._settings.certified:
            self._stored = decision.stored, decision.tube, 1
        memory.plan[:-1] = decision.commands[1:]
        memory.plan[-1] = decision.commands[-1]
        memory.age[1] = 1.0
        v, omega = decision.commands[0].tolist()
        return v, omega

    def _remainder(self, pose: FloatArray) -> tuple[float, float]:
        """The next command of the last certified plan, which ends at rest; rest, if there is none left."""
        if self._stored is None:
            return 0.0, 0.0
        plan, about, k = self._stored
        if k >= len(plan.commands):
            return 0.0, 0.0
        if self._drifts and self._settings.certified:
            plan, about, k = self._shortened(plan.commands[k:], pose)
        self._stored = plan, about, k + 1
        off = pose - plan.states[k]
        off[2] = math.remainder(off[2], 2.0 * math.pi)
        v, omega = (plan.commands[k] + about.gains[k] @ off).tolist()
        limits = self._safety.limits  # beyond them only where it was pushed farther than is assumed
        return min(max(v, limits.v_min), limits.v_max), min(max(omega, -limits.omega_max), limits.omega_max)

    def _shortened(self, commands: FloatArray, pose: FloatArray) -> tuple[Plan, Tube, int]:
        """Of what remains as much as by what is seen now has a certificate, then the hardest braking; a lidar may have shown since what
        nobody knew of when the plan was made."""
        assert self._counted is not None
        memory, safety = self._memory, self._safety
        plan = drive(np.concatenate((pose, memory.velocity)), commands, safety.limits, self._period)
        standing = bool(memory.age[0] >= 2.0)
        kept, whole, about = longest_certified(plan, self._base.foot, self._counted, self._rules, safety, standing, 0)
        if kept < 0:
            whole = stopped_after(plan, 0, safety.limits, self._period)
            about = tube(whole, room(whole, safety.limits), self._period, safety.disturbance, safety.start, standing)
        return whole, about, 0

    def diagnostics(self) -> Diagnostics:
        """Polylines `plan`, `way 1`, ...; circles `obstacles`, `forecast` and `reach`; the tube along the certified plan."""
        decision, forecast, frame = self._decision, self._forecast, self._frame
        circles, polylines, tube = {}, {}, None
        if forecast is not None:
            size = forecast.radius[:, None]
            at = [k * (forecast.reach.shape[1] - 1) // 3 for k in (1, 2, 3)]
            now = _discs(forecast.centre[:, :1], size)
            circles["obstacles"] = frame.back(np.concatenate((forecast.still, now)))
            circles["forecast"] = frame.back(_discs(forecast.path[:, 0, at], size))
            circles["reach"] = frame.back(_discs(forecast.centre[:, at[:1]], size + forecast.reach[:, at[:1]]))
        if decision is not None:
            polylines = {f"way {p + 1}": frame.back(way) for p, way in enumerate(decision.ways)}
            polylines["plan"] = frame.back(decision.states[:, :2])
        if self._stored is not None:
            plan, about, _ = self._stored
            tube = frame.back(np.column_stack((plan.states[:, :2], self._base.foot.circumscribed + about.radius)))
        status = STATUSES[decision.status] if decision is not None else self._approach.status
        return Diagnostics(polylines, circles, tube, status=status, iterations=decision.nodes if decision else 0)


class HpStForesight(HpSt):
    """HP-ST with perfect forecasts of what it has seen: a reference, told the truth."""

    privileged: ClassVar[bool] = True

    def _make_forecaster(
        self, task: Task, parameters: ForecastParameters, count: int
    ) -> Forecaster | PerfectForecaster:
        if task.obstacle_oracle is None:
            raise ClearwayError("hp-st-foresight needs the true future of the obstacles, and this task has none")
        return PerfectForecaster(parameters, task.obstacle_oracle, task.period, count)


_EVASIVE = (
    TunedOn("sar-misspecified", ("rescue",), draws=range(100, 160), note="when it evades"),
    TunedOn("meeting-points", ("tiago",), note="when it evades"),
    TunedOn("dynabarn", ("jackal",), draws=range(16), note="when it evades"),
    TunedOn("replayed-held-out", ("tiago",), draws=range(60), note="how fast it evades"),
)

_UNCOVERED = "base: the certificate covers none that steers like a car; nothing is certified"


def _discs(places: FloatArray, radius: FloatArray) -> FloatArray:
    """(n, 3) of places (m, k, 2) and their radii, (m, 1) or (m, k)."""
    return np.column_stack((places.reshape(-1, 2), np.broadcast_to(radius, places.shape[:2]).reshape(-1)))
