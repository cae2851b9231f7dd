"""`/robot_state_publisher`: link frames; those of fixed joints on `tf_static`, of moving ones on `tf`."""

from __future__ import annotations

import math

from twin.bridge.bus import Bus
from twin.bridge.msgs import (
    JointState,
    Quaternion,
    String,
    TransformStamped,
    Vector3,
    header,
)
from twin.bridge.msgs import Transform as TransformMsg
from twin.bridge.qos import LATCHED
from twin.bridge.tf import StaticTransformBroadcaster, TransformBroadcaster, transform_stamped
from twin.geometry import rotate_wxyz
from twin.models.description import Joint, RobotDescription


class _MovingFrame:
    """A joint's child frame as a function of its position, in plain floats: it is computed at every state."""

    def __init__(self, joint: Joint) -> None:
        self.parent, self.child = joint.parent, joint.child
        self._slides = joint.type == "prismatic"
        self._xyz: tuple[float, float, float] = tuple(joint.T_parent_joint.xyz.tolist())
        self._quat: tuple[float, ...] = tuple(joint.T_parent_joint.quat_wxyz.tolist())
        self._axis = joint.axis
        self._direction = rotate_wxyz(joint.T_parent_joint.quat_wxyz, joint.axis).tolist()

    def at(self, position: float) -> TransformMsg:
        """Return the frame in its parent's at `position` [rad or m]."""
        (x, y, z), (w, i, j, k) = self._xyz, self._quat
        if self._slides:
            dx, dy, dz = self._direction
            moved = Vector3(x + position * dx, y + position * dy, z + position * dz)
            return TransformMsg(moved, Quaternion(i, j, k, w))
        c, s = math.cos(position / 2.0), math.sin(position / 2.0)
        ai, aj, ak = (s * component for component in self._axis)
        turned = Quaternion(
            w * ai + i * c + j * ak - k * aj,
            w * aj - i * ak + j * c + k * ai,
            w * ak + i * aj - j * ai + k * c,
            w * c - i * ai - j * aj - k * ak,
        )
        return TransformMsg(Vector3(x, y, z), turned)


class RobotStatePublisherNode:
    """Subscribes to `joint_states`; publishes `tf`, `tf_static` and `robot_description`."""

    def __init__(
        self,
        bus: Bus,
        description: RobotDescription,
        *,
        namespace: str = "",
        publish_period_ns: int = 50_000_000,
    ) -> None:
        self.node = bus.create_node("robot_state_publisher", namespace)
        self._tf = TransformBroadcaster(self.node)
        self._period_ns = publish_period_ns
        self._window = -1
        joints = description.joints.values()
        self._frames = {joint.name: _MovingFrame(joint) for joint in joints if joint.type != "fixed"}
        self._mimics = [joint for joint in joints if joint.type != "fixed" and joint.mimic is not None]
        description_publisher = self.node.create_publisher(String, "robot_description", LATCHED)
        description_publisher.publish(String(data=description.urdf))
        StaticTransformBroadcaster(self.node).send_transform(
            transform_stamped(joint.parent, joint.child, self.node.now_ns, joint.T_parent_joint)
            for joint in joints
            if joint.type == "fixed"
        )
        self.node.create_subscription(JointState, "joint_states", self._on_joint_states, 1)

    def _on_joint_states(self, message: JointState) -> None:
        now = self.node.now_ns
        # The first state of each period: so its whole multiples, at which sensors sample, are hit exactly.
        window = now // self._period_ns
        if window == self._window:
            return
        self._window = window
        positions = dict(zip(message.name, message.position.tolist(), strict=True))
        for joint in self._mimics:
            assert joint.mimic is not None
            if joint.mimic.joint in positions:
                leader = positions[joint.mimic.joint]
                positions[joint.name] = joint.mimic.multiplier * leader + joint.mimic.offset
        self._tf.send_transform(
            TransformStamped(header(now, frame.parent), frame.child, frame.at(positions[name]))
            for name, frame in self._frames.items()
            if name in positions
        )
