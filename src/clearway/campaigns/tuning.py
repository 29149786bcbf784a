"""How near to each trial's test its navigator's parameters were chosen."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.contract import Navigator
from clearway.errors import ClearwayError
from clearway.navigators.registry import files_of, navigator_class, split_options
from clearway.robots import Robot, load_robot
from clearway.robots.tables import TUNED_ON
from clearway.scenarios.suite import draw_label
from clearway.tuning import Tuned, TunedOn

TUNED_ON_COMMENT = "# clearway: tuned on "
"""How the first line of a YAML file begins that says on what its values were chosen; what follows is JSON."""


def declaration(one: TunedOn) -> dict[str, Any]:
    """What a file says of a test on which its values were chosen."""
    draws = None if one.draws is None else [one.draws.start, one.draws.stop]
    said: dict[str, Any] = {
        "suite": one.suite,
        "floor_plan": one.floor_plan,
        "draws": draws,
        "seeds": list(one.seeds),
        "note": one.note,
        "robots": list(one.robots),
        "speeds": list(one.speeds),
    }
    return {key: value for key, value in said.items() if value not in (None, "", [])}


def declared(said: object, file: object) -> tuple[TunedOn, ...]:
    """Of what a file says of such tests, these.

    Raises:
        ClearwayError: it says it in another way than `declaration`.
    """
    try:
        found = []
        for one in list(said):  # type: ignore[call-overload]
            draws = one.get("draws")
            found.append(
                TunedOn(
                    str(one["suite"]), tuple(one.get("robots", ())), str(one.get("floor_plan", "")),
                    None if draws is None else range(*draws), tuple(one.get("seeds", ())), tuple(one.get("speeds", ())),
                    str(one.get("note", "")),
                )
            )  # fmt: skip
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ClearwayError(
            'says in another way than `[{suite = "hospital", draws = [0, 20]}]` on what it was tuned',
            file=file,
            field=TUNED_ON,
        ) from error
    return tuple(found)


def tuned_by_files(name: str, robot: Robot, options: Mapping[str, Any] | None = None) -> tuple[TunedOn, ...]:
    """On what the robot's table of a navigator, and the files of its options, say that their values were chosen.

    Args:
        name: The navigator, with its options or without.
        robot: Who is driven.
        options: What else its constructor is given.

    Raises:
        ClearwayError: it is said in another way.
    """
    plain = split_options(name)[0]
    table = robot.navigators.get(plain, {})
    found = declared(table[TUNED_ON], f"robot {robot.name}") if isinstance(table, dict) and TUNED_ON in table else ()
    return (*found, *_by_files_of_options(name, options))


def _by_files_of_options(name: str, options: Mapping[str, Any] | None = None) -> tuple[TunedOn, ...]:
    """The same of the files of its options alone."""
    plain, given = split_options(name)[0], split_options(name)[1] | dict(options or {})
    if not given or ":" in plain:  # a user's own module is imported by workers alone
        return ()
    return tuple(one for file in files_of(plain, navigator_class(plain), given) for one in _in_comment(file))


def all_by_files(plan: CampaignPlan, specs: Sequence[TrialSpec]) -> dict[str, tuple[TunedOn, ...]]:
    """The same of every navigator of a campaign, whichever robot it drives."""
    pairs = dict.fromkeys((n, r) for spec in specs for n, r in zip(spec.navigators, spec.robots, strict=True))
    found: dict[str, dict[TunedOn, None]] = {name: {} for name, _ in pairs}
    for name, robot in pairs:
        found[name] |= dict.fromkeys(tuned_by_files(name, load_robot(robot), plan.options.get(name)))
    return {name: tuple(tests) for name, tests in found.items()}


def _in_comment(file: Path) -> Iterable[TunedOn]:
    try:
        with file.open(encoding="utf-8") as text:
            line = text.readline(1 << 16)
    except (OSError, UnicodeDecodeError):
        return ()
    if not line.startswith(TUNED_ON_COMMENT):
        return ()
    try:
        said = json.loads(line.removeprefix(TUNED_ON_COMMENT))
    except ValueError:
        said = None
    return declared(said, file)


def tuned_on(name: str, navigator: Navigator) -> tuple[TunedOn, ...] | None:
    """On what `navigator`, which goes by `name`, says that its parameters were chosen; None if it says nothing.

    Raises:
        ClearwayError: what it says is no tuple of `TunedOn`.
    """
    said = getattr(navigator, "tuned_on", None)
    if said is None:
        return None
    if not isinstance(said, tuple) or not all(isinstance(one, TunedOn) for one in said):
        raise ClearwayError(
            f"navigator {name!r}: `tuned_on` is {said!r}; it must be a tuple of clearway.tuning.TunedOn, () for nothing"
        )
    return said


def in_words(tests: Sequence[TunedOn] | None) -> list[str] | None:
    """What a navigator declares, as its results have it."""
    return None if tests is None else [str(test) for test in tests]


def tuned(said: Sequence[TunedOn] | None, plan: CampaignPlan, spec: TrialSpec) -> Tuned:
    """How near to the trial's test the parameters were chosen. Options behind the navigator's name take the place of what was
    declared, and nobody says on what they were chosen: with them, unless their files declare it, it is never known to be on none.

    Args:
        said: What the trial's navigator declares.
        plan: The campaign that the trial belongs to.
        spec: The trial.
    """
    robot = load_robot(spec.robots[spec.member])
    files = tuned_by_files(spec.driver, robot, plan.options.get(spec.driver))
    if said is None and not files:
        return Tuned.UNDECLARED
    order = list(Tuned)
    near = min((_near(one, plan, spec) for one in (*(said or ()), *files)), key=order.index, default=Tuned.NO)
    options = plan.options.get(spec.driver)
    given = split_options(spec.driver)[1] or options
    silent = given and not _by_files_of_options(spec.driver, options)
    return Tuned.UNDECLARED if near is Tuned.NO and silent else near


def _near(one: TunedOn, plan: CampaignPlan, spec: TrialSpec) -> Tuned:
    scenario = spec.scenario
    if scenario.labels.suite != one.suite:
        return Tuned.NO
    if plan.selection.seeds is None or one.draws is None:
        same = plan.selection.seeds is None and one.draws is None
    else:
        first, last = plan.selection.seeds
        both = range(max(first, one.draws.start), min(last, one.draws.stop))
        same = scenario.labels.configuration in map(draw_label, both)
    if not same or one.floor_plan not in ("", scenario.floor_plan):
        return Tuned.SUITE
    very = (
        (not one.robots or spec.robots[spec.member].partition(":")[0] in one.robots)
        and (not one.seeds or plan.seed in one.seeds)
        and (not one.speeds or scenario.speed in one.speeds)
    )
    return Tuned.SCENARIO if very else Tuned.GEOMETRY
