from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.geometry.grid import OCCUPIED
from clearway.geometry.ros_map import read_map
from clearway.mapping import build_map
from clearway.mapping.tour import plan_tour
from clearway.robots import Robot, load_robot
from clearway.scenarios.floorplan import load_floor_plan

pytestmark = pytest.mark.slow

PLAN = """
name = "flat"
a = [1.0, 1.0, 0.0]
b = [4.0, 1.0, 0.0]

[[walls]]
name = "south"
box = [-0.2, -0.2, 7.2, 0.0]
[[walls]]
name = "north"
box = [-0.2, 5.0, 7.2, 5.2]
[[walls]]
name = "west"
box = [-0.2, 0.0, 0.0, 5.0]
[[walls]]
name = "east"
box = [7.0, 0.0, 7.2, 5.0]
[[walls]]
name = "between, with a door in the east"
box = [0.0, 2.4, 5.4, 2.5]

[[furniture]]
name = "cupboard"
shape = { kind = "square", edge = 0.8 }
pose = [1.0, 4.2, 0.3]
"""


@pytest.fixture
def flat(tmp_path: Path) -> str:
    file = tmp_path / "flat.toml"
    file.write_text(PLAN, encoding="utf-8")
    return str(file)


def quick(name: str = "tiago") -> Robot:
    """Fewer particles and updates than the robot's own, and worse odometry: the tour is short."""
    robot = load_robot(name)
    worse = robot.odometry.model_copy(update={"rotation_per_radian": 0.06, "rotation_per_metre": 0.03})
    few = robot.mapping | {"particles": 4, "linearUpdate": 0.3, "angularUpdate": 0.3, "lskip": 2}
    return robot.model_copy(update={"mapping": few, "odometry": worse})


def test_a_tour_is_closed_clear_of_walls_and_sees_the_far_room(flat: str) -> None:
    plan, robot = load_floor_plan(flat), load_robot("tiago")
    assert plan.a is not None
    way = plan_tour(plan, plan.a, robot)
    steps = np.hypot(*np.diff(way, axis=0).T)
    assert steps.max() < 0.15
    np.testing.assert_allclose(way[0], way[-1])
    assert np.hypot(*(way[0] - plan.a[:2])) < 0.1
    assert (way[:, 1] > 2.9).any()  # through the door
    walls = np.argwhere(plan.map.data == OCCUPIED)[:, ::-1]  # type: ignore[union-attr]
    walls = np.asarray(plan.map.origin) + (walls + 0.5) * 0.05  # type: ignore[union-attr]
    gaps = np.hypot(*np.moveaxis(way[:, None] - walls[None], 2, 0)).min(axis=1)
    assert gaps.min() > 0.27 + 0.1  # TIAGo's radius and some


def test_the_robot_maps_the_flat_in_the_plans_frame_and_odometry_alone_does_not(flat: str, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    made = build_map(flat, quick(), 1, tmp_path / "map", lambda done, total, note="": told.append((done, total)))
    alone = build_map(flat, quick(), 1, tmp_path / "alone", scan_matching=False)
    assert made.f1 > 0.9
    assert alone.f1 < 0.8
    assert made.limit > 0.97
    assert told[-1][0] == told[-1][1]
    assert f"F1 {made.f1:.3f}" in str(made)
    built, plan = read_map(made.map), load_floor_plan(flat)
    rows, cols = np.nonzero(built.data == OCCUPIED)
    assert built.origin[1] + (rows.min() + 0.5) * 0.05 == pytest.approx(0.0, abs=0.11)  # the south wall's face
    assert built.origin[0] + (cols.max() + 0.5) * 0.05 == pytest.approx(7.0, abs=0.11)  # the east wall's face
    assert plan.map is not None
    again = build_map(flat, quick(), 1, tmp_path / "again")
    assert (tmp_path / "again" / "map.pgm").read_bytes() == (tmp_path / "map" / "map.pgm").read_bytes()
    assert again.f1 == made.f1


def test_what_cannot_be_mapped_is_said_in_one_line(flat: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="needs a lidar"):
        build_map(flat, load_robot("tiago").model_copy(update={"lidar": None}), 0, tmp_path)
    with pytest.raises(ClearwayError, match="floor plan"):
        build_map("hal", load_robot("tiago"), 0, tmp_path)
    wide = load_robot("tiago").model_copy(
        update={"footprint": load_robot("tiago").footprint.model_copy(update={"radius": 1.5})}
    )
    with pytest.raises(ClearwayError, match="does not fit"):
        build_map(flat, wide, 0, tmp_path)


@pytest.mark.slow
def test_the_ward_is_mapped(tmp_path: Path) -> None:
    robot = load_robot("tiago")
    made = build_map("ward", robot, 0, tmp_path / "map")
    alone = build_map("ward", robot, 0, tmp_path / "alone", scan_matching=False)
    assert made.f1 > 0.9
    assert alone.f1 < 0.7
