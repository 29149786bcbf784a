"""What a suite is: a list of scenarios that belong together, and how a part of it is selected."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from enum import StrEnum
from typing import Any

from clearway.errors import ClearwayError, shown, unknown
from clearway.reading.limits import LENGTH, TRIALS
from clearway.robots import Robot
from clearway.robots.ideal import errors_named
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.replay import Replay
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.teams import with_team


@dataclass(frozen=True, slots=True)
class Selection:
    """Which part of a suite to run; an empty tuple or None: all of it, as the suite has it.

    A value bars only the tests to which it applies: `gaps=(1.5,)` leaves out other double obstacles, and keeps the
    single ones, which have no gap. One that is named twice counts once.

    Attributes:
        batches: Names of the batches.
        configurations: Names of the configurations.
        speeds: Set speeds of the robot, m/s.
        sizes: Edge of the static obstacles, m.
        gaps: Widths of gaps, in multiples of d_base.
        obstacle_speeds: Speeds of the moving obstacles, m/s.
        repetitions: How often each test is run.
        worlds: Numbers of BARN's or DynaBARN's worlds.
        floor_plan: The floor plan to use instead of the suite's.
        seeds: The range (a, b): instead of the suite's frozen scenarios those that its generator draws from the seeds
            a, a + 1, ..., b - 1.
        disturbance: Factor on each scenario's disturbance.
        scenarios: Names of scenarios; a suite that has none of them gives no scenario.
        latency: Factor on the robot's latency in each scenario; 0: a world without.
        ideal: Errors of the robots, their sensors and motors, that are left out in each scenario, beside those that it leaves out itself.
        team: Who takes part in scenarios of several robots, by name, each as often as it does; only scenarios for so many
            are made. Empty: as each scenario says.
        replay: Recorded people of a user's own, with the task among them, for the suite `replayed`.
    """

    batches: tuple[str, ...] = ()
    configurations: tuple[str, ...] = ()
    speeds: tuple[float, ...] = ()
    sizes: tuple[float, ...] = ()
    gaps: tuple[float, ...] = ()
    obstacle_speeds: tuple[float, ...] = ()
    repetitions: int | None = None
    worlds: tuple[int, ...] = ()
    floor_plan: str | None = None
    seeds: tuple[int, int] | None = None
    disturbance: float | None = None
    scenarios: tuple[str, ...] = ()
    latency: float | None = None
    ideal: tuple[str, ...] = ()
    team: tuple[str, ...] = ()
    replay: Replay | None = None

    def __post_init__(self) -> None:
        for one in fields(self):
            if isinstance(value := getattr(self, one.name), tuple) and one.name not in ("seeds", "team"):
                object.__setattr__(self, one.name, tuple(dict.fromkeys(value)))


@dataclass(frozen=True, slots=True, eq=False)
class Generator:
    """Draws what a suite's scenarios are made of from seeds.

    What a scenario is called, and all of it that no draw decides, is known without drawing: its outline.

    Attributes:
        calls: The arguments of `draw` for each scenario of a selection with `seeds`, each once; their `repr` says all of
            them. With `scenarios` selected it takes no longer, however many seeds there are.
        draw: Draws one, in any process.
        outlines: Builds the scenarios as the suite's `make` does, without what is drawn.
        written: What has been drawn as JSON values.
        read: What has been drawn, of its JSON values.
        drawn: What has been drawn of late, by the arguments.
    """

    calls: Callable[[Selection], Sequence[tuple[Any, ...]]]
    draw: Callable[..., Any]
    outlines: Callable[[Robot, Selection, int], Sequence[Scenario]]
    written: Callable[[Any], Any] = lambda drawn: drawn
    read: Callable[[Any], Any] = lambda values: values
    drawn: dict[tuple[Any, ...], Any] = field(default_factory=dict)

    def __call__(self, *arguments: Any) -> Any:
        """What `draw` returns for the arguments."""
        if arguments not in self.drawn:
            self.hold(arguments, self.draw(*arguments))
        return self.drawn[arguments]

    def hold(self, arguments: tuple[Any, ...], drawn: Any) -> None:
        """Have what was drawn at hand, and let go of what was drawn long before."""
        self.drawn[arguments] = drawn
        while len(self.drawn) > MOST_HELD:
            del self.drawn[next(iter(self.drawn))]


def without_drawing(build: Callable[[Robot, Selection, int], Sequence[Scenario]]) -> Generator:
    """Of a suite whose `build` makes the scenarios of `Selection.seeds` at once: nothing is drawn beforehand."""
    return Generator(lambda selection: (), lambda: None, build)


LEARNING_SEEDS = (2**62, 2**63)
"""Of these are the campaign seeds of what learners meet, and of no campaign: the first, and one behind the last."""
LEARNING_DRAWS = (2**31, 2**32 - 2000)
"""Of these are the seeds from which its scenarios are drawn, likewise; some generators take no more than 32 bits."""
MOST_HELD = 256
"""What a generator has at hand of what it has drawn."""


class Section(StrEnum):
    """A part of the report that a suite may ask for, beside what every report has."""

    PAPER_A = "paper-a"
    """Beside what Rondoni et al. 2024 printed, and which part of their protocol was not run."""
    MANOEUVRING_SPACE = "manoeuvring-space"
    """How much space a robot takes beyond the straight way from A to B."""
    PUBLISHED_BARN_RUNS = "published-barn-runs"
    """World by world beside the runs of move_base that the BARN Challenge published."""
    RESCUE = "search-and-rescue"
    """Tables and figures as those of Rado et al. 2025: scenario by scenario, beside the clairvoyant, why trials failed."""
    BY_NUMBER = "by-number"
    """Curves by how many people or other robots are there: of a suite whose tests are the same but for that."""


@dataclass(frozen=True, slots=True)
class Published:
    """What somebody published of a batch: a report shows it beside what was run.

    Attributes:
        batch: The batch.
        who: Which system it is, and whose figures they are.
        trials: How many trials.
        success: Share that was reached.
        collision: Share that ended in a contact; None: nobody says.
        time: Mean time of those reached, s; None: nobody says.
    """

    batch: str
    who: str
    trials: int
    success: float
    collision: float | None = None
    time: float | None = None


@dataclass(frozen=True, slots=True)
class Suite:
    """A named set of tests, with everything that Clearway knows of it.

    Attributes:
        name: As it is called; unique.
        title: As it is printed.
        description: What is tested, in a sentence.
        batches: Names, in the order in which they run.
        configurations: Names.
        make: Builds the scenarios: (robot, selection, campaign seed) -> all of them, before the labels are filtered. Of
            the selection it heeds `floor_plan`, `repetitions`, `worlds`, `seeds` and `replay`; it may leave out what isn't
            among `scenarios`, and make scenarios for as many robots as the `team` has.
        family: What it shares with its like, such as `barn`: a score that makes sense for these alone asks for it.
        robots: Who drives it unless the user says otherwise; empty: the user has to say.
        report: What the report shows of it beside what it always shows.
        floor_plans: Name -> maker of each floor plan that it brings, beside those that come as files.
        file: Where it was read from, None for one that was written in Python.
        generator: Draws more scenarios from `Selection.seeds`, if it has one.
        source: What it is and whom it was taken from, as a sentence with which a report begins; empty: nothing is said.
        published: Beside which published figures a report sets it.
        replays: Whether it sends robots through the people of `Selection.replay`.
        several: Whether all of its scenarios are for several robots, so that it has nothing for a learner alone.
    """

    name: str
    title: str
    description: str
    batches: tuple[str, ...]
    configurations: tuple[str, ...]
    make: Callable[[Robot, Selection, int], Sequence[Scenario]]
    family: str = "own"
    robots: tuple[str, ...] = ()
    report: tuple[Section, ...] = (Section.MANOEUVRING_SPACE,)
    floor_plans: Mapping[str, Callable[[], FloorPlan]] = field(default_factory=dict)
    file: str | None = None
    generator: Generator | None = None
    source: str = ""
    published: tuple[Published, ...] = ()
    replays: bool = False
    several: bool = False

    def about(self) -> dict[str, Any]:
        """What a results directory keeps of it, as JSON values, so that a report needs nothing but that directory."""
        told: dict[str, Any] = {"title": self.title, "family": self.family, "report": list(self.report)}
        if self.source:
            told["source"] = self.source
        if self.published:
            told["published"] = [asdict(one) for one in self.published]
        return told

    def build(
        self, robot: Robot, selection: Selection | None = None, seed: int = 0, *, outlines: bool = False
    ) -> list[Scenario]:
        """The selected scenarios for `robot`, in the suite's order; none if it has none of `selection.scenarios`.

        A scenario's seed comes from the campaign's `seed` and its name alone: every navigator, every robot and every
        selection meets the same.

        Args:
            robot: Who drives; of a team its first.
            selection: Which of them; None: all.
            seed: The campaign's.
            outlines: Whether those of `selection.seeds` are wanted without what is drawn, and nothing is drawn.

        Raises:
            ClearwayError: a selected value that no scenario has (it names those that exist), a team for which there is none, or none
                is left.
        """
        chosen = selection or Selection()
        if chosen.floor_plan == "":
            raise ClearwayError("'' is the name of no floor plan", field="floor_plan")
        if chosen.repetitions is not None and chosen.repetitions < 1:
            raise ClearwayError(f"{chosen.repetitions} repetitions make no trial; at least 1", field="repetitions")
        if chosen.seeds is not None and self.generator is None:
            raise ClearwayError(f"the suite {self.name!r} has no generator that could draw from seeds", field="seeds")
        if chosen.seeds is not None and not 0 <= chosen.seeds[0] < chosen.seeds[1]:
            a, b = chosen.seeds
            raise ClearwayError(f"'{a}:{b}' is no range of seeds; 0:200 are the seeds 0 to 199", field="seeds")
        if chosen.seeds is not None:
            refuse_many(chosen.seeds[1] - chosen.seeds[0], self.name)
        if (chosen.repetitions or 1) > 100:
            one = len(self.make(robot, replace(chosen, repetitions=1), seed))
            refuse_many(one * (chosen.repetitions or 1), self.name)
        if chosen.replay is not None and not self.replays:
            raise ClearwayError(f"the suite {self.name!r} has no recorded people; 'replayed' has", field="people")
        factor = chosen.disturbance
        if factor is not None and not 0.0 <= factor <= LENGTH:
            raise ClearwayError(
                f"{factor:g} is no factor on a disturbance: 0 for none, 1 as it is, 2 for twice", field="disturbance"
            )
        if chosen.latency is not None and not 0.0 <= chosen.latency <= 100.0:
            raise ClearwayError(
                f"{chosen.latency:g} is no factor on a latency: 0 for none, 1 as the robot's file has it, at most 100",
                field="latency",
            )
        without = errors_named(chosen.ideal)
        make = self.make
        if outlines and chosen.seeds is not None and self.generator is not None:
            make = self.generator.outlines
        made = [_of(self, s) for s in make(robot, chosen, seed)]
        if chosen.team and (made or not chosen.scenarios):
            made = with_team(made, chosen.team, self.name)
        named = [s for s in made if not chosen.scenarios or s.name in chosen.scenarios]
        if chosen.scenarios and not named:
            return []
        _refuse_unknown(self, chosen, made)
        kept = [s for s in named if _selects(chosen, s)]
        if not kept:
            raise ClearwayError(f"no scenario of the suite {self.name!r} has all that is selected together")
        if without:
            kept = [s.model_copy(update={"ideal": errors_named((*s.ideal, *without))}) for s in kept]
        if chosen.latency is not None:
            kept = [s.model_copy(update={"latency": chosen.latency}) for s in kept]
        return kept if chosen.disturbance is None else [_disturbed(s, chosen.disturbance, self.name) for s in kept]


def _of(suite: Suite, scenario: Scenario) -> Scenario:
    """The scenario with the suite's name and family among its labels."""
    labels = scenario.labels.model_copy(update={"suite": suite.name, "family": suite.family})
    return scenario.model_copy(update={"labels": labels})


