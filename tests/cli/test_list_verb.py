"""What `clearway list` tells of robots."""

from __future__ import annotations

import json

from command_line import Shell

from clearway.robots import robot_names


def test_robots_with_their_drive_size_and_lidar(clearway: Shell) -> None:
    lines = clearway("list", "robots").out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == robot_names()
    told = {line.split()[0]: line for line in lines[1:]}
    assert "differential     0.54 m round   lidar of 200 degrees, 606 beams, 25 m" in told["tiago"]
    assert "0.99 x 0.67 m" in told["husky"]
    assert "omnidirectional" in told["pepper"]
    assert "ackermann" in told["f1tenth"]
    assert len({line.index("differential") for line in lines[1:] if "differential" in line}) == 1


def test_navigators_with_what_they_drive(clearway: Shell) -> None:
    told = {line.split()[0]: line for line in clearway("list", "navigators").out.splitlines()[1:]}
    assert told["hp-st"].endswith("ackermann, differential, omnidirectional")
    assert told["orca"].endswith(" differential, omnidirectional")
    assert told["hl-rrt"].endswith(" differential")


def test_robots_for_machines(clearway: Shell) -> None:
    robots = json.loads(clearway("list", "robots", "--json").out)["robots"]
    assert robots["turtlebot3-waffle"] == {
        "title": "TurtleBot3 Waffle",
        "drive": "differential",
        "size": "0.28 x 0.31 m",
        "lidar": "lidar of 360 degrees, 360 beams, 3.5 m",
    }
