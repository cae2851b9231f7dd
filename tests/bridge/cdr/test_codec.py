from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bridge.cdr import rosbags_codec
from tests.bridge.cdr.test_all_types import NAMES, messages, same
from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import String, Twist, Vector3, new

HOT = [
    "geometry_msgs/msg/PoseArray",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/Path",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/LaserScan",
    "tf2_msgs/msg/TFMessage",
]
NARROW = [name for name in NAMES if not rosbags_codec.is_wide(name)]


@settings(max_examples=120, deadline=None)
@given(st.data())
def test_rosbags_codec_writes_and_reads_the_same(data: st.DataObject) -> None:
    message = data.draw(messages(data.draw(st.sampled_from(HOT) | st.sampled_from(NARROW))))
    one = codec(type(message))
    payload = one.encode(message)
    assert payload == rosbags_codec.encode(message)
    assert same(one.decode(payload), rosbags_codec.decode(payload, type(message)))


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_big_endian_is_read(data: st.DataObject) -> None:
    message = data.draw(messages(data.draw(st.sampled_from(HOT) | st.sampled_from(NARROW))))
    assert same(codec(type(message)).decode(rosbags_codec.encode(message, little_endian=False)), message)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_a_truncated_payload_is_an_error(data: st.DataObject) -> None:
    message = data.draw(messages(data.draw(st.sampled_from(HOT) | st.sampled_from(NAMES))))
    payload = codec(type(message)).encode(message)
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(Exception):  # noqa: B017, PT011 (which one is not specified)
        codec(type(message)).decode(payload[:cut])


def test_twist_is_52_bytes() -> None:
    twist = Twist(Vector3(1.0, 2.0, 3.0), Vector3(4.0, 5.0, 6.0))
    assert codec(Twist).encode(twist) == b"\0\1\0\0" + struct.pack("<6d", 1, 2, 3, 4, 5, 6)


def test_a_wide_text_of_big_endian_is_read() -> None:
    payload = b"\0\0\0\0" + struct.pack(">3I", 2, 0xD83D, 0xDE00)
    assert codec(types.get("example_interfaces/msg/WString")).decode(payload).data == "😀"


def test_texts_of_any_length_are_not_kept_for_ever() -> None:
    from twin.bridge.cdr.layouts import Item, Layouts

    layouts = Layouts("<", (Item("s", 1, None),))
    assert [layouts[0, n].size for n in range(5000)] == list(range(5000))
    assert len(layouts) <= 1024
    for n in range(3000):
        message = new(String, data="a" * n)
        assert codec(String).decode(codec(String).encode(message)) == message
