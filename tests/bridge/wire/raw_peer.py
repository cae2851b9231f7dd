"""Another process, made of Zenoh and struct alone; arguments: where it connects, what it does."""

from __future__ import annotations

import json
import struct
import sys
import time

import zenoh

TWIST = (
    "0/cmd_vel/geometry_msgs::msg::dds_::Twist_/"
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
)
STRING = (
    "0/chatter/std_msgs::msg::dds_::String_/"
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
)
ADD = (
    "0/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/"
    "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
)


def attachment(sequence: int, gid: bytes = b"g" * 16) -> bytes:
    return struct.pack("<qqB", sequence, 123, 16) + gid


def twist(x: float) -> bytes:
    return struct.pack("<4s6d", b"\0\1\0\0", x, 0, 0, 0, 0, 0)


def open_session(endpoint: str) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    return zenoh.open(config)


def until_there(session: zenoh.Session, kind: str) -> None:
    deadline = time.monotonic() + 100
    while not list(session.liveliness().get(f"@ros2_lv/0/*/*/*/{kind}/**")):
        assert time.monotonic() < deadline, f"no {kind}"


def send(session: zenoh.Session) -> None:
    until_there(session, "MS")
    # Two sources; the second speaks first, and out of order.
    for sequence, gid in ((1, b"z"), (2, b"a"), (1, b"a")):
        x = sequence + (0.5 if gid == b"z" else 0.0)
        session.put(TWIST, twist(x), attachment=attachment(sequence, gid * 16))


def garbage(session: zenoh.Session) -> None:
    until_there(session, "MS")
    session.put(TWIST, twist(1.0))
    session.put(TWIST, twist(1.0), attachment=b"short")
    session.put(TWIST, b"\0\1\0\0nonsense", attachment=attachment(1))
    session.put(TWIST, b"", attachment=attachment(2))
    session.put(STRING, b"\0\1\0\0\xff\xff\xff\xff", attachment=attachment(1))
    session.put(TWIST.rpartition("/")[0] + "/RIHS01_dead", twist(1.0), attachment=attachment(3))
    session.put(TWIST.replace("::Twist_", "::Accel_"), twist(1.0), attachment=attachment(1))
    session.put(TWIST, twist(7.0), attachment=attachment(4))


def call(session: zenoh.Session) -> None:
    until_there(session, "SS")
    request = b"\0\1\0\0" + struct.pack("<qq", 20, 22)
    replies = session.get(
        ADD,
        payload=request,
        attachment=attachment(9),
        target=zenoh.QueryTarget.ALL_COMPLETE,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=10.0,
    )
    (reply,) = replies
    assert reply.ok is not None
    sequence, _, length, gid = struct.unpack("<qqB16s", reply.ok.attachment.to_bytes())
    assert (sequence, length, gid) == (9, 16, b"g" * 16)
    (total,) = struct.unpack("<4xq", reply.ok.payload.to_bytes())
    sys.stdout.write(f"{total}\n")


def listen(session: zenoh.Session) -> None:
    subscriber = session.declare_subscriber(STRING)
    sample = subscriber.recv()
    sys.stdout.write(f"{sample.payload.to_bytes().hex()} {len(sample.attachment.to_bytes())}\n")


if __name__ == "__main__":
    with open_session(sys.argv[1]) as peer:
        {"send": send, "garbage": garbage, "call": call, "listen": listen}[sys.argv[2]](peer)
