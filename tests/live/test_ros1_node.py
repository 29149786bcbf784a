"""Nodes over real connections, with a master of a few lines."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from typing import Any
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.live.line import WireError
from clearway.live.ros.said import GoalState, Place
from clearway.live.ros1.address import stack
from clearway.live.ros1.messages import message
from clearway.live.ros1.node import Node
from clearway.live.ros1.tcpros import LARGEST, fields_of, header_of, received
from clearway.live.ros1.transport import Tcp

TWIST, ODOMETRY = "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry"


class Master:
    """What the tests take of a master.

    Attributes:
        uri: Where it listens.
        nodes: Topic and who says or hears, "pub" or "sub" -> a node's name and address.
        parameters: That were set.
    """

    def __init__(self) -> None:
        self.nodes: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
        self.parameters: dict[str, Any] = {}
        self.server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self.uri = f"http://127.0.0.1:{self.server.server_address[1]}"
        for method in ("registerPublisher", "registerSubscriber", "unregisterPublisher", "unregisterSubscriber",
                       "getPid", "setParam", "hasParam", "getParam", "getSystemState", "lookupNode", "lookupService"):  # fmt: skip
            self.server.register_function(getattr(self, method))
        threading.Thread(target=self.server.serve_forever, args=(0.02,), daemon=True).start()

    def registerPublisher(self, who: str, topic: str, kind: str, uri: str) -> Any:
        self.nodes[topic, "pub"][who] = uri
        self.tell(topic)
        return 1, "", list(self.nodes[topic, "sub"].values())

    def registerSubscriber(self, who: str, topic: str, kind: str, uri: str) -> Any:
        self.nodes[topic, "sub"][who] = uri
        return 1, "", list(self.nodes[topic, "pub"].values())

    def unregisterPublisher(self, who: str, topic: str, uri: str) -> Any:
        self.nodes[topic, "pub"].pop(who)
        self.tell(topic)
        return 1, "", 1

    def unregisterSubscriber(self, who: str, topic: str, uri: str) -> Any:
        self.nodes[topic, "sub"].pop(who)
        return 1, "", 1

    def tell(self, topic: str) -> None:
        for uri in self.nodes[topic, "sub"].values():
            ServerProxy(uri).publisherUpdate("/master", topic, list(self.nodes[topic, "pub"].values()))  # type: ignore[arg-type]

    def getPid(self, who: str) -> Any:
        return 1, "", 1

    def hasParam(self, who: str, name: str) -> Any:
        return 1, "", name in self.parameters

    def getParam(self, who: str, name: str) -> Any:
        return 1, "", self.parameters[name]

    def setParam(self, who: str, name: str, value: Any) -> Any:
        self.parameters[name] = value
        return 1, "", 0

    def getSystemState(self, who: str) -> Any:
        who_does = [
            [[topic, list(nodes)] for (topic, how), nodes in self.nodes.items() if how == of] for of in ("pub", "sub")
        ]
        return 1, "", [*who_does, []]

    def lookupNode(self, who: str, name: str) -> Any:
        return 1, "", next(nodes[name] for nodes in self.nodes.values() if name in nodes)

    def lookupService(self, who: str, name: str) -> Any:
        return -1, "no provider", 0


@pytest.fixture
def master() -> Iterator[Master]:
    made = Master()
    yield made
    made.server.shutdown()
    made.server.server_close()


@pytest.fixture
def node(master: Master) -> Iterator[Callable[..., Node]]:
    made: list[Node] = []

    def make(namespace: str = "") -> Node:
        made.append(Node(master.uri, "127.0.0.1", namespace))
        return made[-1]

    yield make
    for one in made:
        one.close()


def soon(holds: Callable[[], object]) -> None:
    until = time.monotonic() + 20.0
    while not holds():
        assert time.monotonic() < until
        time.sleep(0.005)


def said(v: float) -> Any:
    return message(TWIST)(message("geometry_msgs/msg/Vector3")(v))


def test_what_is_said_is_heard_in_order_with_who_said_it(node: Callable[..., Node]) -> None:
    one, other = node(), node()
    hears = other.subscription("cmd_vel", TWIST)  # before there is somebody who says: the master tells of it
    says = one.publisher("cmd_vel", TWIST)
    soon(says.subscribers)
    assert says.subscribers() == {other.name}
    for k in range(100):
        says.publish(said(float(k)))
    heard: list[tuple[str, Any]] = []
    until = time.monotonic() + 20.0
    while len(heard) < 100:
        assert time.monotonic() < until
        other.wait(0.1)
        heard += hears.take()
    assert [who for who, _ in heard] == 100 * [one.name]
    assert [twist.linear.x for _, twist in heard] == [float(k) for k in range(100)]


def test_who_comes_late_is_told_what_is_latched_and_nothing_else(node: Callable[..., Node]) -> None:
    one, other = node(), node()
    for name, latched in (("kept", True), ("lost", False)):
        one.publisher(name, TWIST, latched).publish(said(1.0))
    kept, lost = (other.subscription(name, TWIST) for name in ("kept", "lost"))
    soon(lambda: kept.connected() and lost.connected() and kept._heard)
    assert [twist.linear.x for _, twist in kept.take()] == [1.0]
    assert lost.take() == []


def test_a_namespace_is_before_all_topics_but_those_that_robots_share(node: Callable[..., Node]) -> None:
    one = node("/robot1/")
    assert [one.resolved(name) for name in ("cmd_vel", "move_base/goal", "tf", "tf_static", "clock")] == [
        "/robot1/cmd_vel", "/robot1/move_base/goal", "/tf", "/tf_static", "/clock",
    ]  # fmt: skip


def test_another_type_is_refused_on_both_sides(node: Callable[..., Node]) -> None:
    one, other = node(), node()
    one.publisher("cmd_vel", ODOMETRY)
    hears = other.subscription("cmd_vel", TWIST)
    soon(lambda: hears.problem)
    assert hears.problem.startswith(f"{one.name} does not say geometry_msgs/Twist: /cmd_vel has nav_msgs/Odometry")
    assert not hears.connected()


def test_a_publisher_that_leaves_is_not_heard_any_more_and_one_that_cannot_be_reached_is_told(
    node: Callable[..., Node], master: Master
) -> None:
    one, other = node(), node()
    hears, says = other.subscription("cmd_vel", TWIST), one.publisher("cmd_vel", TWIST)
    soon(hears.connected)
    assert says.subscribers()
    one.close()
    soon(lambda: not hears.connected())
    with socket.socket() as nobody:  # bound, and not listening
        nobody.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{nobody.getsockname()[1]}/"
        hears.publishers([uri])
        soon(lambda: hears.problem)
        assert hears.problem.startswith(f"{uri} cannot be reached: ")


def test_one_that_is_closed_looks_for_nobody_whatever_a_master_still_tells(node: Callable[..., Node]) -> None:
    one, other = node(), node()
    hears, says = other.subscription("cmd_vel", TWIST), one.publisher("cmd_vel", TWIST)
    soon(hears.connected)
    hears.close()
    soon(lambda: not hears.connected() and not says.subscribers())
    hears.publishers([one.uri])
    time.sleep(0.3)
    assert not hears.connected()
    assert not says.subscribers()


def test_a_subscriber_that_takes_nothing_is_left(node: Callable[..., Node]) -> None:
    one = node()
    says = one.publisher("cmd_vel", TWIST)
    with socket.create_connection(connection_of(one)) as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.sendall(header_of({"callerid": "/deaf", "topic": "/cmd_vel", "type": "*", "md5sum": "*"}))
        soon(says.subscribers)
        until = time.monotonic() + 30.0
        while says.subscribers():
            assert time.monotonic() < until
            for _ in range(1000):
                says.publish(said(0.0))


def connection_of(node: Node) -> tuple[str, int]:
    return "127.0.0.1", node._connections.server_address[1]


@pytest.mark.parametrize(
    "nonsense", [b"GET / HTTP/1.1\r\n\r\n", struct.pack("<I", 2**31), b"\x04\0\0\0\xff\0\0\0", b""]
)
def test_nonsense_from_others_does_no_harm(node: Callable[..., Node], nonsense: bytes) -> None:
    one, other = node(), node()
    one.publisher("cmd_vel", TWIST)
    with socket.create_connection(connection_of(one)) as connection:
        connection.sendall(nonsense)
    hears = other.subscription("cmd_vel", TWIST)
    soon(hears.connected)


def test_a_topic_that_is_not_said_is_refused(node: Callable[..., Node]) -> None:
    one = node()
    with socket.create_connection(connection_of(one)) as connection:
        connection.sendall(header_of({"callerid": "/x", "topic": "/no"}))
        assert fields_of(received(connection)) == {"error": "nothing is said here on '/no'"}
    assert ServerProxy(one.uri).requestTopic("/x", "/no", [["TCPROS"]])[0] == 0  # type: ignore[index]


def test_a_message_without_end_is_refused() -> None:
    one, other = socket.socketpair()
    with one, other:
        one.sendall(struct.pack("<I", LARGEST + 1))
        with pytest.raises(WireError, match="no message that is heard here has more"):
            received(other)


def test_everything_listens_on_the_address_that_was_told_alone(node: Callable[..., Node]) -> None:
    one = node()
    assert {server.server_address[0] for server in (one._connections, one._asked)} == {"127.0.0.1"}
    assert one.uri.startswith("http://127.0.0.1:")
    one.publisher("cmd_vel", TWIST)
    _, _, (_, host, _) = ServerProxy(one.uri).requestTopic("/x", "/cmd_vel", [["TCPROS"]])  # type: ignore[misc]
    assert host == "127.0.0.1"


def test_a_node_answers_what_tools_ask(node: Callable[..., Node], master: Master) -> None:
    one = node()
    one.publisher("odom", ODOMETRY)
    one.subscription("cmd_vel", TWIST)
    asked = ServerProxy(one.uri)
    assert asked.getMasterUri("/x") == [1, "", master.uri]
    assert asked.getPublications("/x") == [1, "", [["/odom", "nav_msgs/Odometry"]]]
    assert asked.getSubscriptions("/x") == [1, "", [["/cmd_vel", "geometry_msgs/Twist"]]]
    assert asked.shutdown("/rosnode", "killed")[0] == 1  # type: ignore[index]
    with pytest.raises(WireError, match="was told to end by /rosnode: killed"):
        one.wait(0.0)


def test_nothing_is_left_with_the_master(node: Callable[..., Node], master: Master) -> None:
    Tcp(master.uri, "127.0.0.1", "").close()
    assert all(not nodes for nodes in master.nodes.values())
    assert master.parameters == {"/use_sim_time": True}


def test_how_far_the_clock_came_is_left_with_the_master(node: Callable[..., Node], master: Master) -> None:
    robot = Tcp(master.uri, "127.0.0.1", "")
    assert robot.latest == 0
    robot.begin(Place(17 * 10**17, np.zeros(3), None))
    robot.close()
    left = master.parameters["/clearway_clock"]
    for kept, told in ((left, 17 * 10**17), (7, 0), ("-7", 0), ("soon", 0)):  # others may set it to anything
        master.parameters["/clearway_clock"] = kept
        again = Tcp(master.uri, "127.0.0.1", "")
        assert again.latest == told
        again.close()


def test_what_is_missing_is_told_in_turn(node: Callable[..., Node], master: Master) -> None:
    robot = Tcp(master.uri, "127.0.0.1", "")
    try:
        assert robot.missing() == "server of the action move_base"
        stand_in = node()
        for name, kind in (
            ("status", "actionlib_msgs/msg/GoalStatusArray"),
            ("result", "move_base_msgs/msg/MoveBaseActionResult"),
        ):
            stand_in.publisher(f"move_base/{name}", kind)
        goals = stand_in.subscription("move_base/goal", "move_base_msgs/msg/MoveBaseActionGoal")
        stand_in.subscription("move_base/cancel", "actionlib_msgs/msg/GoalID")
        soon(lambda: robot.missing() != "server of the action move_base")
        assert robot.missing() == "publisher of /cmd_vel"
        stand_in.publisher("cmd_vel", TWIST)
        soon(lambda: robot.missing() != "publisher of /cmd_vel")
        assert robot.missing().startswith(f"subscriber of /clock in {stand_in.name}")
        stand_in.subscription("clock", "rosgraph_msgs/msg/Clock")
        soon(lambda: not robot.missing())
        master.nodes["/map", "sub"][stand_in.name] = "http://127.0.0.1:9/"  # says so, and doesn't come
        assert robot.missing() == f"connection of its subscriber {stand_in.name} to /map"
        del master.nodes["/map", "sub"][stand_in.name]
        odometry = stand_in.subscription("scan", ODOMETRY)
        soon(lambda: odometry.problem)
        assert f"{stand_in.name} to /scan (/scan has sensor_msgs/LaserScan" in robot.missing()
        odometry.close()
        del master.nodes["/scan", "sub"][stand_in.name]
        assert not robot.missing()
        master.nodes["/map", "sub"][stand_in.name] = "http://127.0.0.1:9/"
        master.server.shutdown()
        master.server.server_close()
        assert not robot.missing()  # who is connected can do without a master
        robot.begin(Place(7 * 10**9, np.zeros(3), None))
        robot.pursue(np.array((1.0, 2.0, 0.0)))
        assert robot.goal() is GoalState.SENT
        soon(lambda: goals._heard)
        ((who, goal),) = goals.take()
        assert goal.goal_id.id.startswith(who)
        assert (goal.goal.target_pose.header.frame_id, goal.goal.target_pose.pose.position.y) == ("map", 2.0)
        assert (goal.goal_id.stamp.sec, goal.goal_id.stamp.nanosec) == (7, 0)
    finally:
        robot.close()


def test_a_cancel_is_for_all_that_was_sent_up_to_then(node: Callable[..., Node], master: Master) -> None:
    robot = Tcp(master.uri, "127.0.0.1", "")
    try:
        cancels = node().subscription("move_base/cancel", "actionlib_msgs/msg/GoalID")
        goals = node().subscription("move_base/goal", "move_base_msgs/msg/MoveBaseActionGoal")
        soon(lambda: robot._action._cancel.subscribers() and robot._action._send.subscribers())
        robot.begin(Place(7 * 10**9, np.zeros(3), None))
        for _ in range(2):
            robot.pursue(np.array((1.0, 2.0, 0.0)))
        robot.cancel()
        robot.cancel()  # once is enough
        soon(lambda: len(goals._heard) == 2 and cancels._heard)
        ((_, said),) = cancels.take()
        assert said == goals.take()[1][1].goal_id
        assert said.stamp.sec == 7
    finally:
        robot.close()


def test_somebody_else_who_says_the_time_is_refused_while_a_dead_one_is_not(
    node: Callable[..., Node], master: Master
) -> None:
    gone = node()
    gone.publisher("clock", "rosgraph_msgs/msg/Clock")
    listed = dict(master.nodes["/clock", "pub"])
    with pytest.raises(ClearwayError, match=f"has {gone.name} that publishes /clock; the simulated robot alone may"):
        stack(master.uri)()
    gone.close()
    master.nodes["/clock", "pub"] = listed  # as if it had been killed
    stack(master.uri)().close()


@pytest.mark.parametrize(
    ("address", "options", "says"),
    [
        ("127.0.0.1:11311", {}, "is no master's address; write ros1:http://127.0.0.1:11311"),
        ("http://127.0.0.1", {}, "is no master's address"),
        (
            "http://robot:11311",
            {},
            "has its master on another machine, which 127.0.0.1 is not reached from; host=ADDRESS",
        ),
        ("http://127.0.0.1:9", {}, "has no master at http://127.0.0.1:9 .*; start roscore first"),
        ("", {"namespace": "a b"}, "'a b' is no namespace; robot1 is one"),
        ("", {"host": 3}, "host = 3 is no address"),
        ("", {"localised": 1}, "localised = 1; true or false is expected"),
        ("", {"patience": 0.0}, "patience = 0.0 is no time in seconds above 0"),
    ],
)
def test_what_is_no_stack_is_told(address: str, options: dict[str, Any], says: str) -> None:
    with pytest.raises(ClearwayError, match=says):
        stack(address)(**options)
