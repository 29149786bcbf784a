"""The shipped floor plans: their maps follow from their vectors, the line A-B is clear, rooms are as the paper says."""

from __future__ import annotations

import os
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import shapely

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN
from clearway.geometry.rasterise import outline
from clearway.geometry.ros_map import write_map
from clearway.scenarios.floor_plan_files import draw_map, floor_plan_names, read_floor_plan
from clearway.scenarios.floorplan import load_floor_plan

PLANS = Path(str(resources.files("clearway.scenarios") / "plans"))
every = pytest.mark.parametrize("name", ["hall", "ward", "wing"])


def test_names() -> None:
    assert floor_plan_names() == ["arena", "hall", "ward", "wing"]


@every
def test_the_shipped_map_is_the_drawn_one(name: str, tmp_path: Path) -> None:
    write_map(tmp_path / f"{name}.yaml", draw_map(read_floor_plan(PLANS / f"{name}.toml")))
    for suffix in ("yaml", "pgm"):
        assert (tmp_path / f"{name}.{suffix}").read_bytes() == (PLANS / f"{name}.{suffix}").read_bytes()


@pytest.mark.parametrize("name", ["hall", "ward"])
def test_the_line_is_5_m_and_8_by_5_m_around_it_are_clear(name: str) -> None:
    plan = load_floor_plan(name)
    assert plan.a is not None
    assert plan.b is not None
    assert plan.clear is not None
    assert np.hypot(*(plan.b - plan.a)[:2]) == pytest.approx(5.0)
    middle = (plan.a + plan.b)[:2] / 2
    around = shapely.box(middle[0] - 4, middle[1] - 2.5, middle[0] + 4, middle[1] + 2.5)
    for area in (around, shapely.box(*plan.clear)):
        assert shapely.box(*plan.clear).covers(around)
        for fixture in plan.fixtures:
            assert not shapely.Polygon(outline(fixture.shape, fixture.pose)).intersects(area), fixture.name


@every
def test_the_map_agrees_with_the_vectors(name: str) -> None:
    plan = load_floor_plan(name)
    assert plan.map is not None
    solid = shapely.union_all([shapely.Polygon(outline(f.shape, f.pose)) for f in plan.fixtures])
    rows, cols = np.indices(plan.map.data.shape)
    centres = shapely.points(
        plan.map.origin[0] + (cols + 0.5) * plan.map.resolution, plan.map.origin[1] + (rows + 0.5) * plan.map.resolution
    )
    away = shapely.distance(solid, centres)
    half_diagonal = plan.map.resolution * 0.7072
    assert (away[plan.map.data == OCCUPIED] <= half_diagonal).all()
    assert (away[plan.map.data == FREE] > 0).all()
    hull = shapely.union_all([shapely.Polygon(outline(f.shape, f.pose)) for f in plan.fixtures if f.kind == "wall"])
    left, low, right, high = hull.bounds
    outside = plan.map.data[:3].ravel(), plan.map.data[-3:].ravel(), plan.map.data[:, :3].ravel()
    assert (np.concatenate(outside) == UNKNOWN).all()
    assert plan.map.origin[0] < left
    assert plan.map.origin[1] < low
    assert plan.map.origin[0] + plan.map.data.shape[1] * plan.map.resolution > right
    assert plan.map.origin[1] + plan.map.data.shape[0] * plan.map.resolution > high


@every
def test_a_face_runs_through_the_middle_of_its_cells(name: str) -> None:
    plan = load_floor_plan(name)
    assert plan.map is not None
    for k in plan.map.origin:
        assert (k / plan.map.resolution) % 1 == pytest.approx(0.5)


def test_everything_in_the_ward_can_be_reached() -> None:
    plan = load_floor_plan("ward")
    assert plan.map is not None
    for room in plan.rooms:
        free = 0
        for x0, y0, x1, y1 in room.floor:
            c0, c1 = (round((x - plan.map.origin[0]) / plan.map.resolution) for x in (x0, x1))
            r0, r1 = (round((y - plan.map.origin[1]) / plan.map.resolution) for y in (y0, y1))
            assert not (plan.map.data[r0:r1, c0:c1] == UNKNOWN).any(), room.name
            free += int((plan.map.data[r0:r1, c0:c1] == FREE).sum())
        assert free * plan.map.resolution**2 > 0.3 * room.area, room.name


def test_the_ward_follows_the_rules_that_the_paper_quotes() -> None:
    plan = load_floor_plan("ward")
    patients = [r for r in plan.rooms if r.kind == "patient room"]
    assert sorted(r.beds for r in patients) == [1, 1, 2]
    for room in patients:
        assert room.area >= (9.0 if room.beds == 1 else 7.0 * room.beds)
        assert any(r.name == f"bathroom of {room.name}" for r in plan.rooms)
        furniture = [f.name for f in plan.fixtures if f.name.startswith(f"{room.name}, ")]
        assert sum("bed" in n and "bedside" not in n for n in furniture) == room.beds
        assert sum("chair" in n for n in furniture) >= 1
    kinds = {r.kind for r in plan.rooms}
    assert {"waiting area", "corridor", "bathroom", "examination room"} <= kinds


def test_furniture_stands_in_a_room_and_apart() -> None:
    plan = load_floor_plan("ward")
    floors = shapely.union_all([shapely.box(*box) for room in plan.rooms for box in room.floor])
    pieces = [(f.name, shapely.Polygon(outline(f.shape, f.pose))) for f in plan.fixtures if f.kind == "furniture"]
    for i, (name, shape) in enumerate(pieces):
        assert floors.buffer(1e-6).covers(shape), name
        assert not any(shape.intersects(other) for _, other in pieces[:i]), name


