"""Some nodes to look at with commands: `python some_graph.py ENDPOINT`; it ends when its input is closed."""

from __future__ import annotations

import sys
import threading

from twin.bridge import live
from twin.bridge.msgs import String, Twist
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import AddTwoInts

with live.join([], listen=[sys.argv[1]]) as process:
    talker = process.bus.create_node("talker")
    chatter = talker.create_publisher(String, "chatter")
    talker.create_timer(50_000_000, lambda: chatter.publish(String("Hello World")))
    talker.create_publisher(String, "robot_description", LATCHED).publish(String("<robot/>"))
    base = process.bus.create_node("base", "/robot")
    base.create_subscription(Twist, "cmd_vel", lambda message: None)
    adder = process.bus.create_node("adder")
    adder.create_service(AddTwoInts, "add_two_ints", lambda r: AddTwoInts.Response(r.a + r.b))

    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(until=over.is_set)
