"""What both versions of ROS are told where a navigator is named."""

from __future__ import annotations

import re
from collections.abc import Mapping

from clearway.errors import ClearwayError
from clearway.live.ros.navigator import Pace

_NAMESPACE = re.compile(r"/?([A-Za-z]\w*(/[A-Za-z]\w*)*/?)?", re.ASCII)


def pace(name: str, lockstep: bool, deadline: float, watchdog: float, patience: float, fastest: float) -> Pace:
    """How time goes.

    Raises:
        ClearwayError: one of them is none.
    """
    for option, value in (("deadline", deadline), ("watchdog", watchdog), ("patience", patience)):
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < 1e6:
            raise ClearwayError(f"{name}: {option} = {value!r} is no time in seconds above 0")
    if isinstance(fastest, bool) or not isinstance(fastest, int | float) or not 0.0 < fastest < 1e6:
        raise ClearwayError(f"{name}: fastest = {fastest!r}; a number above 0 is expected, 1 for real time at most")
    check_flags(name, {"lockstep": lockstep})
    return Pace(lockstep, deadline, watchdog, patience, fastest)


def check_namespace(name: str, namespace: object) -> None:
    """Refuse what can't be the namespace of topics.

    Raises:
        ClearwayError: it can't.
    """
    if not isinstance(namespace, str) or not _NAMESPACE.fullmatch(namespace) or "__" in namespace:
        raise ClearwayError(f"{name}: {namespace!r} is no namespace; robot1 is one")


def check_flags(name: str, flags: Mapping[str, object]) -> None:
    """Refuse what is neither true nor false.

    Raises:
        ClearwayError: one of them is.
    """
    for option, flag in flags.items():
        if not isinstance(flag, bool):
            raise ClearwayError(f"{name}: {option} = {flag!r}; true or false is expected")
