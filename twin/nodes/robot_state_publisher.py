"""`/robot_state_publisher`: link frames; those of fixed joints on `tf_static`, of moving ones on `tf`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.msgs import (
    Header,
    JointState,
    Quaternion,
    String,
    TransformStamped,
    Vector3,
    ns,
)
from twin.bridge.msgs import Transform as TransformMsg
from twin.bridge.parameters.values import Parameter
from twin.bridge.qos import LATCHED
from twin.bridge.tf import StaticTransformBroadcaster, TransformBroadcaster, transform_stamped
from twin.errors import BridgeError, ModelError
from twin.geometry import rotate_wxyz
from twin.models.description import Joint, RobotDescription
from twin.models.loader import parse_urdf
from twin.periods import period_of

_MAX_HZ = 1000.0
_MOVING = ("continuous", "revolute", "prismatic")


class _MovingFrame:
    """A joint's child frame as a function of its position, in plain floats: it is computed at every state."""

    def __init__(self, joint: Joint) -> None:
        self.parent, self.child = joint.parent, joint.child
        self._slides = joint.type == "prismatic"
        self._xyz: tuple[float, float, float] = tuple(joint.T_parent_joint.xyz.tolist())
        self._place = Vector3(*self._xyz)
        self._quat: tuple[float, ...] = tuple(joint.T_parent_joint.quat_wxyz.tolist())
        self._axis = joint.axis
        self._direction = rotate_wxyz(joint.T_parent_joint.quat_wxyz, joint.axis).tolist()

    def at(self, position: float) -> TransformMsg:
        """Return the frame in its parent's at `position` [rad or m]."""
        w, i, j, k = self._quat
        if self._slides:
            (x, y, z), (dx, dy, dz) = self._xyz, self._direction
            moved = Vector3(x + position * dx, y + position * dy, z + position * dz)
            return TransformMsg(moved, Quaternion(i, j, k, w))
        c, s = math.cos(position / 2.0), math.sin(position / 2.0)
        ai, aj, ak = self._axis
        ai, aj, ak = s * ai, s * aj, s * ak
        turned = Quaternion(
            w * ai + i * c + j * ak - k * aj,
            w * aj - i * ak + j * c + k * ai,
            w * ak + i * aj - j * ai + k * c,
            w * c - i * ai - j * aj - k * ak,
        )
        return TransformMsg(self._place, turned)


class _Joints:
    """What is published of a robot: frames of fixed joints, and of moving ones."""

    def __init__(self, description: RobotDescription) -> None:
        joints = description.joints.values()
        self.fixed = tuple(joint for joint in joints if joint.type == "fixed")
        self.moving = {joint.name: _MovingFrame(joint) for joint in joints if joint.type in _MOVING}
        self.mimics = [(j.name, j.mimic) for j in joints if j.type in _MOVING and j.mimic is not None]
        self.followed = {*self.moving, *(mimic.joint for _, mimic in self.mimics)}
        """Whose positions matter."""


