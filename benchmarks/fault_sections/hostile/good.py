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
