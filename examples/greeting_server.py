"""Greets, in a service type of our own: `python examples/greeting_server.py`."""

from pathlib import Path
from typing import Any

from twin.bridge import live, types
from twin.bridge.bus import Bus

types.add_folder(Path(__file__).parent / "interfaces")
Greeting = types.ServiceType("course_interfaces/srv/Greeting")


def make(bus: Bus) -> None:
    """Offer /greetings."""
    node = bus.create_node("greetings_server")

    def greet(request: Any) -> Any:
        node.get_logger().info(f"Request from {request.name} with age {request.age}")
        return Greeting.Response(feedback=f"Hi {request.name}. I'm server!")

    node.create_service(Greeting, "greetings", greet)


if __name__ == "__main__":
    live.run(make)
