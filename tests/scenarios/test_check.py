"""A wrong file says what is wrong, where, and what would be right; a right one says nothing."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from clearway.robots import load_robot
from clearway.scenarios.check import check_file
from clearway.scenarios.way import room_for, widest_way

EXAMPLES = Path(__file__).parents[2] / "examples"

SCENARIO = """
name = "mine"
floor_plan = "room.toml"
start = [1.0, 1.0, 0.0]
speed = 0.6

[[legs]]
name = "there"
goal = [9.0, 1.0, 0.0]
time_limit = 60.0

[[obstacles]]
name = "box"
shape = { kind = "square", edge = 0.3 }
pose = [3.0, 2.0, 0.0]

[[obstacles]]
name = "visitor"
shape = { kind = "disc", radius = 0.25 }
runs = [{ leg = "there", path = [[7.0, 0.5], [7.0, 3.5]], speed = 0.5 }]
"""

ROOM = """
name = "room"
[[walls]]
name = "south"
box = [0.0, -0.2, 10.0, 0.0]
[[walls]]
name = "north"
box = [0.0, 4.0, 10.0, 4.2]
[[walls]]
name = "west"
box = [-0.2, -0.2, 0.0, 4.2]
[[walls]]
name = "east"
box = [10.0, -0.2, 10.2, 4.2]
[[walls]]
name = "partition, south"
box = [5.0, 0.0, 5.2, 1.5]
[[walls]]
name = "partition, north"
box = [5.0, 2.5, 5.2, 4.0]
"""


def problems(folder: Path, old: str = "", new: str = "", room: str = ROOM, robot: str | None = None) -> list[str]:
    assert old in SCENARIO
    (folder / "room.toml").write_text(room)
    (folder / "mine.toml").write_text(SCENARIO.replace(old, new, 1) if old else SCENARIO)
    found = check_file(folder / "mine.toml", None if robot is None else load_robot(robot))
    for error in found:
        assert error.file == str(folder / "mine.toml")
    return [str(e).removeprefix(f"{folder / 'mine.toml'}: ") for e in found]


def test_what_would_be_right_is_told(tmp_path: Path) -> None:
    found = problems(tmp_path, '{ kind = "square", ', "{ ")
    assert found == ["obstacles.0.shape.kind: is missing; one of square, rectangle, disc, polygon, robot"]
    found = problems(tmp_path, "speed = 0.6", "goal = 0.6")  # like "optimal", but not much
    assert found[0].startswith("goal: unknown key; known: ")
    assert "legs, " in found[0]


PERSON = """
[[people]]
name = "ann"
start = [2.0, 3.0]
route = [{ at = [8.0, 3.0] }]
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("", "", None),
        ("[2.0, 3.0]", "[0.1, 3.0]", "people.0.start: 'ann' at (0.1, 3) would stand in 'west'"),
        ("[2.0, 3.0]", "[2.0, 9.0]", "people.0.start: 'ann' at (2, 9) is outside the floor plan 'room' (x -0.2 to 10.2, y -0.2 to 4.2)"),
        ("[2.0, 3.0]", "[1.3, 1.0]", "people.0.start: 'ann' at (1.3, 1) would stand in tiago"),
        ("[8.0, 3.0]", "[9.9, 3.0]", "people.0.route.0.at: 'ann' at (9.9, 3) would stand in 'east'"),
        ('"ann"', '"box"', "an obstacle and a person have the name 'box'"),
        ("[2.0, 3.0]", "[2.0, inf]", "people.0.start.1: inf is wrong: input should be a finite number"),
        ('start = [2.0', 'reaction = -1.0\nstart = [2.0', "people.0.reaction: -1.0 is wrong: input should be greater than or equal to 0"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_people(tmp_path: Path, old: str, new: str, message: str | None) -> None:
    person = PERSON.replace(old, new, 1) if old else PERSON
    (tmp_path / "room.toml").write_text(ROOM)
    (tmp_path / "mine.toml").write_text(SCENARIO + person)
    found = [str(e).removeprefix(f"{tmp_path / 'mine.toml'}: ") for e in check_file(tmp_path / "mine.toml")]
    assert found[:1] == ([] if message is None else [message])


def test_a_person_who_fits_through_no_door_and_two_in_one_place(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text(ROOM)
    wide = PERSON.replace('"ann"', '"bed"').replace("start", "radius = 1.0\nstart").replace(" 3.0]", " 2.8]")
    (tmp_path / "mine.toml").write_text(SCENARIO + wide + PERSON)
    found = "\n".join(map(str, check_file(tmp_path / "mine.toml")))
    assert "people.0.route.0.at: 'bed' is 2.00 m wide, but the widest way there is about" in found
    assert "people.1.start: 'ann' at (2, 3) would stand in 'bed'" in found


def test_too_many_people(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text(ROOM)
    (tmp_path / "mine.toml").write_text(SCENARIO + "".join(PERSON.replace("ann", f"p{k}") for k in range(501)))
    assert "at most 500 items" in "\n".join(map(str, check_file(tmp_path / "mine.toml")))


def test_a_sound_scenario(tmp_path: Path) -> None:
    assert problems(tmp_path) == []
    assert problems(tmp_path, robot="hosbot") == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("speed = 0.6", "speed = 0.6 m/s", "not a TOML file: Expected newline or end of document after a statement (at line 5, column 13)"),
        ("speed = 0.6", "sped = 0.6", "sped: unknown key; did you mean 'speed'?"),
        ("speed = 0.6", "speed = -0.6", "speed: -0.6 is wrong: input should be greater than 0"),
        ("speed = 0.6\n", "", "speed: is missing"),
        ("speed = 0.6", 'speed = "fast"', "speed: 'fast' is wrong: input should be a valid number"),
        ("start = [1.0, 1.0, 0.0]", "start = [1.0, nan, 0.0]", "start.1: nan is wrong: input should be a finite number"),
        ("goal =", "gaol =", "legs.0.gaol: unknown key; did you mean 'goal'?"),
        ('"square"', '"sqare"', "obstacles.0.shape.kind: unknown kind 'sqare'; did you mean 'square'?"),
        ("edge = 0.3", "edge = 0.0", "obstacles.0.shape.edge: 0.0 is wrong: input should be greater than or equal to 0.0001"),
        ("edge = 0.3", "egde = 0.3", "obstacles.0.shape.egde: unknown key; did you mean 'edge'?"),
        ("pose = [3.0, 2.0, 0.0]\n", "", "obstacles.0: the obstacle 'box' needs one of these: a pose (static), runs (moving), an oscillation (moving), a motion (moving)"),
        ("pose = [3.0, 2.0, 0.0]\n", 'pose = [3.0, 2.0, 0.0]\nruns = [{ leg = "there", path = [[3.0, 2.0], [4.0, 2.0]], speed = 0.5 }]\n', "obstacles.0: the obstacle 'box' has pose and runs; leave all but one of them out"),
        ("goal = [9.0, 1.0, 0.0]", "goal = [9,0, 1,0, 0,0]", "legs.0.goal: [9, 0, 1, 0, 0, 0] is wrong: list should have at most 3 items, not 6"),
        ('leg = "there"', 'leg = "their"', "the obstacle 'visitor' runs on a leg 'their'; legs: there"),
        ('name = "visitor"', 'name = "box"', "two obstacles have the name 'box'"),
        ("room.toml", "room.png", "floor_plan: room.png: is the image of a map; name the yaml beside it, which says where it lies"),
        ("room.toml", "ward2", "floor_plan: unknown floor plan 'ward2'; did you mean 'ward'?"),
        ("start = [1.0, 1.0, 0.0]", "start = [5.1, 1.0, 0.0]", "start: tiago at the start (5.1, 1) would stand in 'partition, south'"),
        ("start = [1.0, 1.0, 0.0]", "start = [0.2, 1.0, 0.0]", "start: tiago at the start (0.2, 1) would stand in 'west'"),
        ("start = [1.0, 1.0, 0.0]", "start = [3.0, 2.3, 0.0]", "start: tiago at the start (3, 2.3) would stand in 'box'"),
        ("goal = [9.0, 1.0, 0.0]", "goal = [19.0, 1.0, 0.0]", "legs.0.goal: the goal 'there' (19, 1) is outside the floor plan 'room' (x -0.2 to 10.2, y -0.2 to 4.2)"),
        ("goal = [9.0, 1.0, 0.0]", "goal = [9.9, 1.0, 0.0]", "legs.0.goal: tiago at the goal 'there' (9.9, 1) would stand in 'east'"),
        ("pose = [3.0, 2.0, 0.0]", "pose = [3.0, 4.0, 0.0]", "obstacles.0.pose: 'box' at (3, 4) overlaps 'north'"),
        ("pose = [3.0, 2.0, 0.0]", "pose = [3.0, 12.0, 0.0]", "obstacles.0.pose: (3, 12) is outside the floor plan 'room' (x -0.2 to 10.2, y -0.2 to 4.2)"),
        ("[7.0, 3.5]]", "[7.0, 4.5]]", "obstacles.1.runs.0.path: 'visitor' would run into 'north' at (7, 3.75)"),
        ("[[7.0, 0.5], [7.0, 3.5]]", "[[1.3, 1.3], [4.0, 1.3]]", "obstacles.1.runs.0.path: 'visitor' touches tiago when it appears at (1.3, 1.3); give it a longer run-up"),
        ("time_limit = 60.0", "time_limit = 10.0", "legs.0.time_limit: 10 s can't do: the straight way takes 13.0 s at 0.6 m/s"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_scenario(tmp_path: Path, old: str, new: str, message: str) -> None:
    found = problems(tmp_path, old, new)
    first = found[0].removeprefix(str(tmp_path) + "/")
    assert first.partition(" known: ")[0] == message  # known are those of suites that other tests have loaded, too


def test_who_strays_from_the_path_is_checked_where_the_hand_goes(tmp_path: Path) -> None:
    """It passes the wall at a distance of 5 cm; the hand strays by up to 10, or it is a cart on rails."""
    old, path = 'runs = [{ leg = "there", path = [[7.0, 0.5], [7.0, 3.5]]', "path = [[9.5, 3.7], [5.5, 3.7]]"
    assert problems(tmp_path, old, f'runs = [{{ leg = "there", {path}') == []
    (found,) = problems(tmp_path, old, f'behaviour = {{ kind = "operator" }}\nruns = [{{ leg = "there", {path}')
    assert found.startswith("obstacles.1.runs.0.path: 'visitor' would run into 'north' at (")
    steady = f'behaviour = {{ kind = "operator", line_keeping = 0.04 }}\nruns = [{{ leg = "there", {path}'
    assert problems(tmp_path, old, steady) == []


def test_overlapping_obstacles(tmp_path: Path) -> None:
    second = '[[obstacles]]\nname = "crate"\nshape = { kind = "disc", radius = 0.2 }\npose = [3.3, 2.0, 0.0]\n\n[[obstacles]]\nname = "visitor"'
    found = problems(tmp_path, '[[obstacles]]\nname = "visitor"', second)
    assert found == ["obstacles.1.pose: 'crate' at (3.3, 2) overlaps 'box'"]


def test_a_moving_obstacle_already_under_way_touches_the_robot(tmp_path: Path) -> None:
    run = "path = [[3.0, 1.0], [0.5, 1.0]], speed = 0.5"
    assert problems(tmp_path, "path = [[7.0, 0.5], [7.0, 3.5]], speed = 0.5", run) == []
    found = problems(tmp_path, "path = [[7.0, 0.5], [7.0, 3.5]], speed = 0.5", f"{run}, delay = -3.5")
    assert found == [
        "obstacles.1.runs.0.path: 'visitor' touches tiago when it appears at (1.25, 1); give it a longer run-up"
    ]


def test_a_robot_wider_than_its_corridor(tmp_path: Path) -> None:
    narrow = ROOM.replace("5.2, 1.5]", "5.2, 1.8]").replace("[5.0, 2.5,", "[5.0, 2.2,")
    (found,) = problems(tmp_path, room=narrow)
    assert found.startswith("legs.0.goal: tiago is 0.54 m wide, but the widest way to the goal 'there' is about 0.")
    assert float(found.split("about ")[1].split()[0]) == pytest.approx(0.4, abs=0.11)
    shut = ROOM.replace("5.2, 1.5]", "5.2, 2.6]")
    (found,) = problems(tmp_path, room=shut)
    assert found.endswith("the widest way to the goal 'there' is about 0.00 m")
    snug = ROOM.replace("5.2, 1.5]", "5.2, 1.7]").replace("[5.0, 2.5,", "[5.0, 2.28,")  # 0.58 m: TIAGo, not HOSBOT
    assert problems(tmp_path, room=snug, robot="tiago") == []


def test_all_problems_are_found_at_once(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text(ROOM)
    text = SCENARIO.replace("speed = 0.6", "speed = -1", 1).replace("goal =", "gaol =").replace("edge", "egde")
    (tmp_path / "mine.toml").write_text(text)
    assert [e.field for e in check_file(tmp_path / "mine.toml")] == [
        "legs.0.gaol", "obstacles.0.shape.egde", "legs.0.goal", "speed", "obstacles.0.shape.edge",
    ]  # fmt: skip


def test_the_examples_are_sound() -> None:
    for name in ("my_corridor.toml", "my_suite.toml"):
        for robot in ("tiago", "hosbot"):
            assert check_file(EXAMPLES / name, load_robot(robot)) == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("repetitions = 3", "repetition = 3", "repetition: unknown key; did you mean 'repetitions'?"),
        ("repetitions = 3", "repetitions = 0", "repetitions: 0 is wrong: input should be greater than or equal to 1"),
        ("speeds = [0.3, 0.6]", "speeds = [0.3, -0.6]", "speeds.1: -0.6 is wrong: input should be greater than 0"),
        ("start = [7.5, 0.0, 0.0]", "start = [7.5, 1.3, 0.0]", "scenario 'into room 1': start: tiago at the start (7.5, 1.3) would stand in 'corridor, north 1'"),
        ('name = "into room 1"', 'name = "trolley in the corridor"', "two scenarios have the name 'trolley in the corridor'"),
        ("goal = [9.3", "gaol = [9.3", "scenario.0.legs.0.gaol: unknown key; did you mean 'goal'?"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_suite(tmp_path: Path, old: str, new: str, message: str) -> None:
    for name in ("my_corridor.toml", "my_suite.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    path = tmp_path / "my_suite.toml"
    path.write_text(path.read_text().replace(old, new, 1))
    assert str(check_file(path)[0]) == f"{path}: {message}"


def test_a_suite_is_checked_as_its_tests_are_made(tmp_path: Path) -> None:
    for name in ("my_corridor.toml", "my_suite.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    path = tmp_path / "my_suite.toml"
    text = path.read_text()
    path.write_text(text.replace("speeds = [0.3, 0.6]", "speeds = [0.3, 0.01]"))
    assert f"{path}: scenario 'into room 1': legs.0.time_limit: 60 s can't do" in str(check_file(path)[0])
    assert all("at 0.01 m/s" in str(error) for error in check_file(path))
    path.write_text(text.replace("speeds = [0.3, 0.6]", "speeds = [0.3, 0.3000001]"))
    assert [str(e) for e in check_file(path)] == [
        f"{path}: speeds: 0.3 m/s stands twice, and would make two tests of one name"
    ]
    path.write_text(text.replace("repetitions = 3", "repetitions = 1000000"))
    (error,) = check_file(path)
    assert "at most 1,000,000 trials" in str(error)


def test_a_suite_that_names_a_missing_file(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text('name = "s"\nfiles = ["gone.toml"]\n')
    assert str(check_file(path)[0]) == f"{tmp_path / 'gone.toml'}: no such file"
    shutil.copy(EXAMPLES / "my_robot.toml", tmp_path / "gone.toml")
    assert str(check_file(path)[0]) == f"{tmp_path / 'gone.toml'}: is the file of a robot, and a scenario is wanted"
    path.write_text('name = "s"\nrepetitions = 2\n')
    assert "a suite needs at least one scenario" in str(check_file(path)[0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("v_max = 1.0", "v_max = -1.0", "drive.v_max: -1.0 is wrong: input should be greater than 0"),
        ("v_max = 1.0", "vmax = 1.0", "drive.vmax: unknown key; did you mean 'v_max'?"),
        ("sigma = 0.02", "sigma = 0.02\nbeam = 3", "lidar.beam: unknown key; did you mean 'beams'?"),
        ("mount = [0.202, 0.0, 0.0]", "mount = [-19.1, 0.0, 0.0]", "the lidar is 19.1 m from base_link; metres are meant, at most 10"),
        ('kind = "circle"', 'kind = "cirle"', "footprint.kind: unknown kind 'cirle'; did you mean 'circle'? known: circle, polygon"),
        ("[presets.trajectory.navigators", "[presets.slow.drive]\nv_max = 0\n[presets.trajectory.navigators", "presets.slow.drive.v_max: 0 is wrong: input should be greater than 0"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_robot(tmp_path: Path, old: str, new: str, message: str) -> None:
    import clearway.robots

    path = tmp_path / "mine.toml"
    text = (Path(clearway.robots.__file__).parent / "tiago.toml").read_text()
    path.write_text(text)
    assert check_file(path) == []
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert str(check_file(path)[0]) == f"{path}: {message}"


def test_what_is_wrong_with_a_plan(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    line = "a = [1.0, 1.0, 0.0]\nb = [6.0, 1.0, 0.0]\nclear = [0.5, 0.5, 6.5, 1.4]\n"
    path.write_text(ROOM.replace('name = "room"\n', 'name = "room"\n' + line))
    assert [str(e) for e in check_file(path)] == [
        f"{path}: clear: 'partition, south' stands in the area that is to be clear"
    ]
    path.write_text(ROOM.replace('name = "room"\n', 'name = "room"\n' + line.replace("[6.0, 1.0", "[5.1, 1.0")))
    assert f"{path}: b: tiago at B (5.1, 1) would stand in 'partition, south'" in [str(e) for e in check_file(path)]


def test_a_map_without_its_image(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text("image: gone.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    assert [str(e) for e in check_file(path)] == [f"{path}: image: 'gone.pgm' does not exist beside the yaml"]


def test_missing_files(tmp_path: Path) -> None:
    for name in ("x.toml", "x.yaml"):
        assert [str(e) for e in check_file(tmp_path / name)] == [f"{tmp_path / name}: no such file"]


def test_widest_way_between_two_walls() -> None:
    import numpy as np

    from clearway.geometry.shapes import rectangle

    for gap in (0.4, 0.8, 1.2):
        off = (gap + 2) / 2
        walls = [(rectangle(0.2, 2.0), np.array([2.5, 2.5 + s * off, 0.0])) for s in (1, -1)]
        walls += [(rectangle(0.2, 5.0), np.array([2.5, 2.5 + s * (off + 3.4), 0.0])) for s in (1, -1)]
        bounds, ends = (0.0, 0.0, 5.0, 5.0), [(1.0, 2.5), (4.0, 2.5)]
        assert widest_way(room_for(walls, bounds, gap / 2 - 0.01), ends) == [None]
        (width,) = widest_way(room_for(walls, bounds, gap / 2 + 0.1), ends)
        assert width == pytest.approx(gap, abs=0.1)
