"""Nav2's navigation as one: its servers, each at its own rate.

    scan, map --> costmaps --.                       .--> controller server --.
                              >-- behaviour tree ---<---> behaviours ----------+--> smoother, monitor --> command
    goal --------------------'                       `--> planner, route, smoother server (a period later)

Within a control period: costmaps, tree, controller and behaviours, and last the servers that plan, which in Nav2 have
threads of their own. Behaviour read from ros-navigation/navigation2, nav2_bt_navigator, nav2_behavior_tree's bt_action_server.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, cast

import numpy as np

from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Task
from clearway.errors import unknown
from clearway.geometry.frames import compose, inverse
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.plans import to_frame
from clearway.navigators.common.inputs import finite, own
from clearway.navigators.common.rates import Rate
from clearway.navigators.nav2.behavior_tree import defaults
from clearway.navigators.nav2.behavior_tree.actions import MoveRequest
from clearway.navigators.nav2.behavior_tree.nodes import Blackboard, Status, TreeError
from clearway.navigators.nav2.behavior_tree.paths import EMPTY
from clearway.navigators.nav2.behavior_tree.reader import Trees, asked, build
from clearway.navigators.nav2.behavior_tree.servers import Job, Validity
from clearway.navigators.nav2.behaviors import STILL, BehaviorServer
from clearway.navigators.nav2.command_chain import CommandChain
from clearway.navigators.nav2.controller_server import ControllerServer
from clearway.navigators.nav2.costmaps.costmap import Costmap, refuse_without_map
from clearway.navigators.nav2.parameters import Parameters, files, read
from clearway.navigators.nav2.parameters import servers as parameters
from clearway.navigators.nav2.parameters.table import read_own
from clearway.navigators.nav2.planner_server import PlannerServer
from clearway.navigators.nav2.route_server import RouteServer, read_routes
from clearway.navigators.nav2.seams import Velocity
from clearway.navigators.nav2.smoother_server import SmootherServer
from clearway.robots import DriveKind, Robot, possible
from clearway.tuning import TunedOn

_ORIGIN = np.zeros(3)
_TOLD = ("follow_path", "compute_path", "compute_route", "smoother")
"""Whose errors tell why a goal failed, by the names that Nav2's trees have for them."""


class _Action(NamedTuple):
    """What a server does, as the behaviour tree has it done.

    Attributes:
        send: Have it done.
        cancel: Have it stopped.
    """

    send: Callable[[Any], Job]
    cancel: Callable[[], object]


class _Around:
    """What the behaviour tree sees of the navigator: its `Servers`."""

    def __init__(self, navigator: Nav2, goal_reached_tol: float) -> None:
        self._navigator = navigator
        self.now, self.speed = 0.0, 0.0
        self.goal_reached_tol = goal_reached_tol
        self.pose: FloatArray = np.zeros(3)
        self.velocity: FloatArray = np.zeros(3)

    def send(self, action: str, request: Any) -> Job:
        """See `Servers`."""
        return self._navigator.actions[action].send(request)

    def cancel(self, action: str) -> None:
        """See `Servers`."""
        if (there := self._navigator.actions.get(action)) is not None:  # it is for every tree that sends
            there.cancel()

    def clear(self, costmap: str, layers: tuple[str, ...], reset_distance: float | None, *, around: bool) -> bool:
        """See `Servers`."""
        n = self._navigator
        cleared = n.local_costmap if costmap == "local_costmap" else n.global_costmap
        return cleared.clear(layers, n.pose_in(cleared), reset_distance, around=around)

    def invalid_poses(self, request: Validity) -> list[int] | None:
        """See `Servers`."""
        n = self._navigator
        return n.planner_server.invalid_poses(request, n.pose_in(n.global_costmap), n.frame_of(n.global_costmap))


