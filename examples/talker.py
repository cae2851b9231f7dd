"""Says Hello World on /chatter twice a second: `python examples/talker.py`."""

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.msgs import String


class Talker:
    """Publishes a text and counts."""

    def __init__(self, bus: Bus, period_s: float) -> None:
        self.node = bus.create_node("talker")
        self.publisher = self.node.create_publisher(String, "chatter", 10)
        self.node.create_timer(round(period_s * 1e9), self.on_timer)
        self.count = 0

    def on_timer(self) -> None:
        """Publish the next text."""
        message = String(f"Hello World: {self.count}")
        self.publisher.publish(message)
        self.node.get_logger().info(f'Publishing: "{message.data}"')
        self.count += 1


def make(bus: Bus, *, period: float = 0.5) -> None:
    """Say Hello World on /chatter, once in a period [s]."""
    Talker(bus, period)


if __name__ == "__main__":
    live.run(make)
