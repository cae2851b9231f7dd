"""`/velocity_smoother`: `cmd_vel_nav` in, `cmd_vel_smoothed` out, as in Nav2."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.controllers.velocity_smoother import VelocitySmoother, VelocitySmootherConfig
from twin.nodes.node_parameters import declare_config


class VelocitySmootherNode:
    """Publishes at a fixed rate while there is something to follow or to bring to rest."""

    def __init__(
        self, bus: Bus, config: VelocitySmootherConfig, *, period_ns: int = 20_000_000, namespace: str = ""
    ) -> None:
        self.node = bus.create_node("velocity_smoother", namespace)
        self.smoother = VelocitySmoother(config)
        declare_config(self.node, config)
        self._period_s = period_ns * 1e-9
        self._publisher = self.node.create_publisher(Twist, "cmd_vel_smoothed", 10)
        self.node.create_subscription(Twist, "cmd_vel_nav", self._on_twist, 10, frozen=True)
        self.node.create_timer(period_ns, self._update)

    def _on_twist(self, message: Twist) -> None:
        if not self.smoother.set_command(message.linear.x, message.angular.z):
            self.node.get_logger().error("cmd_vel_nav refused: velocities must be finite")

    def _update(self) -> None:
        if self.smoother.idle:
            return
        command = twist_from_planar(*self.smoother.update(self._period_s))
        self._publisher.publish(command, frozen=True)
