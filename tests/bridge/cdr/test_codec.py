from __future__ import annotations

import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.bridge import types
from twin.bridge.cdr.codec import codec, general_codec
from twin.bridge.msgs import (
    Clock,
    Header,
    Point,
    Pose,
    PoseArray,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Twist,
    Vector3,
)

numbers = st.floats(allow_nan=False)
texts = st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=12)
times = st.builds(Time, st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))
headers = st.builds(Header, times, texts)
vectors = st.builds(Vector3, numbers, numbers, numbers)
points = st.builds(Point, numbers, numbers, numbers)
quaternions = st.builds(Quaternion, numbers, numbers, numbers, numbers)
transforms = st.builds(TransformStamped, headers, texts, st.builds(Transform, vectors, quaternions))
messages = st.one_of(
    st.builds(Twist, vectors, vectors),
    st.builds(Clock, times),
    st.builds(TFMessage, st.lists(transforms, max_size=4)),
    st.builds(PoseArray, headers, st.lists(st.builds(Pose, points, quaternions), max_size=4)),
)


@given(messages)
def test_fast_paths_equal_the_general_codec(message: Any) -> None:
    fast, general = codec(type(message)), general_codec(type(message))
    payload = general.encode(message)
    assert fast.encode(message) == payload
    assert fast.decode(payload) == general.decode(payload) == message


@given(messages)
def test_big_endian_is_read(message: Any) -> None:
    name = message.__msgtype__
    payload = bytes(types.store.serialize_cdr(message, name, little_endian=False))
    assert codec(type(message)).decode(payload) == message


def test_twist_is_52_bytes() -> None:
    twist = Twist(Vector3(1.0, 2.0, 3.0), Vector3(4.0, 5.0, 6.0))
    assert codec(Twist).encode(twist) == b"\0\1\0\0" + struct.pack("<6d", 1, 2, 3, 4, 5, 6)


@given(messages, st.integers(0, 200))
def test_a_truncated_payload_is_an_error(message: Any, cut: int) -> None:
    payload = codec(type(message)).encode(message)
    with pytest.raises(Exception):  # noqa: B017, PT011 (which one is not specified)
        codec(type(message)).decode(payload[: min(cut, len(payload) - 4)])
