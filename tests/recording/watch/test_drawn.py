"""Markers of a graph, as Rerun has them."""

from __future__ import annotations

from typing import Any

import pytest
import rerun as rr

from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.recording.watch import markers


def marker(kind: int, *points: tuple[float, float, float], **fields: Any) -> Any:
    message = new(types.get("visualization_msgs/msg/Marker"))
    message.type, message.pose.orientation.w = kind, 1.0
    message.scale.x, message.scale.y, message.scale.z = 0.4, 0.2, 0.1
    message.color.r = message.color.a = 1.0
    point = types.get("geometry_msgs/msg/Point")
    message.points = [point(*xyz) for xyz in points]
    for name, value in fields.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize(
    ("message", "kind"),
    [
        (marker(0), rr.Arrows3D),
        (marker(0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), rr.Arrows3D),
        (marker(1), rr.Boxes3D),
        (marker(2), rr.Ellipsoids3D),
        (marker(3), rr.Cylinders3D),
        (marker(4, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), rr.LineStrips3D),
        (marker(5, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)), rr.LineStrips3D),
        (marker(6, (0.0, 0.0, 0.0)), rr.Boxes3D),
        (marker(7, (0.0, 0.0, 0.0)), rr.Ellipsoids3D),
        (marker(8, (0.0, 0.0, 0.0)), rr.Points3D),
        (marker(9, text="here"), rr.Points3D),
        (marker(11, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), rr.Mesh3D),
        (marker(10), type(None)),
    ],
)
def test_each_kind_of_marker_is_a_shape(message: Any, kind: type) -> None:
    assert isinstance(markers.drawn(message), kind)


def test_points_are_where_the_pose_takes_them() -> None:
    message = marker(8, (1.0, 0.0, 0.0))
    message.pose.position.y, message.pose.orientation.z, message.pose.orientation.w = 2.0, 1.0, 0.0
    drawn = markers.drawn(message)
    assert isinstance(drawn, rr.Points3D)
    (xyz,) = drawn.positions.as_arrow_array().to_pylist()
    assert xyz == pytest.approx([-1.0, 2.0, 0.0])
