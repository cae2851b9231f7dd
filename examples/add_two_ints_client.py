"""Asks for a sum: `python examples/add_two_ints_client.py 2 3`."""

from collections.abc import Generator

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.srvs import AddTwoInts


def make(bus: Bus, a: int, b: int) -> Generator[None, None, None]:
    """Ask /add_two_ints for a + b and log the answer."""
    node = bus.create_node("add_two_ints_client")
    client = node.create_client(AddTwoInts, "add_two_ints")
    while not (yield from client.wait_for_service(timeout_ns=1_000_000_000)):
        node.get_logger().info("service not available, waiting again...")
    response = yield from client.call_async(AddTwoInts.Request(a, b))
    node.get_logger().info(f"Result of add_two_ints: {a} + {b} = {response.sum}")


if __name__ == "__main__":
    live.run(make)
