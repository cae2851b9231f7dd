"""The packed codecs of control-rate messages against rosbags' general one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.bridge.cdr.codec import codec, general_codec
from twin.bridge.msgs import (
    Header,
    Imu,
    JointState,
    LaserScan,
    Odometry,
    Path,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from twin.bridge.srvs import IsPathValid
from twin.errors import BridgeError

numbers = st.floats(allow_nan=False)
texts = st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=12)
headers = st.builds(
    Header, st.builds(Time, st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1)), texts
)
vectors = st.builds(Vector3, numbers, numbers, numbers)
points = st.builds(Point, numbers, numbers, numbers)
quaternions = st.builds(Quaternion, numbers, numbers, numbers, numbers)


def arrays(length: int) -> st.SearchStrategy[Any]:
    return st.lists(numbers, min_size=length, max_size=length).map(np.array)


lists = st.lists(numbers, max_size=5).map(lambda values: np.array(values, dtype=np.float64))
paths = st.builds(
    Path,
    headers,
    st.lists(st.builds(PoseStamped, headers, st.builds(Pose, points, quaternions)), max_size=4),
)
floats = st.floats(width=32, allow_nan=False)
float_lists = st.lists(floats, max_size=5).map(lambda values: np.array(values, dtype=np.float32))
messages = st.one_of(
    st.builds(LaserScan, headers, *[floats] * 7, float_lists, float_lists),
    st.builds(
        Odometry,
        headers,
        texts,
        st.builds(PoseWithCovariance, st.builds(Pose, points, quaternions), arrays(36)),
        st.builds(TwistWithCovariance, st.builds(Twist, vectors, vectors), arrays(36)),
    ),
    st.builds(Imu, headers, quaternions, arrays(9), vectors, arrays(9), vectors, arrays(9)),
    paths,
    st.builds(IsPathValid.Request, paths),
    st.builds(JointState, headers, st.lists(texts, max_size=4), lists, lists, lists),
)


@given(messages)
def test_bytes_equal_the_general_codec_both_ways(message: Any) -> None:
    fast, general = codec(type(message)), general_codec(type(message))
    payload = general.encode(message)
    assert fast.encode(message) == payload
    assert general.encode(fast.decode(payload)) == payload


@given(messages, st.data())
def test_truncated_payloads_are_refused(message: Any, data: st.DataObject) -> None:
    payload = codec(type(message)).encode(message)
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(Exception):  # noqa: B017, PT011 - which one is not specified
        codec(type(message)).decode(payload[:cut])


def test_a_covariance_of_the_wrong_size_is_refused() -> None:
    zero = Vector3(0.0, 0.0, 0.0)
    message = Imu(
        Header(Time(0, 0), "imu"),
        Quaternion(0.0, 0.0, 0.0, 1.0),
        np.zeros(8),
        zero,
        np.zeros(9),
        zero,
        np.zeros(9),
    )
    with pytest.raises(BridgeError, match="orientation_covariance has 8 elements; valid: exactly 9"):
        codec(Imu).encode(message)


def test_a_scan_of_double_numbers_is_sent_in_single_precision() -> None:
    ranges = np.array([0.1, 2.5])
    message = LaserScan(Header(Time(0, 0), "lidar"), *[0.0] * 7, ranges, np.zeros(0))
    decoded = codec(LaserScan).decode(codec(LaserScan).encode(message))
    np.testing.assert_array_equal(decoded.ranges, ranges.astype(np.float32))
