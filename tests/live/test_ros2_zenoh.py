"""What is said over Zenoh, as the design document of ros2/rmw_zenoh has it, whose examples these are."""

from __future__ import annotations

import json
import os
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("zenoh")

import numpy as np
import zenoh.ext

from clearway.geometry.grid import OccupancyGrid
from clearway.live.line import WireError
from clearway.live.ros.topics import TOPICS, Topic
from clearway.live.ros2 import messages as m
from clearway.live.ros2.dds import _sockets
from clearway.live.ros2.transport import Ros2Transport
from clearway.live.ros2.zenoh import SERVICES, Entity, ZenohNode, attached, entity_of, quality, unattached

STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
MAP = next(topic for topic in TOPICS if topic.name == "map")
TALKER = Entity(
    "2", "8b20917502ee955ac4476e0266340d5c", "0", "10", "MP", "/", "/", "talker",
    "/chatter", "std_msgs::msg::dds_::String_", STRING, quality(Topic("chatter", "std_msgs/msg/String", 7)),
)  # fmt: skip


def listening(endpoints: dict[str, Any], mode: str = "router") -> Any:
    """A session of nobody's but this test's."""
    return zenoh.open(
        zenoh.Config.from_json5(json.dumps({"mode": mode, **endpoints, "scouting": {"multicast": {"enabled": False}}}))
    )


@pytest.fixture
def router() -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        at = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    with listening({"listen": {"endpoints": [at]}}):
        yield at


def until(there: Callable[[], bool]) -> bool:
    """Whether it comes to be so."""
    end = time.monotonic() + 5.0
    while time.monotonic() < end:
        if there():
            return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize(
    ("token", "key"),
    [
        ("@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener", ""),
        (
            f"@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MS/%/%/listener/%chatter/std_msgs::msg::dds_::String_/{STRING}/::,10:,:,:,,",
            f"2/chatter/std_msgs::msg::dds_::String_/{STRING}",
        ),
        (
            f"@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{STRING}/::,7:,:,:,,",
            f"2/chatter/std_msgs::msg::dds_::String_/{STRING}",
        ),
        (
            f"@ros2_lv/2/f9980ee0495eaafb3e38f0d19e2eae12/0/10/SS/%/%/add_two_ints_server/%add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD}/::,10:,:,:,,",
            f"2/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD}",
        ),
    ],
)
def test_tokens_and_keys_are_those_of_the_design_document(token: str, key: str) -> None:
    entity = entity_of(token)
    assert entity is not None
    assert entity.token == token
    if key:
        assert entity.key == key
    assert entity_of("@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0") is None


def test_a_publisher_is_named_as_the_design_document_names_one() -> None:
    assert TALKER.token == (
        f"@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{STRING}/::,7:,:,:,,"
    )
    assert m.type_hash("std_msgs/msg/String") == STRING


def test_qualities_leave_out_what_is_the_default() -> None:
    """Reliable, volatile, the last 42; best effort is 2 and transient local 1 in rmw/types.h."""
    topics = {topic.name: quality(topic) for topic in TOPICS}
    assert topics["odom"] == "::,10:,:,:,,"
    assert topics["scan"] == "2::,5:,:,:,,"
    assert topics["map"] == ":1:,1:,:,:,,"
    assert quality(Topic("x", "std_msgs/msg/String", 42)) == "::,:,:,:,,"


def test_an_attachment_is_two_numbers_and_the_gid_with_its_length() -> None:
    gid = bytes(range(16))
    found = attached(7, 1_700_000_000_123_456_789, gid)
    assert found == struct.pack("<q", 7) + struct.pack("<q", 1_700_000_000_123_456_789) + b"\x10" + gid
    assert unattached(found) == (7, 1_700_000_000_123_456_789, gid)
    written = zenoh.ext.z_serialize((zenoh.ext.Int64(7), zenoh.ext.Int64(1_700_000_000_123_456_789), gid))
    assert found == written.to_bytes()  # as Zenoh's own serialiser writes them


def test_a_gid_is_the_hash_of_the_token_its_lower_half_first() -> None:
    xxhash = pytest.importorskip("xxhash")
    whole = xxhash.xxh3_128_intdigest(TALKER.token.encode())
    assert TALKER.gid == struct.pack("<QQ", whole % 2**64, whole >> 64)


