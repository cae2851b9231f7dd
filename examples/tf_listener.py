"""Where in the map is what the laser sees: `python examples/tf_listener.py` beside the two broadcasters."""

import math

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.msgs import Point, PointStamped, header
from twin.bridge.tf import TransformBuffer, TransformError, TransformListener


class LaserPoint:
    """Takes the point 1 m ahead of the laser into the map."""

    def __init__(self, bus: Bus, period_s: float) -> None:
        self.node = bus.create_node("tf_listener")
        self.buffer = TransformBuffer()
        TransformListener(self.buffer, self.node)
        self.node.create_timer(round(period_s * 1e9), self.on_timer)

    def on_timer(self) -> None:
        """Say where the point is, by the latest transforms."""
        log = self.node.get_logger()
        point = PointStamped(header(0, "laser"), Point(1.0, 0.0, 0.0))  # time 0: the latest
        try:
            base, there = (self.buffer.transform(point, frame).point for frame in ("base_link", "map"))
        except TransformError as error:
            log.warn(f"not yet: {error}")
            return
        angle = math.degrees(math.atan2(base.y, base.x - 0.2))
        log.info(
            f"1 m ahead of the laser at {angle:.0f}° is in map ({there.x:.3f}, {there.y:.3f}, {there.z:.3f})"
        )


def make(bus: Bus, *, period: float = 1.0) -> None:
    """Log where the point 1 m ahead of the laser is in map, once in a period [s]."""
    LaserPoint(bus, period)


if __name__ == "__main__":
    live.run(make)
