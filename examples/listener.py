"""Logs what is said on /chatter: `python examples/listener.py`."""

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.msgs import String


def make(bus: Bus) -> None:
    """Log what is said on /chatter."""
    node = bus.create_node("listener")
    log = node.get_logger()
    node.create_subscription(String, "chatter", lambda m: log.info(f'I heard: "{m.data}"'), 10)


if __name__ == "__main__":
    live.run(make)