def test_who_comes_late_is_told_the_map_and_finds_the_robot_in_the_graph(router: str) -> None:
    node = ZenohNode(3, router, "ward")
    try:
        cells = m.WRITING.grid(10**9, OccupancyGrid(np.array([[0, 100]], dtype=np.int8), 0.05, (0.0, 0.0)))
        node.publisher(MAP)(cells)
        late, alive = listening({"connect": {"endpoints": [router]}}, "peer"), set()
        with late:
            key = f"3/ward/map/nav_msgs::msg::dds_::OccupancyGrid_/{m.type_hash(MAP.kind)}"
            heard: list[Any] = []
            graph = late.liveliness().declare_subscriber(
                "@ros2_lv/3/**", lambda sample: alive.add(str(sample.key_expr)), history=True
            )
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
            subscriber = zenoh.ext.declare_advanced_subscriber(late, key, heard.append, history=history)
            assert until(lambda: bool(heard) and len(alive) == 2)
            found = sorted(str(token).split("/", 3)[3] for token in alive)
            assert found == [
                "0/0/NN/%/%ward/clearway",
                f"0/1/MP/%/%ward/clearway/%ward%map/nav_msgs::msg::dds_::OccupancyGrid_/{m.type_hash(MAP.kind)}/:1:,1:,:,:,,",
            ]
            assert heard[0].payload.to_bytes() == cells.serialize(use_version_2=False)
            number, _, gid = unattached(heard[0].attachment.to_bytes())
            (publisher,) = (one for one in map(entity_of, alive) if one is not None and one.what == "MP")
            assert (number, gid) == (1, publisher.gid)
            del graph, subscriber
    finally:
        node.close()


def test_a_service_is_asked_under_the_hash_that_its_server_tells(router: str) -> None:
    node, server = ZenohNode(0, router, ""), ZenohNode(0, router, "")
    try:
        client = node.service("cancel", m.CANCEL_GOAL)
        assert not client.served()
        served = server.entity("SS", "cancel", m.CANCEL_GOAL, ADD, SERVICES)
        asked: list[Any] = []

        def answer(query: Any) -> None:
            number, _, gid = unattached(query.attachment.to_bytes())
            asked.append((number, gid, m.CancelRequest.deserialize(query.payload.to_bytes())))
            reply = m.CancelReply(number, []).serialize(use_version_2=False)
            query.reply(served.key, reply, attachment=attached(number, 5, gid))

        server.keep(served, server.session.declare_queryable(served.key, answer, complete=True))
        assert until(client.served)
        request = m.CancelRequest(m.GoalInfo(m.UUID(list(range(16))), m.Time(1, 2)))
        numbers = [client.ask(request), client.ask(request)]
        replies: list[Any] = []
        assert until(lambda: replies.append(client.answer(numbers[1])) or replies[-1] is not None)
        assert replies[-1].return_code == numbers[1] == 2
        (who,) = server.others("SC", "/cancel", m.CANCEL_GOAL)
        assert [(number, gid) for number, gid, _ in asked] == [(1, who.gid), (2, who.gid)]
        assert asked[0][2].serialize() == request.serialize()
    finally:
        node.close()
        server.close()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a process's sockets can't be listed")
def test_it_listens_on_the_loopback_interface_alone(router: str) -> None:
    before = _sockets()
    node = ZenohNode(0, router, "")
    try:
        opened = [socket.socket(fileno=os.dup(file)) for file in _sockets() - before]
        listening = [one for one in opened if one.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)]
        assert {one.getsockname()[0] for one in listening} in ({"127.0.0.1"}, {"::1"}, {"127.0.0.1", "::1"})
        for one in opened:
            one.close()
    finally:
        node.close()


@pytest.mark.parametrize("fails", ["node", "transport"])
def test_what_cannot_be_made_is_closed(router: str, fails: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def raises(*_: Any) -> None:
        raise ValueError("half-way")

    opened, opens = [], zenoh.open

    def kept(config: zenoh.Config) -> zenoh.Session:
        opened.append(opens(config))
        return opened[-1]

    monkeypatch.setattr(zenoh, "open", kept)
    monkeypatch.setattr(ZenohNode, "keep" if fails == "node" else "service", raises)
    with pytest.raises(ValueError, match="half-way"):
        Ros2Transport(ZenohNode(0, router, ""), stamped=False)
    (session,) = opened
    closed = session.is_closed()
    session.close()
    assert closed


def test_nobody_at_the_router_is_said() -> None:
    with pytest.raises(WireError, match=r"finds no Zenoh router at tcp/127\.0\.0\.1:9 "):
        ZenohNode(0, "tcp/127.0.0.1:9", "")
