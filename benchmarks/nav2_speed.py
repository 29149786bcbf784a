"""How long one decision of Nav2's plug-ins takes, beside a decision of move-base's DWA in the same run.

Each controller drives along a corridor 20 m long, past obstacles on both sides, with a local costmap of 3 m by 3 m at 0.05 m and
the parameters of Nav2's own file (MPPI: 2,000 samples of 56 steps, noise drawn anew for each decision), RPP with Nav2's defaults,
DWB with those of robots' public files; DWA with TIAGo's. The time is the thread's own, so that other work on the machine doesn't count; decision by decision the least of the repeats
counts. The time it takes to compile, or to read what is compiled, stands apart.

Each planner plans between the same random poses in the hospital's ward, for an F1TENTH, with Nav2's inflation.

    python benchmarks/nav2_speed.py [--decisions N] [--plans N] [--repeats N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from contextlib import suppress
from time import thread_time
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN
from clearway.geometry.shapes import Circle, FloatArray, Polygon, circumscribed_radius, inscribed_radius
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.move_base.parameters import Parameters
from clearway.navigators.move_base.planners import make_local_planner
from clearway.navigators.nav2.controllers.mppi import MPPIController, MPPIParameters
from clearway.navigators.nav2.controllers.parameters import RegulatedPurePursuitParameters
from clearway.navigators.nav2.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.servers import ControllerServer
from clearway.navigators.nav2.planners.navfn import Navfn
from clearway.navigators.nav2.planners.parameters import NavfnParameters, Smac2DParameters, SmacHybridParameters
from clearway.navigators.nav2.planners.smac_2d import Smac2D
from clearway.navigators.nav2.planners.smac_hybrid import SmacHybrid
from clearway.navigators.nav2.plugins import make_controller
from clearway.navigators.nav2.presets.preset import read_preset
from clearway.navigators.nav2.seams import Controller, CostView, NoPath, NoValidControl, Planner, Tolerances, Velocity
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan

RADIUS, RESOLUTION, CELLS = 0.22, 0.05, 60
LENGTH, AHEAD = 20.0, 2.0
FREQUENCY = 20.0
DWA = "move-base: DWA"

Decide = Callable[[float, FloatArray, Velocity, FloatArray, FloatArray, CostView], Velocity]
"""What is decided at a time [s], pose, velocity, with the path ahead, the goal and the costmap."""


def corridor(seed: int) -> tuple[np.ndarray[Any, Any], FloatArray]:
    """Cost of the whole corridor, and its origin: a disc of 0.15 m about every metre and a half, on either side, inflated."""
    rng = np.random.default_rng(seed)
    origin = np.array((-2.0, -2.0))
    rows, columns = np.mgrid[: round(4.0 / RESOLUTION), : round((LENGTH + 4.0) / RESOLUTION)]
    x, y = origin[0] + (columns + 0.5) * RESOLUTION, origin[1] + (rows + 0.5) * RESOLUTION
    away = np.full(x.shape, np.inf)
    for k, along in enumerate(np.arange(1.5, LENGTH, 1.5)):
        across = (-1) ** k * rng.uniform(0.35, 0.7)
        away = np.minimum(away, np.maximum(np.hypot(x - along - rng.uniform(-0.3, 0.3), y - across) - 0.15, 0.0))
    cost = np.where(away <= RADIUS, 253.0, 252.0 * np.exp(-3.0 * (away - RADIUS)) * (away < 0.7))
    return np.where(away == 0.0, 254.0, cost).astype(np.uint8), origin


def window(cost: np.ndarray[Any, Any], origin: FloatArray, pose: FloatArray) -> CostView:
    """The local costmap about a pose."""
    column, row = ((pose[:2] - origin) / RESOLUTION).astype(int) - CELLS // 2
    row, column = max(row, 0), max(column, 0)
    part = np.ascontiguousarray(cost[row : row + CELLS, column : column + CELLS])
    corner = origin + RESOLUTION * np.array((column, row))
    return CostView(part, corner, RESOLUTION, outline(Circle(RADIUS)), RADIUS, RADIUS, 3.0, 0.7, True)


def of_controller(controller: Controller) -> Decide:
    """A decision of one of Nav2's controllers; it rests where it finds no command."""
    tolerances = Tolerances(0.25, 0.25)

    def decide(
        now: float, pose: FloatArray, velocity: Velocity, path: FloatArray, goal: FloatArray, view: CostView
    ) -> Velocity:
        try:
            return controller.compute(now, pose, velocity, path, goal, tolerances, view)
        except NoValidControl:
            return Velocity(0.0, 0.0, 0.0)

    return decide


