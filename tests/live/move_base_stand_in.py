"""A node of rospy that stands in for move_base: it serves its action by actionlib, and drives straight at the goal.

/usr/bin/python3 move_base_stand_in.py [KIND]; KIND is what it does wrong.
"""

import math
import sys
import threading
import time

import actionlib
import rosgraph
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyResponse

KIND = sys.argv[1] if len(sys.argv) > 1 else ""


def heading(q):
    return 2.0 * math.atan2(q.z, q.w)


class StandIn:
    def __init__(self):
        self.lock = threading.RLock()
        self.goal = self.cleared = self.map = None
        self.seen = set()
        self.count = self.trials = 0
        if KIND == "wrong type":
            self.commands = [rospy.Publisher("cmd_vel", TwistStamped, queue_size=1)]
        elif KIND != "no publisher":
            self.commands = [rospy.Publisher("cmd_vel", Twist, queue_size=10)]
        rospy.Service("move_base/clear_costmaps", Empty, self.clear)
        self.transforms = tf2_ros.Buffer()
        if KIND == "connects late":  # to what it has told the master of
            rosgraph.Master(rospy.get_name()).registerSubscriber("/tf", "tf2_msgs/TFMessage", rospy.get_node_uri())
            threading.Timer(3.0, tf2_ros.TransformListener, (self.transforms,)).start()
        else:
            self.listens = tf2_ros.TransformListener(self.transforms)
        if KIND == "deaf":  # says so to the master, and never connects
            rosgraph.Master(rospy.get_name()).registerSubscriber("/map", "nav_msgs/OccupancyGrid", rospy.get_node_uri())
        else:
            rospy.Subscriber("map", OccupancyGrid, self.heard)
        rospy.Subscriber("odom", Odometry, self.heard)
        rospy.Subscriber("scan", LaserScan, self.heard)
        rospy.Subscriber("initialpose", PoseWithCovarianceStamped, self.heard)
        rospy.Subscriber("amcl_pose", PoseWithCovarianceStamped, self.drive, queue_size=1)
        self.server = actionlib.SimpleActionServer("move_base", MoveBaseAction, auto_start=False)
        self.server.register_goal_callback(self.accept)
        self.server.register_preempt_callback(self.leave)
        if KIND == "thinks":
            hears = self.server.action_server.internal_goal_callback
            self.server.action_server.internal_goal_callback = lambda goal: (time.sleep(2.5), hears(goal))
        self.server.start()

    def clear(self, _):
        self.cleared = True
        return EmptyResponse()

    def heard(self, message):
        self.seen.add(type(message).__name__)
        self.trials += isinstance(message, PoseWithCovarianceStamped)  # the initial pose

    def accept(self):
        with self.lock:
            if KIND == "rejects":
                with self.server.lock:
                    self.server.next_goal.set_rejected(None, "")
                    self.server.new_goal = False
                return
            self.goal = self.server.accept_new_goal().target_pose
            if KIND == "aborts":
                self.goal = None
                self.server.set_aborted()

    def leave(self):
        with self.lock:
            self.goal = None
            self.server.set_preempted()

    def drive(self, pose):
        with self.lock:
            if self.goal is None or KIND in ("silent", "thinks") or self.lacks(pose.header.stamp):
                return
            if KIND == "rests" and self.trials == 2:
                return
            p, theta = pose.pose.pose.position, heading(pose.pose.pose.orientation)
            goal = self.goal.pose
            dx, dy = goal.position.x - p.x, goal.position.y - p.y
            distance = math.hypot(dx, dy)
            turn = math.remainder(
                (math.atan2(dy, dx) if distance > 0.15 else heading(goal.orientation)) - theta, math.tau
            )
            if distance < 0.15 and abs(turn) < 0.1:
                self.goal = None
                self.server.set_succeeded()
                return
            twist = Twist()
            twist.linear.x = 0.5 * max(0.0, math.cos(turn)) ** 4 * min(1.0, distance) if distance > 0.15 else 0.0
            twist.angular.z = max(-1.0, min(1.0, 1.5 * turn))
            self.count += 1
            if KIND == "nan":
                twist.linear.x = math.nan
            if KIND == "late" and self.count % 10 == 0:
                time.sleep(0.1)
            if KIND != "lost" or self.count % 10:
                self.commands[0].publish(twist)

    def lacks(self, stamp):
        """Whether something of what a stack needs has not come: all topics, both transforms, cleared costmaps, a clock."""
        self.transforms.lookup_transform("map", "laser", stamp, rospy.Duration(1.0))
        all_of_them = {"OccupancyGrid", "Odometry", "LaserScan", "PoseWithCovarianceStamped"}
        return not (self.cleared and self.seen >= all_of_them)


rospy.init_node("teleop" if KIND == "second" else "move_base", disable_signals=True)
if KIND == "second":  # commands as the first one does, and serves nothing
    commands = rospy.Publisher("cmd_vel", Twist, queue_size=10)
    rospy.Subscriber("odom", Odometry, lambda _: commands.publish(Twist()))
else:
    StandIn()
print("ready", flush=True)
threading.Event().wait()
