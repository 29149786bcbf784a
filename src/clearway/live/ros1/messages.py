"""The ROS 1 messages that are said or heard: by the standard definitions that come with rosbags, and those of move_base's action."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from clearway.live.ros.writing import Writing

_DEFINED = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "move_base_msgs/msg/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
    "move_base_msgs/msg/MoveBaseResult": "",
    "move_base_msgs/msg/MoveBaseActionGoal": (
        "Header header\nactionlib_msgs/GoalID goal_id\nmove_base_msgs/MoveBaseGoal goal"
    ),
    "move_base_msgs/msg/MoveBaseActionResult": (
        "Header header\nactionlib_msgs/GoalStatus status\nmove_base_msgs/MoveBaseResult result"
    ),
}
STORE = get_typestore(Stores.ROS1_NOETIC)
"""All of them."""
for _name, _text in _DEFINED.items():
    STORE.register(get_types_from_msg(_text, _name))
_ZERO: dict[str, Any] = {"bool": False, "string": "", "float32": 0.0, "float64": 0.0}


@cache
def message(name: str) -> Callable[..., Any]:
    """Who makes the messages of a type, such as `geometry_msgs/msg/Twist`; each field that it isn't given is zero or empty.

    Raises:
        KeyError: nobody has defined it.
    """
    made, fields = STORE.types[name], STORE.fielddefs[name][1]
    names = [field for field, _ in fields]
    zeros = {field: _zero(node, about) for field, (node, about) in fields}
    arrays = {field: dtype for field, (node, about) in fields if (dtype := _dtype(node, about)) is not None}

    def make(*values: Any, **named: Any) -> Any:
        given = dict(zip(names, values, strict=False)) | named
        for field in arrays.keys() & given.keys():
            given[field] = np.asarray(given[field], arrays[field])
        return made(**{field: given[field] if field in given else zeros[field]() for field in names})

    return make


def _zero(node: Any, about: Any) -> Callable[[], Any]:
    if node == Nodetype.NAME:
        return lambda: message(about)()
    if node == Nodetype.BASE:
        return lambda: _ZERO.get(about[0], 0)
    dtype, count = _dtype(node, about), about[1] if node == Nodetype.ARRAY else 0
    return list if dtype is None else lambda: np.zeros(count, dtype)


def _dtype(node: Any, about: Any) -> Any:
    """Of an array of numbers; None: it is something else."""
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE) and about[0][0] == Nodetype.BASE and about[0][1][0] != "string":
        return np.dtype(about[0][1][0])
    return None


@dataclass(frozen=True, slots=True)
class Kind:
    """A type of messages as nodes tell each other of it.

    Attributes:
        name: As ROS 1 writes it: `geometry_msgs/Twist`.
        md5sum: Of its definition: two nodes that have not the same one don't understand each other.
        definition: Its definition, and those of what it is made of.
    """

    name: str
    md5sum: str
    definition: str

    def packed(self, said: Any) -> bytes:
        """A message as it goes over a connection, its length before it."""
        data = STORE.serialize_ros1(said, _full(self.name))
        return struct.pack("<I", len(data)) + data

    def unpacked(self, data: bytes) -> Any:
        """A message, from what stands behind its length."""
        return STORE.deserialize_ros1(data, _full(self.name))


@cache
def kind(name: str) -> Kind:
    """That of a type, such as `geometry_msgs/msg/Twist`."""
    definition, md5sum = STORE.generate_msgdef(name, ros_version=1)
    return Kind(name.replace("/msg/", "/"), md5sum, definition)


def _full(name: str) -> str:
    return name.replace("/", "/msg/")


WRITING = Writing(message)
"""What the robot says, in them."""
