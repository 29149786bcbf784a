"""What stands behind `exec:` and `tcp:` where a navigator is named: who makes one of it."""

from __future__ import annotations

import ipaddress
import os
import shlex
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

from clearway.errors import ClearwayError
from clearway.imports import with_imports
from clearway.live.arena import ArenaPlanner, Manifest, read_manifest
from clearway.live.conformance import Said, said_of
from clearway.live.line import WireError
from clearway.live.navigator import Remote
from clearway.live.peers import Peer, Process, Server


def program(command: str) -> Program:
    """Who makes a navigator of what stands behind `exec:`, a command line.

    Raises:
        ClearwayError: there is no such program, or it can't be run.
    """
    address = f"exec:{command}"
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise ClearwayError(f"navigator {address!r} is no command line: {str(error).lower()}") from error
    if not words:
        raise ClearwayError(f"navigator {address!r} names no program; write exec:./my_planner")
    return Program(address, _runnable(words[0], address), tuple(words[1:]))


def server(where: str) -> At:
    """Who makes a navigator of what stands behind `tcp:`, two slashes, a host and a port.

    Raises:
        ClearwayError: it names no host and port.
    """
    address = f"tcp:{where}"
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port or address != f"tcp://{parts.netloc}" or "@" in parts.netloc:
        raise ClearwayError(f"navigator {address!r} is no address; write tcp://127.0.0.1:5555")
    return At(address, host, port)


@dataclass(frozen=True, slots=True)
class Program:
    """A navigator that is a program of its own: each trial starts it.

    Attributes:
        address: How it is named.
        file: Its file.
        arguments: What it is given.
    """

    address: str
    file: Path
    arguments: tuple[str, ...]

    def __call__(self) -> Remote:
        """Start it.

        Raises:
            ClearwayError: it can't be started, or says no sound hello.
        """
        return _made(self.address, partial(Process, [str(self.file), *self.arguments]))

    def files(self) -> tuple[Path, ...]:
        """Its file, and those that its arguments name; of a Python script also those that it imports from beside it."""
        named = (argument.partition("=")[2] or argument for argument in self.arguments)
        found = [self.file, *(Path(name) for name in named if os.path.isfile(name))]
        return tuple(dict.fromkeys(file for one in found for file in _with_imports(one)))

    def findings(self) -> Iterator[Said]:
        """Whether it keeps to the wire."""
        return said_of(self)


@dataclass(frozen=True, slots=True)
class At:
    """A navigator that is a server, which somebody has started: each trial connects to it.

    Attributes:
        address: How it is named.
        host: Its host's name or address.
        port: Its port.
    """

    address: str
    host: str
    port: int

    def __call__(self, remote: bool = False) -> Remote:
        """Connect to it.

        Args:
            remote: Whether it may be on another machine.

        Raises:
            ClearwayError: it is on another one, nobody listens there, or says no sound hello.
        """
        if not remote and not is_here(self.host):
            raise ClearwayError(
                f"navigator {self.address!r} is not on this machine (127.0.0.1, localhost); {self.address}[remote=true] allows that"
            )
        return _made(self.address, partial(Server, self.host, self.port))

    def findings(self) -> Iterator[Said]:
        """Whether it keeps to the wire."""
        return said_of(self)


def planner(folder: str) -> Arena:
    """Who makes a navigator of what stands behind `arena:`, the folder of a planner of Arena.

    Raises:
        ClearwayError: it is none, or asks for what there is not.
    """
    place = Path(folder)
    for file in (place / "planner.py", place / "planner.yaml"):
        if not file.is_file():
            raise ClearwayError("no such file; arena:FOLDER names a folder with planner.py and planner.yaml", file=file)
    return Arena(f"arena:{folder}", place, read_manifest(place / "planner.yaml"))


@dataclass(frozen=True, slots=True)
class Arena:
    """A navigator that is a planner of Arena: each trial starts it, with the Python of the environment in its folder.

    Attributes:
        address: How it is named.
        folder: Its folder.
        manifest: What it says.
    """

    address: str
    folder: Path
    manifest: Manifest

    def __call__(self, python: str | None = None) -> ArenaPlanner:
        """Start it.

        Args:
            python: The interpreter that runs it; None: `.venv/bin/python` in its folder, else `python3`.

        Raises:
            ClearwayError: it can't be started, or does not answer as it must.
        """
        own = self.folder / ".venv" / "bin" / "python"
        runs = _runnable(python or (str(own) if own.is_file() else "python3"), self.address)
        command = [str(runs), os.path.abspath(self.folder / "planner.py")]
        try:
            return ArenaPlanner(f"navigator {self.address!r}", command, self.manifest)
        except ModuleNotFoundError as error:
            raise ClearwayError(
                f"navigator {self.address!r} takes the package {error.name}: pip install msgpack pyzmq"
            ) from error
        except WireError as error:
            raise ClearwayError(str(error)) from error

    def files(self, python: str | None = None) -> tuple[Path, ...]:
        """Those in its folder, weights too, but for its environment and what is hidden."""
        found = (Path(place, f) for place, _, files in os.walk(self.folder) for f in files)
        return tuple(
            sorted(
                f
                for f in found
                if not any(p.startswith((".", "__pycache__")) for p in f.relative_to(self.folder).parts)
            )
        )


def _made(address: str, connect: Callable[[], Peer]) -> Remote:
    try:
        return Remote(f"navigator {address!r}", connect)
    except WireError as error:
        raise ClearwayError(str(error)) from error


def _runnable(name: str, address: str) -> Path:
    found = shutil.which(name)
    if found is not None:
        return Path(os.path.abspath(found))  # a link stays one: an environment's Python is known by it
    if os.path.isdir(name):
        problem = f"{name!r} is a folder, not a program"
    elif os.path.isfile(name) and os.sep in name:
        problem = f"{name!r} is not executable; chmod +x makes it so, exec:python3 {name} runs a Python script"
    elif os.path.isfile(name):
        problem = f"there is no program {name!r} on the path; the file that lies here is ./{name}"
    else:
        problem = f"there is no program {name!r}"
    raise ClearwayError(f"navigator {address!r}: {problem}")


def is_here(host: str) -> bool:
    """Whether a host's name or address is the loopback interface's."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _with_imports(file: Path) -> list[Path]:
    return [file, *sorted(with_imports(file.resolve()) - {file.resolve()})] if file.suffix == ".py" else [file]
