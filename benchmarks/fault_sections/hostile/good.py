"""Good files of every kind, of which attacks are made, and how a text is laid out for a command."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from clearway.campaigns import CampaignPlan
from clearway.scenarios.suites import Selection
from clearway.trials.store_results import SCHEMA

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples"
PLANS = ROOT / "src" / "clearway" / "scenarios" / "plans"
SCENARIO = """name = "t"
floor_plan = "hall"
start = [-2.0, 0.0, 0.0]
speed = 0.5
[[legs]]
name = "there"
goal = [2.0, 0.0, 0.0]
time_limit = 60.0
"""
ROBOT = (EXAMPLES / "my_robot.toml").read_text()
SUITE = f'name = "s"\nrobots = ["tiago"]\n[[scenario]]\n{SCENARIO.replace("[[legs]]", "[[scenario.legs]]")}'
PLAN = """name = "p"
a = [1.0, 1.0, 0.0]
b = [4.0, 1.0, 0.0]
[[walls]]
name = "south"
box = [0.0, -0.2, 5.0, 0.0]
[[walls]]
name = "north"
box = [0.0, 2.0, 5.0, 2.2]
"""
TEST_PLAN = """[test]
robot = "tiago"
[poses]
A = [0.0, 0.0, 0.0]
[robot]
markers = "robot:"
[[trial]]
note = "not recorded"
"""
KINDS = {"scenario": SCENARIO, "suite": SUITE, "robot": ROBOT, "floor plan": PLAN, "test plan": TEST_PLAN}
COMPANY = """name = "t"
floor_plan = "hall"
start = [-2.0, 0.0, 0.0]
speed = 0.5
latency = 1.0
ideal = ["bias"]
member = "west"
[[legs]]
name = "there"
goal = [2.0, 0.0, 0.0]
time_limit = 60.0
[disturbance]
position = 0.001
[[robots]]
name = "east"
start = [2.5, 2.0, 3.1]
robot = "hosbot"
legs = [{ name = "back", goal = [-2.0, 2.0, 3.1], time_limit = 60.0, arrival = "measured" }]
[[robots]]
name = "other"
role = "other"
navigator = "orca"
start = [3.0, -3.0, 0.0]
legs = [{ name = "on", goal = [3.5, -3.0, 0.0], time_limit = 60.0 }]
[[people]]
name = "ann"
start = [0.0, -1.5]
route = [{ at = [1.0, -1.5], wait = 2.0 }, { at = [0.0, -2.0] }]
loop = true
group = "friends"
radius = 0.2
speed = 1.1
[[people]]
name = "bob"
start = [0.6, -2.2]
route = [{ at = [1.0, -1.0] }]
behaviour = "headed-social-force"
group = "friends"
[[people]]
name = "eve"
start = [-3.5, 1.5]
behaviour = "still"
yields_at = 1.0
[[people]]
name = "joe"
start = [-1.0, 3.0]
route = [{ at = [1.0, 3.0] }]
behaviour = "orca"
reaction = 0.2
sees_robots = false
[[people]]
name = "zoe"
behaviour = "recorded"
track = "walk.csv"
[[obstacles]]
name = "cart"
shape = { kind = "robot", robot = "tiago" }
runs = [{ leg = "there", path = [[-4.0, -3.0], [-1.0, -3.0]], speed = 0.5, delay = 1.0 }]
behaviour = { kind = "operator", reaction = 0.3, patience = 3.0 }
[[obstacles]]
name = "swing"
shape = { kind = "disc", radius = 0.2 }
motion = { kind = "spline", keyframes = [[0.0, -4.0, 2.5], [4.0, -4.0, 3.0], [8.0, -4.0, 2.5]], offset = 1.0 }
"""
TRACK = "t,x,y\n0.0,3.0,0.8\n1.0,3.5,0.8\n2.5,4.0,1.2\n4.0,4.0,1.0\n"
MAP = "image: map.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\n"
CAMPAIGN: dict[str, Any] = {
    "format": "clearway results", "schema": SCHEMA, "trials": 1, "run": {},
    "plan": CampaignPlan(("hospital",), ("tiago",), selection=Selection(repetitions=1)).to_json(),
}  # fmt: skip
Attack = tuple[str, str, Callable[[Path], list[str]], tuple[int, ...]]
"""Which fault, its name, what lays out the files and gives the command line, the exit codes that are right."""
REFUSED = (1, 2)
TAKEN = (0, 1, 2)


def check_of(text: str | bytes, name: str = "it.toml") -> Callable[[Path], list[str]]:
    def lay(folder: Path) -> list[str]:
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
        return ["check", name]

    return lay


def before_tables(good: str, lines: str) -> str:
    return f"{lines}\n{good}"


def map_of(yaml: str, image: bytes | None = b"P5\n4 4\n255\n" + b"\xfe" * 16) -> Callable[[Path], list[str]]:
    def lay(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(yaml)
        if image is not None:
            (folder / "map.pgm").write_bytes(image)
        return ["check", "map.yaml"]

    return lay
