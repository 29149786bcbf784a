"""What a behaviour is: it says where a body will be at its next decision.

It belongs to the world and may know the truth. It never decides for a robot that is tested.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from clearway.crowds.walls import Walls
from clearway.crowds.ways import Room
from clearway.geometry.compiled import kernel
from clearway.geometry.held import Held
from clearway.geometry.packing import Packed
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.people import INSTANT, PersonSpec
from clearway.world.arrivals import Watched
from clearway.world.laid import Laid, RobotTracks
from clearway.world.tracks import Tracks

PERIOD = INSTANT
"""Time from an instant at which somebody may decide to the next, s."""
GLANCE = 0.1
"""Time between two looks at a robot of which its velocity is made, s."""
STEPPING = 0.1
"""Nobody turns who walks slower than this, m/s."""
ABSENT = np.full(3, np.nan)
"""The pose of a body that is not there."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenRobot:
    """A robot that drives in the world, as behaviours can see it.

    Attributes:
        shape: Its footprint, in the frame of its track.
        track: Where it has been up to now, map frame.
    """

    shape: Packed
    track: Laid


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is there when behaviours decide.

    Attributes:
        moving: (m, 3) poses of all moving bodies, map frame; NaN where one is absent.
        before: (m, 3) the same `PERIOD` ago.
        bound: (m, 3) where each has decided to be at its next decision; one that decides now, where it is; NaN: nobody knows.
        free: (m,) whether each decides now.
        robots: The robots that drive there.
    """

    moving: FloatArray
    before: FloatArray
    bound: FloatArray
    free: npt.NDArray[np.bool_]
    robots: tuple[SeenRobot, ...]


class Behaviour(Protocol):
    """Decides for one or several bodies.

    Attributes:
        members: Which of the moving bodies these are, by their places among them.
        speed: (n,) the most that each ever moves at, m/s.
    """

    members: tuple[int, ...]
    speed: FloatArray

    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """At time `t` [s] the tested robot begins the leg of this name; the first at time 0.

        Returns:
            (n, 3) where the bodies are from now on, NaN where one isn't there; None: the legs don't concern them.
        """

    def step(self, t: float, until: float, scene: Scene) -> FloatArray:
        """Decide at time `t` [s]: the poses (n, 3) at time `until`, NaN for none, with nothing known of what comes after `t`."""


class Street(NamedTuple):
    """Everything that moves where a crowd walks.

    Attributes:
        tracks: Of the n moving bodies, robots with pilots last; those of a crowd are laid as it decides.
        since: (n,) when the clock of each began, s.
        decides: (n,) which of them decide.
        there: (2, n, 3) room for their poses now and a `PERIOD` ago.
        robots: The robots with pilots.
        watched: The people who are watched for their arrivals.
    """

    tracks: Tracks
    since: FloatArray
    decides: npt.NDArray[np.bool_]
    there: FloatArray
    robots: RobotTracks
    watched: Watched


@kernel
def hold_street(street: Street) -> Held[Street]:
    """`street`, as compiled behaviours take it."""
    return Held(street)


class CompiledBehaviour(ABC):
    """Decides for a crowd in a kernel, several times in a row.

    Attributes:
        members: Which of the moving bodies these are, by their places among them.
        speed: (k,) the most that each ever moves at, m/s.
        crowd: Who they are, held for their kernel, see `among`.
    """

    members: tuple[int, ...]
    speed: FloatArray
    crowd: Held[Any]

    @abstractmethod
    def begin_leg(self, leg: str, t: float) -> FloatArray | None:
        """As `Behaviour` has it."""

    def look_up(self) -> None:
        """Find what the kernel lacks to go on, where it has stopped for that."""
        return


class Things(NamedTuple):
    """Moving bodies that are no people, such as a bed that is pushed, as people keep out of their way: rows of discs.

    Attributes:
        disc: (d, 3) x, y in the frame of its body, radius, m.
        of: (d,) int64, which of the moving bodies that is.
    """

    disc: FloatArray
    of: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Cast:
    """The people of a scenario who go by one behaviour, and where they are. A behaviour of people is a class, or another factory,
    that is called with it.

    Attributes:
        members: Which of the moving bodies they are, by their places among them.
        people: Who they are.
        radius: (m,) of all moving bodies, as discs, m.
        things: Those of them that are no people.
        group: (m,) int64, to which group each belongs; negative: to none.
        walls: What stands.
        room: How much room what stands leaves, and ways through it.
        seed: Of the trial; draw from `clearway.geometry.streams` with it, so that the same trial has the same bits.
    """

    members: tuple[int, ...]
    people: tuple[PersonSpec, ...]
    radius: FloatArray
    things: Things
    group: npt.NDArray[np.int64]
    walls: Walls
    room: Room
    seed: int
