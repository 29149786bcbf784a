"""The ROS 2 messages that are said or heard, as classes that write and read themselves as CDR.

They are made from the standard definitions that come with rosbags, and from those of Nav2's action and of a request's head, which
stand here. Every field is zero, empty or false by default.
"""

from __future__ import annotations

import types
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from clearway.live.ros.writing import Writing

SEND_GOAL, GET_RESULT = "nav2_msgs/action/NavigateToPose_SendGoal", "nav2_msgs/action/NavigateToPose_GetResult"
CANCEL_GOAL = "action_msgs/srv/CancelGoal"
"""The services that the action is made of: their types."""
_DEFINED = {
    # What rmw_cyclonedds puts before a request and its reply: who asked (its writer's handle), and its how manieth it is.
    "clearway/msg/RequestId": "uint64 guid\nint64 seq",
    f"{SEND_GOAL}_Request": "unique_identifier_msgs/UUID goal_id\ngeometry_msgs/PoseStamped pose\nstring behavior_tree",
    f"{SEND_GOAL}_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    f"{GET_RESULT}_Request": "unique_identifier_msgs/UUID goal_id",
    # What stands behind the status differs between ROS 2's distributions, and is not read.
    f"{GET_RESULT}_Response": "int8 status",
    f"{CANCEL_GOAL}_Request": "action_msgs/GoalInfo goal_info",
    f"{CANCEL_GOAL}_Response": "int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
}
STORE = get_typestore(Stores.ROS2_JAZZY)
"""All of them."""
for _name, _text in _DEFINED.items():
    (_fields,) = get_types_from_msg(_text, _name).values()  # it would name a service's as a message's
    STORE.register({_name: _fields})
_ZERO: dict[str, Any] = {"bool": False, "string": "", "float32": 0.0, "float64": 0.0}


@cache
def message(name: str, *before: tuple[str, Any]) -> Any:
    """The class of the messages of a ROS type, such as `geometry_msgs/msg/Twist`, with the fields of its definition.

    Args:
        name: Of the type.
        before: Fields that stand before those, each with its class.

    Raises:
        KeyError: nobody has defined it.
    """
    space: dict[str, Any] = {"__annotations__": dict(before), "__module__": __name__}
    for attribute, (node, about) in STORE.fielddefs[name][1]:
        space["__annotations__"][attribute], space[attribute] = _field(node, about)
    package, kind, plain = name.split("/")
    made = types.new_class(
        plain, (IdlStruct,), {"typename": f"{package}.{kind}.dds_.{plain}_"}, lambda ns: ns.update(space)
    )
    return dataclass(made)


def _field(node: Any, about: Any) -> tuple[Any, Any]:
    """What DDS takes for a field, and the field's default."""
    if node == Nodetype.NAME:
        inner = message(about)
        return inner, field(default_factory=inner)
    if node == Nodetype.BASE:
        return _base(about[0]), field(default=_ZERO.get(about[0], 0))
    element, count = about
    inner, default = _field(*element)
    if node == Nodetype.ARRAY:
        return idl.array[inner, count], field(default_factory=lambda: [default.default] * count)
    return idl.sequence[inner], field(default_factory=list)


def _base(name: str) -> Any:
    return {"bool": bool, "string": str}.get(name) or getattr(idl, name)


def type_hash(name: str) -> str:
    """The hash of a topic's type, as REP-2016 has it."""
    return str(STORE.hash_rihs01(name))


Time = message("builtin_interfaces/msg/Time")
Header = message("std_msgs/msg/Header")
Clock = message("rosgraph_msgs/msg/Clock")
Vector3 = message("geometry_msgs/msg/Vector3")
PoseStamped = message("geometry_msgs/msg/PoseStamped")
PoseWithCovarianceStamped = message("geometry_msgs/msg/PoseWithCovarianceStamped")
Twist = message("geometry_msgs/msg/Twist")
TwistStamped = message("geometry_msgs/msg/TwistStamped")
LaserScan = message("sensor_msgs/msg/LaserScan")
UUID = message("unique_identifier_msgs/msg/UUID")
GoalInfo = message("action_msgs/msg/GoalInfo")
SendGoalRequest, SendGoalReply = message(f"{SEND_GOAL}_Request"), message(f"{SEND_GOAL}_Response")
GetResultRequest, GetResultReply = message(f"{GET_RESULT}_Request"), message(f"{GET_RESULT}_Response")
CancelRequest, CancelReply = message(f"{CANCEL_GOAL}_Request"), message(f"{CANCEL_GOAL}_Response")

WRITING = Writing(message)
"""What the robot says, in them."""
