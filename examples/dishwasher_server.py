"""Washes dishes as an action of our own type: `python examples/dishwasher_server.py`."""

from collections.abc import Generator
from pathlib import Path
from typing import Any

from twin.bridge import live, types
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus

types.add_folder(Path(__file__).parent / "interfaces")
DoDishes = types.ActionType("course_interfaces/action/DoDishes")

WASHERS = (1, 2)


class Dishwasher:
    """Says after each dish how many percent are done; what is washed when it is cancelled counts."""

    def __init__(self, bus: Bus, dishes: int, period_s: float) -> None:
        self.node = bus.create_node("dishwasher")
        self.dishes = dishes
        self.rate_hz = 1.0 / period_s
        ActionServer(self.node, DoDishes, "do_dishes", self.execute, self.on_goal, policy="queue")

    def on_goal(self, goal: Any) -> bool:
        """Accept only dishwashers that there are."""
        return goal.dishwasher_id in WASHERS

    def execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        """Wash a dish in a period."""
        log, rate = self.node.get_logger(), self.node.create_rate(self.rate_hz)
        cleaned = 0
        while cleaned < self.dishes:
            yield from rate.sleep()
            if handle.is_cancel_requested:
                handle.canceled()
                log.info(f"Stopped after {cleaned} of {self.dishes} dishes")
                break
            cleaned += 1
            handle.publish_feedback(DoDishes.Feedback(100.0 * cleaned / self.dishes))
        else:
            log.info(f"Dishwasher {handle.request.dishwasher_id} cleaned {cleaned} dishes")
        return DoDishes.Result(cleaned)


def make(bus: Bus, *, dishes: int = 20, period: float = 0.5) -> None:
    """Offer /do_dishes: so many dishes, one in a period [s]."""
    Dishwasher(bus, dishes, period)


if __name__ == "__main__":
    live.run(make)
