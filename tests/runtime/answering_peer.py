"""A controller made of Zenoh and struct alone, which knows nothing of lock-step: one /cmd_vel per /odom.

Arguments: endpoint, longest sleep [s], how many to answer before it falls silent (0: all).
"""

from __future__ import annotations

import json
import queue
import random
import struct
import sys
import time

import zenoh

CMD_VEL = (
    "0/cmd_vel/geometry_msgs::msg::dds_::Twist_/"
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
)
ODOM = "0/odom/nav_msgs::msg::dds_::Odometry_/*"
GID = b"teleop-in-a-proc"


def position(data: bytes) -> float:
    """Return x: behind two texts, whose lengths and padding tell where."""
    at = 12
    for _ in range(2):
        at += -(at - 4) % 4
        at += 4 + struct.unpack_from("<I", data, at)[0]
    return float(struct.unpack_from("<d", data, at + -(at - 4) % 8)[0])


def main() -> None:
    endpoint, longest, patience = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    arrived: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    with connected(config) as session:
        session.declare_subscriber(ODOM, lambda sample: arrived.put(sample.payload.to_bytes()))
        sequence = 0
        while True:
            x = position(arrived.get())
            time.sleep(random.uniform(0.0, longest))
            sequence += 1
            if sequence == patience:
                continue
            twist = struct.pack("<4s6d", b"\0\1\0\0", 0.3 - 0.1 * x, 0.0, 0.0, 0.0, 0.0, 0.2)
            attachment = struct.pack("<qqB", sequence, time.time_ns(), 16) + GID
            session.put(CMD_VEL, twist, attachment=attachment)


def connected(config: zenoh.Config) -> zenoh.Session:
    deadline = time.monotonic() + 100
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


if __name__ == "__main__":
    main()
