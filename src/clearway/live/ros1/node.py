"""A node of ROS 1: known to the master, asked by other nodes over XML-RPC, connected to them over TCP."""

from __future__ import annotations

import os
import secrets
import socket
import threading
from contextlib import suppress
from socketserver import BaseRequestHandler, ThreadingMixIn, ThreadingTCPServer
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

from clearway.live.line import WireError
from clearway.live.ros1.master import Master
from clearway.live.ros1.messages import kind
from clearway.live.ros1.tcpros import fields_of, header_of, received
from clearway.live.ros1.topics import Publisher, Subscription

_GLOBAL = ("clock", "tf", "tf_static")
"""Topics that all robots share, whatever their namespace."""
_SAYS_WHO = 5.0
"""s in which somebody who connects has to send a header."""


class Node:
    """A node with what it says and hears.

    Args:
        master: Where the master listens.
        host: The address of this machine on which it listens, and which it tells others.
        namespace: Before the names of its topics, but for those that all robots share; empty: none.

    Attributes:
        name: By which others know it.
        master: Its master.

    Raises:
        WireError: there is no master, or it can't listen there.
    """

    def __init__(self, master: str, host: str, namespace: str) -> None:
        self.name = f"/clearway_{os.getpid()}_{secrets.token_hex(4)}"
        self.master = Master(master, self.name)
        self._namespace = "/" + namespace.strip("/") if namespace.strip("/") else ""
        self._publishers: dict[str, Publisher] = {}
        self._subscriptions: dict[str, Subscription] = {}
        self._came = threading.Event()
        self._told_to_end = ""
        self.master.call("getPid")
        try:
            self._connections = _Connections((host, 0), _Connection)
        except OSError as error:
            raise WireError(f"cannot listen on {host!r}: {error.strerror or error}") from error
        self._connections.publishers = self._publishers
        self._asked = _Asked((host, 0), _AskedOnce, logRequests=False, allow_none=True)
        self._asked.register_function(self._answer_to("requestTopic"), "requestTopic")
        for method in _ANSWERS:
            self._asked.register_function(self._answer_to(method), method)
        self._host, self.uri = host, f"http://{host}:{self._asked.server_address[1]}/"
        for server in (self._connections, self._asked):
            threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()

    def publisher(self, name: str, type_: str, latched: bool = False) -> Publisher:
        """Somebody who says messages of a type, such as `geometry_msgs/msg/Twist`, under a name.

        Raises:
            WireError: the master refuses, or is not there any more.
        """
        topic = self.resolved(name)
        made = self._publishers[topic] = Publisher(self.name, topic, kind(type_), latched)
        self.master.call("registerPublisher", topic, made.kind.name, self.uri)
        return made

    def subscription(self, name: str, type_: str) -> Subscription:
        """Somebody who hears messages of a type under a name; `wait` returns when one comes.

        Raises:
            WireError: the master refuses, or is not there any more.
        """
        topic = self.resolved(name)
        made = self._subscriptions[topic] = Subscription(self.name, topic, kind(type_), self._came)
        made.publishers(self.master.call("registerSubscriber", topic, made.kind.name, self.uri))
        return made

    def subscribers(self, name: str) -> set[str]:
        """Names of the nodes that hear what is said here under a name."""
        return self._publishers[self.resolved(name)].subscribers()

    def unconnected(self, node: str) -> list[str]:
        """Topics said here that a node subscribes to, as the master knows, and has not connected to (yet), with why it was refused; none
        where there is no master any more, as who is connected can do without it."""
        try:
            listeners = dict(self.master.call("getSystemState")[1])
        except WireError:
            return []
        return [
            f"{topic}{said.refused.get(node, '')}"
            for topic, said in self._publishers.items()
            if node in listeners.get(topic, ()) and node not in said.subscribers()
        ]

    def call(self, service: str, within: float) -> None:
        """Call a service that takes nothing and says nothing (std_srvs/Empty); nothing happens where nobody offers it.

        Args:
            service: Its name.
            within: How long it is waited for, s.
        """
        name = self.resolved(service)
        where = self.master.service(name)
        if where is None:
            return
        asked = {"callerid": self.name, "md5sum": "*", "service": name}
        with suppress(OSError, EOFError), socket.create_connection(where, within) as connection:
            connection.sendall(header_of(asked))
            if "error" not in fields_of(received(connection)):
                connection.sendall(b"\0\0\0\0")  # an empty request
                connection.recv(1)

    def wait(self, seconds: float) -> None:
        """Return when a message has come, at the latest after so long.

        Raises:
            WireError: somebody has asked this node to end.
        """
        if self._told_to_end:
            raise WireError(f"was told to end by {self._told_to_end}")
        self._came.wait(seconds)
        self._came.clear()

    def resolved(self, name: str) -> str:
        """The whole name of a topic or a service."""
        return f"/{name}" if name in _GLOBAL else f"{self._namespace}/{name}"

    def close(self) -> None:
        """Leave the master and the other nodes."""
        for subscription in self._subscriptions.values():
            subscription.close()
        with suppress(WireError):
            for topic in self._subscriptions:
                self.master.call("unregisterSubscriber", topic, self.uri)
            for topic in self._publishers:
                self.master.call("unregisterPublisher", topic, self.uri)
        for publisher in self._publishers.values():
            publisher.close()
        for server in (self._connections, self._asked):
            server.shutdown()
            server.server_close()

    def _answer_to(self, method: str) -> Any:
        """What a node answers to a call of the Slave API."""

        def answer(caller: str, *arguments: Any) -> tuple[int, str, Any]:
            if method == "requestTopic":
                topic, protocols = arguments
                if topic not in self._publishers or not any(one[0] == "TCPROS" for one in protocols):
                    return 0, f"{self.name} says nothing on {topic} over TCPROS", 0
                return 1, "", ["TCPROS", self._host, self._connections.server_address[1]]
            if method == "publisherUpdate" and arguments[0] in self._subscriptions:
                self._subscriptions[arguments[0]].publishers(arguments[1])
            if method == "shutdown":
                self._told_to_end = f"{caller}: {arguments[0] if arguments else ''}"
            return 1, "", _ANSWERS[method](self)

        return answer

    def _topics(self, of: dict[str, Any]) -> list[list[str]]:
        return [[topic, one.kind.name] for topic, one in of.items()]