def test_a_barn_world_is_a_plan_without_map() -> None:
    plan = load_floor_plan("barn-108")
    assert plan.map is None
    assert plan.a is None
    assert len(plan.fixtures) == 185
    assert all(f.kind == "wall" and f.shape.radius == 0.075 for f in plan.fixtures)  # type: ignore[union-attr]


def test_a_bare_ros_map_is_a_plan(tmp_path: Path) -> None:
    path = tmp_path / "office.yaml"
    hall = load_floor_plan("hall")
    assert hall.map is not None
    write_map(path, hall.map)
    plan = load_floor_plan(str(path))
    assert plan.name == "office"
    assert plan.map is not None
    assert plan.a is None
    assert (plan.map.data == hall.map.data).all()
    area = sum(shapely.Polygon(outline(f.shape, f.pose)).area for f in plan.fixtures)
    assert area == pytest.approx((hall.map.data == OCCUPIED).sum() * 0.05**2)


PLAN = """
name = "room"
a = [1.0, 1.0, 0.0]
b = [3.0, 1.0, 0.0]
[[walls]]
name = "south"
box = [0.0, 0.0, 4.0, 0.2]
[[furniture]]
name = "table"
shape = { kind = "rectangle", length = 1.0, width = 0.5 }
pose = [2.0, 3.0, 0.1]
"""


def test_a_plan_without_walls_has_those_of_its_map(tmp_path: Path) -> None:
    hall = load_floor_plan("hall")
    assert hall.map is not None
    write_map(tmp_path / "floor.yaml", hall.map)
    path = tmp_path / "ours.toml"
    lines = 'name = "ours"\nmap = "floor.yaml"\na = [-1.0, 0.0, 0.0]\nb = [1.0, 0.0, 0.0]\n'
    path.write_text(
        lines + '[[furniture]]\nname = "chair"\nshape = { kind = "disc", radius = 0.2 }\npose = [0.0, 1.0, 0.0]\n'
    )
    plan, bare = load_floor_plan(str(path)), load_floor_plan(str(tmp_path / "floor.yaml"))
    assert (plan.name, plan.area, plan.bounds) == ("ours", None, bare.bounds)
    assert [f.name for f in plan.fixtures] == [*(f.name for f in bare.fixtures), "chair"]
    assert len({f.name for f in bare.fixtures}) == len(bare.fixtures) > 1
    assert all(re.fullmatch(r"cells at -?[\d.]+, -?[\d.]+", f.name) for f in bare.fixtures)
    assert plan.map is not None
    assert (plan.map.data == hall.map.data).all()
    assert plan.a is not None
    assert plan.a.tolist() == [-1.0, 0.0, 0.0]
    path.write_text(lines.replace("[-1.0, 0.0, 0.0]", "[-100.0, 0.0, 0.0]"))
    with pytest.raises(ClearwayError, match=r"ours\.toml: a: \(-100, 0\) is outside the floor plan"):
        load_floor_plan(str(path))
    path.write_text(lines.replace('map = "floor.yaml"', ""))
    with pytest.raises(ClearwayError, match="a plan has walls, a map whose occupied cells they are, or an area"):
        load_floor_plan(str(path))


def test_a_user_s_plan(tmp_path: Path) -> None:
    path = tmp_path / "room.toml"
    path.write_text(PLAN)
    plan = load_floor_plan(str(path))
    assert [(f.name, f.kind) for f in plan.fixtures] == [("south", "wall"), ("table", "furniture")]
    assert plan.map is not None
    assert plan.map.resolution == 0.05
    path.write_text(PLAN.replace('name = "south"', 'name = "north"'))
    os.utime(path, ns=(1, 1))
    assert load_floor_plan(str(path)).fixtures[0].name == "north"  # read again once it has changed


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("box = [0.0, 0.0, 4.0, 0.2]", "box = [4.0, 0.0, 0.0, 0.2]", r"walls\.0: \[4\.0, 0\.0, 0\.0, 0\.2\] must be"),
        (
            "box = [0.0, 0.0, 4.0, 0.2]",
            "boxx = [0.0, 0.0, 4.0, 0.2]",
            r"walls\.0\.boxx: unknown key; did you mean 'box'",
        ),
        ("box = [0.0, 0.0, 4.0, 0.2]", "", r"either a box or vertices"),
        ("b = [3.0, 1.0, 0.0]", "b = [3.0, 1.0, 0.5]", r"must head along the line"),
        ("b = [3.0, 1.0, 0.0]", "", r"both a and b"),
        ('name = "table"', 'name = "south"', r"'south' stands twice"),
        ("length = 1.0", "length = -1.0", r"furniture\.0\.shape\.length: -1\.0 is wrong"),
        ('name = "room"', 'name = "room" map', r"not a TOML file: .*line 2"),
    ],
)
def test_bad_plans(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "room.toml"
    path.write_text(PLAN.replace(old, new))
    with pytest.raises(ClearwayError, match=message) as error:
        load_floor_plan(str(path))
    assert str(path) in str(error.value)


def test_unknown_plan() -> None:
    with pytest.raises(ClearwayError, match=r"unknown floor plan 'hal'; did you mean 'hall'\?"):
        load_floor_plan("hal")
    with pytest.raises(ClearwayError, match=r"unknown floor plan 'barn-7'"):
        load_floor_plan("barn-7")
    with pytest.raises(ClearwayError, match=r"nowhere\.toml: no such file"):
        load_floor_plan("nowhere.toml")
