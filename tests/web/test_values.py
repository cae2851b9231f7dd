from __future__ import annotations

import base64
import math

import cbor2
import numpy as np
import orjson
import pytest

from twin.bridge.msgs import (
    CompressedImage,
    Header,
    LaserScan,
    OccupancyGrid,
    PointStamped,
    Twist,
    new,
    stamp,
)
from twin.errors import BridgeError
from twin.web.rosbridge.frames import from_json, png_of, to_json
from twin.web.rosbridge.values import to_message, to_values


def test_nan_is_null_in_lists_and_alone() -> None:
    scan = new(LaserScan, range_min=math.nan, ranges=np.array([1.5, math.nan, math.inf], np.float32))
    told = orjson.loads(to_json(to_values(scan)))
    assert (told["range_min"], told["ranges"]) == (None, [1.5, None, None])
    again = to_message(LaserScan, told, 0)
    assert math.isnan(again.range_min)
    assert np.isnan(again.ranges[1])


def test_bytes_are_base64_and_other_numbers_lists() -> None:
    image = new(CompressedImage, data=np.frombuffer(b"\0\xff\x10", np.uint8))
    assert to_values(image)["data"] == base64.b64encode(b"\0\xff\x10").decode()
    assert bytes(to_message(CompressedImage, to_values(image), 0).data) == b"\0\xff\x10"
    assert bytes(to_message(CompressedImage, {"data": [0, 255, 16]}, 0).data) == b"\0\xff\x10"
    grid = new(OccupancyGrid, data=np.array([-1, 0, 100], np.int8))
    assert orjson.loads(to_json(to_values(grid)))["data"] == [-1, 0, 100]


def test_cbor_has_typed_arrays_of_rfc_8746() -> None:
    scan = new(LaserScan, ranges=np.array([1.5, -2.0], np.float32))
    tag = cbor2.loads(cbor2.dumps(to_values(scan, "cbor")))["ranges"]
    values = tag.value if isinstance(tag, cbor2.CBORTag) else tag
    assert (
        np.frombuffer(bytes(values), "<f4").tolist() == [1.5, -2.0]
        if isinstance(values, bytes)
        else [*values]
    )


@pytest.mark.parametrize(
    "given", [{}, {"stamp": {"sec": 0, "nanosec": 0}}, {"stamp": {"secs": 0, "nsecs": 0}}, None]
)
def test_a_header_without_a_time_gets_one(given: object) -> None:
    message = to_message(PointStamped, {"header": given} if given is not None else {}, 7_000_000_005)
    assert message.header.stamp == (stamp(7_000_000_005) if given is not None else stamp(0))


def test_what_clients_for_ros_1_count_in_a_header_is_passed_over() -> None:
    values = {"header": {"seq": 7, "frame_id": "base"}, "point": {"x": 1.0}}
    assert to_message(PointStamped, values, 0).header.frame_id == "base"
    with pytest.raises(BridgeError, match="no field 'seq'"):
        to_message(PointStamped, {"seq": 7}, 0)


def test_a_time_may_be_spelled_as_in_ros_1() -> None:
    message = to_message(Header, {"stamp": {"secs": 3, "nsecs": 4}, "frame_id": "map"}, 0)
    assert message == Header(stamp(3_000_000_004), "map")


def test_what_is_left_out_has_its_default() -> None:
    assert to_message(Twist, {"linear": {"x": 0.1}}, 0).linear.x == 0.1
    assert to_message(Twist, None, 0) == new(Twist)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"linear": {"q": 1}}, "Twist.linear has no field 'q'"),
        ({"linear": 5}, "linear is a geometry_msgs/msg/Vector3"),
        ({"linear": {"x": "fast"}}, "linear.x is a float64; not 'fast'"),
        ({"linear": {"x": True}}, "linear.x"),
        ([1], "is an object"),
    ],
)
def test_other_values_are_refused(values: object, words: str) -> None:
    with pytest.raises(BridgeError, match=words):
        to_message(Twist, values, 0)


def test_what_moves_has_finite_numbers() -> None:
    with pytest.raises(BridgeError, match="finite"):
        to_message(Twist, {"linear": {"x": None}}, 0, is_finite=True)


def test_a_picture_holds_the_text() -> None:
    import io

    from PIL import Image

    text = to_json({"op": "publish", "msg": "ü" * 1000})
    picture = Image.open(io.BytesIO(base64.b64decode(png_of(text))))
    assert picture.mode == "RGB"
    assert picture.tobytes().decode().rstrip("\n") == text


@pytest.mark.parametrize("text", ["", "[]", "{", "7", "nul", b"\xff\xfe", "[" * 100_000, '{"op": NaN}'])
def test_what_is_no_object_is_refused(text: str) -> None:
    with pytest.raises(BridgeError):
        from_json(text)
