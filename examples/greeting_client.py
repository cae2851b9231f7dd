"""Says hello to the server: `python examples/greeting_client.py HAN 20`."""

from collections.abc import Generator
from pathlib import Path

from twin.bridge import live, types
from twin.bridge.bus import Bus

types.add_folder(Path(__file__).parent / "interfaces")
Greeting = types.ServiceType("course_interfaces/srv/Greeting")


def make(bus: Bus, name: str = "HAN", age: int = 20) -> Generator[None, None, None]:
    """Say name and age on /greetings and log the answer."""
    node = bus.create_node("greetings_client")
    client = node.create_client(Greeting, "greetings")
    yield from client.wait_for_service()
    response = yield from client.call_async(Greeting.Request(name, age))
    node.get_logger().info(f"Response from server: {response.feedback}")


if __name__ == "__main__":
    live.run(make)
