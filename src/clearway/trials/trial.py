"""One attempt at a task, with everything needed to score and to replay it, wherever it came from.

What a recording doesn't know is None; an indicator that needs it answers "not computable", with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from clearway.contract import BodyKind, Diagnostics, EventKind
from clearway.geometry.shapes import FloatArray, Shape
from clearway.robots.drive_limits import DriveLimits
from clearway.tuning import Tuned

UNTIED = "nothing ties the recording to the map, in which the goals are given (frame of the source in the test plan)"
"""Why the goals of a recorded trial are nowhere although its plan gives them: the `frame` of its provenance."""
NOT_RECORDED = "not recorded"
UNUSABLE = "the recording cannot be used"
"""Why an attempt counts of which there is no motion: in its reason, behind what a person noted."""
BROKEN_OFF = ("emergency stop", "aborted by the operator")
ASSISTED = "a person had to help"
GOING_ON = "while the robot moves"
"""In the reason of an aborted recording: with one of these it begins if a person ended the attempt, so it ends if the recording did."""
OBSERVED = "observed by the operator"
"""What is said of a contact of which nobody said when it was."""
AS_PLACED = "where it was placed"
"""How the reason of a simulated collision ends if the trial began with it."""
TOUCHED, HELPED = "touched", "helped"
"""In a recording's provenance: whether the operator saw a contact (None: not said), how often a person helped (None: not said)."""


class Outcome(StrEnum):
    """How an attempt ended."""

    REACHED = "reached"  # every leg was called reached (whether within tolerance by the truth is for the indicators)
    COLLISION = "collision"
    TIMEOUT = "timeout"
    LIVELOCK = "livelock"
    NAVIGATOR_FAILED = "navigator_failed"  # raised, or gave no finite command
    SCENARIO_FAILED = (
        "scenario_failed"  # by a behaviour of its people or as it was built: it tells nothing of the navigator
    )
    ABORTED = "aborted"  # the navigator gave up, or a person stopped it


BROKEN = frozenset({Outcome.NAVIGATOR_FAILED, Outcome.SCENARIO_FAILED})
"""How an attempt ends in which somebody's code failed."""
LATE = 0.01
"""Share of a robot's control periods that decisions may overrun and still be called keeping up: on a machine that does other things as well some do."""


@dataclass(frozen=True, slots=True)
class Labels:
    """Where a trial stands in its suite. None: does not apply.

    Attributes:
        suite: The suite's name, such as `hospital`.
        batch: The batch's name, such as `SO`; what a report groups by.
        configuration: The configuration's name, such as `parallel`; the same test at other speeds has the same one.
        speed: Set speed, m/s; None if unknown.
        obstacle_speed: Speed of the moving obstacles, m/s.
        size: Edge of the static obstacles, m.
        gap: Width of the gap between double obstacles, in multiples of d_base.
        repetition: Which repetition it is, from 1.
        setup: How much thinking was allowed, such as paper B's `1` (0.15 s a decision) and `2` (unlimited).
        family: What the suite shares with its like, such as `barn`; `own` where nobody says.
    """

    suite: str
    batch: str
    configuration: str
    speed: float | None
    obstacle_speed: float | None = None
    size: float | None = None
    gap: float | None = None
    repetition: int = 1
    setup: str | None = None
    family: str = "own"


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """One goal of an attempt.

    Attributes:
        name: `forth`, `turn`, `back`.
        start: (3,) pose in the map frame, NaN where unknown.
        goal: (3,) pose in the map frame, NaN where unknown.
        xy_tolerance: How far from the goal it may end, m.
        yaw_tolerance: How far its heading may be off there, rad; inf where it is free.
        scored: Whether it counts for the indicators (the turn at B does not).
        time_limit: s.
        planner_xy_tolerance: What the robot's planner was told, m; NaN where nobody knows.
        planner_yaw_tolerance: The same of the heading, rad; inf where it is free.
    """

    name: str
    start: FloatArray
    goal: FloatArray
    xy_tolerance: float
    yaw_tolerance: float
    scored: bool = True
    time_limit: float = float("inf")
    planner_xy_tolerance: float = float("nan")
    planner_yaw_tolerance: float = float("nan")


