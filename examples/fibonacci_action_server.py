"""Computes Fibonacci numbers as an action: `python examples/fibonacci_action_server.py`."""

from collections.abc import Generator
from typing import Any

import numpy as np

from twin.bridge import live
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus


class FibonacciServer:
    """Sends the sequence so far as feedback, can be cancelled, rejects orders that are not positive."""

    def __init__(self, bus: Bus, period_s: float) -> None:
        self.node = bus.create_node("fibonacci_action_server")
        self.rate_hz = 1.0 / period_s
        ActionServer(self.node, Fibonacci, "fibonacci", self.execute, goal_callback=self.on_goal)

    def on_goal(self, goal: Any) -> bool:
        """Accept or reject."""
        self.node.get_logger().info(f"Received goal request with order {goal.order}")
        return goal.order > 0

    def execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        """Compute one number in a period."""
        log, rate = self.node.get_logger(), self.node.create_rate(self.rate_hz)
        log.info("Executing goal...")
        sequence = [0, 1]
        while len(sequence) <= handle.request.order:
            if handle.is_cancel_requested:
                handle.canceled()
                log.info("Goal canceled")
                break
            sequence.append(sequence[-1] + sequence[-2])
            log.info(f"Feedback: {sequence}")
            handle.publish_feedback(Fibonacci.Feedback(np.array(sequence, np.int32)))
            yield from rate.sleep()
        else:
            log.info("Goal succeeded")
        return Fibonacci.Result(np.array(sequence, np.int32))


def make(bus: Bus, *, period: float = 1.0) -> None:
    """Offer /fibonacci, with feedback once in a period [s]."""
    FibonacciServer(bus, period)


if __name__ == "__main__":
    live.run(make)