def _disturbed(scenario: Scenario, factor: float, suite: str) -> Scenario:
    """With `factor` times the disturbance; its name and seed, hence the direction of every push, stay.

    Raises:
        ClearwayError: it has none.
    """
    bounds = scenario.disturbance
    if bounds is None:
        raise ClearwayError(
            f"the suite {suite!r} has no disturbance that could be multiplied by {factor:g}",
            field="disturbance",
        )
    change = {name: factor * getattr(bounds, name) for name in ("position", "heading", "velocity", "turn")}
    return scenario.model_copy(update={"disturbance": bounds.model_copy(update=change)})


def seed_range(text: str) -> tuple[int, int]:
    """`A:B` as (A, B): the seeds A, A + 1, ..., B - 1.

    Raises:
        ClearwayError: it is something else.
    """
    first, colon, last = text.partition(":")
    numbers = all(part.isascii() and part.isdecimal() and len(part) <= 19 for part in (first, last))
    if not (colon and numbers and int(first) < int(last) <= 2**63):
        raise ClearwayError(f"{shown(text)} is no range of seeds; 0:200 are the seeds 0 to 199", field="seeds")
    return int(first), int(last)


def refuse_many(count: int, suite: str) -> None:
    """Refuse more scenarios than a campaign may have trials, before they are made.

    Raises:
        ClearwayError: `count` is more.
    """
    if count > TRIALS:
        raise ClearwayError(
            f"of the suite {suite!r} {count:,} scenarios are asked for; a campaign has at most {TRIALS:,} trials"
        )


