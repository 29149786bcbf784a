"""A process that stands in for Nav2: it serves NavigateToPose as rclcpp_action does, and drives straight at the goal.

python nav2_stand_in.py ADDRESS [KIND]; ADDRESS is a DDS domain or a Zenoh router's, KIND is what it does wrong.
"""

import math
import sys
import time
from collections import deque
from typing import Any

from clearway.live.ros.topics import Topic
from clearway.live.ros2 import messages as m


class DdsServer:
    """A service over DDS, as rmw_cyclonedds serves it."""

    def __init__(self, node: Any, name: str, kind: str) -> None:
        from clearway.live.ros2.dds import RELIABLE, headed

        self._reply = headed(f"{kind}_Response")
        self._requests = node.reader(f"{name}Request", headed(f"{kind}_Request"), RELIABLE, 10, "rq")
        self._replies = node.writer(f"{name}Reply", self._reply, RELIABLE, 10, "rr")

    def asked(self) -> list[tuple[Any, Any]]:
        """Who asks, and what."""
        from clearway.live.ros2.dds import taken

        return [(request, request) for request in taken(self._requests)]

    def answer(self, asker: Any, *fields: Any) -> None:
        """Wait for the reader of the client that asked, which its USER_DATA tells, as rmw_cyclonedds does before it replies."""
        from cyclonedds.core import Policy

        client = self._requests.get_matched_publication_data(asker.sample_info.publication_handle)
        until = time.monotonic() + 2.0
        while client is not None and time.monotonic() < until:
            readers = (
                self._replies.get_matched_subscription_data(h) for h in self._replies.get_matched_subscriptions()
            )
            if any(r is not None and r.qos[Policy.Userdata] == client.qos[Policy.Userdata] for r in readers):
                break
            time.sleep(0.005)
        self._replies.write(self._reply(asker.request, *fields))


class ZenohServer:
    """A service over Zenoh, as rmw_zenoh serves it."""

    def __init__(self, node: Any, name: str, kind: str) -> None:
        from clearway.live.ros2.zenoh import SERVICES

        self._node, self._request, self._reply = node, m.message(f"{kind}_Request"), m.message(f"{kind}_Response")
        self._queries: deque[Any] = deque()
        self._server = node.entity("SS", name, kind, f"RIHS01_{len(name):064x}", SERVICES)
        node.keep(self._server, node.session.declare_queryable(self._server.key, self._hear, complete=True))

    def asked(self) -> list[tuple[Any, Any]]:
        found = []
        while self._queries:
            query = self._queries.popleft()
            found.append((query, self._request.deserialize(query.payload.to_bytes())))
        return found

    def answer(self, asker: Any, *fields: Any) -> None:
        from clearway.live.ros2.zenoh import attached, unattached, written

        number, _, gid = unattached(asker.attachment.to_bytes())
        asker.reply(self._server.key, written(self._reply(*fields)), attachment=attached(number, time.time_ns(), gid))
        asker.drop()

    def _hear(self, query: Any) -> None:
        self._queries.append(query)
        self._node.woken()


def node_at(address: str) -> tuple[Any, Any]:
    """A node there, and what serves its services."""
    if address.isdigit():
        from clearway.live.ros2.dds import DdsNode

        return DdsNode(int(address), "lo", ""), DdsServer
    from clearway.live.ros2.zenoh import ZenohNode

    return ZenohNode(0, address, ""), ZenohServer


def heading(q: Any) -> float:
    return 2.0 * math.atan2(q.z, q.w)


def last(topic: Any, before: Any) -> Any:
    return [before, *(said for said, _ in topic.taken())][-1]


def at_time(stamp: Any) -> tuple[int, int]:
    return stamp.sec, stamp.nanosec


def main(address: str, kind: str = "") -> None:
    node, server = node_at(address)
    at = "navigate_to_pose/_action/"
    goals, results, cancels = (
        server(node, f"{at}{name}", service)
        for name, service in (("send_goal", m.SEND_GOAL), ("get_result", m.GET_RESULT), ("cancel_goal", m.CANCEL_GOAL))
    )
    stamped = kind in ("stamped", "wrong frame", "jumps back", "late")
    twists = Topic("cmd_vel", f"geometry_msgs/msg/Twist{'Stamped' if stamped else ''}")
    commands = [node.publisher(twists) for _ in range(2 if kind == "two" else 1)]
    poses = node.subscription(Topic("amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", 1))
    clock = node.subscription(Topic("clock", "rosgraph_msgs/msg/Clock", 1))
    scans = node.subscription(Topic("scan", "sensor_msgs/msg/LaserScan", 1, sensor=True))
    goal = pose = waiting = now = None
    count = 0
    print("ready", flush=True)
    while True:
        node.wait(1.0)
        scans.taken()
        for asker, request in goals.asked():
            good = kind != "rejects"
            goal, waiting = (request.pose.pose, None) if good else (goal, waiting)
            goals.answer(asker, good, m.Time(0, 0))
        for waiting, _ in results.asked():
            if kind == "aborts":
                results.answer(waiting, 6)
                goal = waiting = None
        for asker, _ in cancels.asked():
            goal = None
            cancels.answer(asker, 0, [])
        pose = last(poses, pose)
        now = last(clock, now)
        if now is None or goal is None or pose is None or waiting is None or kind == "silent":
            continue
        clocked, now = now.clock, None
        while at_time(pose.header.stamp) < at_time(clocked):
            node.wait(0.01)
            pose = last(poses, pose)
        p, theta = pose.pose.pose.position, heading(pose.pose.pose.orientation)
        dx, dy = goal.position.x - p.x, goal.position.y - p.y
        distance = math.hypot(dx, dy)
        turn = math.remainder((math.atan2(dy, dx) if distance > 0.15 else heading(goal.orientation)) - theta, math.tau)
        if distance < 0.15 and abs(turn) < 0.1:
            results.answer(waiting, 4)
            goal = waiting = None
            continue
        v = 0.5 * max(0.0, math.cos(turn)) ** 4 * min(1.0, distance) if distance > 0.15 else 0.0
        twist = m.Twist(m.Vector3(math.nan if kind == "nan" else v), m.Vector3(z=max(-1.0, min(1.0, 1.5 * turn))))
        count += 1
        if kind == "late" and count % 10 == 0:
            time.sleep(0.1)
        if kind == "lost" and count % 10 == 0:
            continue
        for say in commands:
            if stamped:
                stamp = m.Time(clocked.sec - (kind == "jumps back" and count == 5), clocked.nanosec)
                frame = "odom" if kind == "wrong frame" else "base_link"
                say(m.TwistStamped(m.Header(stamp, frame), twist))
            else:
                say(twist)


main(*sys.argv[1:])
