"""The navigator `hp-tmpc` (paper B): perceive, plan, tighten, solve the tracking problem, correct; once per period."""

from __future__ import annotations

import math
import time
from collections.abc import Collection
from typing import ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from clearway.contract import Command, Diagnostics, Need, Observation, Task
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.geometry.streams import stream
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.inputs import area_of, finite, perception_radius
from clearway.navigators.common.motion import stop_and_turn
from clearway.navigators.common.parametrised import Parametrised
from clearway.navigators.common.tracking.gauss_newton import BUDGET, begin, conclude, search_on
from clearway.navigators.common.tracking.problem import ITERATION_LIMIT, TOLERANCE, Problem, Solution, seeds
from clearway.navigators.hp_tmpc.decision import STATUSES, Decision, decide, settle
from clearway.navigators.hp_tmpc.heuristic_planner.belts import Reference, reference_speed
from clearway.navigators.hp_tmpc.parameters import (
    Parameters,
    Planner,
    Solver,
    chosen_from,
    literal_from,
)
from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.genetic import genetic
from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.pattern_search import pattern_search
from clearway.navigators.hp_tmpc.tube_mpc.posing import (
    AGE,
    CORNERS,
    STEP,
    Settings,
    fresh_memory,
    pose_problem,
    sort_out,
)
from clearway.robots import Robot
from clearway.tuning import HOSPITAL, TunedOn

_Discs: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray, npt.NDArray[np.bool_]]
"""Position, velocity (n, 2), radius, error, moving (n,) of the obstacles."""


