"""The corners of a robot in the map: `python examples/robot_corners.py` beside static_tf_broadcaster.py."""

from collections.abc import Generator

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.tf import TransformBuffer, TransformListener

CORNERS = ((0.30, 0.45, 0.0), (0.30, -0.45, 0.0), (-0.30, -0.45, 0.0), (-0.30, 0.45, 0.0))
"""In base_link [m]."""


def make(bus: Bus) -> Generator[None, None, None]:
    """Log where the corners of the robot are in map."""
    node = bus.create_node("robot_corners")
    buffer = TransformBuffer()
    TransformListener(buffer, node)
    while not buffer.can_transform("map", "base_link"):
        yield
    for x, y, _ in buffer.lookup("map", "base_link").apply(CORNERS):
        node.get_logger().info(f"corner at ({x:.3f}, {y:.3f})")


if __name__ == "__main__":
    live.run(make)
