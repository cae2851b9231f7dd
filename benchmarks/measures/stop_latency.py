"""How long an emergency stop takes to the robot: to a zero on its topic, and to wheels that are slower.

The robot is `twin plant`, its guard `twin guard`, each in a process of its own; who presses is a third one,
and all meet on this computer.

python -m benchmarks.measures.stop_latency --times 50
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from tests.processes import free_endpoint, program, wait_for_listener
from twin.bridge import live
from twin.bridge.msgs import Odometry, Twist
from twin.live.guard.client import GuardClient
from twin.live.guard.gate import Velocity

MOST_MS = 100.0
SPEED = 0.4
_LONG_S = 60.0


def measure(times: int) -> None:
    """Press so often while it drives, and print how long each took."""
    endpoint = free_endpoint()
    with program("plant", "diff_bot_figure8", "--listen", endpoint):
        wait_for_listener(endpoint)
        with program("guard", "--robot", "diff_bot", "--connect", endpoint), live.join([endpoint]) as process:
            told, moves = press(process, times)
    for what, found in (("zero on /cmd_vel", told), ("slower by its odometry", moves)):
        spread = (
            f"median {np.median(found):.1f} ms, 95 % {np.percentile(found, 95):.1f}, largest {max(found):.1f}"
        )
        print(f"{what}: {spread} ({len(found)} times)")
    if np.median(moves) > MOST_MS:
        raise SystemExit(1)


def press(process: live.LiveBus, times: int) -> tuple[list[float], list[float]]:
    """Return how long it took to each of the two [ms]."""
    node = process.bus.create_node("operator")
    client = GuardClient(node)
    commanded: list[tuple[float, float]] = []
    driven: list[tuple[float, float]] = []

    def on_command(message: Twist) -> None:
        commanded.append((time.perf_counter(), message.linear.x))

    def on_odometry(message: Odometry) -> None:
        driven.append((time.perf_counter(), message.twist.twist.linear.x))

    node.create_subscription(Twist, "/cmd_vel", on_command, 100)
    node.create_subscription(Odometry, "/odom", on_odometry, 100)
    node.create_timer(50_000_000, lambda: client.send(Velocity(SPEED)))

    def until(condition: Callable[[], object]) -> None:
        if not process.spin(condition, _LONG_S):
            raise SystemExit("nothing happens")

    until(lambda: client.is_present and client.status is not None)
    told: list[float] = []
    moves: list[float] = []
    for _ in range(times):
        released = client.release()
        until(lambda released=released: released is None or released.is_accepted)
        until(lambda: driven and driven[-1][1] > 0.97 * SPEED)
        was = driven[-1][1]
        pressed_s = time.perf_counter()
        client.stop()

        def first(heard: list[tuple[float, float]], below: float, since_s: float = pressed_s) -> float | None:
            return next((at_s - since_s for at_s, x in heard if at_s > since_s and x < below), None)

        until(lambda was=was, first=first: first(commanded, 1e-9) and first(driven, was - 0.03))
        told.append(1e3 * (first(commanded, 1e-9) or 0.0))
        moves.append(1e3 * (first(driven, was - 0.03) or 0.0))
        until(lambda: abs(driven[-1][1]) < 0.01)
        del commanded[:], driven[:-1]
    return told, moves


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=50)
    measure(parser.parse_args().times)
