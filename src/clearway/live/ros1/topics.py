"""A topic of ROS 1 as its publisher and as its subscriber."""

from __future__ import annotations

import socket
import struct
import threading
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from clearway.live.line import WireError
from clearway.live.ros1.master import PROBLEMS, called
from clearway.live.ros1.messages import Kind
from clearway.live.ros1.tcpros import fields_of, header_of, received

_TAKES = 1
"""s in which a subscriber has to take what is sent: one that doesn't is left, so that it can't hold the robot up."""
_CONNECTS = 2.0
_AGAIN = 0.25
"""s until a publisher is tried again that could not be reached."""


class Publisher:
    """Says messages to all that have connected.

    Args:
        node: The node's name.
        topic: The topic's.
        kind: Of the messages.
        latched: Whether who connects later is told the last one too.

    Attributes:
        refused: Why, in brackets, a node was refused that wants messages of another kind.
    """

    def __init__(self, node: str, topic: str, kind: Kind, latched: bool) -> None:
        self.kind, self._latched = kind, latched
        self.refused: dict[str, str] = {}
        self._header = {
            "callerid": node, "latching": str(int(latched)), "md5sum": kind.md5sum,
            "message_definition": kind.definition, "topic": topic, "type": kind.name,
        }  # fmt: skip
        self._lock = threading.Lock()
        self._subscribers: dict[socket.socket, str] = {}
        self._last = b""

    def publish(self, said: Any) -> None:
        """Say a message."""
        data = self.kind.packed(said)
        with self._lock:
            self._last = data if self._latched else b""
            for subscriber in tuple(self._subscribers):
                try:
                    subscriber.sendall(data)
                except OSError:
                    del self._subscribers[subscriber]
                    _shut(subscriber)

    def subscribers(self) -> set[str]:
        """Names of the nodes that have connected."""
        with self._lock:
            return set(self._subscribers.values())

    def serve(self, connection: socket.socket, asked: dict[str, str]) -> None:
        """Have somebody who has said what is asked as a subscriber, until the connection ends."""
        wanted = asked.get("type", "*"), asked.get("md5sum", "*")
        if any(one not in ("*", ours) for one, ours in zip(wanted, (self.kind.name, self.kind.md5sum), strict=True)):
            why = f"{self._header['topic']} has {self.kind.name} ({self.kind.md5sum}), not {wanted[0]} ({wanted[1]})"
            self.refused[asked.get("callerid", "")] = f" ({why})"
            connection.sendall(header_of({"callerid": self._header["callerid"], "error": why}))
            return
        connection.settimeout(None)  # it may be silent for ever; what is sent to it has a limit
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", _TAKES, 0))
        with self._lock:
            connection.sendall(header_of(self._header) + self._last)
            self._subscribers[connection] = asked.get("callerid", "")
        try:
            while connection.recv(1024):  # a subscriber says nothing: this waits until it closes
                pass
        finally:
            with self._lock:
                self._subscribers.pop(connection, None)

    def close(self) -> None:
        """Leave them all."""
        with self._lock:
            for subscriber in self._subscribers:
                _shut(subscriber)
            self._subscribers.clear()


class Subscription:
    """Hears messages of all publishers of a topic.

    Args:
        node: The node's name.
        topic: The topic's.
        kind: Of the messages.
        came: Is set when one has come.

    Attributes:
        problem: Why the last publisher that could not be heard could not; empty: none.
    """

    def __init__(self, node: str, topic: str, kind: Kind, came: threading.Event) -> None:
        self.kind, self.problem = kind, ""
        self._node, self._topic, self._came = node, topic, came
        self._lock = threading.Lock()
        self._wanted: dict[str, threading.Event] = {}
        self._open: dict[str, socket.socket] = {}
        self._heard: deque[tuple[str, bytes]] = deque(maxlen=1000)
        self._closed = False

    def publishers(self, uris: Iterable[str]) -> None:
        """Hear these nodes, and no others; once closed, none: a master goes on telling of publishers for a while."""
        with self._lock:
            uris = set() if self._closed else set(uris)
            for uri in self._wanted.keys() - uris:
                self._wanted.pop(uri).set()
                if uri in self._open:
                    _shut(self._open[uri])
            for uri in uris - self._wanted.keys():
                left = self._wanted[uri] = threading.Event()
                threading.Thread(target=self._follow, args=(uri, left), daemon=True).start()

    def connected(self) -> bool:
        """Whether there is a publisher that is heard."""
        with self._lock:
            return bool(self._open)

    def take(self) -> list[tuple[str, Any]]:
        """What came, oldest first, and the name of who said it.

        Raises:
            WireError: it is no message of the topic's kind.
        """
        found = []
        while self._heard:
            publisher, data = self._heard.popleft()
            try:
                found.append((publisher, self.kind.unpacked(data)))
            except Exception as error:  # whatever the reader meets in bytes that are no message
                raise WireError(f"says on {self._topic} what is no {self.kind.name}: {error}") from error
        return found

    def close(self) -> None:
        """Hear nobody any more."""
        self._closed = True  # before the lock is taken: who holds it now is followed by the next line
        self.publishers(())

    def _follow(self, uri: str, left: threading.Event) -> None:
        while not left.is_set():
            try:
                self._hear(uri, left)
            except EOFError:
                pass
            except WireError as error:
                self.problem = str(error)
            except PROBLEMS as error:
                self.problem = f"{uri} cannot be reached: {getattr(error, 'strerror', None) or error}"
            left.wait(_AGAIN)

    def _hear(self, uri: str, left: threading.Event) -> None:
        _, host, port = called(uri, "requestTopic", self._node, self._topic, [["TCPROS"]])
        with socket.create_connection((host, port), _CONNECTS) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            asked = {
                "callerid": self._node, "md5sum": self.kind.md5sum, "message_definition": self.kind.definition,
                "tcp_nodelay": "1", "topic": self._topic, "type": self.kind.name,
            }  # fmt: skip
            connection.sendall(header_of(asked))
            told = fields_of(received(connection))
            publisher = told.get("callerid", uri)
            if "error" in told or told.get("md5sum") not in ("*", self.kind.md5sum):
                why = told.get("error") or f"it says {told.get('type')}"
                raise WireError(f"{publisher} does not say {self.kind.name}: {why}")
            connection.settimeout(None)
            with self._lock:
                if left.is_set():
                    return
                self._open[uri], self.problem = connection, ""
            try:
                while True:
                    self._heard.append((publisher, received(connection)))
                    self._came.set()
            finally:
                with self._lock:
                    if self._open.get(uri) is connection:
                        del self._open[uri]


def _shut(connection: socket.socket) -> None:
    """End a connection that another thread may wait for; who has opened it closes it."""
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