class HpTmpc(Parametrised[Parameters]):
    """Heuristic planner and robust tube-based MPC for a differential drive among discs that stand or move.

    One unit of `task.budget.iterations` is an interior-point iteration (`gauss-newton`) or a roll-out (the others).
    `task.budget.seconds` ends the search between two linearisations or populations; planning is never cut short.

    Args:
        solver: `gauss-newton`, or one of the paper's own: `pattern-search`, `genetic`.
        planner: `heuristic` (the paper's) or `exact` (tangent visibility graph).
        prediction_horizon: N^P, periods; None: the robot's file or the stand-ins.
        control_horizon: N^c, periods; None: likewise.
        literal: Equations to take as printed, of "1", "2", "3f", "3k"; a collection or a text such as 1+3f.
        parameters: Any other field of `parameters.Parameters`.

    Attributes:
        correction: ||K (x - x_bar)|| of the last decision.
        spectral_radius: f^SR(A + B K) of it.

    Raises:
        ClearwayError: an option that does not exist, or a parameter out of its range.
    """

    parameters = Parameters
    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = (
        *(TunedOn(suite, ("rescue",), draws=range(0), note="stand-ins") for suite in ("sar-case1", "sar-case2")),
        *(
            TunedOn(suite, ("tiago",), "hall", seeds=(0,), speeds=(0.6,), note="horizon and reference speed")
            for suite in HOSPITAL
        ),
    )

    def __init__(
        self,
        solver: Solver = "gauss-newton",
        planner: Planner = "heuristic",
        *,
        prediction_horizon: int | None = None,
        control_horizon: int | None = None,
        literal: Collection[str] | str | int = (),
        **parameters: float,
    ) -> None:
        self._solver = chosen_from("solver", solver, Solver)
        self._planner = chosen_from("planner", planner, Planner)
        self._literal = literal_from(literal)
        super().__init__(prediction_horizon=prediction_horizon, control_horizon=control_horizon, **parameters)
        self.correction, self.spectral_radius = 0.0, 0.0
        self._decision: Decision | None = None

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial.

        Raises:
            ClearwayError: a parameter in the robot's file is wrong.
        """
        p = self.read_parameters(robot)
        self._settings = _settings(p, task, robot, self._literal, self._planner == "exact")
        self._memory = fresh_memory(p.prediction_horizon, p.prediction_horizon + p.commitment)
        self._rng, self._key = rng, np.uint64(stream(int(rng.integers(2**62)), "hp-tmpc"))
        self._seconds = task.budget.seconds
        self._iterations = task.budget.iterations
        self._decision, self._approach = None, Approach(robot.limits(task.speed_limit), task.period)
        self._ahead = Ahead(task.latency, self._settings.limits)
        self._planned: Reference | None = None
        self._discs: _Discs | None = None
        self.correction, self.spectral_radius = 0.0, 0.0
        if self._seconds is not None:
            self._load()

    def step(self, observation: Observation) -> Command:
        """Decide for one control period: for the instant from which on it is followed.

        Raises:
            ValueError: the pose or the goal is not finite.
        """
        before = self._memory.input.copy()
        command = self._decide(observation)
        self._ahead.decided(observation.t, before, *self._memory.input)
        return command

    def _decide(self, observation: Observation) -> Command:
        pose, goal = finite("pose", observation.pose), finite("goal.pose", observation.goal.pose)
        first = self._approach.goal is None
        if self._approach.set_out(observation.goal):
            self._memory.clock[AGE] = -1
            if first:
                self._memory.input[:] = np.nan_to_num(observation.velocity, posinf=0.0, neginf=0.0)
        pose = self._ahead.pose(observation.t, pose, observation.velocity)
        arrived = self._approach.reached(pose, self._memory.input)
        if self._approach.stopping:
            return self._turn(self._approach.turn, arrived)
        discs = self._discs = _arrays(observation, self._ahead.time)
        draw, self._stopped = self._rng.random(), False
        if self._solver == "gauss-newton" and self._seconds is None:
            budget = BUDGET if self._iterations is None else self._iterations
            decision = decide(self._settings, self._memory, *discs, pose, goal, draw, budget)
        else:
            decision = self._decide_in_chunks(discs, pose, goal, draw)
        self._decision = decision
        if decision.planned:
            self._planned = decision.reference
        self.correction, self.spectral_radius = decision.correction, decision.radius
        cut = self._stopped or (decision.cut and self._iterations is not None)
        return Command(decision.v, decision.omega, arrived=False, status=STATUSES[decision.status], cut=cut)

    def diagnostics(self) -> Diagnostics:
        """Polylines `plan`, `other side`, `horizon`; circles `belts` and `obstacles`; the tube along the horizon."""
        decision, memory = self._decision, self._memory
        if decision is None:
            return Diagnostics(status=self._approach.status)
        polylines = {"horizon": decision.states[:, :2].copy()}
        polylines["plan"] = memory.path[: memory.clock[CORNERS]].copy()
        circles = {}
        if self._discs is not None:
            seen = np.column_stack((self._discs[0], self._discs[2]))
            circles["obstacles"] = seen[np.isfinite(seen).all(axis=1)]
        if self._planned is not None:
            circles["belts"] = self._planned.belts
            if len(self._planned.other):
                polylines["other side"] = self._planned.other
        tube = np.column_stack((decision.states[:, :2], self._settings.rho_rob + decision.tube[1:]))
        return Diagnostics(polylines, circles, tube, status=STATUSES[decision.status], iterations=decision.iterations)

    def _load(self) -> None:
        """Compile what decides, or load it: the first decision's clock shall not pay for that."""
        memory, seconds = self._memory, self._seconds
        self._seconds = math.inf if self._solver == "gauss-newton" else 0.0  # the others' first piece is always done
        self._memory = fresh_memory(self._settings.horizon, len(memory.inputs))
        near, still = np.array(((0.5, 0.0), (0.7, 0.3))), np.zeros((2, 2))
        discs = near, still, np.full(2, 0.3), np.zeros(2), np.array((True, False))
        self._decide_in_chunks(discs, np.zeros(3), np.array((1.0, 0.0, 0.0)), 0.0)
        self._memory, self._seconds = memory, seconds

    def _decide_in_chunks(self, discs: _Discs, pose: FloatArray, goal: FloatArray, draw: float) -> Decision:
        """A decision that may be stopped by the clock; what it solves first is always posed."""
        settings, memory, began = self._settings, self._memory, time.perf_counter()
        deadline = math.inf if self._seconds is None else began + self._seconds
        still, moving_obstacles = sort_out(*discs, settings.rho_rob)
        left = self._iterations
        posed = pose_problem(settings, memory, still, moving_obstacles, pose, goal, draw, False)
        solution = self._solve(posed.problem, posed.warm, left, deadline)
        late = self._seconds is not None and time.perf_counter() >= deadline
        if solution.violation > TOLERANCE and not posed.planned and not late:
            left = None if left is None else max(left - solution.iterations, 0)
            posed = pose_problem(settings, memory, still, moving_obstacles, pose, goal, draw, True)
            solution = self._solve(posed.problem, posed.warm, left, deadline)
        return settle(settings, memory, posed, solution)

    def _solve(self, problem: Problem, warm: FloatArray, budget: int | None, deadline: float) -> Solution:
        if self._solver == "gauss-newton":
            search, most = begin(problem, warm), BUDGET if budget is None else budget
            ended = False
            while not ended and time.perf_counter() < deadline:
                ended = search_on(problem, search, most)
            self._stopped = not ended
            return conclude(problem, search, most if ended else 0)
        starts = np.concatenate((warm[None], seeds(problem)))
        if self._solver == "genetic":
            step = int(self._memory.clock[STEP])
            solution = genetic(problem, starts, self._key, step, budget=budget, deadline=deadline)
        else:
            solution = pattern_search(problem, starts, budget=budget, deadline=deadline)
        self._stopped = self._seconds is not None and solution.status == ITERATION_LIMIT
        return solution

    def _turn(self, error: float, arrived: bool) -> Command:
        """Stop, and turn by `error` [rad] on the spot."""
        settings, memory = self._settings, self._memory
        v, rate = stop_and_turn(error, memory.input[0], memory.input[1], settings.limits, settings.period)
        memory.input[:] = v, rate
        memory.clock[AGE] = -1
        memory.plan[:] = 0.0
        self._decision = None
        return Command(float(v), float(rate), arrived, status=self._approach.status)


