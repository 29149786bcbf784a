"""The mapping phase: a robot is driven once through a floor plan and builds the map that it will navigate on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.ndimage import distance_transform_edt

from clearway.contract import Scan
from clearway.errors import ClearwayError
from clearway.geometry.frames import compose
from clearway.geometry.grid import FREE, OccupancyGrid
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.ros_map import write_map
from clearway.geometry.shapes import FloatArray
from clearway.mapping.tour import SPEED, Teleoperator, plan_tour
from clearway.perception import MappingParameters
from clearway.perception.map_quality import map_quality
from clearway.perception.mapping import GridMapper, render
from clearway.perception.scan_matching import beams as usable_beams
from clearway.placing import placed
from clearway.robots import Robot
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.scenario import LegSpec, Scenario
from clearway.trials import Outcome
from clearway.world import simulate

Tell = Callable[[int, int, str], None]
"""Told (done, total, note)."""


@dataclass(frozen=True, slots=True)
class MappingResult:
    """What came of a mapping tour.

    Attributes:
        floor_plan: Its name.
        robot: The robot's name.
        seed: What the sensors' noise, the odometry's and the mapper's draws came from.
        scan_matching: Whether scans were matched; without it the odometry was believed.
        map: The yaml file of the map, which lies in the plan's frame.
        f1: Harmonic mean of precision and recall.
        precision: Share of the map's occupied cells that lie within one cell of one that a perfect map of the same tour
            shows.
        recall: Share of the perfect map's occupied cells that lie within one cell of one of the map.
        limit: The F1 that this robot's scans give when they are put where they were truly made.
        distance: How far the robot was driven, m.
        duration: How long the drive took, s.
        scans: How many scans were used.
        path_error: Largest distance between where the mapper thought the robot was and where it was, m.
        wall: How long it took to compute, s of wall clock.
    """

    floor_plan: str
    robot: str
    seed: int
    scan_matching: bool
    map: Path
    f1: float
    precision: float
    recall: float
    limit: float
    distance: float
    duration: float
    scans: int
    path_error: float
    wall: float

    def __str__(self) -> str:
        how = "scan matching" if self.scan_matching else "odometry alone"
        return (
            f"{self.map}: {self.floor_plan} mapped by {self.robot} ({how}): F1 {self.f1:.3f} of occupied cells within one "
            f"cell (precision {self.precision:.3f}, recall {self.recall:.3f}; with true poses {self.limit:.3f}); "
            f"{self.distance:.0f} m in {self.duration:.0f} s, {self.scans} scans used, at most {self.path_error:.2f} m "
            f"off the true path; computed in {self.wall:.0f} s"
        )


def build_map(
    floor_plan: str,
    robot: Robot,
    seed: int,
    out: Path,
    progress: Tell | None = None,
    scan_matching: bool = True,
) -> MappingResult:
    """Drive `robot` through a floor plan, build its map, save it as `out`/map.yaml and map.pgm, and judge it.

    The tour begins at the plan's A (without one, at the free spot with most room), which the robot is told: so the
    map comes out in the plan's frame.

    Args:
        floor_plan: A shipped floor plan's name or a file.
        robot: The robot that is driven; it needs a lidar.
        seed: Of the sensors' noise, the odometry's, and the mapper's draws.
        out: Folder for the map, made if it isn't there.
        progress: Called with (scans done, scans in all, note).
        scan_matching: Whether scans are matched; without it the odometry is believed.

    Returns:
        Where the map lies, and how good it is.

    Raises:
        ClearwayError: no such plan, no lidar, a wrong parameter, the robot can't drive there, or `out` can't be written.
    """
    begun = perf_counter()
    tell: Tell = progress or _silent
    if robot.lidar is None:
        raise ClearwayError(f"mapping needs a lidar, robot {robot.name!r} has none", field="lidar")
    parameters = MappingParameters.read(robot)
    plan = load_floor_plan(floor_plan)
    start = _start(plan) if plan.a is None else plan.a
    way = plan_tour(plan, start, robot)
    with placed(out) as new:  # from the beginning: where it can't be written is seen before the drive
        driver = drive_tour(floor_plan, robot, seed, start, way)

        mapper = GridMapper(parameters, start, seed, scan_matching=scan_matching)
        total = len(driver.scans)
        used = []
        for k, (odom, scan) in enumerate(zip(driver.odometry, driver.scans, strict=True)):
            if mapper.add(odom, scan):
                used.append(k)
                tell(k, total, "")
        built = mapper.map()

        poses = np.array([driver.truth[k] for k in used])
        farthest, usable = mapper.ranges(driver.scans[0])
        truth = visible_walls(plan, robot, poses, farthest, usable, parameters.delta)
        quality = map_quality(built, truth)
        real = [_usable(driver.scans[k], usable, farthest) for k in used]
        limit = render(poses, real, driver.scans[0].mount, parameters.delta, parameters.occ_thresh)
        write_map(new / "map.yaml", built)
    tell(total, total, "")
    moves = np.diff([p[:2] for p in driver.truth], axis=0)
    return MappingResult(
        floor_plan=plan.name,
        robot=robot.name,
        seed=seed,
        scan_matching=scan_matching,
        map=out / "map.yaml",
        f1=quality.f1,
        precision=quality.precision,
        recall=quality.recall,
        limit=map_quality(limit, truth).f1,
        distance=float(np.hypot(*moves.T).sum()),
        duration=total * robot.period,
        scans=len(used),
        path_error=float(np.hypot(*(mapper.path - poses)[:, :2].T).max()),
        wall=perf_counter() - begun,
    )


def drive_tour(floor_plan: str, robot: Robot, seed: int, start: FloatArray, way: FloatArray) -> Teleoperator:
    """Drive `robot` along a way in the world, as a person with a joystick would.

    Args:
        floor_plan: A shipped floor plan's name or a file.
        robot: The robot that is driven.
        seed: Of the sensors' noise and the odometry's.
        start: (3,) pose where the way begins, map frame: m, m, rad.
        way: (n, 2) points to drive along, m.

    Returns:
        The driver, who has kept what the robot sensed.

    Raises:
        ClearwayError: the drive ended before the way did.
    """
    length = float(np.hypot(*np.diff(way, axis=0).T).sum())
    leg = LegSpec(
        name="tour",
        goal=(float(way[-1, 0]), float(way[-1, 1]), float(start[2])),
        yaw_tolerance=math.inf,
        time_limit=4.0 * length / SPEED + 60.0,
    )
    scenario = Scenario(
        name=f"mapping-{floor_plan}",
        floor_plan=floor_plan,
        start=(float(start[0]), float(start[1]), float(start[2])),
        legs=(leg,),
        speed=SPEED,
        localisation="truth",
        placement_xy=0.0,
        placement_yaw=0.0,
        seed=seed,
    )
    driver = Teleoperator(way)
    trial = simulate(scenario, robot, driver, navigator="teleoperation", localisation="truth", map=None)
    if trial.outcome is not Outcome.REACHED:
        raise ClearwayError(f"the mapping tour ended early ({trial.outcome}): {trial.reason}", file=floor_plan)
    return driver


def visible_walls(
    plan: FloorPlan, robot: Robot, poses: FloatArray, farthest: float, usable: float, delta: float
) -> OccupancyGrid:
    """The cells in which a beam without noise ends, cast from the true poses of a tour: all that a map can show.

    Args:
        plan: The true floor.
        robot: The robot whose lidar it is.
        poses: (n, 3) true poses, map frame: m, m, rad.
        farthest: Longest range that is used at all, m.
        usable: Range up to which a longer one is then used, m.
        delta: Edge of a cell, m.
    """
    lidar = robot.lidar
    assert lidar is not None
    walls = scene([f.shape for f in plan.fixtures], np.array([f.pose for f in plan.fixtures]))
    eye = beams(lidar.beams, lidar.angle_min, lidar.angle_max, lidar.range_min, lidar.range_max)
    mount = np.array(lidar.mount)
    scans = []
    for pose in poses:
        ranges = sweep(walls, eye, compose(pose, mount))
        scan = Scan(ranges, eye.angle_min, eye.increment, lidar.range_min, lidar.range_max, mount)
        scans.append(_usable(scan, usable, farthest))
    return render(poses, scans, mount, delta, 0.0)


def _silent(done: int, total: int, note: str) -> None:
    """Tells nobody."""


def _usable(scan: Scan, usable: float, farthest: float) -> FloatArray:
    return usable_beams(scan.ranges, scan.angle_min, scan.angle_increment, scan.mount, usable, farthest)


def _start(plan: FloorPlan) -> FloatArray:
    """The free spot that is farthest from any wall, heading along x."""
    if plan.map is None or not (plan.map.data == FREE).any():
        raise ClearwayError("a mapping tour needs a plan with free floor marked in a map", file=plan.name)
    room = distance_transform_edt(plan.map.data == FREE)
    row, col = np.unravel_index(int(np.argmax(room)), room.shape)
    x, y = (o + (k + 0.5) * plan.map.resolution for o, k in zip(plan.map.origin, (col, row), strict=True))
    return np.array((float(x), float(y), 0.0))
