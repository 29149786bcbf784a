"""From a bag of scans and odometry and a map to a table of poses that a test plan can name."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.localising.offline import Localised, localise
from clearway.recordings import formats
from clearway.recordings.formats import beside, table
from clearway.recordings.recording import Recording, Track, Want
from clearway.robots import load_robot
from clearway.scenarios.floorplan import load_floor_plan

BODY = "robot"
"""As the track is called in the table."""


def localise_recording(
    recording: str | Path,
    map: str,
    robot: str,
    start: tuple[float, float, float],
    out: str | Path,
    *,
    scan: str | None = None,
    odometry: str | None = None,
    mount: tuple[float, float, float] | None = None,
    within: tuple[float, float] = (0.5, 0.26),
    seed: int = 0,
) -> Localised:
    """Localise a recorded robot on a map, and write its poses with their uncertainty as a table, with its description beside it.

    Args:
        recording: A bag with scans and odometry.
        map: A floor plan's name or file, or the yaml of a ROS map.
        robot: A robot's name or file, for its parameters of AMCL.
        start: Where the robot was when the recording begins, in the map: m, m, rad.
        out: The table, a CSV that doesn't exist yet.
        scan: Topic of the scans; None: the only one.
        odometry: Topic or `parent->child` of the odometry; None: the only topic.
        mount: Pose of the lidar in the robot's base; None: as the recording says.
        within: Standard uncertainty of the start: m, rad.
        seed: Of the filters' random numbers.

    Raises:
        ClearwayError: As for `localise`, or a file can't be read or written, or it isn't clear which topics are meant.
    """
    path, target = Path(recording), Path(out)
    for file in (target, beside.beside(target)):
        if os.path.exists(file):
            raise ClearwayError("exists already; nothing is overwritten", file=file)
    floor = load_floor_plan(map)
    if floor.map is None:
        raise ClearwayError(f"the floor plan {map!r} has no map to localise on", field="map")
    held = formats.look(path)
    scan = held.only("scan", scan)
    odometry = odometry if odometry is not None and "->" in odometry else held.only("odometry", odometry)
    read = formats.read(path, Want(frozenset({scan, odometry})))
    sweeps = read.scans[scan]
    if mount is not None:
        sweeps = replace(sweeps, mount=np.array(mount, dtype=np.float64))
    try:
        found = localise(
            read.tracks[odometry], sweeps, floor.map, np.array(start), load_robot(robot), within=within, seed=seed
        )
    except ClearwayError as error:
        raise error if error.file is not None else ClearwayError(error.problem, file=path, field=error.field) from error
    half = found.pose[:, 2] / 2
    zero = np.where(np.isfinite(half), 0.0, np.nan)
    track = Track(
        "table",
        "map",
        "",
        found.t,
        np.column_stack((found.pose[:, :2], zero)),
        np.column_stack((zero, zero, np.sin(half), np.cos(half))),
        sigma=found.sigma,
    )
    table.write(target, Recording(target, "table", tracks={BODY: track}, epoch=read.epoch))
    return found
