from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from twin.bridge.msgs import LaserScan, Point, PointStamped, String, Twist
from twin.bridge.types.default_values import new
from twin.bridge.types.fields import fields_of
from twin.cli.ros.topic.filter import compile_filter
from twin.cli.ros.topic.values import value_text
from twin.errors import BridgeError

SCAN = new(LaserScan, range_max=8.0, ranges=np.array([0.5, 2.0, 9.0], np.float32))


@pytest.mark.parametrize(
    ("message", "expression", "expected"),
    [
        (String("Hello 12"), "m.data == 'Hello 12'", True),
        (String("Hello 12"), "m.data.startswith('He') and int(m.data.split(' ')[1]) > 11", True),
        (String("Hello 12"), "'x' in m.data or not m.data", False),
        (new(PointStamped, point=Point(3.0, 4.0, 0.0)), "math.hypot(m.point.x, m.point.y) == 5", True),
        (new(PointStamped), "m.header.stamp.sec + 1 < 1", False),
        (SCAN, "any(0.4 < r < 0.6 for r in m.ranges)", True),
        (SCAN, "len([r for r in m.ranges if r > m.range_max]) == 2", False),
        (SCAN, "min(m.ranges) >= 0.5 if len(m.ranges) else False", True),
        (SCAN, "m.ranges[-1] - m.ranges[:2][1] == 7 and -m.ranges[0] < 0", True),
    ],
)
def test_what_is_understood(message: Any, expression: str, expected: bool) -> None:
    assert compile_filter(expression)(message) is expected


@pytest.mark.parametrize(
    "expression",
    [
        "__import__('os').system('true')",
        "m.__class__",
        "(lambda: 1)()",
        "open('x')",
        "[c for c in m._x]",
        "m.data.format(1)",
        "f'{m.data}'",
        "2 ** 10 ** 10",
        "(x := 1)",
        "max(m, key=len)",
        "print",
    ],
)
def test_what_is_no_filter_of_messages_is_refused(expression: str) -> None:
    with pytest.raises(BridgeError, match="--filter"):
        compile_filter(expression)(String("a"))


def test_faults_are_told() -> None:
    with pytest.raises(BridgeError, match="is no expression"):
        compile_filter("m.data ==")
    with pytest.raises(BridgeError, match="Twist has no field 'linea'; did you mean 'linear'"):
        compile_filter("m.linea.x > 0")(new(Twist))
    with pytest.raises(BridgeError, match="'>' not supported"):
        compile_filter("m.data > 3")(String("a"))
    with pytest.raises(BridgeError, match="multiplied"):
        compile_filter("'a' * 1000000000 == m.data")(String("a"))


def test_fields_are_printed_as_rclpy_holds_them() -> None:
    fields = {field.name: field for field in fields_of("sensor_msgs/msg/LaserScan")}
    assert value_text(SCAN.ranges, fields["ranges"]) == "array('f', [0.5, 2.0, 9.0])"
    assert value_text(SCAN.range_max, fields["range_max"]) == "8.0"
    (data,) = fields_of("std_msgs/msg/String")
    assert value_text("Hello", data) == "Hello"
    covariance = fields_of("geometry_msgs/msg/PoseWithCovariance")[1]
    assert value_text(np.zeros(2), covariance) == "[0. 0.]"
    points = fields_of("geometry_msgs/msg/Polygon")[0]
    assert value_text([], points) == "[]"
