"""Has dishes washed: `python examples/dishwasher_client.py --dishwasher 1 --cancel-at 50`."""

from collections.abc import Generator
from pathlib import Path

from twin.bridge import live, types
from twin.bridge.actions import ActionClient
from twin.bridge.bus import Bus
from twin.bridge.msgs import GoalStatus

types.add_folder(Path(__file__).parent / "interfaces")
DoDishes = types.ActionType("course_interfaces/action/DoDishes")


def make(bus: Bus, *, dishwasher: int = 1, cancel_at: float = 0.0) -> Generator[None, None, None]:
    """Send a goal to /do_dishes and log how far it is; cancel it at so many percent if wanted."""
    node = bus.create_node("dishwasher_client")
    log = node.get_logger()
    client = ActionClient(node, DoDishes, "do_dishes")
    yield from client.wait_for_server()

    percents: list[float] = []
    goal = client.send_goal(DoDishes.Goal(dishwasher), lambda news: percents.append(news.percent_complete))
    while not goal.done:
        if percents:
            percent = percents.pop(0)
            log.info(f"{percent:.0f} % complete")
            if 0.0 < cancel_at <= percent:
                cancel_at = 0.0
                goal.cancel()
        yield
    if not goal.accepted:
        log.info(f"There is no dishwasher {dishwasher}")
        return
    how = "Cancelled" if goal.status == GoalStatus.STATUS_CANCELED else "Done"
    log.info(f"{how}: {goal.result.total_dishes_cleaned} dishes are clean")


if __name__ == "__main__":
    live.run(make)