class RobotStatePublisherNode:
    """Subscribes to `joint_states`; publishes `tf`, `tf_static` and `robot_description`.

    Parameters, as those of ROS's node of this name (robot_state_publisher.cpp); they may be set at any time:
        robot_description: The robot file, URDF without xacro; one that cannot be read is refused.
        publish_frequency: At most so often is a joint's frame published [Hz]; up to 1000, default 20.
        frame_prefix: What every frame's name begins with, such as `robot/`.
        ignore_timestamp: Whether every joint state is published at once, whatever its stamp.

    Frames of planar and floating joints, which a joint state cannot tell, are left out.
    """

    def __init__(
        self,
        bus: Bus,
        description: RobotDescription,
        *,
        namespace: str = "",
        parameters: Mapping[str, Any] | None = None,
    ) -> None:
        self.node = node = bus.create_node("robot_state_publisher", namespace, parameters)
        self._source = description.source
        self._joints = _Joints(description)
        self._tf = TransformBroadcaster(node)
        self._windows: dict[str, int] = {}
        self._warned = False
        node.declare_parameter("robot_description", description.urdf)
        node.declare_parameter("publish_frequency", 20.0)
        node.declare_parameter("frame_prefix", "")
        node.declare_parameter("ignore_timestamp", False)
        self._description = node.create_publisher(String, "robot_description", LATCHED)
        self._static = StaticTransformBroadcaster(node)
        self._check_frequency(node.get_parameter("publish_frequency").value)
        self._configure()
        self._publish_description()
        self._publish_fixed()
        node.create_subscription(JointState, "joint_states", self._on_joint_states, 1, frozen=True)
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._on_changed)

    def _on_set(self, parameters: list[Parameter]) -> None:
        """Refuse what cannot be."""
        for parameter in parameters:
            if parameter.name == "publish_frequency":
                self._check_frequency(parameter.value)
            elif parameter.name == "robot_description":
                self._read(parameter.value)

    def _on_changed(self, parameters: list[Parameter]) -> None:
        self._configure()
        for parameter in parameters:
            if parameter.name == "robot_description":
                self._joints = self._read(parameter.value)
                self._publish_description()
        if {"robot_description", "frame_prefix"} & {parameter.name for parameter in parameters}:
            self._publish_fixed()

    def _read(self, urdf: str) -> _Joints:
        try:
            return _Joints(parse_urdf(urdf, self._source))
        except ModelError as error:
            raise BridgeError(f"robot_description: {error}") from error

    def _publish_description(self) -> None:
        self._description.publish(String(data=self.node.get_parameter("robot_description").value))

    def _publish_fixed(self) -> None:
        prefix, now_ns = self._prefix, self.node.now_ns
        self._static.send_transform(
            transform_stamped(prefix + joint.parent, prefix + joint.child, now_ns, joint.T_parent_joint)
            for joint in self._joints.fixed
        )

    def _configure(self) -> None:
        """Take over the parameters: to ask for them at every joint state costs more than to publish."""
        self._prefix: str = self.node.get_parameter("frame_prefix").value
        self._ignores_stamps: bool = self.node.get_parameter("ignore_timestamp").value
        frequency: float = self.node.get_parameter("publish_frequency").value
        self._period_ns = period_of(frequency)

    def _check_frequency(self, frequency: float) -> None:
        if not 0.0 < frequency <= _MAX_HZ:
            raise BridgeError(
                f"the parameter publish_frequency of {self.node.fully_qualified_name} is {frequency:g}; "
                f"valid is more than 0 and at most {_MAX_HZ:g} Hz"
            )

    def _on_joint_states(self, message: JointState) -> None:
        joints = self._joints
        if len(message.name) != len(message.position):
            if not self._warned:
                self._warned = True
                self.node.get_logger().warn(
                    f"a joint state with {len(message.name)} names and {len(message.position)} positions "
                    "was ignored (said once)"
                )
            return
        positions = {
            name: position
            for name, position in zip(message.name, message.position.tolist(), strict=True)
            if name in joints.followed and math.isfinite(position)
        }
        if not self._is_due(positions, ns(message.header.stamp)):
            return
        for name, mimic in joints.mimics:
            if mimic.joint in positions:
                positions.setdefault(name, positions[mimic.joint] * mimic.multiplier + mimic.offset)
        prefix, stamp = self._prefix, message.header.stamp
        moved = [
            TransformStamped(
                Header(stamp, prefix + frame.parent), prefix + frame.child, frame.at(positions[name])
            )
            for name, frame in joints.moving.items()
            if name in positions
        ]
        self._tf.send_transform(moved, frozen=True)

    def _is_due(self, positions: Mapping[str, float], time_ns: int) -> bool:
        """Return whether a joint is in its first state of a period.

        Periods begin at whole multiples, so that the times at which sensors sample are hit exactly. Each
        joint counts for itself, as several nodes may each publish some joints.
        """
        window = time_ns // self._period_ns
        windows = self._windows
        due = any(windows.get(name) != window for name in positions)
        if due:
            windows.update(dict.fromkeys(positions, window))
        return due or (bool(positions) and self._ignores_stamps)
