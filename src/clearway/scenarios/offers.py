"""What an environment offers a robot, as one number: how wide a door is, how many people walk there. A test is made of the number.

A robot goes from one room to another. Whoever adds an offer writes an `Offer` and a line in `OFFERS`, or registers it under the
entry-point group `clearway.offers`. What a test looks like, and why, stands in the section "Offers" of DECISIONS.md beside this file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, circumscribed_radius
from clearway.registry import Registry
from clearway.robots import Robot
from clearway.scenarios.floor_plan_files import FloorPlanSpec, WallSpec
from clearway.scenarios.people import PersonSpec, StopSpec
from clearway.scenarios.scenario import LabelSpec, LegSpec, ObstacleSpec, RectangleSpec, Scenario
from clearway.scenarios.suite import draw

OFFERS = Registry(
    "requirement",
    "clearway.offers",
    {
        "corridor": "clearway.scenarios.offers:CORRIDOR",
        "density": "clearway.scenarios.offers:DENSITY",
        "door": "clearway.scenarios.offers:DOOR",
        "gap": "clearway.scenarios.offers:GAP",
        "lane": "clearway.scenarios.offers:LANE",
        "latency": "clearway.scenarios.offers:LATENCY",
        "lidar-noise": "clearway.scenarios.offers:LIDAR_NOISE",
        "odometry-noise": "clearway.scenarios.offers:ODOMETRY_NOISE",
    },
)
ROOM = (3.0, 5.0)
"""Length and width of the room on either side, m."""
FROM_WALL = 2.0
"""How far before the passage a robot starts, and how far behind it its goal lies, m."""
ASIDE = 1.0
"""How far to one side of the passage's middle it starts, and to the other its goal lies, m: nobody comes up to a door straight."""
WALL = 0.2
"""Thickness of walls, m."""
LENGTH = 4.0
"""Of a corridor, m."""
WIDE = 1.0
"""Of the door in tests in which something else than its width varies, m."""
APART = 0.005
"""Between an obstacle and the wall that it stands at, m: what touches a wall counts as overlapping it."""
FREE = 0.8
"""Nobody stands nearer to where the robot starts or goes, m; if it is large, further away."""
PERSON = 0.25
"""Their radius, m."""
BESIDE = 0.05
"""Between a robot at its start and whoever stands there, m: more than it may be placed astray."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One trial of an offer.

    Attributes:
        scenario: The test; its `floor_plan` is not yet set.
        floor_plan: Where.
        robot: With which robot: the one asked for, or one that senses worse.
    """

    scenario: Scenario
    floor_plan: FloorPlanSpec
    robot: Robot


@dataclass(frozen=True, slots=True, eq=False)
class Offer:
    """A quantity of the environment that a robot may need more or less of.

    Attributes:
        name: As it is called; unique.
        phrase: What has the quantity, for a sentence: `a door of {}`.
        unit: Its unit, as printed behind a number; empty for a factor.
        quantity: What an axis says of it.
        eases: Whether more of it is easier.
        least: No value may lie below.
        usual: Least and greatest value to look at, for a robot.
        step: Distance of neighbouring values.
        make: Builds a trial of (value, robot, speed [m/s], name, seed); the seed decides what differs from trial to trial.
    """

    name: str
    phrase: str
    unit: str
    quantity: str
    eases: bool
    least: float
    usual: Callable[[Robot], tuple[float, float]]
    step: float
    make: Callable[[float, Robot, float, str, int], Task]

    def values(
        self, robot: Robot, between: tuple[float, float] | None = None, step: float | None = None
    ) -> list[float]:
        """The values of a range, from the hardest to the easiest.

        Args:
            robot: For whom.
            between: Least and greatest value; None: the usual ones.
            step: Distance of neighbouring ones; None: the usual one.

        Raises:
            ClearwayError: the range is upside down, beyond what can be, or holds fewer than two values or more than 1000.
        """
        (low, high), apart = between or self.usual(robot), self.step if step is None else step
        if not low < high < float("inf"):
            raise ClearwayError(
                f"{low:g}:{high:g} is no range; the first value must lie below the second", field="range"
            )
        if low < self.least:
            raise ClearwayError(f"{low:g} cannot be: the {self.quantity} is at least {self.least:g}", field="range")
        if not 1e-9 < apart <= high - low + 1e-9:
            raise ClearwayError(f"{apart:g} is no step from {low:g} to {high:g}", field="step")
        many = int((high - low) / apart + 1e-6) + 1
        if many > 1000:
            raise ClearwayError(f"{many} values are too many; at most 1000 are searched", field="step")
        found = [round(low + i * apart, 9) for i in range(many)]
        return found if self.eases else found[::-1]


