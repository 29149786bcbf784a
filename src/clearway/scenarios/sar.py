"""The suites `sar-...`: paper B's search-and-rescue cases, as far as they are known, and harder ones after them.

Paper B prints how many obstacles there are, how they move (eqs. 6-7) and how large the place is; everything else is a
stand-in (`clearway/stand_ins.toml`). `sar-case3`, `sar-stress` and `sar-misspecified` are Clearway's own. Ten scenarios of each case are frozen in a file, which `python -m
clearway.scenarios.sar` writes anew; `Selection.seeds` draws others by the same rules.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from clearway.geometry.shapes import Circle, inscribed_radius
from clearway.robots import Robot
from clearway.robots.robot import RESCUE, load_robot
from clearway.scenarios.motions import DrivenSpec
from clearway.scenarios.sar_draws import CASES, Case, Drawn, generate
from clearway.scenarios.sar_rules import RADIUS, TASK, Layout
from clearway.scenarios.scenario import (
    DiscSpec,
    DisturbanceSpec,
    LabelSpec,
    LegSpec,
    ObstacleSpec,
    OptimalSpec,
    OscillationSpec,
    Scenario,
)
from clearway.scenarios.static_way import least_length
from clearway.scenarios.suite import (
    Generator,
    Section,
    Selection,
    Suite,
    draw_label,
    refuse_floor_plan,
    refuse_speeds,
    scenario_seed,
    selected_seeds,
)

FROZEN = 10
"""Scenarios of each case, as in paper B."""
SHARP = 0.005
"""Error of the clairvoyant's time that a frozen scenario may have at most."""
_FILE = "sar_scenarios.json"
_MOTIONS: TypeAdapter[tuple[DrivenSpec, ...]] = TypeAdapter(tuple[DrivenSpec, ...])
_START, _GOAL = ((float(x), float(y), float(theta)) for x, y, theta in (TASK["start"], TASK["goal"]))


def build(
    robot: Robot,
    selection: Selection,
    seed: int,
    suite: str,
    cases: Sequence[str],
    draw: Callable[[Case, int], Drawn | None],
) -> list[Scenario]:
    """The frozen scenarios of the `cases`, or those that `draw` gives for `selection.seeds`; at `selection.speeds` (default: each
    case's set speed, or what the robot can do), `selection.repetitions` times, each with another disturbance."""
    refuse_floor_plan(selection.floor_plan, suite, "arena")
    refuse_speeds(selection.speeds, robot)
    return [
        _scenario(suite, case, label, drawn, robot, speed, repetition, seed)
        for case in _chosen(cases, selection)
        for label, drawn in _drawn(case, selection, draw)
        for speed in selection.speeds or (min(case.speed, robot.drive.v_max),)
        for repetition in range(1, (selection.repetitions or 1) + 1)
    ]


def _chosen(cases: Sequence[str], selection: Selection) -> list[Case]:
    return [CASES[name] for name in cases if not selection.batches or name in selection.batches]


def _calls(selection: Selection, cases: Sequence[str]) -> list[tuple[Case, int]]:
    """What `generate` is to be called with for the `selection`."""
    return [(case, seed) for case in _chosen(cases, selection) for seed in _seeds(case, selection)]


def _drawn(
    case: Case, selection: Selection, draw: Callable[[Case, int], Drawn | None]
) -> list[tuple[str, Drawn | None]]:
    """Labels and obstacles."""
    if selection.seeds is None:
        return [(f"scenario-{i}", drawn) for i, drawn in enumerate(frozen()[case.name], 1)]
    return [(draw_label(seed), draw(case, seed)) for seed in _seeds(case, selection)]


def _seeds(case: Case, selection: Selection) -> list[int]:
    """The seeds to draw from, without those that give no scenario of a name that is asked for."""
    return selected_seeds(selection, _stem(case, "seed-"))


def _stem(case: Case, label: str) -> str:
    return f"{case.name.replace(' ', '-')}-{label}"


def _scenario(
    suite: str, case: Case, label: str, drawn: Drawn | None, robot: Robot, speed: float, repetition: int, seed: int
) -> Scenario:
    name = f"{_stem(case, label)}-v{speed:g}-r{repetition}"
    return Scenario(
        name=name,
        floor_plan="arena",
        start=_START,
        legs=(
            LegSpec(name="way", goal=_GOAL, yaw_tolerance=math.inf, time_limit=TASK["time_limit"], arrival="measured"),
        ),
        speed=speed,
        obstacles=() if drawn is None else obstacles(drawn.layout),
        labels=LabelSpec(suite=suite, batch=case.name, configuration=label, repetition=repetition),
        reference_length=math.dist(_START[:2], _GOAL[:2]),
        localisation="truth",
        tracking="difference",
        disturbance=DisturbanceSpec(**TASK["disturbance"]),
        optimal=drawn.optimal if drawn is not None and _is_meant(robot) and speed == case.speed else None,
        shortest=None if drawn is None else _shortest(drawn.layout, robot),
        livelock=True,
        placement_xy=0.0,
        placement_yaw=0.0,
        seed=scenario_seed(seed, name),
    )


def _shortest(layout: Layout, robot: Robot) -> float | None:
    """The least length of a path past what stands, for the largest disc within the robot; see `least_length`."""
    apart = RADIUS + inscribed_radius(robot.shape)
    discs = np.column_stack([layout.static, np.full(len(layout.static), apart)])
    return least_length(np.array(_START[:2]), np.array(_GOAL[:2]), discs, robot.tolerances.xy)


