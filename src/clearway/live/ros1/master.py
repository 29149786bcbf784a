"""A ROS master, and other nodes, as XML-RPC has them: calls that answer (code, message, value)."""

from __future__ import annotations

import http.client
import xmlrpc.client
from typing import Any

from clearway.live.line import WireError

PROBLEMS = (OSError, http.client.HTTPException, xmlrpc.client.Error, ValueError)
"""What a call raises where nobody, or somebody else, is there."""

_TIMEOUT = 3.0


class _Transport(xmlrpc.client.Transport):
    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT
        return connection


def called(uri: str, method: str, *arguments: Any) -> Any:
    """What a node or a master answers.

    Raises:
        WireError: it refuses.
        PROBLEMS: it can't be asked.
    """
    with xmlrpc.client.ServerProxy(uri, transport=_Transport()) as other:
        code, why, value = getattr(other, method)(*arguments)  # type: ignore[misc]
    if code != 1:
        raise WireError(f"refuses {method}: {why}")
    return value


class Master:
    """The master, for a node.

    Args:
        uri: Where it listens.
        caller: The node's name.
    """

    def __init__(self, uri: str, caller: str) -> None:
        self.uri, self._caller = uri, caller

    def call(self, method: str, *arguments: Any) -> Any:
        """What it answers.

        Raises:
            WireError: it refuses, or is not there.
        """
        try:
            return called(self.uri, method, self._caller, *arguments)
        except WireError as error:
            raise WireError(f"has a master at {self.uri} that {error}") from error
        except PROBLEMS as error:
            why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise WireError(f"has no master at {self.uri} ({why}); start roscore first") from error

    def publishers(self, topic: str) -> list[str]:
        """The nodes that publish on a topic and answer: a node that was killed stays in the master's list."""
        listed: list[str] = next((nodes for name, nodes in self.call("getSystemState")[0] if name == topic), [])
        return [node for node in listed if node != self._caller and self._answers(node)]

    def service(self, name: str) -> tuple[str, int] | None:
        """Where a service is to be had; None: nowhere."""
        try:
            uri = called(self.uri, "lookupService", self._caller, name)
        except (WireError, *PROBLEMS):
            return None
        host, _, port = uri.removeprefix("rosrpc://").rstrip("/").rpartition(":")
        return host, int(port)

    def _answers(self, node: str) -> bool:
        try:
            called(self.call("lookupNode", node), "getPid", self._caller)
        except (WireError, *PROBLEMS):
            return False
        return True
