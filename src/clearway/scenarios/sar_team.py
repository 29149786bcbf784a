"""The suites `sar-team` and `sar-team-held-out`: paper B's cases with several robots, of one kind or of several.

Paper B names multi-robot systems "with potentially heterogeneous characteristics" as future work and says no more of them: robots, starts and
goals are stand-ins (`clearway/stand_ins.toml`). None talks to another. Ten scenarios of each number of robots are frozen: drawn by the same
rules from numbers of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.robots import Robot, load_robot
from clearway.robots.robot import RESCUE
from clearway.scenarios.sar import obstacles
from clearway.scenarios.sar_draws import CASES, Case
from clearway.scenarios.sar_rules import SPEED, TASK, Layout
from clearway.scenarios.sar_team_draws import KINDS, MOST, STREAMS, TEAM, TeamLayout, draw
from clearway.scenarios.scenario import DisturbanceSpec, LabelSpec, LegSpec, RobotSpec, Scenario
from clearway.scenarios.suite import (
    Generator,
    Section,
    Selection,
    Suite,
    draw_label,
    refuse_floor_plan,
    scenario_seed,
    selected_seeds,
)

FROZEN = 10
"""Scenarios of each batch and number of robots."""
NUMBERS = (2, 4, 8)
_MIXED = " mixed"


@dataclass(frozen=True, slots=True)
class Setting:
    """What tells one of the suites from the other.

    Attributes:
        name: The suite.
        cases: Batch -> by which rules its obstacles are drawn; of a mixed one the robots are of several kinds.
        speed: Set speed of robots of one kind, m/s.
        mixed_speed: Set speed of robots of several kinds, and the highest of any team, m/s.
    """

    name: str
    cases: Mapping[str, Case]
    speed: float
    mixed_speed: float


SETTING = Setting(
    "sar-team",
    {f"{case}{kind}": CASES[f"{case} confined"] for case in ("case 1", "case 2") for kind in ("", _MIXED)},
    SPEED,
    TEAM["speed"],
)
HELD_OUT = Setting(
    "sar-team-held-out",
    {f"streams{kind}": STREAMS for kind in ("", _MIXED)},
    TEAM["streams"]["speed"],
    TEAM["streams"]["mixed_speed"],
)
_NONE = np.zeros((0, 2))
_OUTLINE = TeamLayout(
    tuple(((1.0 + k, 1.0), (1.0 + k, 9.0)) for k in range(MOST)), Layout(_NONE, _NONE, _NONE, _NONE, _NONE)
)
"""Stands for what has yet to be drawn."""

_PARTS = ("static", "start", "velocity", "attraction", "stiffness")
Draw = Callable[[Case, int, int, str], TeamLayout]


def build(robot: Robot, selection: Selection, seed: int, setting: Setting, drawn: Draw) -> list[Scenario]:
    """The frozen scenarios, or those of `selection.seeds`, for each number of robots or for that of the team."""
    refuse_floor_plan(selection.floor_plan, setting.name, "arena")
    if len(selection.team) > MOST:
        raise ClearwayError(
            f"{len(selection.team)} robots are more than the arena of the suite {setting.name!r} is meant for; at most {MOST}",
            field="team",
        )
    made = []
    for batch, number, seeds, family in _asked(selection, setting):
        usual = setting.speed if _MIXED not in batch else setting.mixed_speed
        if selection.team:
            usual = max(load_robot(name).drive.v_max for name in dict.fromkeys(selection.team))
        for draw_number in seeds:
            for speed in selection.speeds or (min(usual, setting.mixed_speed),):
                for repetition in range(1, (selection.repetitions or 1) + 1):
                    label = draw_label(draw_number) if family != "frozen" else f"scenario-{draw_number}"
                    name = f"{_stem(batch, number)}{label}-v{speed:g}-r{repetition}"
                    if not selection.scenarios or name in selection.scenarios:
                        layout = drawn(setting.cases[batch], number, draw_number, family)
                        labels = LabelSpec(batch=batch, configuration=str(number), repetition=repetition)
                        made.append(_scenario(name, speed, layout, number, labels, scenario_seed(seed, name)))
    return made


def _asked(selection: Selection, setting: Setting) -> list[tuple[str, int, Sequence[int], str]]:
    """Batches, numbers of robots, the seeds to draw from, and which family of draws these are of."""
    chosen = [b for b in setting.cases if not selection.batches or b in selection.batches]
    if selection.team:  # it says itself of which kinds it is
        chosen = [b for b in chosen if _MIXED not in b] or chosen
    numbers = (len(selection.team),) if selection.team else NUMBERS
    if selection.seeds is None:
        return [(b, n, range(1, FROZEN + 1), "frozen") for b in chosen for n in numbers]
    return [(b, n, selected_seeds(selection, f"{_stem(b, n)}seed-"), "held out") for b in chosen for n in numbers]


def _stem(batch: str, number: int) -> str:
    return f"{batch.replace(' ', '-')}-{number}-"


def _scenario(name: str, speed: float, drawn: TeamLayout, number: int, labels: LabelSpec, seed: int) -> Scenario:
    (start, leg), *others = (_way(*ends) for ends in drawn.ends[:number])
    kinds = [KINDS[k % len(KINDS)] if _MIXED in labels.batch else None for k in range(number - 1)]
    return Scenario(
        name=name,
        floor_plan="arena",
        start=start,
        legs=(leg,),
        speed=speed,
        obstacles=obstacles(drawn.layout),
        robots=tuple(
            RobotSpec(name=f"robot {k}", start=s, legs=(g,), robot=kind)
            for k, ((s, g), kind) in enumerate(zip(others, kinds, strict=True), 2)
        ),
        labels=labels,
        reference_length=math.dist(start[:2], leg.goal[:2]),
        localisation="truth",
        tracking="difference",
        disturbance=DisturbanceSpec(**TASK["disturbance"]),
        livelock=True,
        placement_xy=0.0,
        placement_yaw=0.0,
        seed=seed,
    )


def _way(start: tuple[float, float], goal: tuple[float, float]) -> tuple[tuple[float, float, float], LegSpec]:
    heading = round(math.atan2(goal[1] - start[1], goal[0] - start[0]), 4)
    leg = LegSpec(
        name="way", goal=(*goal, heading), yaw_tolerance=math.inf, time_limit=TASK["time_limit"], arrival="measured"
    )
    return (*start, heading), leg


def _calls(selection: Selection, setting: Setting) -> list[tuple[Case, int, int, str]]:
    return [(setting.cases[b], n, seed, family) for b, n, seeds, family in _asked(selection, setting) for seed in seeds]


def _written(drawn: TeamLayout) -> dict[str, Any]:
    return {"ends": drawn.ends} | {part: getattr(drawn.layout, part).tolist() for part in _PARTS}


def _read(row: dict[str, Any]) -> TeamLayout:
    ends = tuple(((a[0], a[1]), (b[0], b[1])) for a, b in row["ends"])
    static, start, velocity, attraction, stiffness = (np.array(row[part], dtype=np.float64) for part in _PARTS)
    return TeamLayout(ends, Layout(static, start, velocity, attraction, stiffness))


def _suite(setting: Setting, title: str, description: str) -> Suite:
    make = partial(build, setting=setting)
    outlines = partial(make, drawn=lambda *_: _OUTLINE)
    generator = Generator(partial(_calls, setting=setting), draw, outlines, _written, _read)
    return Suite(
        setting.name,
        title,
        description,
        tuple(setting.cases),
        tuple(map(str, NUMBERS)),
        partial(make, drawn=generator),
        family="search-and-rescue",
        robots=(RESCUE,),
        report=(Section.BY_NUMBER,),
        several=True,
        generator=generator,
        source="Paper B's cases (Rado, Baglioni, Jamshidnejad 2025) with several robots, equal or of different kinds, which that paper names as future work. It has no figures"
        " of several robots, so none stand beside it.",
    )


SAR_TEAM = _suite(
    SETTING,
    "Search and rescue, several robots",
    "2, 4 or 8 robots, equal or of three kinds, among the obstacles of paper B's cases, each from a start to a goal of its own",
)
HELD_OUT_SAR_TEAM = _suite(
    HELD_OUT,
    "Search and rescue, several robots, held out",
    "the same in two streams towards each other, among more that stands and less that moves, on which nothing was chosen",
)