def find_offer(name: str) -> Offer:
    """What an environment offers, by its name or address.

    Raises:
        ClearwayError: there is none of this name.
    """
    found = OFFERS.find(name)
    if not isinstance(found, Offer):
        raise ClearwayError(f"{name!r} is a {type(found).__name__}, not an Offer; see clearway.scenarios.offers")
    return found


def width_of(robot: Robot) -> float:
    """How wide a robot is, m: what it takes when it drives ahead."""
    shape = robot.shape
    if isinstance(shape, Circle):
        return 2.0 * shape.radius
    return 2.0 * max(abs(y) for _, y in shape.vertices)


def two_rooms(opening: float, depth: float) -> FloorPlanSpec:
    """Two rooms side by side along x, joined by an opening in their middle.

    Args:
        opening: Its width, m.
        depth: Its length, m.
    """
    half, side = depth / 2, ROOM[1] / 2
    end = half + ROOM[0]
    if not 0.0 < opening < ROOM[1]:
        raise ClearwayError(f"an opening of {opening:g} m has no place in a wall of {ROOM[1]:g} m", field="range")
    boxes = {
        "south wall": (-end - WALL, -side - WALL, end + WALL, -side),
        "north wall": (-end - WALL, side, end + WALL, side + WALL),
        "west wall": (-end - WALL, -side, -end, side),
        "east wall": (end, -side, end + WALL, side),
        "south jamb": (-half, -side, half, -opening / 2),
        "north jamb": (-half, opening / 2, half, side),
        "pillar": (-end, side - 0.4, -end + 0.4, side),  # the two rooms can be told apart
        "cupboard": (end - 0.4, -side, end, -side + 1.0),
    }
    return FloorPlanSpec(
        name="two rooms",
        a=(-half - FROM_WALL, 0.0, 0.0),
        b=(half + FROM_WALL, 0.0, 0.0),
        walls=tuple(WallSpec(name=name, box=box) for name, box in boxes.items()),
    )


def hall() -> FloorPlanSpec:
    """The two rooms without anything between them."""
    whole = two_rooms(1.0, WALL)
    return whole.model_copy(update={"name": "hall", "walls": tuple(w for w in whole.walls if "jamb" not in w.name)})


def through(name: str, robot: Robot, speed: float, depth: float, **more: object) -> Scenario:
    """The task: from one room into the other one."""
    x = depth / 2 + FROM_WALL
    nominal = (2.0 * x + 2.0 * ASIDE) / min(speed, robot.drive.v_max)
    return Scenario(
        name=name,
        floor_plan="",
        start=(-x, -ASIDE, 0.0),
        legs=(LegSpec(name="through", goal=(x, ASIDE, 0.0), time_limit=3.0 * nominal + 20.0),),
        speed=speed,
        labels=LabelSpec(batch="requirement", configuration=name.rpartition("-")[0]),
        **more,  # type: ignore[arg-type]
    )


def _wide(robot: Robot) -> tuple[float, float]:
    """From its own width to 0.6 m more."""
    least = int(width_of(robot) / 0.02 + 1e-6) * 0.02
    return round(least, 2), round(least + 0.6, 2)