def _is_meant(robot: Robot) -> bool:
    """Whether the clairvoyant's limit, which was searched for the stand-in robot, holds for this one."""
    meant, shape = load_robot(RESCUE), robot.shape
    return isinstance(shape, Circle) and shape == meant.shape and robot.tolerances.xy == meant.tolerances.xy


def obstacles(layout: Layout) -> tuple[ObstacleSpec, ...]:
    """The layout as a scenario has it: `static-1`, ..., `moving-1`, ..."""
    disc = DiscSpec(kind="disc", radius=RADIUS)
    still = [
        ObstacleSpec(name=f"static-{i}", shape=disc, pose=(x, y, 0.0))
        for i, (x, y) in enumerate(layout.static.tolist(), 1)
    ]
    each = zip(*(a.tolist() for a in (layout.start, layout.velocity, layout.attraction, layout.stiffness)), strict=True)
    moving = [
        ObstacleSpec(
            name=f"moving-{i}",
            shape=disc,
            oscillation=OscillationSpec(start=start, velocity=velocity, attraction=attraction, stiffness=stiffness),
        )
        for i, (start, velocity, attraction, stiffness) in enumerate(each, 1)
    ]
    if layout.motions:
        moving = [
            ObstacleSpec(name=f"moving-{i}", shape=disc, motion=motion) for i, motion in enumerate(layout.motions, 1)
        ]
    return (*still, *moving)


@cache
def frozen() -> dict[str, tuple[Drawn, ...]]:
    """The scenarios that come with Clearway, by case."""
    text = (resources.files("clearway.scenarios") / _FILE).read_text("utf-8")
    return {case: tuple(_read(row) for row in rows) for case, rows in json.loads(text).items()}


def freeze(case: Case, count: int = FROZEN) -> list[dict[str, Any]]:
    """The first scenarios of `case` in the family of the frozen ones whose limit is sharp, as JSON values."""
    drawn = (generate(case, s, "frozen") for s in itertools.count())
    return [_written(d) for d in itertools.islice((d for d in drawn if d.optimal.error <= SHARP), count)]


def _written(drawn: Drawn) -> dict[str, Any]:
    layout = drawn.layout
    return {
        "seed": drawn.seed,
        "static": layout.static.tolist(),
        "start": layout.start.tolist(),
        "velocity": layout.velocity.tolist(),
        "attraction": layout.attraction.tolist(),
        "stiffness": layout.stiffness.tolist(),
        "optimal": drawn.optimal.model_dump(),
        **({"motions": _MOTIONS.dump_python(layout.motions, mode="json")} if layout.motions else {}),
    }


def _read(row: dict[str, Any]) -> Drawn:
    parts = ("static", "start", "velocity", "attraction", "stiffness")
    arrays = {part: np.array(row[part], dtype=np.float64).reshape(-1, 2) for part in parts}
    layout = Layout(**arrays, motions=_MOTIONS.validate_python(tuple(row.get("motions", ()))))
    return Drawn(row["seed"], layout, OptimalSpec(**row["optimal"]))


def write_frozen() -> None:
    """Draw the frozen scenarios anew."""
    rows = {name: ",\n".join(json.dumps(row) for row in freeze(case)) for name, case in CASES.items()}
    text = ",\n".join(f'"{name}": [\n{listed}\n]' for name, listed in rows.items())
    Path(str(resources.files("clearway.scenarios") / _FILE)).write_text(f"{{\n{text}\n}}\n", encoding="utf-8")


def _suite(name: str, title: str, description: str, cases: tuple[str, ...]) -> Suite:
    configurations = tuple(f"scenario-{i}" for i in range(1, FROZEN + 1))
    outlines = partial(build, suite=name, cases=cases, draw=lambda case, seed: None)
    generator = Generator(partial(_calls, cases=cases), generate, outlines, _written, _read)
    make = partial(build, suite=name, cases=cases, draw=generator)
    return Suite(
        name,
        title,
        description,
        cases,
        configurations,
        make,
        family="search-and-rescue",
        robots=(RESCUE,),
        report=(Section.RESCUE, Section.MANOEUVRING_SPACE),
        generator=generator,
    )


CASE_1 = _suite(
    "sar-case1",
    "Search and rescue, case 1",
    "6 static and 5 oscillating obstacles in an open square of 14 m, ten scenarios (paper B)",
    ("case 1",),
)
CASE_2 = _suite(
    "sar-case2",
    "Search and rescue, case 2",
    "8 static and 8 oscillating obstacles with a gap that closes on the shortest way, ten scenarios (paper B)",
    ("case 2",),
)
CONFINED = _suite(
    "sar-confined",
    "Search and rescue, confined",
    "both cases with obstacles that stay near their attraction and inside the square",
    ("case 1 confined", "case 2 confined"),
)
CASE_3 = _suite(
    "sar-case3",
    "Search and rescue, case 3",
    "12 static and 16 oscillating obstacles inside the square, a gap that closes, a robot at 0.6 m/s: ten scenarios",
    ("case 3",),
)
STRESS = _suite(
    "sar-stress",
    "Search and rescue, stress",
    "as case 2, with a robot at 0.6 m/s among obstacles that are faster: ten scenarios",
    ("stress",),
)
MISSPECIFIED = _suite(
    "sar-misspecified",
    "Search and rescue, misspecified",
    "as case 2, with obstacles that move as no forecast models: damped, shaken, stop-and-go, pursuing; ten scenarios",
    ("misspecified",),
)


if __name__ == "__main__":
    write_frozen()
