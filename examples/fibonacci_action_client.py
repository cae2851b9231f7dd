"""Sends a goal: `python examples/fibonacci_action_client.py --order 10 --cancel-after 3`."""

from collections.abc import Generator

from twin.bridge import live
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionClient
from twin.bridge.bus import Bus
from twin.bridge.msgs import GoalStatus


def make(bus: Bus, *, order: int = 10, cancel_after: float = 0.0) -> Generator[None, None, None]:
    """Send a goal to /fibonacci and log what becomes of it; cancel it after some seconds if wanted."""
    node = bus.create_node("fibonacci_action_client")
    log = node.get_logger()
    client = ActionClient(node, Fibonacci, "fibonacci")
    log.info("Waiting for action server...")
    yield from client.wait_for_server()

    goal = client.send_goal(
        Fibonacci.Goal(order), lambda feedback: log.info(f"Received feedback: {feedback.sequence.tolist()}")
    )
    while goal.accepted is None:
        yield
    if not goal.accepted:
        log.info("Goal rejected :(")
        return
    log.info("Goal accepted :)")
    accepted_ns = node.now_ns
    while not goal.done:
        if cancel_after > 0.0 and node.now_ns - accepted_ns >= cancel_after * 1e9:
            cancel_after = 0.0
            log.info("Canceling goal")
            goal.cancel()
        yield
    ended = {GoalStatus.STATUS_SUCCEEDED: "Goal succeeded!", GoalStatus.STATUS_CANCELED: "Goal canceled"}
    log.info(f"{ended.get(goal.status, 'Goal failed')} Result: {goal.result.sequence.tolist()}")


if __name__ == "__main__":
    live.run(make)
