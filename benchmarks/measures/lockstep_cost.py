"""What a tick in lock-step costs, as a ratio to the same controller in process and to a bare Zenoh `get`.

`make bench` prints it. The medians are of wall time on the machine as it is: on a busy one, all three grow.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import zenoh

from tests.processes import free_endpoint
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Odometry, Twist, new
from twin.bridge.programs.factory import create_nodes
from twin.runtime.outside import Lockstep
from twin.scenario.outside import Outside

ROOT = Path(__file__).parents[2]
NODE = f"{ROOT / 'tests' / 'runtime' / 'lockstep_nodes.py'}:answering"
TICKS, WARM_UP = 2000, 200
ECHO = """
import sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("connect/endpoints", sys.argv[1])
with zenoh.open(config) as session:
    answer = bytes(56)
    queryable = session.declare_queryable("echo", lambda query: query.reply("echo", answer), complete=True)
    print("ready", flush=True)
    sys.stdin.read()
"""


def median(call: Callable[[int], None]) -> float:
    """Return the median time of a call [s]."""
    times = []
    for number in range(TICKS + WARM_UP):
        start = time.perf_counter()
        call(number)
        times.append(time.perf_counter() - start)
    return statistics.median(times[WARM_UP:])


def ticks(bus: Bus, clock: Clock, step: Callable[[], None]) -> float:
    """Return the median time [s] of: /odom published, the controller run, its /cmd_vel handled."""
    base = bus.create_node("base")
    odometry = base.create_publisher(Odometry, "odom")
    commands: list[Twist] = []
    base.create_subscription(Twist, "cmd_vel", commands.append)
    message = new(Odometry)

    def tick(number: int) -> None:
        clock.now_ns = number * 20_000_000
        odometry.publish(message)
        bus.spin()
        step()

    result = median(tick)
    bus.spin()
    assert len(commands) == TICKS + WARM_UP, "every tick has an answer"
    return result


def in_process() -> float:
    clock = Clock()
    with Bus.open(clock) as bus:
        create_nodes(bus, NODE)
        return ticks(bus, clock, lambda: None)


def lock_step() -> float:
    clock, where = Clock(), free_endpoint()
    words = [sys.executable, "-m", "twin.cli", "exec", NODE, "--lockstep", "--connect", where]
    with Bus.open(clock, listen=[where], session="twin") as bus, subprocess.Popen(words, cwd=ROOT) as child:
        lockstep = Lockstep(bus, Outside(wait_for=("/answering",), wait_timeout_s=60.0))
        result = ticks(bus, clock, lockstep.step)
        lockstep.close()
        child.wait(10)
    return result


def bare_get() -> float:
    """Return the median time [s] of a request of /odom's size and a response of /cmd_vel's."""
    where = free_endpoint()
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps([where]))
    words = [sys.executable, "-c", ECHO, json.dumps([where])]
    with (
        zenoh.open(config) as session,
        subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child,
    ):
        assert child.stdout is not None
        assert child.stdin is not None
        child.stdout.readline()
        payload = bytes(724)
        querier = session.declare_querier("echo")
        result = median(lambda _: sum(1 for _ in querier.get(payload=payload)))  # type: ignore[arg-type]
        child.stdin.close()
        child.wait(10)
    return result


def main() -> None:
    """Print one table."""
    rows = {"controller in process": in_process(), "bare get": bare_get(), "tick in lock-step": lock_step()}
    alone, get, tick = rows.values()
    print(f"{'':24}{'µs':>8}{'x in process':>14}{'x bare get':>12}")
    for name, value in rows.items():
        print(f"{name:24}{value * 1e6:8.0f}{value / alone:14.1f}{value / get:12.2f}")
    print(f"at 50 Hz lock-step costs {(tick - alone) * 50e3:.0f} ms of wall time per simulated second")


if __name__ == "__main__":
    main()
