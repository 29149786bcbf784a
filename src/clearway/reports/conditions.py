"""What has to be said about a test so that another lab can judge and repeat it.

Laid out after ASTM F3327 (recording the configuration of a test of an automatic or autonomous unmanned ground
vehicle): the vehicle, its load, the floor, the software, who, when; and what deviated from the protocol. What only a
person knows is left as a line to fill in. No conformity is claimed.
"""

from __future__ import annotations

import math
import platform
from collections import Counter
from collections.abc import Mapping
from typing import Any

from clearway.reports import paper, parameters, recordings
from clearway.reports.findings import Findings
from clearway.reports.selection import System, distinct, driver, is_recorded
from clearway.reports.suites import SuiteAbout
from clearway.robots import DriveLimits, Robot
from clearway.scenarios.suite import Section
from clearway.trials.keeping import KEEPS
from clearway.versions import version_of

Facts = list[tuple[str, str]]
_PUSHES = {"position": "m", "heading": "rad", "velocity": "m/s", "turn": "rad/s"}
"""What a disturbance bounds, with its unit."""
BLANK = ""
"""Left for a pen."""


def vehicle(f: Findings, name: str) -> Facts:
    """What is known of a robot, and what has to be filled in."""
    robot = f.robots.get(name)
    facts: Facts = [("name", f.title(name))]
    load, software = (recordings.stated(f, what, name) for what in ("load", "software"))
    facts += [("software", software)] if software else []
    if robot is None:
        return [*facts, ("make and model", BLANK), ("serial number", BLANK), ("load", load)]
    given = dict(robot.conditions)
    facts += [("make and model", given.pop("make", BLANK)), ("serial number", given.pop("serial", BLANK))]
    carried = given.pop("load", BLANK)
    facts += [("load", load or carried), *given.items(), ("footprint", _footprint(robot))]
    facts.append(("drive limits", _drive(robot.limits())))
    if robot.lidar is not None:
        lidar = robot.lidar
        facts.append(
            ("lidar", f"{lidar.beams} beams over {57.29578 * (lidar.angle_max - lidar.angle_min):.0f}°, "
             f"{lidar.range_min:g} to {lidar.range_max:g} m, σ {100 * lidar.sigma:g} cm, bias within "
             f"{100 * lidar.bias:g} cm, spots of {1000 * lidar.divergence:g} mrad, {100 * lidar.dropout:g} % lost, "
             f"a sweep of {1000 * lidar.sweep:g} ms")
        )  # fmt: skip
    o = robot.odometry
    if any(r["robot"] == name and not is_recorded(r) for r in f.rows):
        noise = (
            f"systematic {100 * o.scale:g} % of the way, {100 * o.turning:g} % of turns, {1000 * o.curvature:g} mrad/m; "
            f"drift {100 * o.translation_per_metre:g} cm/√m, {1000 * o.rotation_per_metre:g} mrad/√m, "
            f"{1000 * o.rotation_per_radian:g} mrad/√rad"
        )
        facts.append(("wheel odometry", noise))
        facts.append(("latency", _latency(f, robot)))
        if motors := _motors(robot):
            facts.append(("motors and wheels", motors))
        if without := _dict(_dict(f.results.campaign.get("plan")).get("selection")).get("ideal"):
            facts.append(("errors left out", ", ".join(map(str, without))))
    facts.append(("control period", f"{robot.period:g} s"))
    facts.append(("tolerances at the goal, of the test", _tolerances(f, name, "xy_tolerance", "yaw_tolerance")))
    if told := _tolerances(f, name, "planner_xy_tolerance", "planner_yaw_tolerance"):
        facts.append(("tolerances at the goal, of the planner", told))
    return facts


def _tolerances(f: Findings, name: str, xy: str, yaw: str) -> str:
    """Those of a robot's tests; empty where nobody knows any."""
    legs = [leg for system, own in f.goals.items() if system.robot == name for leg in own]
    parts = []
    for tolerance, unit in ((xy, "m"), (yaw, "rad")):
        values = sorted({v for leg in legs if not math.isnan(v := getattr(leg, tolerance))})
        if values:
            parts.append(" or ".join("any heading" if math.isinf(v) else f"{v:g} {unit}" for v in values))
    return ", ".join(parts)


def _drive(d: DriveLimits) -> str:
    straight = f"{d.v_max:g} m/s, {d.acceleration:g}/{d.deceleration:g} m/s²"
    if d.kind == "ackermann":
        return (
            f"{straight}, wheelbase {d.wheelbase:g} m, steering {d.steering_max:.2f} rad, {d.steering_rate:.2f} rad/s"
        )
    turning = f"{d.omega_max:.2f} rad/s, {d.angular_acceleration:.2f} rad/s²"
    if d.kind == "differential":
        return f"{straight}, {turning}"
    return f"{straight}, to its sides {d.v_y_max:g} m/s, {d.lateral_acceleration:g}/{d.lateral_deceleration:g} m/s², {turning}"


