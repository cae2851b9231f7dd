from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from twin.bridge import types
from twin.bridge.messages.as_text import message_to_csv, message_to_dict, message_to_yaml
from twin.bridge.messages.from_values import message_from_dict
from twin.bridge.msgs import (
    DiagnosticStatus,
    Header,
    LaserScan,
    Odometry,
    PointStamped,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    String,
    Time,
    Twist,
    Vector3,
    new,
)
from twin.errors import BridgeError

SCAN = {"header": {"frame_id": "laser"}, "range_max": 12, "ranges": [0.1, 2, float("inf")]}


def test_yaml_is_that_of_ros2_topic_echo() -> None:
    scan = message_from_dict(LaserScan, SCAN)
    assert message_to_yaml(scan) == (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: laser\n"
        "angle_min: 0.0\nangle_max: 0.0\nangle_increment: 0.0\ntime_increment: 0.0\nscan_time: 0.0\n"
        "range_min: 0.0\nrange_max: 12.0\nranges:\n- 0.10000000149011612\n- 2.0\n- .inf\nintensities: []\n"
    )
    assert "\nranges: [0.10000000149011612, 2.0, .inf]\n" in message_to_yaml(scan, flow_style=True)
    assert message_to_yaml(scan, flow_style=True).startswith("header:\n  stamp:\n    sec: 0\n")
    assert message_to_csv(scan) == "0,0,laser,0.0,0.0,0.0,0.0,0.0,0.0,12.0,0.10000000149011612,2.0,inf,"


def test_what_is_long_is_cut_or_told_by_its_length() -> None:
    scan = message_from_dict(LaserScan, SCAN)
    assert "ranges:\n- 0.10000000149011612\n- 2.0\n- '...'\n" in message_to_yaml(scan, truncate_length=2)
    assert "frame_id: la...\n" in message_to_yaml(scan, truncate_length=2)
    assert "ranges: '<sequence type: float, length: 3>'\n" in message_to_yaml(scan, no_arr=True)
    assert "frame_id: '<string length: <5>>'\n" in message_to_yaml(scan, no_str=True)
    odometry = message_to_dict(new(Odometry), no_arr=True)
    assert odometry["pose"]["covariance"] == "<array type: double[36]>"
    assert message_to_csv(message_from_dict(String, {"data": "abcdef"}), truncate_length=3) == "abc..."


def test_a_byte_is_shown_as_rclpy_has_it() -> None:
    status = message_from_dict(DiagnosticStatus, {"level": 2, "values": [{"key": "a"}]})
    assert message_to_yaml(status) == (
        "level: \"\\x02\"\nname: ''\nmessage: ''\nhardware_id: ''\nvalues:\n- key: a\n  value: ''\n"
    )
    assert message_to_csv(status).startswith("b'\\x02',")


def test_an_empty_message_shows_nothing() -> None:
    assert message_to_yaml(new(types.get("std_msgs/msg/Empty"))) == "{}\n"


def test_fields_that_are_not_given_have_their_defaults() -> None:
    twist = message_from_dict(Twist, {"linear": {"x": 2, "y": "1e-3"}})
    assert twist.linear == Vector3(2.0, 0.001, 0.0)
    assert type(twist.linear.x) is float
    assert message_from_dict(Quaternion, {}) == message_from_dict(Quaternion, None) == new(Quaternion)
    assert message_from_dict(PoseArray, {"poses": [{}]}).poses[0].orientation.w == 1.0
    assert message_from_dict(String, {"data": 5}).data == "5"
    ranges = message_from_dict(LaserScan, {"ranges": [1, 2]}).ranges
    assert ranges.dtype == np.float32


def test_now_stamps_headers_and_times() -> None:
    stamped = message_from_dict(PoseStamped, {"header": "auto"}, now_ns=1_500_000_000)
    assert stamped.header == Header(Time(1, 500_000_000), "")
    values = {"header": {"stamp": "now", "frame_id": "map"}}
    assert message_from_dict(PointStamped, values, now_ns=2_000_000_000).header == Header(Time(2, 0), "map")
    with pytest.raises(BridgeError, match="header"):
        message_from_dict(PoseStamped, {"header": "auto"})


@pytest.mark.parametrize(
    ("typename", "values", "said"),
    [
        ("geometry_msgs/Twist", {"linear": {"y": "fast"}}, "linear.y is a float64 and cannot be 'fast'"),
        ("geometry_msgs/Twist", {"linar": {}}, "no field 'linar'; did you mean 'linear'"),
        ("geometry_msgs/Twist", {"linear": 5}, "linear is a geometry_msgs/msg/Vector3 .* fields of x, y, z"),
        ("std_msgs/Int8", {"data": 300}, "data is a int8 and cannot be 300; valid: .* -128 to 127"),
        ("std_msgs/UInt8", {"data": 1.5}, "cannot be 1.5"),
        ("std_msgs/UInt8", {"data": True}, None),
        ("std_msgs/Float32", {"data": 1e300}, "a number up to 3.4e"),
        ("std_msgs/Bool", {"data": "yes"}, "true or false"),
        ("std_msgs/String", {"data": None}, "a text"),
        ("geometry_msgs/PoseArray", {"poses": [{}, {"position": {"q": 1}}]}, r"'poses\[1\].position.q'"),
        ("sensor_msgs/LaserScan", {"ranges": 3}, "a list"),
        ("geometry_msgs/PoseWithCovariance", {"covariance": [1]}, "1 elements; valid: exactly 36"),
        ("type_description_interfaces/FieldType", {"nested_type_name": "x" * 256}, "at most 255"),
    ],
)
def test_values_that_do_not_fit_name_their_field(typename: str, values: Any, said: str | None) -> None:
    if said is None:
        message_from_dict(types.get(typename), values)
        return
    with pytest.raises(BridgeError, match=said):
        message_from_dict(types.get(typename), values)


def test_a_message_survives_the_way_over_a_dict() -> None:
    pose = new(PoseWithCovariance, covariance=np.arange(36.0))
    back = message_from_dict(PoseWithCovariance, message_to_dict(pose))
    assert np.array_equal(back.covariance, pose.covariance)
    assert back.pose == pose.pose
