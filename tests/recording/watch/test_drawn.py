"""Images and markers of a graph, as Rerun has them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import rerun as rr

from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.recording.watch import channels, markers


def image(encoding: str, pixels: Any, *, padding: int = 0, big: bool = False) -> Any:
    message = new(types.get("sensor_msgs/msg/Image"))
    message.encoding, message.height, message.width = encoding, len(pixels), len(pixels[0])
    rows = np.array(pixels).reshape(len(pixels), -1)
    data = [row.tobytes() + b"x" * padding for row in (rows.byteswap() if big else rows)]
    message.step, message.data = len(data[0]), np.frombuffer(b"".join(data), np.uint8)
    message.is_bigendian = int(big)
    return message


def pixels(drawn: Any, kind: Any) -> list[Any]:
    (buffer,) = drawn.buffer.as_arrow_array().to_pylist()
    return np.array(buffer, np.uint8).view(kind).tolist()


def test_colours_keep_their_order_and_lose_what_pads_rows() -> None:
    drawn = channels.drawn(image("bgr8", np.uint8([[[1, 2, 3], [4, 5, 6]]] * 2), padding=2))
    assert isinstance(drawn, rr.Image)
    assert pixels(drawn, np.uint8) == [1, 2, 3, 4, 5, 6] * 2


@pytest.mark.parametrize("big", [False, True])
def test_depths_are_of_either_byte_order(big: bool) -> None:
    drawn = channels.drawn(image("16UC1", np.uint16([[1000, 2500]]), big=big))
    assert isinstance(drawn, rr.DepthImage)
    assert pixels(drawn, np.uint16) == [1000, 2500]
    assert drawn.meter.as_arrow_array().to_pylist() == [1000.0]


def test_images_that_are_none_are_not_drawn() -> None:
    torn = image("rgb8", np.uint8([[[1, 2, 3]]]))
    torn.data = torn.data[:2]
    empty = image("mono8", np.uint8([[0]]))
    empty.width = empty.height = empty.step = 0
    empty.data = np.zeros(0, np.uint8)
    for message in (torn, empty, image("bayer_rggb8", np.uint8([[1, 2]]))):
        assert channels.drawn(message) is None


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
