"""`/robot_state_publisher`: link frames; those of fixed joints on `tf_static`, of moving ones on `tf`."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.msgs import JointState, String
from twin.bridge.qos import LATCHED
from twin.bridge.tf import StaticTransformBroadcaster, TransformBroadcaster, transform_stamped
from twin.models.description import RobotDescription
from twin.models.kinematics import joint_motion


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
        self._joints = {joint.name: joint for joint in description.joints.values() if joint.type != "fixed"}
        self._mimics = [joint for joint in self._joints.values() if joint.mimic is not None]
        description_publisher = self.node.create_publisher(String, "robot_description", LATCHED)
        description_publisher.publish(String(data=description.urdf))
        StaticTransformBroadcaster(self.node).send_transform(
            transform_stamped(joint.parent, joint.child, self.node.now_ns, joint.T_parent_joint)
            for joint in description.joints.values()
            if joint.type == "fixed"
        )
        self.node.create_subscription(JointState, "joint_states", self._on_joint_states, 10)

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
            transform_stamped(
                joint.parent,
                joint.child,
                now,
                joint.T_parent_joint @ joint_motion(joint, positions[name]),
            )
            for name, joint in self._joints.items()
            if name in positions
        )
