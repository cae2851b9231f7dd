"""Adds two integers: `python examples/add_two_ints_server.py`."""

from typing import Any

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.srvs import AddTwoInts


def make(bus: Bus) -> None:
    """Offer /add_two_ints."""
    node = bus.create_node("add_two_ints_server")

    def add(request: Any) -> Any:
        node.get_logger().info(f"Incoming request: a={request.a} b={request.b}")
        return AddTwoInts.Response(sum=request.a + request.b)

    node.create_service(AddTwoInts, "add_two_ints", add)


if __name__ == "__main__":
    live.run(make)
