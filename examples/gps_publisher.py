"""Publishes positions in a message type of our own: `python examples/gps_publisher.py`."""

from pathlib import Path

from twin.bridge import live, types
from twin.bridge.bus import Bus

types.add_folder(Path(__file__).parent / "interfaces")
Gps = types.get("course_interfaces/msg/Gps")


class GpsPublisher:
    """Moves away from the origin, and says where it is."""

    def __init__(self, bus: Bus, period_s: float) -> None:
        self.node = bus.create_node("gps_publisher")
        self.publisher = self.node.create_publisher(Gps, "gps_info", 10)
        self.node.create_timer(round(period_s * 1e9), self.on_timer)
        self.x, self.y = 1.0, 1.0

    def on_timer(self) -> None:
        """Publish the next position."""
        self.x *= 1.03
        self.y *= 1.01
        self.publisher.publish(Gps(x=self.x, y=self.y, state="working"))
        self.node.get_logger().info(f"Talker: GPS: x = {self.x:.6f}, y = {self.y:.6f}")


def make(bus: Bus, *, period: float = 1.0) -> None:
    """Publish positions on /gps_info, once in a period [s]."""
    GpsPublisher(bus, period)


if __name__ == "__main__":
    live.run(make)
