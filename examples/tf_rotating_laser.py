"""A laser that turns on its robot: `python examples/tf_rotating_laser.py`."""

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.geometry import Pose3


class RotatingLaser:
    """Turns by a step in each period."""

    def __init__(self, bus: Bus, period_s: float, step: float) -> None:
        self.node = bus.create_node("tf_rotating_laser")
        self.broadcaster = TransformBroadcaster(self.node)
        self.step, self.angle = step, 0.0
        self.node.create_timer(round(period_s * 1e9), self.on_timer)

    def on_timer(self) -> None:
        """Publish where the laser is now."""
        pose = Pose3.from_xyz_rpy((0.2, 0.0, 0.1), (0.0, 0.0, self.angle))
        self.broadcaster.send_transform(transform_stamped("base_link", "laser", self.node.now_ns, pose))
        self.angle += self.step


def make(bus: Bus, *, period: float = 0.1, step: float = 0.1) -> None:
    """Publish the transform from base_link to a laser that turns by a step [rad] in each period [s]."""
    RotatingLaser(bus, period, step)


if __name__ == "__main__":
    live.run(make)
