"""What a worker process does all its life: takes calls from its parent, answers them, and ends when the parent does.

Run as a script by `clearway.campaigns.pool`. What stands at the top is quick to import, so that the process ends with its
parent from its first moments on, while it imports and compiles too.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import signal
import sys
import threading
import time
from typing import Any

_PR_SET_PDEATHSIG = 1


def end_with(parent: int) -> None:
    """Have this process end when its parent has ended, however it did and whatever goes on here."""
    if sys.platform == "linux":
        ask = ctypes.CDLL(None).prctl
        ask(_PR_SET_PDEATHSIG, signal.SIGKILL)
        os.register_at_fork(after_in_child=lambda: ask(_PR_SET_PDEATHSIG, signal.SIGKILL))  # what it forks ends with it
    else:
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    if os.getppid() != parent:  # it has ended already
        os._exit(1)


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


def _die_first() -> None:
    """Where memory runs out, this process is the one to go, and not its parent."""
    try:
        with open("/proc/self/oom_score_adj", "w") as file:
            file.write("1000")
    except OSError:
        pass


def serve(key: str, connection: int, beat: int, traces: int, path: list[str]) -> None:
    """Answer calls until there are no more.

    Args:
        key: What each answer begins with, so that nothing else that is written there is taken for one.
        connection: Descriptor of the socket that they come by.
        beat: Descriptor of the file that the heartbeat is shared by.
        traces: Descriptor of the file to which is written where a crash happened.
        path: Where modules lie.
    """
    faulthandler.enable(traces, all_threads=False)
    faulthandler.register(signal.SIGUSR2, traces, all_threads=False)
    sys.path[:] = path
    import pickle
    from multiprocessing.connection import Connection

    from clearway.campaigns.heartbeat import HEARTBEAT
    from clearway.campaigns.surroundings import Sources, limits, settle

    HEARTBEAT.share(beat)
    line, me, sources, threads, most = (
        Connection(connection),
        os.getpid(),
        Sources(),
        threading.active_count(),
        limits(),
    )
    line.send_bytes(pickle.dumps((key, "ready", None, False)))
    while True:
        try:
            setting, call = pickle.loads(line.recv_bytes())
        except (EOFError, OSError):
            _end()
        answer: tuple[str, Any]
        if sources.changed() or list(setting.path) != path:  # what was imported may not be what would be now
            answer = ("stale", None)
        else:
            settle(setting)
            answer = _answer(setting.objects, call)
            sources.look()
        if os.getpid() != me:  # a navigator has forked, and went on in both
            os._exit(0)
        # who goes on would slow down the next trial, and what may be taken no more can't be had again
        leaves = threading.active_count() > threads or _has_children() or limits() != most
        line.send_bytes(pickle.dumps((key, *answer, leaves)))


def _end() -> None:
    """End, and whatever was started here."""
    if os.getpgrp() == os.getpid():
        os.killpg(os.getpid(), signal.SIGKILL)
    os._exit(0)


def _has_children() -> bool:
    try:
        return os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None
    except ChildProcessError:
        return False


def _answer(objects: bytes, call: bytes) -> tuple[str, Any]:
    import pickle

    from clearway.errors import ClearwayError
    from clearway.foreign import said, traced
    from clearway.given import unpack

    try:
        unpack(objects)
        function, arguments = pickle.loads(call)
        return "done", function(*arguments)
    except ClearwayError as error:
        return "refused", error
    except BaseException as error:
        return "broke", (said(error), traced(error))


if __name__ == "__main__":
    asked = json.loads(sys.argv[1])
    end_with(asked.pop("parent"))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's affair
    _die_first()
    serve(**asked)