_ANSWERS: dict[str, Any] = {
    "getPid": lambda node: os.getpid(),
    "getMasterUri": lambda node: node.master.uri,
    "getPublications": lambda node: node._topics(node._publishers),
    "getSubscriptions": lambda node: node._topics(node._subscriptions),
    "getBusInfo": lambda node: [],
    "getBusStats": lambda node: [[], [], []],
    "paramUpdate": lambda node: 0,
    "publisherUpdate": lambda node: 0,
    "shutdown": lambda node: 0,
}


class _AskedOnce(SimpleXMLRPCRequestHandler):
    rpc_paths = ()  # any

    def log_message(self, format: str, *arguments: Any) -> None:
        pass


class _Asked(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True
    block_on_close = False


class _Connections(ThreadingTCPServer):
    daemon_threads = True
    block_on_close = False
    publishers: dict[str, Publisher]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Nothing: who connects and says nonsense is left."""


class _Connection(BaseRequestHandler):
    def handle(self) -> None:
        connection: socket.socket = self.request
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.settimeout(_SAYS_WHO)
        asked = fields_of(received(connection))
        publisher = self.server.publishers.get(asked.get("topic", ""))  # type: ignore[attr-defined]
        if publisher is None:
            connection.sendall(header_of({"error": f"nothing is said here on {asked.get('topic')!r}"}))
            return
        publisher.serve(connection, asked)
