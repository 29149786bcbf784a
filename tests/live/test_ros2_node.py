"""Where a robot's node listens."""

from __future__ import annotations

import os
import socket
import sys
import time

import pytest

pytest.importorskip("cyclonedds")

from cyclonedds.core import Policy

from clearway.errors import ClearwayError
from clearway.live.ros.topics import TOPICS
from clearway.live.ros2 import dds
from clearway.live.ros2.messages import message, type_hash

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


def test_a_publishers_user_data_tells_the_hash_of_its_type():
    """Beneath the namespace, as Jazzy and later look for it."""
    odom = next(topic for topic in TOPICS if topic.name == "odom")
    robot, other = (dds.DdsNode(DOMAIN + 1, "lo", "/ward/") for _ in range(2))
    try:
        robot.publisher(odom)
        reader = other.reader("odom", message(odom.kind), dds.RELIABLE, 1, "rt")
        until = time.monotonic() + 5.0
        while not (found := reader.get_matched_publications()) and time.monotonic() < until:
            time.sleep(0.01)
        told = reader.get_matched_publication_data(found[0])
        assert told is not None
        assert told.topic_name == "rt/ward/odom"
        assert told.qos[Policy.Userdata].data == f"typehash={type_hash('nav_msgs/msg/Odometry')};".encode()
    finally:
        robot.close()
        other.close()


def test_a_second_interface_of_a_domain_is_refused():
    dds.DdsNode(DOMAIN, "lo", "").close()
    with pytest.raises(ClearwayError, match="joined already by this process, and not on the interface 'eth7'"):
        dds.DdsNode(DOMAIN, "eth7", "")