def refuse_speeds(speeds: Iterable[float], robot: Robot) -> None:
    """Refuse set speeds [m/s] that `robot` cannot drive.

    Raises:
        ClearwayError: one is, which is named.
    """
    for speed in speeds:
        if not 0 < speed <= robot.drive.v_max:
            raise ClearwayError(
                f"the speed {speed:g} m/s is out of reach for {robot.name!r}, at most {robot.drive.v_max:g}",
                field="speeds",
            )


def beyond_reach(speeds: Iterable[float], robot: str, v_max: float) -> str:
    """What is to be said of set speeds [m/s] that a robot cannot drive; empty: it can drive them all.

    Args:
        speeds: Of its tests.
        robot: Its name for people.
        v_max: How fast it is, m/s.
    """
    beyond = [f"{speed:g}" for speed in sorted(set(speeds)) if speed > v_max]
    if not beyond:
        return ""
    said = f"{robot} drives {v_max:g} m/s at most: its tests at {listed(beyond)} m/s are "
    return said + ("one test at that, but for when moving obstacles meet it" if len(beyond) > 1 else "driven at that")


def listed(words: Sequence[str]) -> str:
    """The words in a sentence, `and` before the last."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def refuse_floor_plan(asked: str | None, suite: str, plan: str) -> None:
    """Refuse another floor plan than `plan`, in which all of `suite` takes place.

    Raises:
        ClearwayError: another one is asked for, which is named.
    """
    if asked not in (None, plan):
        raise ClearwayError(f"the suite {suite!r} takes place in {plan!r}, not in {asked!r}", field="floor_plan")


def scenario_seed(seed: int, name: str) -> int:
    """The seed of the scenario `name` in a campaign with `seed`: the first 63 bits of a SHA-256."""
    return int.from_bytes(hashlib.sha256(f"{seed}:{name}".encode()).digest()[:8], "big") >> 1


def selected_seeds(selection: Selection, stem: str) -> list[int]:
    """The seeds of `selection.seeds`; where scenarios are selected by name, those whose scenarios, called `stem`, the seed, `-v` and
    so on, may be among them."""
    seeds = range(*(selection.seeds or (0, 0)))
    if not selection.scenarios:
        return list(seeds)
    named = (re.match(re.escape(stem) + r"(0|[1-9][0-9]{0,18})-v", n) for n in selection.scenarios)
    return sorted({seed for name in named if name and (seed := int(name[1])) in seeds})


def draw_label(seed: int) -> str:
    """The configuration of a scenario that a suite's generator drew from `seed`."""
    return f"seed-{seed}"


