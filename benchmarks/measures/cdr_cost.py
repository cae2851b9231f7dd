"""What encoding and decoding costs per type, as a ratio to a bare put of the same bytes in one process.

`make bench` prints it. It is CPU time; all three are taken in turns on the same machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import zenoh

from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import (
    Clock,
    Image,
    Imu,
    JointState,
    LaserScan,
    OccupancyGrid,
    Odometry,
    Path,
    PointCloud2,
    PoseArray,
    PoseStamped,
    String,
    TFMessage,
    TransformStamped,
    Twist,
    new,
)
from twin.bridge.wire.session import direct

ROUNDS, SECONDS = 5, 0.02


def filled(cls: type[Any], **fields: Any) -> Any:
    message = new(cls)
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def messages() -> dict[str, Any]:
    joints = 10
    return {
        "Twist": new(Twist),
        "Clock": new(Clock),
        "String": filled(String, data="hello " * 5),
        "Imu": new(Imu),
        "Odometry": new(Odometry),
        "JointState, 10 joints": filled(
            JointState,
            name=[f"joint_{n}" for n in range(joints)],
            **{field: np.zeros(joints) for field in ("position", "velocity", "effort")},
        ),
        "LaserScan, 360 rays": filled(
            LaserScan, ranges=np.ones(360, np.float32), intensities=np.ones(360, np.float32)
        ),
        "TFMessage, 20 frames": filled(TFMessage, transforms=[new(TransformStamped) for _ in range(20)]),
        "PoseArray, 500 poses": filled(PoseArray, poses=[new(PoseStamped).pose for _ in range(500)]),
        "Path, 200 poses": filled(Path, poses=[new(PoseStamped) for _ in range(200)]),
        "OccupancyGrid, 400 x 400": filled(OccupancyGrid, data=np.zeros(160_000, np.int8)),
        "Image, 640 x 480": filled(Image, data=np.zeros(640 * 480 * 3, np.uint8)),
        "PointCloud2, 1 MB": filled(PointCloud2, data=np.zeros(1_000_000, np.uint8)),
    }


def cost(call: Callable[[], Any]) -> float:
    """Return the CPU time of a call [s], the best of some rounds."""
    best = float("inf")
    for _ in range(ROUNDS):
        count, start = 0, time.process_time()
        while (spent := time.process_time() - start) < SECONDS:
            call()
            count += 1
        best = min(best, spent / count)
    return best


def main() -> None:
    """Print one table."""
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", "[]")
    print(f"{'':26}{'bytes':>9}{'put µs':>9}{'x encode':>10}{'x decode':>10}")
    with zenoh.open(config) as session:
        subscriber = session.declare_subscriber("bench", direct(lambda sample: None))
        publisher = session.declare_publisher("bench")
        for name, message in messages().items():
            how = codec(type(message))
            payload = how.encode(message)
            put = cost(lambda payload=payload: publisher.put(payload))
            encode = cost(lambda how=how, message=message: how.encode(message))
            decode = cost(lambda how=how, payload=payload: how.decode(payload))
            print(f"{name:26}{len(payload):9}{put * 1e6:9.1f}{encode / put:10.2f}{decode / put:10.2f}")
        subscriber.undeclare()


if __name__ == "__main__":
    main()
