"""The columns of `trials.parquet` that are no indicators: what was tested, how it ended, and what a person should know.

To add one, add it to `COLUMNS`; the row, its schema, the reference and the selection of figures are made from that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import attrgetter

from clearway.contract import BodyKind, EventKind
from clearway.indicators import clearance, cruise, incidents, path_length
from clearway.indicators.avoidable import avoidable, touched_body
from clearway.indicators.cause import cause, who_moved
from clearway.indicators.clipping import clipped
from clearway.indicators.column import Column, Kind
from clearway.indicators.confirm import near_tolerance, to_confirm
from clearway.indicators.fleet import arrived, blocked_by, waited_for
from clearway.indicators.indicator import NotComputable
from clearway.indicators.success import failure
from clearway.trials import Trial


def _failure(trial: Trial) -> str | None:
    try:
        return failure(trial)
    except NotComputable:
        return None


def _violations(trial: Trial) -> int:
    return sum(event.kind == EventKind.ASSUMPTION for event in trial.events)


def _count(kind: BodyKind) -> Callable[[Trial], int]:
    return lambda trial: sum(body.kind == kind for body in trial.attempt.bodies)


def _touched(trial: Trial) -> str:
    body = touched_body(trial)
    return "" if body is None else str(body.kind)


def _touched_body(trial: Trial) -> str:
    body = touched_body(trial)
    return "" if body is None else body.name


def _legs_by_motion(trial: Trial) -> bool:
    """Whether a leg of a recording begins where the robot moved off: neither a goal nor the test plan says when."""
    told = trial.provenance.get("legs")
    legs = [leg for leg in told if isinstance(leg, str)] if isinstance(told, list | tuple) else []
    given = ("goal sent", "span given")
    return trial.attempt.source == "recorded" and any(not any(how in leg for how in given) for leg in legs)


def _label(name: str, kind: Kind, text: str, unit: str = "") -> Column:
    return Column(name, kind, text, attrgetter(f"attempt.labels.{name}"), unit, selectable=True)


def _attempted(
    name: str, kind: Kind, text: str, *, selectable: bool = False, of: str = "", arrow: str | None = None
) -> Column:
    return Column(name, kind, text, attrgetter(f"attempt.{of or name}"), "", selectable, arrow)


def _bounds(name: str, unit: str, of: Callable[[Trial], tuple[float, float] | None]) -> tuple[Column, Column]:
    """Two columns: what an indicator is at least and at most, where a recording does not tell it."""

    def end(k: int) -> Callable[[Trial], float | None]:
        def value(trial: Trial) -> float | None:
            found = of(trial)
            return None if found is None or not math.isfinite(found[k]) else found[k]

        return value

    words = f"{{}} {name} of a recording can have been, where the robot or an obstacle was not seen all of the time"
    return (
        Column(f"{name}_at_least", Kind.NUMBER, words.format("the least that"), end(0), unit),
        Column(f"{name}_at_most", Kind.NUMBER, words.format("the most that"), end(1), unit),
    )


COLUMNS = (
    _attempted("scenario", Kind.WORD, "unique in its suite", selectable=True),
    _label("suite", Kind.WORD, "name of the suite"),
    _label("family", Kind.WORD, "what its suite shares with its like, such as barn"),
    _label("batch", Kind.WORD, "NO, SO, MO, CE in the hospital protocol; what the report groups by"),
    _label("configuration", Kind.WORD, "the same test at other speeds has the same configuration"),
    _attempted("robot", Kind.WORD, "name, with :PRESET if one was used", selectable=True),
    _attempted("navigator", Kind.WORD, "name, with [option=value] if any was given", selectable=True),
    _label("setup", Kind.WORD, "how much thinking was allowed a decision; empty: no bound"),
    _attempted("localisation", Kind.WORD, "truth, odometry or amcl", selectable=True),
    _attempted("tracking", Kind.WORD, "how obstacles were followed; empty if the navigator asked for none"),
    _attempted("privileged", Kind.BOOLEAN, "whether the navigator was told the obstacles' future"),
    _attempted(
        "tuned", Kind.WORD,
        "on what the navigator says that its parameters were chosen: on this scenario, on this geometry (the same obstacles in the "
        "same place), on other scenarios of this suite, no; empty if it says nothing, or no and options were given", of="tuned.value",
    ),
    _attempted("floor_plan", Kind.WORD, "where it was driven", selectable=True),
    _label("speed", Kind.NUMBER, "set speed", "m/s"),
    _label("obstacle_speed", Kind.NUMBER, "of the moving obstacle", "m/s"),
    _label("size", Kind.NUMBER, "edge of the static obstacles", "m"),
    _label("gap", Kind.NUMBER, "between double obstacles", "d_base"),
    _label("repetition", Kind.COUNT, "of the same test, from 1"),
    _attempted("seed", Kind.COUNT, "of the scenario; the same for every robot and navigator", arrow="uint64"),
    Column(
        "outcome", Kind.WORD, "reached, collision, timeout, livelock, navigator_failed, scenario_failed or aborted",
        lambda trial: trial.outcome.value, selectable=True,
    ),
    Column("reason", Kind.WORD, "of an outcome other than reached, in words", attrgetter("reason")),
    Column(
        "failure", Kind.WORD, "why success is false; empty if it is true, null where nobody can tell", _failure
    ),
    Column("cause", Kind.WORD, "why success is false in paper B's words, each decided by a stated test", cause),
    Column(
        "moved_at_contact", Kind.WORD,
        "who moved at contact: robot, obstacle, both or neither; empty without one (Tsoi et al. 2022, SEAN 2.0, count a robot's contacts "
        "with people and people's with a robot apart)", who_moved,
    ),
    Column(
        "touched", Kind.WORD,
        "what kind of body was touched: wall, furniture, obstacle, moving obstacle, person, robot; empty without a contact, or where"
        " nobody knows", _touched,
    ),
    Column("touched_body", Kind.WORD, "the name of the body that was touched; empty likewise", _touched_body),
    Column(
        "avoidable", Kind.WORD,
        "of a contact: seen too late, escape existed when first seen, or planner's fault, each decided by a stated test",
        avoidable,
    ),
    Column(
        "violations", Kind.COUNT,
        "how often an assumption of the navigator's guarantee was seen to be untrue (events `assumption`)", _violations,
    ),
    _attempted("run", Kind.WORD, "the simulation that it shares with the trials of other robots; empty: none"),
    _attempted("member", Kind.WORD, "the name of its robot there"),
    Column("people", Kind.COUNT, "how many people are there", _count(BodyKind.PERSON)),
    Column("other_robots", Kind.COUNT, "how many robots drive there beside it", _count(BodyKind.ROBOT)),
    Column("arrived", Kind.NUMBER, "when it had arrived at the last of its goals, since the trial began", arrived, "s"),
    Column(
        "waits", Kind.WORD,
        "JSON: other robot -> s for which it waited for it: stood within 1 m of its outline, the nearest of them counts; empty: for none",
        waited_for,
    ),
    Column(
        "blocked_by", Kind.WORD,
        "the robot for which it waited in the last 5 s of its trial without arriving; empty: it arrived, touched something, drove, or nobody "
        "was near", blocked_by,
    ),
    Column(
        "clipped", Kind.COUNT,
        "in how many control periods the base was told what it can't do (beyond its limits, the set speed among them) and did what"
        " it could; null where nobody knows", clipped,
    ),
    _attempted("source", Kind.WORD, "simulated or recorded"),
    Column(
        "contacts", Kind.COUNT, "how often the robot touched something; null where neither a person nor the geometry tells",
        incidents.contacts,
    ),
    Column("first_contact", Kind.NUMBER, "when it first did, as far as that is known", incidents.first_contact, "s"),
    Column(
        "interventions", Kind.COUNT, "how often a person had to help; null where nobody said, and of simulations",
        incidents.interventions,
    ),
    Column("first_intervention", Kind.NUMBER, "when one first did, as far as that is known", incidents.first_intervention, "s"),
    Column(
        "legs_by_motion", Kind.BOOLEAN,
        "whether a recording's legs were found by the robot's motion, not by goals or given spans; see CT",
        _legs_by_motion,
    ),
    Column(
        "to_confirm", Kind.WORD,
        "what a person has to look at: possible contacts, starts and ends of legs that did not show, a recording that can't be used or can't be right",
        to_confirm,
    ),
    Column(
        "near_tolerance", Kind.WORD,
        "DE or OE closer to its tolerance than its uncertainty; success keeps to the values", near_tolerance,
    ),
    *_bounds("MDO", "m", clearance.bounds),
    *_bounds("PL", "m", path_length.bounds),
    *_bounds("TCS", "%", cruise.bounds),
    Column(
        "note", Kind.WORD, "the tester's, of a recorded trial", lambda trial: str(trial.provenance.get("note", ""))
    ),
)  # fmt: skip
"""In the order of the table."""
