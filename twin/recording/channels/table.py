"""Which topics a recording shows, and how: by ROS type, or by name and type."""

from __future__ import annotations

from typing import Any

from twin.recording.channels.belief import BeliefChannel
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.clouds import CloudChannel
from twin.recording.channels.detections import BoxChannel, SolidChannel, TagChannel
from twin.recording.channels.images import DepthChannel
from twin.recording.channels.pictures import PictureChannel
from twin.recording.channels.series import (
    DocumentChannel,
    JointChannel,
    LogChannel,
    NumberChannel,
    StateChannel,
    VelocityChannel,
)
from twin.recording.channels.spatial import (
    GridChannel,
    GridUpdateChannel,
    PathChannel,
    PoseArrayChannel,
    ScanChannel,
)
from twin.recording.channels.truth import KINDS
from twin.recording.channels.voxels import VoxelChannel
from twin.recording.frames import Frames

_BY_TYPE: dict[str, type[Any]] = {
    "sensor_msgs/msg/LaserScan": ScanChannel,
    "sensor_msgs/msg/PointCloud2": CloudChannel,
    "nav_msgs/msg/OccupancyGrid": GridChannel,
    "map_msgs/msg/OccupancyGridUpdate": GridUpdateChannel,
    "nav_msgs/msg/Path": PathChannel,
    "nav2_msgs/msg/VoxelGrid": VoxelChannel,
    "geometry_msgs/msg/PoseArray": PoseArrayChannel,
    "rcl_interfaces/msg/Log": LogChannel,
    "sensor_msgs/msg/CompressedImage": PictureChannel,
    "sensor_msgs/msg/Image": DepthChannel,
    "apriltag_msgs/msg/AprilTagDetectionArray": TagChannel,
    "vision_msgs/msg/Detection2DArray": BoxChannel,
    "vision_msgs/msg/Detection3DArray": SolidChannel,
}
_BY_NAME: dict[tuple[str, str], type[Any]] = {
    ("cmd_vel", "geometry_msgs/msg/Twist"): VelocityChannel,
    ("cmd_vel", "geometry_msgs/msg/TwistStamped"): VelocityChannel,
    ("odom", "nav_msgs/msg/Odometry"): VelocityChannel,
    ("joint_states", "sensor_msgs/msg/JointState"): JointChannel,
    ("tf", "tf2_msgs/msg/TFMessage"): BeliefChannel,
    ("mission/state", "std_msgs/msg/String"): StateChannel,
    ("mission/label", "std_msgs/msg/String"): StateChannel,
    ("mirror/status", "std_msgs/msg/String"): DocumentChannel,
    ("divergence/position", "std_msgs/msg/Float64"): NumberChannel,
    ("divergence/yaw", "std_msgs/msg/Float64"): NumberChannel,
}

SHOWN_TYPES = frozenset(_BY_TYPE) | {msgtype for _, msgtype in _BY_NAME}
"""Of a message of any other type, nothing is shown."""


def open_channel(context: Context, topic: str, msgtype: str) -> Channel[Any] | None:
    """Return how a topic is drawn, or None for a topic that a recording does not show."""
    kind = KINDS[msgtype] if topic in context.truths else kind_of(context.frames, topic, msgtype)
    return None if kind is None else kind(context, context.frames.split(topic)[0], topic)


def kind_of(frames: Frames, topic: str, msgtype: str) -> type[Any] | None:
    """Return what draws a topic."""
    return _BY_TYPE.get(msgtype) or _BY_NAME.get((frames.split(topic)[1], msgtype))
