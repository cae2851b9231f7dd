"""Says once where the robot stands in the map: `python examples/static_tf_broadcaster.py`."""

import math

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.geometry import Pose3


def make(bus: Bus, *, x: float = 2.0, y: float = 1.0, yaw_deg: float = 45.0) -> None:
    """Publish the transform from map to base_link on /tf_static: x, y [m] and yaw [degrees]."""
    node = bus.create_node("static_tf_broadcaster")
    pose = Pose3.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, math.radians(yaw_deg)))
    StaticTransformBroadcaster(node).send_transform(transform_stamped("map", "base_link", node.now_ns, pose))
    node.get_logger().info(f"base_link is in map at ({x:.2f}, {y:.2f}), turned by {yaw_deg:.0f} degrees")


if __name__ == "__main__":
    live.run(make)
