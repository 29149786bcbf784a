"""What stands behind `ros2:` where a navigator is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from clearway.errors import ClearwayError
from clearway.live.line import WireError
from clearway.live.ros.address import check_flags, check_namespace, pace
from clearway.live.ros.navigator import RosNavigator
from clearway.live.ros2.node import Node


def stack(namespace: str) -> Ros2:
    """Who makes a navigator of the ROS 2 stack in a namespace; empty: that without one.

    Raises:
        ClearwayError: it is no namespace.
    """
    check_namespace(f"navigator 'ros2:{namespace}'", namespace)
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
        rmw: str = "cyclonedds",
        domain: int = 0,
        interface: str | None = None,
        router: str | None = None,
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
            rmw: How it speaks, as in RMW_IMPLEMENTATION: `cyclonedds` or `zenoh`.
            domain: The number of the domain, as in ROS_DOMAIN_ID.
            interface: Of cyclonedds: the network interface; None: `lo`, nothing leaves this machine.
            router: Of zenoh: where its router listens; None: tcp/localhost:7447.
            stamped: Whether `/cmd_vel` holds TwistStamped, as Nav2's default is since Kilted; else Twist.
            localised: Whether it is given our pose; false: it localises itself.
            lockstep: Whether `/clock` waits for its commands; false: it keeps to the wall clock.
            deadline: How long it is waited for in each period, s of wall clock.
            watchdog: How long the base keeps the last command, s of `/clock`.
            patience: How long its action, an accepted goal and its first command are waited for, s of wall clock.
            fastest: How many times as fast as the wall clock `/clock` goes at most, in lockstep.

        Raises:
            ClearwayError: a package is missing, the domain can't be joined, or there is no router.
        """
        name = f"navigator 'ros2:{self.namespace}'"
        if rmw not in ("cyclonedds", "zenoh"):
            raise ClearwayError(f"{name}: rmw = {rmw!r} is not spoken; cyclonedds and zenoh are")
        if isinstance(domain, bool) or not isinstance(domain, int) or not 0 <= domain <= 232:
            raise ClearwayError(f"{name}: domain = {domain!r} is none; 0 to 232 are")
        for option, value, of in (("interface", interface, "cyclonedds"), ("router", router, "zenoh")):
            if value is not None and rmw != of:
                raise ClearwayError(f"{name}: {option} is an option of rmw = {of}, and {rmw} is spoken")
        goes = pace(name, lockstep, deadline, watchdog, patience, fastest)
        check_flags(name, {"stamped": stamped, "localised": localised})
        alone = f"ROS 2's domain {domain} over {rmw}" + (f" at the router {router}" if router else "")
        try:
            from clearway.live.ros2.transport import Ros2Transport

            node = self._node(rmw, domain, interface, router)
        except ModuleNotFoundError as error:
            extra = "zenoh" if rmw == "zenoh" else "ros2"
            raise ClearwayError(f"{name} takes the package {error.name}: pip install 'clearway[{extra}]'") from error
        try:
            return RosNavigator(name, lambda: Ros2Transport(node(), stamped), goes, localised, alone)
        except WireError as error:
            raise ClearwayError(f"{name} {error}") from error

    def _node(self, rmw: str, domain: int, interface: str | None, router: str | None) -> Callable[[], Node]:
        """Who makes its node; only here is the middleware's package needed."""
        if rmw == "zenoh":
            from clearway.live.ros2.zenoh import ROUTER, ZenohNode

            return partial(ZenohNode, domain, router or ROUTER, self.namespace)
        from clearway.live.ros2.dds import DdsNode

        return partial(DdsNode, domain, interface or "lo", self.namespace)
