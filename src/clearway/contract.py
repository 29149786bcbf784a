"""What passes between the rooms in a control period.

    world --Sensing--> pilot = localiser + tracker + navigator --Decision--> world

The world gives raw sensing only. A pilot (composed by a run, see `clearway.campaigns.pilot`) makes an
`Observation` of it and asks the navigator for a `Command`. Frames follow REP-105: `map` (the floor plan's),
`odom` (dead reckoning, drifts, starts at zero), `base_link` (x forward, y left). SI units, radians.
Arrays that a navigator is given can't be written: what it wants to change it copies.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, Literal, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.robots import Robot

Need: TypeAlias = Literal["map", "scan", "obstacles"]
"""What a navigator may ask for: the floor's map, lidar scans, obstacles with position and velocity."""


class BodyKind(StrEnum):
    """What a body is that a robot can hit."""

    WALL = "wall"
    FURNITURE = "furniture"
    OBSTACLE = "obstacle"  # placed by the test
    MOVING_OBSTACLE = "moving obstacle"
    PERSON = "person"  # whether standing or walking
    ROBOT = "robot"  # one that a navigator drives


PLACED = frozenset({BodyKind.OBSTACLE, BodyKind.MOVING_OBSTACLE, BodyKind.PERSON, BodyKind.ROBOT})
"""What the test puts there; the rest belongs to the floor."""


class EventKind(StrEnum):
    """What can happen in a trial."""

    ARRIVED = "arrived"
    STATUS = "status"  # the navigator's word, whenever it changes
    ASSUMPTION = "assumption"  # something that its guarantee assumes was seen to be untrue
    CONTACT = "contact"
    TIMEOUT = "timeout"
    LIVELOCK = "livelock"
    GAVE_UP = "gave up"
    ERROR = "error"
    POSSIBLE_CONTACT = "possible contact"  # a measured clearance of zero within its uncertainty: a person must look
    NEAR_MISS = "near miss"  # one that a person has denied
    INTERVENTION = "intervention"  # a person had to help
    UNSEEN_DEPARTURE = "unseen departure"  # the start of a leg that had to be found and did not show
    UNSEEN_ARRIVAL = "unseen arrival"


