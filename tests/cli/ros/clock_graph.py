"""A /clock five hundred times as fast as time, and what goes with it: `python clock_graph.py ENDPOINT`."""

from __future__ import annotations

import sys
import threading

from twin.bridge import live
from twin.bridge.msgs import Clock, PointStamped, String, new, stamp

WALL_NS, SIM_NS = 20_000_000, 10_000_000_000
"""Of a tick."""


with live.join([], listen=[sys.argv[1]]) as process:
    node = process.bus.create_node("ticker")
    clock = node.create_publisher(Clock, "/clock", 1)
    chatter = node.create_publisher(String, "chatter")
    point = node.create_publisher(PointStamped, "point")
    lossy = node.create_publisher(String, "lossy")
    now_ns = 10_000_000_000_000

    def tick() -> None:
        global now_ns
        now_ns += SIM_NS
        clock.publish(Clock(stamp(now_ns)))
        chatter.publish(String(str(now_ns // SIM_NS)))
        message = new(PointStamped)
        message.header.stamp = stamp(now_ns - 1_000_000_000_000)
        point.publish(message)
        if lossy._sequence % 3 == 1:
            lossy._sequence += 1  # as if this one had been lost on its way
        lossy.publish(String("hi"))

    node.create_timer(WALL_NS, tick)
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(until=over.is_set)
