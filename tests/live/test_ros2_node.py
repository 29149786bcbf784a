"""Where a robot's node listens."""

from __future__ import annotations

import os
import socket
import sys

import pytest

pytest.importorskip("cyclonedds")

from clearway.errors import ClearwayError
from clearway.live.ros2 import dds

DOMAIN = 120 + os.getpid() % 80


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere sockets can't be bound to an interface")
def test_nothing_listens_on_other_than_the_loopback_interface():
    before = dds._sockets()
    dds.DdsNode(DOMAIN, "lo", "").close()
    opened = [socket.socket(fileno=os.dup(file)) for file in dds._sockets() - before]
    listening = [one for one in opened if one.family == socket.AF_INET]
    assert len(listening) >= 2
    assert {one.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16) for one in listening} == {b"lo\0"}
    for one in opened:
        one.close()


def test_a_second_interface_of_a_domain_is_refused():
    dds.DdsNode(DOMAIN, "lo", "").close()
    with pytest.raises(ClearwayError, match="joined already by this process, and not on the interface 'eth7'"):
        dds.DdsNode(DOMAIN, "eth7", "")