class Status(StrEnum):
    """How a navigator found its command: the words that scoring understands. Any other word is for people only."""

    TRACKING = "tracking"
    TURNING = "turning"  # on the spot, to the goal's heading
    ARRIVING = "arriving"  # at the goal, comes to rest or stands
    ARRIVED = "arrived"
    BRAKING = "braking"
    NO_PATH = "no path"
    INFEASIBLE = "infeasible"
    INPUT_LIMIT = "input limit"
    ITERATION_LIMIT = "iteration limit"


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One sweep of a 2-D lidar, whose beams are cast one after another (`lidar.sweep` of the robot); it is stamped with the
    time of its middle.

    Attributes:
        ranges: (n,) metres along beam i at `angle_min + i * angle_increment` in the sensor's frame; inf: no return.
        angle_min: Direction of the first beam in the sensor's frame, rad.
        angle_increment: Angle from a beam to the next, rad.
        range_min: Shortest distance that is measured, m; a return below it is never given.
        range_max: Longest distance that is measured, m; a return beyond it is never given.
        mount: (3,) pose of the sensor in base_link.
        time_increment: Time from a beam to the next, s; negative where the last one is cast first, 0 where all are at once.
    """

    ranges: FloatArray
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: FloatArray
    time_increment: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """Perceived obstacles as discs, in the map frame (in a `Sensing`: as measured; in an `Observation`: tracked).

    Attributes:
        position: (n, 2) centre, m.
        velocity: (n, 2) velocity, m/s, NaN where unknown (in an `Observation`: never).
        radius: (n,) radius, m.
        error: (n,) bound on the length of the position's error, m. Of what moves the tracker `kalman` tells 3 standard deviations along
            an axis, which 98.9 % of Gaussian errors in the plane keep, or what the measurement's own bound says where that is less;
            of what stands, and by `difference`, it is the measurement's own. Structure, such as walls, has 0.
        velocity_error: (n,) the same for the velocity, m/s: 3 standard deviations by `kalman`; by `difference` what both positions'
            bounds and half a period's acceleration allow. Inf where unknown.
        identity: (n,) int64, the same over time for the same obstacle.
        moving: (n,) bool, whether it is perceived as one that moves (or can move).
    """

    position: FloatArray
    velocity: FloatArray
    radius: FloatArray
    error: FloatArray
    velocity_error: FloatArray
    identity: npt.NDArray[np.int64]
    moving: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.radius)


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """Where to go now. A new object in `Observation.goal` is a new goal.

    Attributes:
        pose: (3,) in the map frame.
        xy_tolerance: Within which of it the planner is to come, m; a test may judge by another one.
        yaw_tolerance: The same of the heading, rad; inf where it is free.
        leg: Index of the leg of the trial that it belongs to.
    """

    pose: FloatArray
    xy_tolerance: float
    yaw_tolerance: float
    leg: int = 0


@dataclass(frozen=True, slots=True)
class Budget:
    """How much a navigator may think per control period; with neither there is no bound.

    Attributes:
        iterations: Most iterations, which is reproducible.
        seconds: Most seconds of wall clock.
    """

    iterations: int | None = None
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Latency:
    """How late a robot senses and acts.

    Attributes:
        sensing: How old what an observation holds is when the navigator gets it, s.
        command: From a decision until the wheels follow it, s.
        jitter: The most that either is longer than that, s.
        lag: Time constant with which the wheels then follow, by first order, s.
    """

    sensing: float = 0.0
    command: float = 0.0
    jitter: float = 0.0
    lag: float = 0.0

    @property
    def expected(self) -> float:
        """From what is told to the instant at which a decision of now is followed, s. Motors that lag count as so much later: what they
        do from a steady speed on ends where it ends without lag, `lag` times that speed further on."""
        return self.sensing + self.command + self.lag


ObstacleOracle: TypeAlias = Callable[[float], FloatArray]
"""For a privileged navigator only: time [s] -> (n, 4) true x, y, radius [m] and presence (1 or 0) of each obstacle."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """What a navigator is told once, before it starts.

    Attributes:
        period: Control period, s.
        speed_limit: The set speed of the test, m/s; the plant clips to it.
        start: (3,) where the robot is believed to stand, map frame (placed by hand: the truth differs a little).
        map: What is known of the floor, or None.
        area: Where the robot's centre may be: x_min, y_min, x_max, y_max [m]; None: anywhere.
        budget: How much it may think per control period.
        time_limit: How long each leg may take, s.
        obstacle_oracle: The truth, for privileged navigators only.
        latency: How late the robot senses and acts, as its maker would have measured it.
    """

    period: float
    speed_limit: float
    start: FloatArray
    map: OccupancyGrid | None = None
    area: tuple[float, float, float, float] | None = None
    budget: Budget = field(default_factory=Budget)
    time_limit: float = float("inf")
    obstacle_oracle: ObstacleOracle | None = None
    latency: Latency = Latency()


class Sensing(NamedTuple):
    """What the robot's sensors gave: raw, before any estimation.

    Attributes:
        t: When it was sensed, s since the trial began; with a latency that is a while ago, at first before the trial.
        odom_pose: (3,) dead-reckoned pose in the odom frame.
        odom_velocity: (2,) measured v [m/s], omega [rad/s]; of an omnidirectional base (3,) with v_y [m/s] behind them.
        scan: The lidar's sweep, None without a lidar.
        obstacles: What the camera measured (map frame, by the true pose), None without a camera.
        goal: Where to go.
        truth: (3,) the true pose in the map frame; only the localiser `truth` may read it, to show what localisation
            costs.
    """

    t: float
    odom_pose: FloatArray
    odom_velocity: FloatArray
    scan: Scan | None
    obstacles: Obstacles | None
    goal: Goal
    truth: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What a navigator is told each control period.

    Attributes:
        t: When that was which it tells of, s since the trial began: `task.latency.sensing` ago.
        pose: (3,) estimated pose in the map: x, y [m], theta [rad].
        velocity: (2,) estimated v [m/s], omega [rad/s]; of an omnidirectional base (3,) with v_y [m/s] behind them.
        odom_pose: (3,) smooth but drifting pose in the odom frame (a rolling costmap lives there).
        goal: Where to go.
        scan: The lidar's sweep, if the navigator's `needs` asks for it, else None.
        obstacles: What was perceived or measured of obstacles, if its `needs` asks for it, else None.
    """

    t: float
    pose: FloatArray
    velocity: FloatArray
    odom_pose: FloatArray
    goal: Goal
    scan: Scan | None = None
    obstacles: Obstacles | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """What the base is to do in the next control period.

    Attributes:
        v: Forward speed, m/s.
        omega: Yaw rate, rad/s.
        arrived: Whether the navigator calls the goal reached; None leaves that to the run's goal checker, which goes by
            the goal's tolerances and the estimated pose. While it is called so, the base is told to stand, whatever v
            and omega; the leg is reached when it does. A call that is taken back before doesn't count.
        gave_up: Why the navigator can't go on; ends the trial as `aborted`.
        status: How it was found, a `Status` or a word of its own; each change of it becomes an event of the trial.
        cut: Whether the budget ended the thinking before it was finished.
        violated: What this period showed to be untrue of that which the navigator's guarantee assumes (a bound on the
            disturbance, on an obstacle's speed), one text each; each becomes an event of the trial.
        v_y: Speed to the left, m/s; only for an omnidirectional base.
    """

    v: float
    omega: float
    arrived: bool | None = None
    gave_up: str | None = None
    status: str = ""
    cut: bool = False
    violated: tuple[str, ...] = ()
    v_y: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Diagnostics:
    """What a navigator shows of its thinking, in a fixed vocabulary (map frame); the report draws it, whoever made it.

    Attributes:
        polylines: Name -> (n, 2) points, m, such as `global plan`, `local plan`.
        circles: Name -> (n, 3) x, y, radius, m.
        tube: (n, 3) x, y, radius along a plan, m.
        tree: (n, 4) edges x0, y0, x1, y1, m.
        field: Values of a potential or cost with the grid it lies on.
        status: The navigator's state, in a word.
        iterations: How many iterations it spent this period.
    """

    polylines: Mapping[str, FloatArray] = field(default_factory=dict)
    circles: Mapping[str, FloatArray] = field(default_factory=dict)
    tube: FloatArray | None = None
    tree: FloatArray | None = None
    field: OccupancyGrid | None = None
    status: str = ""
    iterations: int = 0