def variations(selection: Selection, repetitions: int) -> list[tuple[str, int, str]]:
    """Those of each test whose draws are cheap: its part of a scenario's name, the repetition that it counts as, and by what it is drawn.

    The frozen ones (`repetitions` of them, or as many as are selected) are drawn by their number alone, those of `selection.seeds` by the seed.
    """
    if selection.seeds is None:
        return [(f"r{k}", k, f"frozen {k}") for k in range(1, (selection.repetitions or repetitions) + 1)]
    again = range(1, (selection.repetitions or 1) + 1)
    return [(f"{draw_label(s)}-r{k}", k, draw_label(s)) for s in range(*selection.seeds) for k in again]


def draw(seed: int, what: str) -> float:
    """A number in [0, 1) that depends on `seed` and `what` alone, the same on every machine and version."""
    return int.from_bytes(hashlib.sha256(f"{seed}:{what}".encode()).digest()[:8], "big") / 2**64


_FIELDS = (
    ("batches", "batch"),
    ("configurations", "configuration"),
    ("obstacle_speeds", "obstacle_speed"),
    ("sizes", "size"),
    ("gaps", "gap"),
)


def _selects(selection: Selection, scenario: Scenario) -> bool:
    """Whether every label that the scenario has is among the selected; one that it hasn't (a gap in NO) is no bar."""
    if selection.speeds and scenario.speed not in selection.speeds:
        return False
    for plural, label in _FIELDS:
        chosen, value = getattr(selection, plural), getattr(scenario.labels, label)
        if chosen and value is not None and value not in chosen:
            return False
    return True


def _refuse_unknown(suite: Suite, selection: Selection, scenarios: Sequence[Scenario]) -> None:
    for asked, kind, known in (
        (selection.batches, "batch", suite.batches),
        (selection.configurations, "configuration", suite.configurations),
    ):
        made = {getattr(scenario.labels, kind) for scenario in scenarios}  # a suite may have more than it lists
        for name in asked:
            if name not in known and name not in made:
                raise unknown(kind, name, known)
    _refuse_number("speed", selection.speeds, [s.speed for s in scenarios], suite.name)
    for plural, label in _FIELDS[2:]:
        _refuse_number(label, getattr(selection, plural), [getattr(s.labels, label) for s in scenarios], suite.name)


def _refuse_number(field: str, asked: Sequence[float], known: Iterable[float | None], suite: str) -> None:
    values = sorted({v for v in known if v is not None})
    for value in asked:
        if value not in values:
            listed = ", ".join(f"{v:g}" for v in values) or "none"
            raise ClearwayError(f"no scenario of the suite {suite!r} has the {field} {value:g}; known: {listed}")
