"""What stands behind `ros2:` where a navigator is named."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.errors import ClearwayError
from clearway.live.ros.address import check_flags, pace
from clearway.live.ros.navigator import RosNavigator


def stack(namespace: str) -> Ros2:
    """Who makes a navigator of the ROS 2 stack in a namespace; empty: that without one."""
    return Ros2(namespace)


@dataclass(frozen=True, slots=True)
class Ros2:
    """A navigator that is a ROS 2 stack, which somebody has started.

    Attributes:
        namespace: Of its topics and its action.
    """

    namespace: str

    def __call__(
        self,
        domain: int = 0,
        interface: str = "lo",
        stamped: bool = False,
        localised: bool = True,
        lockstep: bool = True,
        deadline: float = 0.5,
        watchdog: float = 0.5,
        patience: float = 8.0,
        fastest: float = 1000.0,
    ) -> RosNavigator:
        """Join its domain.

        Args:
            domain: The number of the DDS domain, as in ROS_DOMAIN_ID.
            interface: The network interface; `lo`: nothing leaves this machine.
            stamped: Whether `/cmd_vel` holds TwistStamped, as Nav2's default is since Kilted; else Twist.
            localised: Whether it is given our pose; false: it localises itself.
            lockstep: Whether `/clock` waits for its commands; false: it keeps to the wall clock.
            deadline: How long it is waited for in each period, s of wall clock.
            watchdog: How long the base keeps the last command, s of `/clock`.
            patience: How long its action, an accepted goal and its first command are waited for, s of wall clock.
            fastest: How many times as fast as the wall clock `/clock` goes at most, in lockstep.

        Raises:
            ClearwayError: the package cyclonedds is missing, or the domain can't be joined.
        """
        name = f"navigator 'ros2:{self.namespace}'"
        if isinstance(domain, bool) or not isinstance(domain, int) or not 0 <= domain <= 232:
            raise ClearwayError(f"{name}: domain = {domain!r} is none; 0 to 232 are")
        goes = pace(name, lockstep, deadline, watchdog, patience, fastest)
        check_flags(name, {"stamped": stamped, "localised": localised})
        try:
            from cyclonedds.core import DDSException

            from clearway.live.ros2.transport import Dds
        except ModuleNotFoundError as error:
            raise ClearwayError(f"{name} takes the package {error.name}: pip install 'clearway[ros2]'") from error
        try:
            return RosNavigator(
                name,
                lambda: Dds(domain, interface, self.namespace, stamped),
                goes,
                localised,
            )
        except DDSException as error:
            raise ClearwayError(
                f"{name} cannot join domain {domain} on the interface {interface!r}: {error}"
            ) from error
