"""What other programs do on the wire, made of Zenoh alone; and how tests wait for them."""

from __future__ import annotations

import json
import socket
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import zenoh

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
STRING = "0/chatter/std_msgs::msg::dds_::String_"
ADD_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
ADD = "0/add/example_interfaces::srv::dds_::AddTwoInts_"


def free_endpoint(protocol: str = "tcp") -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"{protocol}/127.0.0.1:{probe.getsockname()[1]}"


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


def wait_for(condition: Callable[[], object], seconds: float = 15.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "nothing happened in time"
        time.sleep(0.002)


def matched(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """A publisher that somebody hears."""
    publisher = session.declare_publisher(key)
    wait_for(lambda: publisher.matching_status.matching)
    return publisher