@dataclass(frozen=True, slots=True)
class Wish:
    """What somebody wants who walks there.

    Attributes:
        speed: Preferred, m/s; None if unknown.
        route: Places (x, y) to which they go, one after another, map frame, m.
        group: Who walks together has the same; empty: alone.
    """

    speed: float | None
    route: tuple[tuple[float, float], ...] = ()
    group: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Something that the robot can hit.

    Attributes:
        name: Its name.
        kind: Whether it is part of the floor plan, was put there, or moves.
        shape: Its outline in its own frame.
        pose: (3,) pose in the map: x, y [m], theta [rad]; None for a moving obstacle, whose poses are a column of
            `Trial.moving_obstacles`.
        sigma: Standard uncertainty of a static one's position, m.
        outlined: Whether its shape is known; else a point stands for it.
        measured: Whether the capture that saw the robot saw it too, so that an error of the frame's tie to the map is
            the same for both.
        visits: Whether a moving one was not there, rather than not seen, before its first pose and after its last.
        wish: What a person wants; None if unknown.
    """

    name: str
    kind: BodyKind
    shape: Shape
    pose: FloatArray | None
    sigma: float = 0.0
    outlined: bool = True
    measured: bool = False
    visits: bool = False
    wish: Wish | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """What was attempted: frozen before the robot moves, so that a trial can be scored without its scenario.

    Attributes:
        labels: What it is compared and grouped by.
        robot: The robot's name as the user gave it (`recorded` where nobody knows).
        navigator: The navigator's name, likewise.
        localisation: The localiser's name, likewise.
        footprint: Contact shape in base_link; None if unknown.
        legs: What was asked, leg by leg.
        bodies: All that the robot can hit.
        speed_limit: Set speed, m/s; None if unknown.
        period: Control or sampling period, s.
        reference_length: Length of one leg, m (paper A's d_AB, BARN's path); None without one.
        floor_plan: Name of the floor plan.
        scenario: Its id in its suite; None for a recording.
        seed: Seed of this attempt.
        privileged: Whether the navigator was given the truth.
        tracking: How obstacles were followed; empty if they weren't.
        optimal_time: Time of the best that a clairvoyant could do, s; None where that is not known to 0.5 %.
        shortest_path: Length that no path past what stands can be shorter than, m; None where that is not known.
        limits: Limits of the base at this set speed; None if unknown.
        source: Either `simulated` (what is known is exact) or `recorded` (what is known was measured).
        sight: How far obstacles are perceived (the camera's range, without one the lidar's), m, None if unknown.
        tuned: How near to this test the navigator's parameters were chosen.
        run: The simulation that it shares with the trials of other robots, which are moving bodies of this one; empty: none.
        member: The name of its robot there.
    """

    labels: Labels
    robot: str
    navigator: str
    localisation: str
    footprint: Shape | None
    legs: tuple[Leg, ...]
    bodies: tuple[Body, ...]
    speed_limit: float | None
    period: float
    reference_length: float | None = None
    floor_plan: str = ""
    scenario: str | None = None
    seed: int | None = None
    privileged: bool = False
    tracking: str = ""
    optimal_time: float | None = None
    shortest_path: float | None = None
    limits: DriveLimits | None = None
    source: Literal["simulated", "recorded"] = "simulated"
    sight: float | None = None
    tuned: Tuned = Tuned.UNDECLARED
    run: str = ""
    member: str = ""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened.

    Attributes:
        t: When, in seconds since the trial began.
        kind: What it was.
        detail: What people read about it; of a `STATUS` the navigator's word.
        body: Index into `Attempt.bodies` of the body that it happened with, None without one or where nobody knows.
    """

    t: float
    kind: EventKind
    detail: str = ""
    body: int | None = None


