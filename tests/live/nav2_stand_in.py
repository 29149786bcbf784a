"""A process that stands in for Nav2: it serves NavigateToPose as rclcpp_action does, and drives straight at the goal.

python nav2_stand_in.py DOMAIN [KIND]; KIND is what it does wrong.
"""

import math
import sys
import time
from typing import Any

from cyclonedds.core import Policy

from clearway.live.ros2 import messages as m
from clearway.live.ros2.node import Node, taken


def heading(q: Any) -> float:
    return 2.0 * math.atan2(q.z, q.w)


def heard(reader: Any, request: Any, writer: Any) -> None:
    """Wait for the reader of the client that asked, which its USER_DATA tells, as rmw_cyclonedds does before it replies."""
    asker = reader.get_matched_publication_data(request.sample_info.publication_handle)
    until = time.monotonic() + 2.0
    while asker is not None and time.monotonic() < until:
        for handle in writer.get_matched_subscriptions():
            found = writer.get_matched_subscription_data(handle)
            if found is not None and found.qos[Policy.Userdata] == asker.qos[Policy.Userdata]:
                return
        time.sleep(0.005)


def main(domain: int, kind: str = "") -> None:
    node = Node(domain, "lo", "")
    at = "navigate_to_pose/_action/"
    goals = node.reader(f"{at}send_goalRequest", m.SendGoalRequest, prefix="rq")
    accept = node.writer(f"{at}send_goalReply", m.SendGoalReply, prefix="rr")
    asked = node.reader(f"{at}get_resultRequest", m.GetResultRequest, prefix="rq")
    results = node.writer(f"{at}get_resultReply", m.GetResultReply, prefix="rr")
    cancels = node.reader(f"{at}cancel_goalRequest", m.CancelRequest, prefix="rq")
    canceled = node.writer(f"{at}cancel_goalReply", m.CancelReply, prefix="rr")
    stamped = kind in ("stamped", "wrong frame", "jumps back", "late")
    twist_of = m.TwistStamped if stamped else m.Twist
    commands = [node.writer("cmd_vel", twist_of) for _ in range(2 if kind == "two" else 1)]
    poses, clock = (
        node.reader("amcl_pose", m.PoseWithCovarianceStamped, depth=1),
        node.reader("clock", m.Clock, depth=1),
    )
    scans = node.reader("scan", m.LaserScan, "sensor", depth=1)
    goal = pose = waiting = None
    count = 0
    while True:
        node.wait(1.0)
        scans.take(1)
        for request in taken(goals):
            good = kind != "rejects"
            goal = request.pose.pose if good else goal
            heard(goals, request, accept)
            accept.write(m.SendGoalReply(request.request, good, m.Time(0, 0)))
        for request in taken(asked):
            waiting = request.request
            heard(asked, request, results)
            if kind == "aborts":
                results.write(m.GetResultReply(waiting, 6))
                goal = None
        for request in taken(cancels):
            goal = None
            canceled.write(m.CancelReply(request.request, 0, []))
        for sample in taken(poses):
            pose = sample
        for now in taken(clock):
            if goal is None or pose is None or waiting is None or kind == "silent":
                continue
            if pose.header.stamp != now.clock:
                while not (new := taken(poses)):
                    node.wait(0.01)
                pose = new[0]
            p, theta = pose.pose.pose.position, heading(pose.pose.pose.orientation)
            dx, dy = goal.position.x - p.x, goal.position.y - p.y
            distance = math.hypot(dx, dy)
            turn = math.remainder(
                (math.atan2(dy, dx) if distance > 0.15 else heading(goal.orientation)) - theta, math.tau
            )
            if distance < 0.15 and abs(turn) < 0.1:
                results.write(m.GetResultReply(waiting, 4))
                goal = waiting = None
                continue
            v = 0.5 * max(0.0, math.cos(turn)) ** 4 * min(1.0, distance) if distance > 0.15 else 0.0
            twist = m.Twist(m.Vector3(math.nan if kind == "nan" else v), m.Vector3(z=max(-1.0, min(1.0, 1.5 * turn))))
            count += 1
            if kind == "late" and count % 10 == 0:
                time.sleep(0.1)
            if kind == "lost" and count % 10 == 0:
                continue
            for writer in commands:
                if stamped:
                    stamp = m.Time(now.clock.sec - (kind == "jumps back" and count == 5), now.clock.nanosec)
                    frame = "odom" if kind == "wrong frame" else "base_link"
                    writer.write(m.TwistStamped(m.Header(stamp, frame), twist))
                else:
                    writer.write(twist)


main(int(sys.argv[1]), *sys.argv[2:])
