"""What other programs do on the wire, made of Zenoh alone."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from tests.processes import wait_for

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
STRING = "0/chatter/std_msgs::msg::dds_::String_"
ADD_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
ADD = "0/add/example_interfaces::srv::dds_::AddTwoInts_"


@contextmanager
def raw_session(endpoint: str, **settings: object) -> Iterator[zenoh.Session]:
    """A Zenoh client that knows nothing of ROS."""
    config = zenoh.Config()
    wanted = {
        "mode": "client",
        "scouting/multicast/enabled": False,
        "connect/endpoints": [endpoint],
        "timestamping/enabled": True,
        **settings,
    }
    for key, value in wanted.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield session


def string(text: str) -> bytes:
    data = text.encode() + b"\0"
    return b"\0\1\0\0" + struct.pack("<I", len(data)) + data


def attachment(sequence: int, gid: bytes = b"g" * 16) -> bytes:
    return struct.pack("<qqB", sequence, 123, 16) + gid


def matched(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """A publisher that somebody hears, and that waits where Zenoh's default would drop samples."""
    publisher = session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
    wait_for(lambda: publisher.matching_status.matching)
    return publisher