@runtime_checkable
class Navigator(Protocol):
    """Decides. Register it under the entry-point group `clearway.navigators`, or name it `my_pkg:MyNavigator`.

    `needs` says what observations must hold. A navigator may also have

    - `wants`, a frozenset with `scan` where it is shown scans of robots that have a lidar, and does without of those that have none;
    - `drives`, a frozenset of the kinds of bases (`clearway.robots.DriveKind`) that it can drive; without it only
      `differential` ones;
    - `read_parameters(robot)`, which reads what the robot's file holds for it and raises a `ClearwayError` where that is
      wrong (`clearway.robots.RobotTable` does both): it is asked before the first trial runs;
    - `files(**options)`, a classmethod that is given the constructor's options: paths of the files among them whose content
      decides what it does, so that resuming and rerunning notice when one has changed;
    - `diagnostics() -> Diagnostics`, asked for now and then;
    - `slowest`, how long a decision of it may take, s of wall clock: a campaign that allows no more is refused;
    - `alone`, what two robots that drive at once can't share of what it drives by, as text: a campaign in which they would is refused;
    - `close()`, called when it is needed no more, however its trial ended;
    - `privileged = True`, which gives it `Task.obstacle_oracle` and a label in every table;
    - `tuned_on`, a tuple of `clearway.tuning.TunedOn`: on which tests its parameters were chosen, which every table tells
      beside its results there; `()` for none.
    """

    needs: ClassVar[frozenset[Need]]

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial."""

    def step(self, observation: Observation) -> Command:
        """Decide for one control period. Must always return a finite command within the robot's limits."""


class Localiser(Protocol):
    """Says where the robot is: `clearway.perception` has `truth`, `odometry` and `amcl`."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Start at `task.start`, which is a little wrong."""

    def update(self, sensing: Sensing) -> FloatArray:
        """The estimated pose (3,) in the map frame."""


class Tracker(Protocol):
    """Makes obstacles with position, velocity and error bounds of what the sensors gave: `clearway.perception` has
    `difference` (no memory beyond the last frame) and `kalman`.
    """

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget all obstacles."""

    def update(self, sensing: Sensing, pose: FloatArray) -> Obstacles:
        """The obstacles now, given the robot's estimated pose (3,) in the map frame."""


class Decision(NamedTuple):
    """A pilot's answer.

    Attributes:
        command: What to drive.
        estimate: (3,) estimated pose in the map: x, y [m], theta [rad].
        diagnostics: What the navigator thought; None in most periods.
    """

    command: Command
    estimate: FloatArray
    diagnostics: Diagnostics | None = None


class Pilot(Protocol):
    """Localiser, tracker and navigator as one: all that the world talks to."""

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Prepare for a new trial."""

    def decide(self, sensing: Sensing) -> Decision:
        """Turn one period's sensing into a command."""
