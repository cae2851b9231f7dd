"""A wave of points on /wave, coloured on /coloured_wave: `python examples/cloud_publisher.py`."""

import numpy as np

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.msgs import PointCloud2, header
from twin.bridge.point_cloud2 import cloud_of, create_cloud_xyz32

X, Y = np.meshgrid(np.linspace(-1.0, 1.0, 41), np.linspace(-1.0, 1.0, 41))
"""Of the points [m]."""


class CloudPublisher:
    """Publishes the same surface in two ways that a cloud can be made."""

    def __init__(self, bus: Bus, period_s: float, frame: str) -> None:
        self.node = bus.create_node("cloud_publisher")
        self.plain = self.node.create_publisher(PointCloud2, "wave", 10)
        self.coloured = self.node.create_publisher(PointCloud2, "coloured_wave", 10)
        self.node.create_timer(round(period_s * 1e9), self.on_timer)
        self.frame = frame

    def on_timer(self) -> None:
        """Publish the wave as it is now."""
        now = self.node.now_ns
        z = 0.2 * np.sin(4.0 * np.hypot(X, Y) - 2.0 * now * 1e-9)
        stamped = header(now, self.frame)
        # Numbers of shape (n, 3) are x, y, z.
        self.plain.publish(create_cloud_xyz32(stamped, np.column_stack((X.ravel(), Y.ravel(), z.ravel()))))
        # The fields of an array are those of the cloud; two dimensions make it organised, as an image is.
        points = np.zeros(X.shape, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("rgb", "u4")])
        points["x"], points["y"], points["z"] = X, Y, z
        red = np.rint(255.0 * (z + 0.2) / 0.4).astype(np.uint32)
        points["rgb"] = red << 16 | (255 - red)
        self.coloured.publish(cloud_of(stamped, points))
        self.node.get_logger().info(f"Publishing {points.size} points in '{self.frame}'")


def make(bus: Bus, *, period: float = 0.2, frame: str = "map") -> None:
    """Publish a wave on /wave and /coloured_wave, once in a period [s], in a frame."""
    CloudPublisher(bus, period, frame)


if __name__ == "__main__":
    live.run(make)
