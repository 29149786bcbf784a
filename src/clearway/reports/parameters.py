"""The navigation parameters that were used, each with its source, beside paper A's Table 3."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from clearway.reports import paper
from clearway.reports.findings import Findings
from clearway.reports.grid import NONE, Cell, Grid, grid, text
from clearway.reports.selection import is_recorded
from clearway.robots import Robot

NAVIGATOR = "move-base"
_LOCAL = "<local planner>"
_WHERE = (
    (("move_base.planner_frequency",), "Hz"),
    (("global_planner.default_tolerance",), "m"),
    ((), ""),
    (("move_base.controller_frequency",), "Hz"),
    ((f"{_LOCAL}.vx_samples",), ""),
    ((f"{_LOCAL}.vy_samples",), ""),
    ((f"{_LOCAL}.vth_samples", f"{_LOCAL}.vtheta_samples"), ""),
    ((f"{_LOCAL}.xy_goal_tolerance", "/goal_checker.xy_goal_tolerance", "/tolerances.xy"), "m"),
    ((f"{_LOCAL}.yaw_goal_tolerance", "/goal_checker.yaw_goal_tolerance", "/tolerances.yaw"), "rad"),
    ((f"{_LOCAL}.max_vel_x",), "m/s"),
    ((f"{_LOCAL}.max_vel_theta", f"{_LOCAL}.max_rotational_vel"), "rad/s"),
    (("local_costmap.update_frequency",), "Hz"),
    (("local_costmap.obstacle_layer.obstacle_range",), "m"),
    (("local_costmap.obstacle_layer.raytrace_range",), "m"),
    (("local_costmap.width",), "m"),
    (("local_costmap.resolution",), "m"),
)
"""For each row of Table 3: where move_base's own files hold it, or with a slash the robot's (the first that is there), and
its unit."""


def table_3(f: Findings, robot: str) -> Grid | None:
    """Table 3 as printed and as used here, with the source of each value; None where our move-base did not drive it."""
    known = f.robots.get(robot)
    if (
        known is None
        or NAVIGATOR not in known.navigators
        or all(r["navigator"] != NAVIGATOR for r in f.rows if r["robot"] == robot and not is_recorded(r))
    ):
        return None
    values, given = known.model_dump(), known.navigators[NAVIGATOR]
    planner = str(given.get("move_base", {}).get("base_local_planner", "")).rpartition("/")[2]
    column = {"hosbot": "hosbot", "tiago": "tiago"}.get(robot.partition(":")[0])
    rows = []
    for printed, (places, unit) in zip(paper.TABLE_3, _WHERE, strict=True):
        theirs = getattr(printed, column) if column else NONE
        if not places:
            rows.append(
                [
                    printed.title,
                    theirs,
                    Cell("each control period", strong=column is not None),
                    "move_base asks its local planner anew each period; it has no such parameter",
                ]
            )
            continue
        place, value = next(
            ((p, v) for p in places if (v := _get(values, _dotted(p, planner))) is not None), (places[0], None)
        )
        name = place.replace(_LOCAL, planner).removeprefix("/")
        if value is None:
            rows.append([printed.title, theirs, NONE, Cell("not in the robot's file", name)])
            continue
        used = f"{value:g} {unit}".strip() if isinstance(value, int | float) else str(value)
        differs = column is not None and _number(theirs) != value
        rows.append(
            [
                printed.title,
                theirs,
                Cell(used, strong=differs),
                Cell(source(known, _dotted(place, planner)), name),
            ]
        )
    local = f"local planner {planner}" if planner else "local planner not named"
    return grid(
        f"{f.title(robot)}, {local}: the paper's Table 3 and what was used here (in bold where it differs)",
        [text("Parameter"), "paper", "here", text("Source of the value here")],
        rows,
    )


def _dotted(place: str, planner: str) -> str:
    return place[1:] if place.startswith("/") else f"navigators.{NAVIGATOR}.{place.replace(_LOCAL, planner)}"


def differences(f: Findings, robot: str) -> list[str]:
    """What a robot was driven with that is not as Table 3 prints it, such as `Local resolution 0.05 m (0.025 m)`."""
    found = table_3(f, robot)
    if found is None:
        return []
    return [
        f"{row[0].text[:1].lower()}{row[0].text[1:]} {row[2].text} (printed: {row[1].text})"
        for row in found.rows
        if row[2].strong
    ]


def every_parameter(robot: Robot) -> list[tuple[str, str, str]]:
    """(dotted name, value, source) of everything that the robot's file sets."""
    values = robot.model_dump(mode="json", exclude={"sources", "presets", "name", "title"})
    return [(name, _text(value), source(robot, name)) for name, value in _flat(values)]


def source(robot: Robot, name: str) -> str:
    """Where a value comes from: the source of the longest dotted prefix that has one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        found = robot.sources.get(".".join(parts[:end]))
        if found:
            return found
    return NONE


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif value is not None:
            yield f"{prefix}{key}", value


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "; ".join(str(v.get("name", v)) for v in value)
    return ", ".join(map(_text, value)) if isinstance(value, list) else str(value)


def _get(values: Mapping[str, Any], path: str) -> Any:
    for part in path.split("."):
        if not isinstance(values, Mapping) or part not in values:
            return None
        values = values[part]
    return values


def _number(printed: str) -> float | None:
    try:
        return float(printed.split()[0])
    except (ValueError, IndexError):
        return None