def _motors(robot: Robot) -> str:
    base = robot.drive
    parts = [f"lag {base.lag:g} s"] if base.lag else []
    if base.slip_ratio or base.turn_slip_ratio:
        parts.append(f"slip {100 * base.slip_ratio:g} % of the way, {100 * base.turn_slip_ratio:g} % of turns")
    return ", ".join(parts)


def _latency(f: Findings, robot: Robot) -> str:
    factor = _dict(_dict(f.results.campaign.get("plan")).get("selection")).get("latency")
    factor = 1.0 if factor is None else float(factor)
    late = robot.latency
    if not factor * (late.sensing + late.command + late.jitter):
        return "none: senses and acts at once" + (", but for its motors" if robot.drive.lag else "")
    parts = [f"sensing {factor * late.sensing:g} s", f"command {factor * late.command:g} s"]
    parts += [f"up to {factor * late.jitter:g} s more of either"] if late.jitter else []
    return ", ".join(parts) + (f" ({factor:g} times what its file says)" if factor != 1.0 else "")


def test(f: Findings) -> Facts:
    """The test itself: where, how, when, by whom, with which software."""
    campaign = f.results.campaign
    plan, run = (_dict(campaign.get(key)) for key in ("plan", "run"))
    map_used = plan.get("map") or "the floor plan's true map"
    if f.suites and all(suite.mapped is False for suite in f.suites.values()):
        map_used = "none"
    recorded = bool(f.rows) and all(map(is_recorded, f.rows))
    if recorded:
        map_used = BLANK
    kind = (
        "recording of real robots"
        if recorded
        else "simulation and recording of real robots"
        if f.recorded
        else "simulation"
    )
    facts: Facts = [
        ("kind of test", kind),
        ("suite", ", ".join(distinct(f.rows, "suite"))),
        ("floor plan", _some([p for p in distinct(f.rows, "floor_plan") if p])),
        ("floor surface", recordings.stated(f, "floor") if f.recorded else _floor(f)),
        *([("measured by", recordings.stated(f, "capture"))] if f.recorded else []),
        ("map given to the robot", "the floor plan's true map" if map_used == "true" else str(map_used)),
        ("localisation", ", ".join(distinct(f.rows, "localisation"))),
        ("navigators", ", ".join(dict.fromkeys(driver(s.navigator) for s in f.systems))),
        *[
            (f"options of {name}", ", ".join(f"{key} = {value}" for key, value in _dict(options).items()))
            for name, options in _dict(plan.get("options")).items()
            if options
        ],
        *_if_any("obstacles followed by", [t for t in distinct(f.rows, "tracking") if t]),
        *_if_any("set-ups (thinking a decision)", distinct(f.rows, "setup")),
        *([] if recorded else [("seed", str(plan.get("seed", "not recorded")))]),
        ("trials", str(len(f.rows))),
        *([] if (keep := f.results.keep) == "trajectories" else [("kept", KEEPS[keep])]),
        *_shard(_dict(campaign.get("shard"))),
        *([("attempts without a recording", str(len(recordings.unrecorded(f))))] if f.recorded else []),
        *([("tested on", recordings.stated(f, "date"))] if f.recorded else []),
        ("scoring started" if recorded else "started", _date(run.get("started"))),
        ("scoring finished" if recorded else "finished", _date(run.get("finished"))),
        ("Clearway", str(campaign.get("clearway", version_of("clearway")))),
        ("software", _software(campaign.get("versions"))),
        ("machine", _machines(run) or BLANK),
        ("report made with", f"Clearway {version_of('clearway')}, Python {platform.python_version()}"),
        ("place", recordings.stated(f, "place")),
        ("tested by", recordings.stated(f, "operator")),
    ]
    return facts


def _shard(shard: Mapping[str, Any]) -> Facts:
    """Which part of a campaign these are the results of, if not of all of it."""
    return [("part of a campaign", "shard {number} of {of}, of {total} trials".format(**shard))] if shard else []


def _machines(run: Mapping[str, Any]) -> str:
    """What it was run on; of a campaign that was run in shards each kind of machine, with how many shards it ran."""
    told = Counter(
        _software({k: one[k] for k in ("system", "processor", "cores") if k in one}) for one in run.get("shards", [run])
    )
    return "; ".join(words if len(told) == 1 else f"{count} shards on {words}" for words, count in told.items())


def _floor(f: Findings) -> str:
    """Wheels slip everywhere; in some suites the ground also moves the robot."""
    words = "level and dry; slip as in the wheel odometry's error"
    rough = {suite.title: _rough(suite) for suite in f.suites.values() if suite.disturbances}
    if not rough:
        return words
    parts = list(dict.fromkeys(rough.values()))
    if len(parts) > 1:
        parts = [f"{title}: {part}" for title, part in rough.items()]
    even = [suite.title for suite in f.suites.values() if not suite.disturbances]
    return "; ".join([*parts, *([f"{', '.join(even)}: {words}"] if even else [])])


