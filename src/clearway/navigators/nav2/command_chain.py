"""What becomes of a command on its way to the base: the velocity smoother, then the collision monitor, where the file has them.

    controller server, behaviours --cmd_vel_nav--> velocity smoother --cmd_vel_smoothed--> collision monitor --cmd_vel--> base

The remappings are those of nav2_bringup/launch/navigation_launch.py.
"""

from __future__ import annotations

import numpy as np

from clearway.contract import Scan
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.layers import directions, scan_points
from clearway.navigators.common.rates import EARLY
from clearway.navigators.nav2.collision_monitor import CollisionMonitor
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.seams import Velocity
from clearway.navigators.nav2.velocity_smoother import VelocitySmoother, VelocitySmootherParameters

_NOTHING: FloatArray = np.empty((0, 2))


class CommandChain:
    """Hands commands on to the base.

    Attributes:
        zone: Name of the collision monitor's zone that decided the last command; empty: none did.
    """

    def __init__(self, smoother: Branch | None, monitor: Branch | None) -> None:
        """
        Args:
            smoother: Parameters of the velocity smoother; None: there is none.
            monitor: Parameters of the collision monitor; None: likewise.
        """
        self._smoother: VelocitySmoother | None = None
        if smoother is not None:
            assert isinstance(smoother.group, VelocitySmootherParameters)
            self._smoother = VelocitySmoother(smoother.group)
        self._monitor = None if monitor is None else CollisionMonitor(monitor)
        self._next: float | None = None
        self.zone = ""

    def hand_on(
        self, now: float, command: Velocity | None, measured: Velocity, scan: Scan | None, footprint: FloatArray
    ) -> Velocity | None:
        """What the base is told at `now` [s], None: nothing, so that it goes on as it was told.

        Args:
            now: s.
            command: Of the controller server or a behaviour, if one came.
            measured: The robot's velocity.
            scan: The lidar's.
            footprint: (m, 2) the outline in base_link, m.
        """
        if self._smoother is not None:
            command = self._smooth(self._smoother, now, command, measured)
        if command is None or self._monitor is None:
            return command
        points = _NOTHING if scan is None else self._points(scan)
        verdict = self._monitor.judge(now, command, points, now, footprint)
        self.zone = verdict.zone
        return verdict.command

    def _smooth(
        self, smoother: VelocitySmoother, now: float, command: Velocity | None, measured: Velocity
    ) -> Velocity | None:
        """The last of the smooth commands that were due since the last period: those before `now` towards the old command."""
        told = None
        due = now if self._next is None else self._next
        while due < now - EARLY:
            told = smoother.smooth(due, measured) or told
            due += smoother.period
        if command is not None:
            smoother.hear(now, command)
        if due <= now + EARLY:
            told = smoother.smooth(now, measured) or told
            due += smoother.period
        self._next = due
        return told

    def _points(self, scan: Scan) -> FloatArray:
        beams = directions(scan.ranges.size, scan.angle_min, scan.angle_increment)
        return scan_points(scan.ranges, beams, scan.range_min, scan.range_max, scan.mount, False, 0.0)[0]