def of_file(preset: str) -> Decide:
    """The controller of a robot's public file."""
    table = read_preset(preset).tables["controller_server"]
    branch = settle(ControllerServer, table, "controller_server", None).children["FollowPath"]
    return of_controller(make_controller(branch, FREQUENCY, np.random.default_rng(0)))


def pursuit(**given: Any) -> Decide:
    """Regulated pure pursuit with Nav2's defaults and what is given instead."""
    return of_controller(RegulatedPurePursuit(RegulatedPurePursuitParameters(**given), 1.0 / FREQUENCY))


def mppi(**given: Any) -> Decide:
    """MPPI with Nav2's own file and what is given instead."""
    table = read_preset("nav2").tables["controller_server"]["FollowPath"] | given
    branch = settle(MPPIParameters, table, "FollowPath", None)
    spaces = {name: child.group for name, child in branch.children.items()}
    assert isinstance(branch.group, MPPIParameters)
    return of_controller(MPPIController(branch.group, spaces, FREQUENCY, np.random.default_rng(0)))


def dwa() -> Decide:
    """DWA as move-base asks it."""
    planner = make_local_planner(Parameters.read(load_robot("tiago")), outline(Circle(RADIUS)))
    planner.reset()

    def decide(
        now: float, pose: FloatArray, velocity: Velocity, path: FloatArray, goal: FloatArray, view: CostView
    ) -> Velocity:
        seen = np.array((velocity.v_x, velocity.omega))
        found = planner.compute(pose, seen, path, goal, view.cost, view.origin, view.resolution, math.inf)
        return Velocity(found.v, 0.0, found.omega)

    return decide


ROWS: dict[str, Callable[[], Decide]] = {
    DWA: dwa,
    "RPP": pursuit,
    "RPP, dynamic window": lambda: pursuit(use_dynamic_window=True),
    "DWB, 20 x 20 samples (TurtleBot 4)": lambda: of_file("turtlebot4"),
    "DWB, 20 x 40 samples (TurtleBot 3)": lambda: of_file("turtlebot3-waffle"),
    "DWB, 20 x 20 samples (Jackal)": lambda: of_file("jackal"),
    "MPPI, 1000 samples": lambda: mppi(batch_size=1000),
    "MPPI, 2000 samples": mppi,
    "MPPI, 2000 samples, noise kept": lambda: mppi(regenerate_noises=False),
    "MPPI, 2000 samples, omnidirectional": lambda: mppi(motion_model="omni", omni={"plugin": "mppi::OmniMotionModel"}),
}
"""What is measured, by its name in the table."""


RADIUS_OF_TURN = 0.3302 / math.tan(0.4189)
"""An F1TENTH's least, m."""

PLANNERS: dict[str, Callable[[], Planner]] = {
    "NavFn": lambda: Navfn(NavfnParameters()),
    "NavFn, A*": lambda: Navfn(NavfnParameters(use_astar=True)),
    "Smac 2D": lambda: Smac2D(Smac2DParameters()),
    "Smac Hybrid, Reeds-Shepp": lambda: SmacHybrid(
        SmacHybridParameters(minimum_turning_radius=RADIUS_OF_TURN, motion_model_for_search="REEDS_SHEPP")
    ),
}
"""Planners that are measured, by their name in the table."""


def ward(plans: int) -> tuple[CostView, FloatArray]:
    """The ward's costmap for an F1TENTH, and pairs of poses (plans, 2, 3) at which it has room, all in one place."""
    grid = load_floor_plan("ward").map
    if grid is None:
        raise ClearwayError("the ward has no map")
    outlined = np.array(load_robot("f1tenth").footprint.vertices)  # type: ignore[union-attr]
    shape = Polygon(tuple((float(x), float(y)) for x, y in outlined))
    inscribed, circumscribed = inscribed_radius(shape), circumscribed_radius(shape)
    away = distance_transform_edt(grid.data != OCCUPIED) * grid.resolution
    cost = np.where(away <= inscribed, 253.0, 252.0 * np.exp(-3.0 * (away - inscribed)) * (away < 0.7))
    cost[grid.data == OCCUPIED] = 254
    cost[(grid.data == UNKNOWN) & (cost < 253)] = 255
    view = CostView(
        cost.astype(np.uint8),
        np.array(grid.origin),
        grid.resolution,
        outlined,
        inscribed,
        circumscribed,
        3.0,
        0.7,
        True,
    )
    rng = np.random.default_rng(0)
    open_cells = np.argwhere((grid.data == FREE) & (away > 0.6))
    found = open_cells[rng.integers(len(open_cells), size=(plans, 2))]
    at = view.origin + (found[..., ::-1] + 0.5) * grid.resolution
    return view, np.concatenate((at, rng.uniform(-math.pi, math.pi, (plans, 2, 1))), axis=2)