def _rough(suite: SuiteAbout) -> str:
    """How the ground moves the robot at most, whichever the scenario."""
    most = {name: max(float(d.get(name, 0.0)) for d in suite.disturbances) for name in _PUSHES}
    said = [f"{value:g} {_PUSHES[name]}" for name, value in most.items() if value]
    resting = "" if all(d.get("at_rest", True) for d in suite.disturbances) else ", while it drives"
    return f"rough: it moves the robot by at most {' and '.join(said) or 'nothing'} a control period{resting}"


def _if_any(name: str, values: list[Any]) -> Facts:
    return [(name, ", ".join(map(str, values)))] if values else []


def deviations(f: Findings) -> list[str]:
    """What differs from the protocol, in sentences."""
    found = []
    if not f.recorded:
        found.append(
            "The robots, their sensors and the moving obstacle are simulated; no motion capture is involved: the true pose is known exactly."
        )
    protocol = f.asked(Section.PAPER_A)
    for system in f.systems:
        rows = [r for r in f.of(system) if r["suite"] in protocol]
        short = [
            f"{batch} {n} of {whole}" for batch, whole in paper.PROTOCOL.items()
            if (n := sum(r["batch"] == batch for r in rows)) != whole
        ]  # fmt: skip
        if rows and short:
            found.append(f"{f.name(system)}: not the whole protocol was run ({', '.join(short)} trials).")
    for name in f.robots:
        preset = name.partition(":")[2]
        if preset and not name.endswith(".toml"):
            found.append(f"{f.title(name)}: the robot's preset “{preset}” replaces some of its parameters.")
        if found_there := parameters.differences(f, name):
            found.append(f"{f.title(name)}: not as the paper's Table 3 prints it: {'; '.join(found_there)}.")
    for system in f.systems:
        if stricter := _as_printed(f, system):
            found.append(stricter)
    if clocked := [s for s in distinct(f.rows, "setup") if s in ("1", "real time") or s.endswith(" s")]:
        found.append(
            f"Set-up {', '.join(clocked)}: it goes by wall clock, so these trials depend on the machine and are not the same each time."
        )
    if len(kinds := distinct(f.rows, "localisation")) > 1 or kinds not in (["amcl"], ["odometry"], ["recorded"]):
        found.append(f"Localisation: {', '.join(kinds)}.")
    for navigator in dict.fromkeys(r["navigator"] for r in f.rows if r["privileged"]):
        found.append(
            f"The navigator {navigator} was given the truth about the obstacles (privileged); it is a reference, not a candidate."
        )
    found += recordings.deviations(f)
    for outcome, words in (
        ("navigator_failed", "the navigator raised or gave no valid command; they count as failed"),
        (
            "scenario_failed",
            "the scenario failed, by a behaviour of its people or as it was built; they count neither as successes nor as failures",
        ),
        ("aborted", "the navigator gave up; they count as failed"),
    ):
        if count := sum(r["outcome"] == outcome and not is_recorded(r) for r in f.rows):
            found.append(f"In {count} trial{'s' if count > 1 else ''} {words}.")
    if protocol:
        found.append(
            "What the paper leaves open (gaps, timing of the moving obstacle, cruise band, pairing of trials) is read as docs/decisions.md states."
        )
    return found


def _as_printed(f: Findings, system: System) -> str:
    """How many trials would be a success by the heading tolerance that Table 3 prints, where another one was used."""
    allowed, printed = f.tolerances.get((system, "OE_max")), paper.YAW_TOLERANCE.get(system.robot.partition(":")[0])
    if allowed is None or printed is None or allowed <= printed:
        return ""
    protocol = f.asked(Section.PAPER_A)
    rows = [r for r in f.of(system) if r["suite"] in protocol]
    if not rows:
        return ""
    met = sum(bool(r["success"]) and r["OE_max"] is not None and r["OE_max"] <= printed for r in rows)
    return (
        f"{f.name(system)}: judged by a heading tolerance of {allowed:g} rad, {sum(bool(r['success']) for r in rows)} "
        f"of {len(rows)} trials are a success; by the {printed:g} rad of Table 3, {met} would be."
    )


def _dict(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _date(value: Any) -> str:
    """An ISO time in UTC as people write it; anything else as it is."""
    text = str(value or BLANK)
    return f"{text[:10]} {text[11:16]} UTC" if text.endswith("+00:00") else text


def _footprint(robot: Robot) -> str:
    spec = robot.footprint
    if spec.kind == "circle":
        return f"disc, diameter {2 * spec.radius:g} m"
    xs, ys = zip(*spec.vertices, strict=True)
    return f"polygon of {len(spec.vertices)} vertices, {max(xs) - min(xs):g} m by {max(ys) - min(ys):g} m"


def _some(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]} ({len(names)} plans)"


def _software(versions: Any) -> str:
    return ", ".join(f"{k} {v}" for k, v in versions.items()) if isinstance(versions, dict) else BLANK