def _door(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    return Task(through(name, robot, speed, WALL), two_rooms(value, WALL), robot)


def _corridor(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    return Task(through(name, robot, speed, LENGTH), two_rooms(value, LENGTH), robot)


def _gap(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    if not 0.0 < value < ROOM[1]:
        raise ClearwayError(f"a gap of {value:g} m has no place in a hall of {ROOM[1]:g} m", field="range")
    width = (ROOM[1] - value) / 2 - APART
    shape = RectangleSpec(kind="rectangle", length=0.6, width=width)
    row = tuple(
        ObstacleSpec(name=f"row {side}", shape=shape, pose=(0.0, sign * (value + width) / 2, 0.0))
        for side, sign in (("south", -1), ("north", 1))
    )
    return Task(through(name, robot, speed, WALL, obstacles=row), hall(), robot)


def _lane(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    x = LENGTH / 2 + FROM_WALL
    late = 2.0 * draw(seed, f"{name} late")
    comes = PersonSpec(
        name="comes towards it",
        start=(x, -ASIDE),
        route=(StopSpec(at=(x, -ASIDE), wait=late), StopSpec(at=(-x, ASIDE))),
    )
    return Task(through(name, robot, speed, LENGTH, people=(comes,)), two_rooms(value, LENGTH), robot)


def _density(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    length, width = 2 * ROOM[0] + WALL, ROOM[1]
    people, places = list[PersonSpec](), list[tuple[float, float]]()
    more = max(0.0, circumscribed_radius(robot.shape) + PERSON + BESIDE - FREE)
    ends = ((-FROM_WALL - WALL / 2, -ASIDE), (FROM_WALL + WALL / 2, ASIDE))
    for k in range(round(value * length * width)):
        start = _place(seed, f"{name} start {k}", places, ends, more)
        places.append(start)
        goal = _place(seed, f"{name} goal {k}", [], ends, more)
        people.append(
            PersonSpec(name=f"person {k + 1}", start=start, route=(StopSpec(at=goal), StopSpec(at=start)), loop=True)
        )
    return Task(through(name, robot, speed, WALL, people=tuple(people)), hall(), robot)


def _place(
    seed: int, what: str, taken: Sequence[tuple[float, float]], ends: Sequence[tuple[float, float]], more: float
) -> tuple[float, float]:
    """A place in the hall, away from others, and from the robot's `ends` by `more` [m], as far as there is room: the best of many that
    are drawn, if none is free."""
    x, y = ROOM[0] - 0.6, ROOM[1] / 2 - 0.4

    def apart(place: tuple[float, float]) -> float:
        every = [*((end, more) for end in ends), *((other, 0.0) for other in taken)]
        return min(float(((place[0] - a) ** 2 + (place[1] - b) ** 2) ** 0.5) - off for (a, b), off in every)

    drawn = [
        (round(x * (2 * draw(seed, f"{what} x{i}") - 1), 3), round(y * (2 * draw(seed, f"{what} y{i}") - 1), 3))
        for i in range(40)
    ]
    return next((place for place in drawn if apart(place) >= FREE), max(drawn, key=apart))


def _latency(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    return Task(through(name, robot, speed, WALL, latency=value), two_rooms(WIDE, WALL), robot)


def _lidar_noise(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    if robot.lidar is None:
        raise ClearwayError(f"the robot {robot.name!r} has no lidar that could be noisy", field="robot")
    worse = robot.lidar.model_copy(update={"sigma": value})
    changed = robot.model_copy(update={"name": f"{robot.name}, lidar noise {value:g} m", "lidar": worse})
    return Task(through(name, robot, speed, WALL), two_rooms(WIDE, WALL), changed)


DRIFTS = (
    "translation_per_metre", "rotation_per_metre", "rotation_per_radian", "scale", "turn_scale", "curvature", "speed_noise",
    "yaw_rate_noise",
)  # fmt: skip


def _odometry_noise(value: float, robot: Robot, speed: float, name: str, seed: int) -> Task:
    drifts = {f: getattr(robot.odometry, f) for f in DRIFTS}
    worse = robot.odometry.model_copy(update={f: v * value for f, v in drifts.items() if v is not None})
    changed = robot.model_copy(update={"name": f"{robot.name}, odometry noise {value:g}", "odometry": worse})
    return Task(through(name, robot, speed, WALL), two_rooms(WIDE, WALL), changed)


DOOR = Offer("door", "a door of {}", " m", "width of a door, m", True, 0.0, _wide, 0.02, _door)
CORRIDOR = Offer("corridor", "a corridor of {}", " m", "width of a corridor, m", True, 0.0, _wide, 0.02, _corridor)
GAP = Offer("gap", "a gap of {} between obstacles", " m", "width of a gap, m", True, 0.0, _wide, 0.02, _gap)
LANE = Offer(
    "lane", "a corridor of {} in which somebody comes towards it", " m", "width of a corridor with somebody in it, m", True,
    0.0, lambda robot: (round(_wide(robot)[0] + 0.4, 2), round(_wide(robot)[0] + 2.0, 2)), 0.1, _lane,
)  # fmt: skip
DENSITY = Offer(
    "density", "a density of {}", " people/m²", "people per square metre", False, 0.0, lambda robot: (0.05, 0.8), 0.05, _density
)  # fmt: skip
LATENCY = Offer(
    "latency", "{} times its latency", "", "latency, as a factor", False, 0.0, lambda robot: (1.0, 12.0), 0.5, _latency
)  # fmt: skip
LIDAR_NOISE = Offer(
    "lidar-noise", "lidar noise of {}", " m", "standard deviation of lidar ranges, m", False, 0.0,
    lambda robot: (0.02, 0.5), 0.02, _lidar_noise,
)  # fmt: skip
ODOMETRY_NOISE = Offer(
    "odometry-noise", "{} times its odometry's errors", "", "odometry errors, as a factor", False, 0.0,
    lambda robot: (1.0, 20.0), 1.0, _odometry_noise,
)  # fmt: skip