def measure_planners(plans: int, repeats: int) -> list[dict[str, Any]]:
    """A row for each planner."""
    view, poses = ward(plans)
    rows = []
    for name, make in PLANNERS.items():
        planner = make()
        took = np.full((repeats, plans), np.inf)
        none = 0
        began = thread_time()
        with suppress(NoPath):
            planner.plan(*poses[0], view)
        first = thread_time() - began
        for r in range(repeats):
            none = 0
            for k, (start, goal) in enumerate(poses):
                began = thread_time()
                try:
                    planner.plan(start, goal, view)
                except NoPath:
                    none += 1
                took[r, k] = thread_time() - began
        t = 1e3 * took.min(axis=0)
        median, p90 = float(np.median(t)), float(np.quantile(t, 0.9))
        rows.append({"planner": name, "first": first, "median": median, "p90": p90, "none": none / plans})
    return rows


def drive(decide: Decide, decisions: int) -> list[float]:
    """Seconds of each decision; from the corridor's beginning again where its end is reached or no way on is found."""
    cost, origin = corridor(0)
    x = np.arange(0.0, LENGTH, RESOLUTION)
    whole = np.column_stack((x, np.zeros((len(x), 2))))
    pose, velocity, took, still = np.zeros(3), Velocity(0.0, 0.0, 0.0), [], 0
    for k in range(decisions):
        begin = int(np.argmin(np.hypot(*(whole[:, :2] - pose[:2]).T)))
        path = whole[begin : begin + round(AHEAD / RESOLUTION)]
        view = window(cost, origin, pose)
        began = thread_time()
        velocity = decide(k / FREQUENCY, pose, velocity, path, whole[-1], view)
        took.append(thread_time() - began)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        ways = np.array((velocity.v_x * c - velocity.v_y * s, velocity.v_x * s + velocity.v_y * c, velocity.omega))
        pose = pose + ways / FREQUENCY
        still = still + 1 if abs(velocity.v_x) < 0.02 else 0
        if pose[0] > LENGTH - 1.0 or still > FREQUENCY:
            pose, velocity, still = np.zeros(3), Velocity(0.0, 0.0, 0.0), 0
    return took


def measure(decisions: int, repeats: int) -> list[dict[str, Any]]:
    """A row for each plug-in."""
    first = {}
    for name, make in ROWS.items():
        began = thread_time()
        drive(make(), 2)
        first[name] = thread_time() - began
    runs: dict[str, list[list[float]]] = {name: [] for name in ROWS}
    for _ in range(repeats):
        for name, make in ROWS.items():  # one after another in each round, so that a slow minute is everybody's
            runs[name].append(drive(make(), decisions))
    times = {name: np.min(runs[name], axis=0) for name in ROWS}
    beside = float(np.median(times[DWA]))
    return [
        {
            "plug-in": name,
            "first": first[name],
            "median": 1e3 * float(np.median(t)),
            "p99": 1e3 * float(np.quantile(t, 0.99)),
            "ratio": float(np.median(t)) / beside,
        }
        for name, t in times.items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--decisions", type=int, default=600, help="of each line")
    parser.add_argument("--plans", type=int, default=100, help="of each planner")
    parser.add_argument("--repeats", type=int, default=3, help="the least of them counts, decision by decision")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="a small run")
    options = parser.parse_args()
    rows = measure(*((20, 1) if options.smoke else (options.decisions, options.repeats)))
    plans = measure_planners(*((4, 1) if options.smoke else (options.plans, options.repeats)))
    if options.json:
        print(json.dumps({"controllers": rows, "planners": plans}, indent=1))
        return
    print(f"{'plug-in':36s} {'median':>10s} {'p99':>10s} {'of DWA':>8s} {'before the first':>18s}")
    for r in rows:
        print(
            f"{r['plug-in']:36s} {r['median']:7.3f} ms {r['p99']:7.3f} ms {r['ratio']:8.2f} {r['first']:16.2f} s".rstrip()
        )
    print(f"\n{'planner, in the ward':36s} {'median':>10s} {'90 %':>10s} {'no path':>8s} {'before the first':>18s}")
    for r in plans:
        print(
            f"{r['planner']:36s} {r['median']:7.2f} ms {r['p90']:7.2f} ms {r['none']:8.0%} {r['first']:16.2f} s".rstrip()
        )


if __name__ == "__main__":
    main()