def _arrays(observation: Observation, ahead: float) -> _Discs:
    """The obstacles, moved on by `ahead` [s], in types that the kernels are compiled for (a read-only array would be another one)."""
    seen = observation.obstacles
    if seen is None or len(seen) == 0:
        return np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0, np.bool_)
    position, velocity = np.array(seen.position, np.float64), np.array(seen.velocity, np.float64)
    if ahead > 0.0:
        position[seen.moving] += ahead * np.nan_to_num(velocity[seen.moving])
    radius, error = np.array(seen.radius, np.float64), np.array(seen.error, np.float64)
    return position, velocity, radius, error, np.array(seen.moving, np.bool_)


def _settings(p: Parameters, task: Task, robot: Robot, literal: frozenset[str], exact: bool) -> Settings:
    limits = robot.limits(task.speed_limit)
    if not p.reverse:
        limits = limits._replace(v_min=0.0)
    return Settings(
        period=task.period,
        horizon=p.prediction_horizon,
        control_horizon=p.control_horizon,
        window=p.planning_window,
        commitment=p.commitment,
        rho_rob=circumscribed_radius(robot.planner_shape),
        safe_margin=p.safe_margin,
        perception=perception_radius(robot, p.scan_range),
        area=area_of(task),
        limits=limits,
        input_change=p.input_change,
        w1=p.w1,
        w2=p.w2,
        heading_weight=p.heading_weight,
        w_rob=p.w_rob,
        xi_rob=p.xi_rob,
        w_dyn=p.w_dyn,
        xi_dyn=p.xi_dyn,
        poles=np.array((p.pole_along, p.pole_left, p.pole_heading)),
        gain_limit=p.gain_limit,
        threshold=p.tracking_threshold,
        speed=float(reference_speed(limits.v_min, limits.v_max, p.reference_share)),
        align=p.turn_beyond,
        turn=p.turn_share * limits.omega_max,
        model="1" in literal,
        discount="2" in literal,
        circle="3f" in literal,
        feedback="3k" in literal,
        exact=exact,
        keep=p.side_share,
    )
