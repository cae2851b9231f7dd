"""Small bags for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import LaserScan, String, TFMessage, header, new
from twin.bridge.qos import LATCHED, SENSOR_DATA, QoS
from twin.bridge.tf import transform_stamped
from twin.geometry import Pose2, Pose3

PERIOD_NS = 100_000_000
COUNT = 30

TOPICS = {
    "/scan": (LaserScan, SENSOR_DATA),
    "/chatter": (String, QoS(depth=7)),
    "/tf_static": (TFMessage, LATCHED),
}


def scan(number: int) -> LaserScan:
    message = new(LaserScan)
    message.header = header(number * PERIOD_NS, "lidar")
    message.ranges = np.arange(90, dtype=np.float32) + number
    return message


def messages(count: int = COUNT) -> list[tuple[str, Any, int]]:
    """Return (topic, message, time [ns]) in order."""
    static = TFMessage([transform_stamped("base", "lidar", 0, Pose3.from_pose2(Pose2(0.1, 0.0, 3.1)))])
    found: list[tuple[str, Any, int]] = [("/tf_static", static, 0)]
    for number in range(count):
        found.append(("/scan", scan(number), number * PERIOD_NS))
        found.append(("/chatter", String(f"Hello World: {number}"), number * PERIOD_NS + 1))
    return found


def fill(writer: BagWriter, count: int = COUNT, start_ns: int = 0) -> None:
    for name, (cls, qos) in TOPICS.items():
        writer.add_topic(BagTopic(name=name, type=cls.__msgtype__, qos=(OfferedQoS.of(qos),)))
    for sequence, (topic, message, time_ns) in enumerate(messages(count), 1):
        data = codec(type(message)).encode(message)
        writer.write(BagMessage(topic, data, start_ns + time_ns, start_ns + time_ns, sequence))


def make_bag(folder: Path, count: int = COUNT, start_ns: int = 0, **config: Any) -> Path:
    with BagWriter(folder, BagConfig(**config)) as writer:
        fill(writer, count, start_ns)
    return folder
