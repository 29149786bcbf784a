"""Who is at the other end of a line: a process that is started and ended here, or a server that somebody has started."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Protocol

from clearway.live.line import Line, WireError

ENDING = 1.0
"""s that a process has to end after its `bye`, or a server to close the connection."""

_CONNECTING = 5.0
_GUARD = ("/bin/sh", "-c", "trap '' HUP INT TERM; read nothing; kill -KILL 0")
_PR_SET_PDEATHSIG = 1
_C = ctypes.CDLL(None)


class Peer(Protocol):
    """Somebody who answers.

    Attributes:
        line: To it.
    """

    line: Line

    def fate(self) -> str:
        """Why its line is closed, for people."""

    def leave(self) -> str:
        """Close our end of the line, and let it end by itself; what is wrong with how it does, empty for nothing."""

    def end(self) -> None:
        """Let nothing of it go on."""


class Process:
    """A process that speaks on its standard streams. It ends with this one, and with it what it has started.

    Args:
        command: The program and its arguments.

    Raises:
        WireError: it can't be started.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self._program = Program(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self._process = self._program.process
        streams = (self._process.stdout, self._process.stdin, self._process.stderr)
        self._streams = [stream for stream in streams if stream is not None]
        self.line = Line(*(stream.fileno() for stream in self._streams))

    def fate(self) -> str:
        return fate_of(self._process) or "closed its standard output"

    def leave(self) -> str:
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(ENDING)
        except subprocess.TimeoutExpired:
            return f"had not ended after {ENDING:g} s"
        return self.fate() if self._process.returncode else ""

    def end(self) -> None:
        self._program.end()
        for stream in self._streams:
            with suppress(OSError):
                stream.close()


class Program:
    """A program and all that it starts, a group of processes that ends with this process, however this one ends.

    Ctrl-C doesn't come there. A shell that is the first of the group waits for this process to end, and then ends the group.

    Args:
        command: The program and its arguments.
        how: Further arguments of `Popen`.

    Attributes:
        process: The program itself.

    Raises:
        WireError: it can't be started.
    """

    def __init__(self, command: Sequence[str], **how: Any) -> None:
        quiet = subprocess.DEVNULL
        guard: subprocess.Popen[bytes] | None = None
        try:
            self._guard = guard = subprocess.Popen(
                _GUARD, bufsize=0, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet, process_group=0
            )
            self.process = subprocess.Popen(
                command, bufsize=0, preexec_fn=_ending_with(os.getpid()), process_group=guard.pid, **how
            )
        except (OSError, subprocess.SubprocessError) as error:
            if guard is not None:
                self._end_group()
            raise WireError(f"cannot be started: {getattr(error, 'strerror', None) or error}") from error

    def end(self) -> None:
        """End it, and whatever it has started."""
        self._end_group()
        self.process.kill()  # it may have left the group
        self.process.wait()

    def _end_group(self) -> None:
        if self._guard.returncode is None:  # so the group's number is nobody else's yet
            os.killpg(self._guard.pid, signal.SIGKILL)
            self._guard.wait()
        assert self._guard.stdin is not None
        self._guard.stdin.close()


def fate_of(process: subprocess.Popen[bytes]) -> str:
    """How a process has ended, for people; empty if it hasn't within `ENDING`."""
    try:
        code = process.wait(ENDING)
    except subprocess.TimeoutExpired:
        return ""
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def _ending_with(parent: int) -> Callable[[], None]:
    def ask() -> None:
        if sys.platform == "linux":
            _C.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            if os.getppid() != parent:
                os._exit(1)

    return ask


class Server:
    """A server of this machine, or of another one.

    Args:
        host: Its name or address.
        port: Its port.

    Raises:
        WireError: nobody listens there.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            self._socket = socket.create_connection((host, port), _CONNECTING)
        except OSError as error:
            why = error.strerror or str(error)
            raise WireError(f"cannot be reached ({why}); start it first") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.line = Line(self._socket.fileno(), self._socket.fileno())

    def fate(self) -> str:
        return "closed the connection"

    def leave(self) -> str:
        with suppress(OSError):  # it may have closed the connection already
            self._socket.shutdown(socket.SHUT_WR)
        return "" if self.line.ends(ENDING) else f"had not closed the connection after {ENDING:g} s"

    def end(self) -> None:
        self._socket.close()