class Nav2:
    """ROS 2's Nav2, with the parameters of a file of its own.

    Args:
        params: A file of ROS 2 parameters (`nav2_params.yaml`), or the name of a preset; None: the robot's own public file,
            or, for one that has none, Nav2's own fitted to the robot.
        trees: Of which branch of Nav2 the behaviour trees are that it ships: `main` or `jazzy`.

    Attributes:
        actions: What its servers do, by its name in Nav2.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"map", "scan"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional", "ackermann"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = ()

    def __init__(self, params: str | None = None, trees: str = "main") -> None:
        if trees not in ("main", "jazzy"):
            raise unknown("branch of Nav2", trees, ("main", "jazzy"), field="trees")
        self._params = None if params is None else str(params)
        self._branch: Literal["main", "jazzy"] = "jazzy" if trees == "jazzy" else "main"

    @classmethod
    def files(cls, params: str | None = None, trees: str = "main") -> tuple[Path, ...]:
        """The files whose content decides what it does, given its options."""
        return files(params)

    def read_parameters(self, robot: Robot, *, mapped: bool = True) -> Parameters:
        """What it would drive `robot` with, which has a map if it is `mapped`.

        Raises:
            ClearwayError: One of them is wrong, or its behaviour tree or graph of routes is.
        """
        found = read_own(robot, mapped=mapped) if self._params is None else read(self._params, robot, mapped=mapped)
        found = found.for_tree(asked(self._trees(found)))
        if found.route_server is not None:
            read_routes(found.route_server, found.file)
        return found

    def check_without_map(self, robot: Robot) -> None:
        """
        Raises:
            ClearwayError: A costmap of its file has a static layer.
        """
        p = self.read_parameters(robot, mapped=False)
        refuse_without_map("local_costmap", p.local_costmap)
        refuse_without_map("global_costmap", p.global_costmap)

    def _trees(self, p: Parameters) -> Trees:
        text = cast("parameters.BtNavigator", p.bt_navigator.group).default_nav_to_pose_bt_xml
        return defaults.named(text, p.file, self._branch)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial.

        Raises:
            ClearwayError: a parameter is wrong, or a static layer has no map.
        """
        p = self._parameters = self.read_parameters(robot, mapped=task.map is not None)
        self.local_costmap = Costmap("local_costmap", p.local_costmap, robot, task.map)
        self.global_costmap = Costmap("global_costmap", p.global_costmap, robot, task.map)
        self._rates = [(costmap, Rate(costmap.frequency)) for costmap in (self.local_costmap, self.global_costmap)]
        self.controller_server = ControllerServer(p.controller_server, rng, task.speed_limit)
        self.planner_server = PlannerServer(p.planner_server, self.global_costmap)
        self.behavior_server = BehaviorServer(p.behavior_server)
        self.smoother_server = None if (q := p.smoother_server) is None else SmootherServer(q, self.global_costmap)
        self.route_server = None if p.route_server is None else RouteServer(p.route_server, p.file, self.global_costmap)
        self.actions = self._actions()
        navigator = cast("parameters.BtNavigator", p.bt_navigator.group)
        self._tick_rate = Rate(1000.0 / navigator.bt_loop_duration)
        self._filter = navigator.filter_duration
        self._around = _Around(self, navigator.goal_reached_tol)
        self._board = Blackboard()
        self._tree = build(self._trees(p), self._board, self._around, wrap_around=self._branch != "main")
        self._limits = robot.limits(task.speed_limit)
        self._goal: Goal | None = None
        self._speeds: deque[tuple[float, float, float]] = deque()
        self._active = self._arrived = False
        self._gave_up: str | None = None
        self._chain = CommandChain(p.velocity_smoother, p.collision_monitor)
        self._said: Velocity | None = None  # by a server, in this period
        self._command = STILL  # as last published: the base holds it until the next
        self._status = ""

    def step(self, observation: Observation) -> Command:
        """Decide for one control period."""
        o = own(observation)
        self._pose, self._odom_pose = o.pose, o.odom_pose
        self._odom = compose(o.pose, inverse(o.odom_pose))  # pose of the odom frame in the map
        self._map = inverse(self._odom)  # pose of the map frame in the odom frame
        self._said = None
        velocity = Velocity(
            float(o.velocity[0]), float(o.velocity[2]) if len(o.velocity) > 2 else 0.0, float(o.velocity[1])
        )
        self._sense(o)
        self._measure(o, velocity)
        if o.goal is not self._goal:
            self._accept(o)
        if self._active and self._tick_rate.due(o.t):
            self._tick()
        local, pose = self.local_costmap, self.pose_in(self.local_costmap)
        frame = _ORIGIN if local.frame == "map" else self._map
        commands = (
            self.controller_server.step(o.t, pose, velocity, frame, local.view(), current=local.current),
            self.behavior_server.step(o.t, pose, local.view()),
        )
        for command in commands:
            self._said = self._said if command is None else command
        command = self._chain.hand_on(o.t, self._said, velocity, o.scan, local.footprint)
        self._command = self._command if command is None else command
        self._think()
        return self._decided()

    def _think(self) -> None:
        """What in Nav2 has threads of its own: whoever asked has the answer one period later."""
        frame = self.frame_of(self.global_costmap)
        self.planner_server.think(self.pose_in(self.global_costmap), frame)
        if self.route_server is not None:
            self.route_server.think(self._pose, frame)
        if self.smoother_server is not None:
            self.smoother_server.think(frame)

    def _decided(self) -> Command:
        v, omega, v_y = possible(self._limits, self._command.v_x, self._command.omega, self._command.v_y)
        if self._limits.v_y_max == 0.0:
            v_y = 0.0
        return Command(v, omega, arrived=self._arrived, gave_up=self._gave_up, status=self._status, v_y=v_y)

    def diagnostics(self) -> Diagnostics:
        """The global and the local plan, and what it is doing."""
        path = self._board.get("path")
        local = self.controller_server.trajectory
        if self.local_costmap.frame == "odom" and len(local):
            local = to_frame(np.ascontiguousarray(local), self._odom)
        lines = {"global plan": (EMPTY if path is None else path)[:, :2], "local plan": local}
        doing = "following" if self.controller_server.running else "planning" if self._active else ""
        return Diagnostics(polylines=lines if self._active else {}, status=self._status or doing)

    def pose_in(self, costmap: Costmap) -> FloatArray:
        """(3,) the robot's pose in a costmap's frame."""
        return self._pose if costmap.frame == "map" else self._odom_pose

    def frame_of(self, costmap: Costmap) -> FloatArray:
        """(3,) pose of a costmap's frame in the map."""
        return _ORIGIN if costmap.frame == "map" else self._odom

    def _actions(self) -> dict[str, _Action]:
        """What the servers that are there do."""
        planner, controller = self.planner_server, self.controller_server
        found = {
            name: _Action(partial(planner.send, name), partial(planner.cancel, name))
            for name in ("compute_path_to_pose", "compute_path_through_poses")
        }
        if (route := self.route_server) is not None:
            found["compute_route"] = _Action(route.send, route.cancel)
        if (smoother := self.smoother_server) is not None:
            found["smooth_path"] = _Action(smoother.send, smoother.cancel)
        found["follow_path"] = _Action(lambda request: controller.send(request, self._around.now), controller.cancel)
        for name in ("spin", "wait", "backup", "drive_on_heading"):
            found[name] = _Action(partial(self._behave, name), partial(self._leave, name))
        return found

    def _behave(self, behavior: str, request: MoveRequest) -> Job:
        return self.behavior_server.send(behavior, request, self._around.now, self.pose_in(self.local_costmap))

    def _leave(self, behavior: str) -> None:
        if self.behavior_server.cancel(behavior) and behavior != "wait":
            self._said = STILL

    def _sense(self, o: Observation) -> None:
        """Bring the costmaps up to date, each at its own rate."""
        for costmap, rate in self._rates:
            due, pose = rate.due(o.t), self.pose_in(costmap)
            if o.scan is not None and (due or costmap.keeps_scans):
                costmap.buffer(o.t, o.scan, pose)
            if due:
                costmap.update(pose, self.frame_of(costmap))

    def _measure(self, o: Observation, velocity: Velocity) -> None:
        """The mean speed over `filter_duration` (nav2_util's OdomSmoother)."""
        self._speeds.append((o.t, velocity.v_x, velocity.v_y))
        while len(self._speeds) > 1 and o.t - self._speeds[0][0] > self._filter:
            self._speeds.popleft()
        n = len(self._speeds)
        around = self._around
        around.speed = math.hypot(sum(s[1] for s in self._speeds) / n, sum(s[2] for s in self._speeds) / n)
        around.now, around.pose, around.velocity = o.t, o.pose, np.array(velocity)

    def _accept(self, o: Observation) -> None:
        """A new goal (NavigateToPoseNavigator::initializeGoalPose)."""
        self._goal = o.goal
        self._board.set("goal", finite("goal.pose", o.goal.pose))
        self._board.set("path", EMPTY)
        if not self._active:
            self._tick_rate.restart()
        self._active, self._arrived, self._gave_up = True, False, None

    def _tick(self) -> None:
        """One tick of the tree (BehaviorTreeEngine::run)."""
        try:
            answer = self._tree.execute()
        except TreeError as error:
            self._end(gave_up=str(error))
            return
        behavior = self.behavior_server.running
        zone = self._chain.zone
        self._status = f"recovery: {behavior}" if behavior else f"collision monitor: {zone}" if zone else ""
        if answer is Status.SUCCESS:
            self._end()
        elif answer is not Status.RUNNING:
            reasons = [self._board.get(f"{what}_error_msg") for what in _TOLD]
            why = "; ".join(reason for reason in reasons if reason) or "the behaviour tree failed"
            self._end(gave_up=f"Goal failed: {why}")

    def _end(self, *, gave_up: str | None = None) -> None:
        """The goal is done with, one way or the other."""
        self._tree.halt()
        self._tree.status = Status.IDLE
        for action in self.actions.values():
            action.cancel()
        self._said = STILL
        self._active = False
        self._arrived, self._gave_up = gave_up is None, gave_up
        self._status = ""
