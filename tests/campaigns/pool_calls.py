"""What a pool's workers are asked to do in its tests."""

from __future__ import annotations

import os
import signal

from misbehaving_navigators import CRASHES

from clearway.campaigns.pool import Fate
from clearway.errors import ClearwayError


def meet(end: str) -> str:
    """Ends as it is told, or changes its surroundings and says what it finds there."""
    if end == "exit":
        os._exit(3)
    if end == "spoil":
        CRASHES["WritesIntoSockets"]()
    if end == "refuse":
        raise ClearwayError("refused", field=end)
    os.chdir("/")
    return f"{os.environ.get('MET')} {end}"


def die(file: str, times: int) -> int:
    """Kills the first so many workers that it is given to; tells which one came through."""
    with open(file, "a") as met:
        met.write("x")
    if (number := os.path.getsize(file)) <= times:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def stood_in(fate: Fate, end: str, *others: int) -> str:
    """In place of a call that fell."""
    return f"{end}: {fate}"
