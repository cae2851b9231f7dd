"""Computes the distance of positions from the origin: `python examples/gps_subscriber.py`."""

import math
from pathlib import Path
from typing import Any

from twin.bridge import live, types
from twin.bridge.bus import Bus

types.add_folder(Path(__file__).parent / "interfaces")
Gps = types.get("course_interfaces/msg/Gps")


def make(bus: Bus) -> None:
    """Log how far the positions on /gps_info are from the origin."""
    node = bus.create_node("gps_subscriber")

    def on_gps(message: Any) -> None:
        distance = math.hypot(message.x, message.y)
        node.get_logger().info(f"Listener: distance to the origin = {distance:.6f}, state = {message.state}")

    node.create_subscription(Gps, "gps_info", on_gps, 10)


if __name__ == "__main__":
    live.run(make)