@dataclass(frozen=True, slots=True)
class Errand:
    """How a person of a simulation came to the place that it was walking to when the trial ended, or at which it stayed.

    The trial of the last robot, if there are several. From then on the robots are gone, and the people walk on.

    Attributes:
        body: Index into `Attempt.bodies` of the person.
        place: Number of the place on its route, from 0; a route that begins anew has ever more.
        arrived: When it came there, s since the trial began; NaN: not in time.
        path: How far it walked by then, m; NaN as well.
        arrived_without: The same in the same scene without robots, s; NaN: not in time, or nobody knows.
        path_without: The same, m.
        until: Until when it was waited for, s since the trial began; NaN: nobody knows how it is without robots.
    """

    body: int
    place: int
    arrived: float
    path: float
    arrived_without: float = math.nan
    path_without: float = math.nan
    until: float = math.nan


@dataclass(frozen=True, slots=True)
class Span:
    """When a leg was driven.

    Attributes:
        leg: Index of the leg.
        start: When it began, s.
        end: When it ended, s.
        reached: Whether it was called reached.
    """

    leg: int
    start: float
    end: float
    reached: bool


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What the navigator showed of its thinking.

    Attributes:
        t: When, s since the trial began.
        diagnostics: What it showed.
    """

    t: float
    diagnostics: Diagnostics


@dataclass(frozen=True, slots=True, eq=False)
class Instants:
    """What was where between samples, for whoever asks how near it came.

    Attributes:
        t: (k,) s, increasing, none of them a sample's.
        pose: (k, 3) true poses of the robot, map frame.
        moving_obstacles: (k, m, 3) poses of the bodies that move, NaN while one is absent.
    """

    t: FloatArray
    pose: FloatArray
    moving_obstacles: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One attempt as it went.

    Attributes:
        attempt: What was attempted.
        t: (n,) time of each sample, s, increasing, from 0.
        pose: (n, 3) true poses of the robot, map frame.
        velocity: (n, 2) its true v [m/s] and omega [rad/s], of an omnidirectional base (n, 3) with v_y [m/s] behind them, or
            None.
        estimate: (n, 3) the robot's own belief of its pose, or None.
        command: (n, 2) v [m/s] and omega [rad/s] that the base was told at t, (n, 3) as `velocity`, or None.
        leg: (n,) int, index into attempt.legs of what was being driven at t.
        moving_obstacles: (n, m, 3) poses of the bodies whose pose is None, in their order; NaN while one is absent.
        spans: One per leg begun, in order.
        events: What happened, in order.
        outcome: How it ended.
        reason: Why, for people.
        snapshots: What the navigator showed of its thinking.
        provenance: What ran, on which version, from which file.
        timing: Wall-clock figures, s, kept apart.
        thinking: (n,) wall clock that the decision at t took, s, kept apart; NaN where there was none, and of the first one,
            which may load or compile code; None: unknown.
        cut: (n,) bool, whether the budget cut the decision at t short, or None.
        sigma: (n, 1 + m, 2) standard uncertainty of position [m] and heading [rad] of the robot and of the moving
            obstacles, NaN where unknown; None: of a simulation, that there is none, of a recording, that it is unknown.
        tie: (n, 2) the part of the robot's sigma that the frame's tie to the map makes, None for no tie. The sigma of a
            `measured` body has the same part, and between it and the robot it cancels.
        between: Instants between samples wherever lines from sample to sample would be wrong about how near the robot
            came to something that moves; None where there are none, as in a recording.
        errands: What became of the people who walk to places of their own; of a simulation.
    """

    attempt: Attempt
    t: FloatArray
    pose: FloatArray
    velocity: FloatArray | None
    estimate: FloatArray | None
    command: FloatArray | None
    leg: Any
    moving_obstacles: FloatArray
    spans: tuple[Span, ...]
    events: tuple[Event, ...]
    outcome: Outcome
    reason: str = ""
    snapshots: tuple[Snapshot, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    timing: Mapping[str, float] = field(default_factory=dict)
    thinking: FloatArray | None = None
    cut: npt.NDArray[np.bool_] | None = None
    sigma: FloatArray | None = None
    tie: FloatArray | None = None
    between: Instants | None = None
    errands: tuple[Errand, ...] = ()
