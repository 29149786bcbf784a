"""What stands behind `ros1:` where a navigator is named."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit

from clearway.errors import ClearwayError
from clearway.live.addresses import is_here
from clearway.live.line import WireError
from clearway.live.ros.address import check_flags, check_namespace, pace
from clearway.live.ros.navigator import RosNavigator
from clearway.live.ros1.transport import Tcp

MASTER = "http://127.0.0.1:11311"
"""Where `roscore` listens."""


def stack(master: str) -> Ros1:
    """Who makes a navigator of the ROS 1 stack with a master; empty: that of `roscore` on this machine.

    Raises:
        ClearwayError: it is no master's address.
    """
    try:
        parts = urlsplit(master or MASTER)
        sound = parts.scheme == "http" and parts.hostname and parts.port and parts.path in ("", "/")
    except ValueError:
        sound = False
    if not sound or "@" in master or parts.query or parts.fragment:
        raise ClearwayError(f"navigator 'ros1:{master}' is no master's address; write ros1:{MASTER}, or ros1: for that")
    return Ros1(master)


@dataclass(frozen=True, slots=True)
class Ros1:
    """A navigator that is a ROS 1 stack, which somebody has started.

    Attributes:
        master: Where its master listens; empty: where `roscore` does on this machine.
    """

    master: str

    def __call__(
        self,
        namespace: str = "",
        host: str = "127.0.0.1",
        localised: bool = True,
        lockstep: bool = True,
        deadline: float = 0.5,
        watchdog: float = 0.5,
        patience: float = 8.0,
        fastest: float = 1000.0,
    ) -> RosNavigator:
        """Register with its master.

        Args:
            namespace: Of its topics and its action.
            host: The address of this machine on which it listens for the stack's nodes; by default no other machine reaches it.
            localised: Whether it is given our pose; false: it localises itself.
            lockstep: Whether `/clock` waits for its commands; false: it keeps to the wall clock.
            deadline: How long it is waited for in each period, s of wall clock.
            watchdog: How long the base keeps the last command, s of `/clock`.
            patience: How long its action, an accepted goal and its first command are waited for, s of wall clock.
            fastest: How many times as fast as the wall clock `/clock` goes at most, in lockstep.

        Raises:
            ClearwayError: there is no master, or it is not on this machine and nobody has said that it may.
        """
        name, master = f"navigator 'ros1:{self.master}'", self.master or MASTER
        goes = pace(name, lockstep, deadline, watchdog, patience, fastest)
        check_flags(name, {"localised": localised})
        check_namespace(name, namespace)
        if not isinstance(host, str) or not host:
            raise ClearwayError(f"{name}: host = {host!r} is no address of this machine; 127.0.0.1 is")
        if is_here(host) and not is_here(urlsplit(master).hostname or ""):
            raise ClearwayError(
                f"{name} has its master on another machine, which {host} is not reached from; host=ADDRESS, one of this "
                "machine's, allows that"
            )
        try:
            return RosNavigator(name, lambda: Tcp(master, host, namespace), goes, localised, f"the ROS master {master}")
        except WireError as error:
            raise ClearwayError(f"{name} {error}") from error
