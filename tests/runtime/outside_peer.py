"""A process of its own, made of Zenoh and struct alone: drives by /cmd_vel, and decodes /odom and /clock.

Arguments: endpoint, seconds to take part from the first `/clock` on. Prints one line of JSON.
"""

from __future__ import annotations

import json
import struct
import sys
import threading
import time

import zenoh

# rmw_zenoh's keys: domain/topic/type/RIHS01 hash of the type, as ROS 2 Jazzy computes it
CMD_VEL = (
    "0/cmd_vel/geometry_msgs::msg::dds_::Twist_/"
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
)
ODOM = "0/odom/nav_msgs::msg::dds_::Odometry_/*"
CLOCK = "0/clock/rosgraph_msgs::msg::dds_::Clock_/*"


def text(data: bytes, at: int) -> tuple[str, int]:
    """Return a CDR string and the offset behind it; alignment counts from behind the header of 4 bytes."""
    at += -(at - 4) % 4
    (size,) = struct.unpack_from("<I", data, at)
    return data[at + 4 : at + 3 + size].decode(), at + 4 + size


def odometry(data: bytes) -> dict[str, object]:
    sec, nanosec = struct.unpack_from("<iI", data, 4)
    frame, at = text(data, 12)
    child, at = text(data, at)
    at += -(at - 4) % 8
    x, y, z, *quaternion = struct.unpack_from("<7d", data, at)
    (vx,) = struct.unpack_from("<d", data, at + 8 * (7 + 36))
    return {
        "t": sec + nanosec * 1e-9,
        "frames": [frame, child],
        "x": x,
        "y": y,
        "z": z,
        "q": quaternion,
        "vx": vx,
    }


def main() -> None:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
    session = connected(config)
    poses: list[dict[str, object]] = []
    clocks: list[float] = []
    begun, done = threading.Event(), threading.Event()

    def on_odom(sample: zenoh.Sample) -> None:
        if not done.is_set():
            poses.append(odometry(sample.payload.to_bytes()))

    def on_clock(sample: zenoh.Sample) -> None:
        if not done.is_set():
            sec, nanosec = struct.unpack_from("<iI", sample.payload.to_bytes(), 4)
            clocks.append(sec + nanosec * 1e-9)
            begun.set()

    with session:
        session.declare_subscriber(ODOM, on_odom)
        session.declare_subscriber(CLOCK, on_clock)
        begun.wait(100)  # the run listens before it is built
        end = time.monotonic() + float(sys.argv[2])
        sequence = 0
        while time.monotonic() < end:
            sequence += 1
            payload = struct.pack("<4s6d", b"\0\1\0\0", 0.4, 0.0, 0.0, 0.0, 0.0, 0.0)
            attachment = struct.pack("<qqB", sequence, time.time_ns(), 16) + b"teleop-in-a-proc"
            session.put(CMD_VEL, payload, attachment=attachment)
            time.sleep(0.05)
        done.set()
    sys.stdout.write(
        json.dumps({"odom": [*poses[:1], *poses[-1:]], "count": len(poses), "clock": clocks}) + "\n"
    )


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
