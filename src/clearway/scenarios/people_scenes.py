"""The suite `people`: hand-made scenes in a ward, each a meeting that everybody knows, with its expected course in words.

People walk by social forces at speeds drawn from what is published; a scene's repetitions differ by these, and by the noise. A bed that
is pushed is driven by somebody who looks. What is expected is of a robot that is fit for a ward: nobody has to stand still for it
for long, nobody is touched, it arrives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from clearway.quantities import PoseSpec
from clearway.robots import Robot
from clearway.scenarios.behaviours import OperatorSpec
from clearway.scenarios.people import PersonSpec, StopSpec
from clearway.scenarios.scenario import (
    LabelSpec,
    LegSpec,
    ObstacleSpec,
    RectangleSpec,
    RobotSpec,
    RunSpec,
    Scenario,
)
from clearway.scenarios.suite import Section, Selection, Suite, draw, refuse_floor_plan, scenario_seed

SPEED = 0.6
"""Set speed, m/s."""
REPETITIONS = 3
_Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Scene:
    """One meeting.

    Attributes:
        name: Its configuration.
        course: What is expected to happen.
        start: Where the robot starts.
        goal: Where it is to go.
        people: Who walks there.
        obstacles: What else does.
        robots: Who else drives there, from where to where.
    """

    name: str
    course: str
    start: PoseSpec
    goal: PoseSpec
    people: tuple[PersonSpec, ...]
    obstacles: tuple[ObstacleSpec, ...] = ()
    robots: tuple[tuple[str, PoseSpec, PoseSpec], ...] = ()


def _walks(name: str, *way: _Place, wait: float = 0.0, group: str = "", speed: float | None = None) -> PersonSpec:
    """Somebody who stands at the first place of `way` for `wait` [s] and walks on to the others."""
    stops = (StopSpec(at=way[0], wait=wait), *(StopSpec(at=p) for p in way[1:]))
    return PersonSpec(name=name, start=way[0], route=stops, group=group, speed=speed)


_BED = ObstacleSpec(
    name="bed", shape=RectangleSpec(kind="rectangle", length=2.1, width=0.96), behaviour=OperatorSpec(acceleration=0.4, deceleration=0.8, line_keeping=0.05),  # trolleys on both sides
    runs=(RunSpec(leg="there", path=((15.7, 0.0), (3.0, 0.0)), speed=0.7),),
)  # fmt: skip


def _crowd() -> tuple[PersonSpec, ...]:
    """Twenty people who cross the waiting area, from places that lie apart to others."""
    places = [(-5.2 + 1.2 * (k % 9), -2.2 + 1.5 * (k // 9)) for k in range(27)]
    from_ = [p for p in places if math.dist(p, (-5.5, 0.0)) > 1.2][:20]
    to = [(x, 0.3 - y) for x, y in reversed(from_)]
    return tuple(_walks(f"person {k + 1}", a, b) for k, (a, b) in enumerate(zip(from_, to, strict=True)))


SCENES = (
    Scene(
        "passing", "Robot and person meet head on in the corridor; both keep to one side, neither stops.",
        (7.4, 0.0, 0.0), (15.6, 0.0, 0.0), (_walks("visitor", (16.2, 0.1), (3.0, 0.3)),),
    ),
    Scene(
        "crossing", "A person crosses the robot's way in the waiting area; one passes behind the other, at a step's distance.",
        (-4.5, 0.0, 0.0), (4.5, 0.0, 0.0), (_walks("visitor", (0.0, -2.7), (0.0, 2.7), wait=4.0),),
    ),
    Scene(
        "overtaking", "A person comes from behind, walks past the robot and on; the robot keeps its way.",
        (-4.5, 0.0, 0.0), (5.0, 0.0, 0.0), (_walks("nurse", (-5.6, 0.2), (5.6, 0.4), (9.3, 0.3), speed=1.5),),
    ),
    Scene(
        "group", "Three who talk walk abreast towards the robot in the corridor; they fall into file, or it waits for them to one side.",
        (7.4, 0.0, 0.0), (15.6, 0.0, 0.0),
        tuple(_walks(f"friend {k + 1}", (15.9, 0.6 - 0.6 * k), (3.0, 0.6 - 0.6 * k), group="friends", speed=1.0) for k in range(3)),
    ),
    Scene(
        "door", "Three come out of room 1 while the robot is to go in; it lets them out, then enters.",
        (7.4, 0.0, 0.0), (9.3, 2.7, 1.5708),
        tuple(_walks(f"visitor {k + 1}", (9.1, 2.4 + 0.7 * k), (9.3, 0.4), (4.0, -0.8 + 0.8 * k), speed=0.8) for k in range(3)),
    ),
    Scene(
        "stepping out", "A person steps out of room 2 before the robot; it slows down or gives way, and goes on.",
        (7.4, 0.0, 0.0), (15.6, 0.0, 0.0), (_walks("patient", (13.0, 2.4), (13.0, 0.2), (8.0, 0.4), wait=6.0, speed=0.8),),
    ),
    Scene(
        "bed", "A bed is pushed through the corridor towards the robot, which leaves it the way; who pushes it waits rather than push on.",
        (3.5, -1.5, 0.0), (9.3, 0.0, 0.0), (), (_BED,),
    ),
    Scene(
        "crowd", "Twenty people cross the waiting area in all directions; the robot gets through without touching anybody.",
        (-5.5, 0.0, 0.0), (5.0, 0.0, 0.0), _crowd(),
    ),
    Scene(
        "two robots", "Two robots meet head on in the corridor; both keep to one side, or one lets the other pass.",
        (7.4, 0.0, 0.0), (15.6, 0.0, 0.0), (), (), (("robot 2", (15.6, 0.0, math.pi), (7.4, 0.0, math.pi)),),
    ),
    Scene(
        "four robots", "Four robots cross the waiting area from four sides at once; all get across, in whatever order.",
        (-3.5, 0.0, 0.0), (3.5, 0.0, 0.0), (), (), (
            ("robot 2", (3.5, 0.3, math.pi), (-3.5, 0.3, math.pi)), ("robot 3", (0.0, -2.4, math.pi / 2), (0.0, 2.4, math.pi / 2)),
            ("robot 4", (0.3, 2.4, -math.pi / 2), (0.3, -2.4, -math.pi / 2)),
        ),
    ),
)  # fmt: skip


def build(robot: Robot, selection: Selection, seed: int) -> Sequence[Scenario]:
    """Every scene with its repetitions; who waits at first does so for up to half a second more or less."""
    refuse_floor_plan(selection.floor_plan, "people", "ward")
    made = []
    for scene in SCENES:
        for repetition in range(1, (selection.repetitions or REPETITIONS) + 1):
            name = f"{scene.name}-r{repetition}"
            own = scenario_seed(seed, name)
            leg = LegSpec(name="there", goal=scene.goal, time_limit=90.0)
            made.append(
                Scenario(
                    name=name, floor_plan="ward", start=scene.start, legs=(leg,), speed=SPEED, obstacles=scene.obstacles,
                    people=tuple(_delayed(p, own) for p in scene.people), robots=_others(scene), seed=own,
                    labels=LabelSpec(batch="people", configuration=scene.name, repetition=repetition),
                )
            )  # fmt: skip
    return made


def _others(scene: Scene) -> tuple[RobotSpec, ...]:
    return tuple(
        RobotSpec(name=name, start=start, legs=(LegSpec(name="there", goal=goal, time_limit=90.0),))
        for name, start, goal in scene.robots
    )


def _delayed(person: PersonSpec, seed: int) -> PersonSpec:
    first, *rest = person.route
    if first.wait == 0.0:
        return person
    wait = first.wait + draw(seed, f"wait {person.name}") - 0.5
    return person.model_copy(update={"route": (first.model_copy(update={"wait": wait}), *rest)})


PEOPLE = Suite(
    "people",
    "People in a ward",
    "Ten meetings: passing, crossing, overtaking, a group, a door, stepping out, a bed, a crowd, two robots, four robots",
    batches=("people",),
    configurations=tuple(scene.name for scene in SCENES),
    make=build,
    family="people",
    robots=("tiago", "hosbot"),
    report=(Section.MANOEUVRING_SPACE,),
)
