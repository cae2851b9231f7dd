"""Nodes with topics of every kind, for commands: `python topic_graph.py ENDPOINT`."""

from __future__ import annotations

import sys
import threading

import numpy as np

from twin.bridge import live, types
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionClient, ActionServer
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import LaserScan, PointStamped, String, Twist, stamp
from twin.bridge.qos import LATCHED, SENSOR_DATA, QoS
from twin.bridge.srvs import AddTwoInts
from twin.bridge.topics.raw_publisher import RawPublisher
from twin.bridge.types.default_values import new

types.register("course_msgs/msg/Gps", "string name\nfloat64 x\nfloat64[2] position")
Gps = types.get("course_msgs/msg/Gps")

with live.join([], listen=[sys.argv[1]]) as process:
    bus = process.bus
    talker = bus.create_node("talker")
    chatter = talker.create_publisher(String, "chatter")
    secret = talker.create_publisher(String, "_secret")
    count = 0

    def talk() -> None:
        global count
        count += 1
        chatter.publish(String(f"Hello World: {count}"))
        secret.publish(String("hidden"))

    talker.create_timer(20_000_000, talk)
    talker.create_publisher(String, "robot_description", LATCHED).publish(String("<robot/>" * 30))

    # As ROS 2's own serializer leaves a buffer.
    padded = RawPublisher(
        talker, "/padded", "std_msgs/msg/String", types.rihs01("std_msgs/msg/String"), LATCHED
    )
    padded.publish(codec(String).encode(String("whole")) + b"\xa5" * 8)

    sensors = bus.create_node("sensors", "/robot")
    scan = sensors.create_publisher(LaserScan, "scan", SENSOR_DATA)
    point = sensors.create_publisher(PointStamped, "point")
    gps = sensors.create_publisher(Gps, "gps")
    sensors.create_publisher(String, "mixed", QoS())
    promised = QoS(
        history="keep_all",
        deadline_ns=200_000_000,
        lifespan_ns=3_000_000_000,
        liveliness="manual_by_topic",
        lease_ns=1_000_000_001,
    )
    sensors.create_publisher(String, "promised", promised)
    bus.create_node("other").create_publisher(String, "/robot/mixed", SENSOR_DATA)

    def sense() -> None:
        late = stamp(sensors.now_ns - 200_000_000)
        scan.publish(new(LaserScan, range_max=8.0, ranges=np.arange(200, dtype=np.float32) / 4))
        message = new(PointStamped)
        message.header.stamp = late
        message.header.frame_id = "map"
        point.publish(message)
        gps.publish(Gps("gps", 1.5, np.array([3.0, 4.0])))

    sensors.create_timer(50_000_000, sense)

    base = bus.create_node("base", "/robot")
    heard = base.create_publisher(Twist, "heard", QoS(depth=5, durability="transient_local"))
    base.create_subscription(Twist, "cmd_vel", heard.publish)
    adder = bus.create_node("adder")
    adder.create_service(AddTwoInts, "add_two_ints", lambda r: AddTwoInts.Response(r.a + r.b))
    ActionServer(adder, Fibonacci, "fibonacci", lambda handle: iter(()))
    ActionClient(talker, Fibonacci, "fibonacci")

    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(until=over.is_set)
