"""Definitions of the messages that Clearway understands: the standard ones that come with rosbags (Noetic's for ROS 1, the newest
distribution's for ROS 2), and of what these lack, by the packages' own files."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

_HEADER = "std_msgs/Header header\n"
_NAVIGATING = "geometry_msgs/PoseStamped current_pose\nbuiltin_interfaces/Duration navigation_time\n"
_AHEAD = "builtin_interfaces/Duration estimated_time_remaining\n"
_LEFT = "int16 number_of_recoveries\nfloat32 distance_remaining\n"

OWN: dict[str, tuple[str, ...]] = {
    "tf2_msgs/msg/TFMessage": ("geometry_msgs/TransformStamped[] transforms",),
    "tf/msg/tfMessage": ("geometry_msgs/TransformStamped[] transforms",),
    "move_base_msgs/msg/MoveBaseGoal": ("geometry_msgs/PoseStamped target_pose",),
    "move_base_msgs/msg/MoveBaseActionGoal": (f"{_HEADER}actionlib_msgs/GoalID goal_id\nMoveBaseGoal goal",),
    "move_base_msgs/msg/MoveBaseFeedback": ("geometry_msgs/PoseStamped base_position",),
    "move_base_msgs/msg/MoveBaseActionFeedback": (
        f"{_HEADER}actionlib_msgs/GoalStatus status\nMoveBaseFeedback feedback",
    ),
    "motion_capture_tracking_interfaces/msg/NamedPose": ("string name\ngeometry_msgs/Pose pose",),
    "motion_capture_tracking_interfaces/msg/NamedPoseArray": (f"{_HEADER}NamedPose[] poses",),
    **{
        f"{package}/msg/{name}": (text,)
        for package in ("mocap4r2_msgs", "mocap_msgs")  # the older name
        for name, text in (
            ("Marker", "int8 id_type\nint32 marker_index\nstring marker_name\ngeometry_msgs/Point translation"),
            ("Markers", f"{_HEADER}uint32 frame_number\nMarker[] markers"),
            ("RigidBody", "string rigid_body_name\nMarker[] markers\ngeometry_msgs/Pose pose"),
            ("RigidBodies", f"{_HEADER}uint32 frame_number\nRigidBody[] rigidbodies"),
        )
    },
    "vicon_receiver/msg/Position": (
        "float32 x_trans\nfloat32 y_trans\nfloat32 z_trans\nfloat32 x_rot\nfloat32 y_rot\nfloat32 z_rot\nfloat32 w\n"
        "string segment_name\nstring subject_name\nint32 frame_number\nstring translation_type",
    ),
    "people_msgs/msg/Person": (
        "string name\ngeometry_msgs/Point position\ngeometry_msgs/Point velocity\nfloat64 reliability\nstring[] tagnames\n"
        "string[] tags",
    ),
    "people_msgs/msg/People": (f"{_HEADER}Person[] people",),
    "people_msgs/msg/PositionMeasurement": (
        f"{_HEADER}string name\nstring object_id\ngeometry_msgs/Point pos\nfloat64 reliability\nfloat64[9] covariance\n"
        "byte initialization",
    ),
    "people_msgs/msg/PositionMeasurementArray": (f"{_HEADER}PositionMeasurement[] people\nfloat32[] cooccurrence",),
    "spencer_tracking_msgs/msg/TrackedPerson": (
        "uint64 track_id\nbool is_occluded\nbool is_matched\nuint64 detection_id\nduration age\n"
        "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist",
    ),
    "spencer_tracking_msgs/msg/TrackedPersons": (f"{_HEADER}TrackedPerson[] tracks",),
    "nav2_msgs/action/NavigateToPose_Feedback": (
        _NAVIGATING + _AHEAD + _LEFT,
        _NAVIGATING + _AHEAD + _LEFT + "float32 position_tracking_error\nfloat32 heading_tracking_error",
        _NAVIGATING + _LEFT,
    ),
    "nav2_msgs/action/NavigateToPose_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id\nnav2_msgs/action/NavigateToPose_Feedback feedback",
    ),
}
"""By type; several where distributions differ: Nav2's feedback of Galactic to Kilted, of those after, of Foxy."""

MOST = max(map(len, OWN.values()))


@cache
def typestore(ros1: bool, variant: int = 0) -> Typestore:
    """The definitions of ROS 1 or ROS 2, with the `variant`-th (or last) of what has several."""
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.LATEST)
    types: dict[Any, Any] = {}
    for name, texts in OWN.items():
        package = name.split("/")[0]
        known = name not in store.fielddefs and (not ros1 or package not in ("nav2_msgs",))
        if known:
            types |= get_types_from_msg(texts[min(variant, len(texts) - 1)], name)
    store.register(types)
    return store


def typestores(ros1: bool, name: str) -> tuple[Typestore, ...]:
    """Every variant of the definitions that differs for the type `name`."""
    several = 1 if ros1 or not name.startswith("nav2_msgs/") else MOST
    return tuple(typestore(ros1, i) for i in range(several))
