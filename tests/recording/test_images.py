"""Images as Rerun has them, and the few depths that a recording keeps of a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr

from tests.recording.conftest import FakeSample
from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.recording.channels import images
from twin.recording.read_back import Recording, read
from twin.recording.sink import RerunSink

TOPIC = "/camera/depth/image_raw"
ENTITY = f"/depths{TOPIC}"


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
    drawn = images.drawn(image("bgr8", np.uint8([[[1, 2, 3], [4, 5, 6]]] * 2), padding=2))
    assert isinstance(drawn, rr.Image)
    assert pixels(drawn, np.uint8) == [1, 2, 3, 4, 5, 6] * 2


@pytest.mark.parametrize("big", [False, True])
def test_depths_are_of_either_byte_order(big: bool) -> None:
    drawn = images.drawn(image("16UC1", np.uint16([[1000, 2500]]), big=big))
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
        assert images.drawn(message) is None


def recording_of(path: Path, make_world: Any, messages: list[Any]) -> Recording:
    """Return a recording of images that came every 0.3 s."""
    world, sink = make_world(), RerunSink(path)
    sink.declare(world, depths=[TOPIC])
    for i, message in enumerate(messages, 1):
        world.time_ns = i * 300_000_000
        sink.on_sample(FakeSample(TOPIC, "sensor_msgs/msg/Image", world.time_ns, b"", message))  # type: ignore[arg-type]
        sink.on_tick(world)
    sink.close()
    return read(path)


def depths(recording: Recording, row: int) -> Any:
    """Return the millimetres of an image, as Rerun has them; 0 is nothing."""
    told = recording.columns[ENTITY]
    (form,) = told["DepthImage:format"].values[row]
    (buffer,) = told["DepthImage:buffer"].values[row]
    assert told["DepthImage:meter"].values[row] == [1000.0]
    return np.array(buffer, np.uint8).view(np.uint16).reshape(form["height"], form["width"])


@pytest.mark.parametrize("encoding", ["32FC1", "16UC1"])
def test_a_depth_image_a_second_is_kept_in_millimetres(
    tmp_path: Path, make_world: Any, encoding: str
) -> None:
    if encoding == "32FC1":
        pixels: Any = np.array([[0.5, np.nan, np.inf], [1.2344, 70.0, -np.inf]], np.float32)
        expected = [[500, 0, 0], [1234, 0, 0]]
    else:
        pixels, expected = np.array([[500, 0, 65535]], np.uint16), [[500, 0, 65535]]
    recording = recording_of(tmp_path / "a.rrd", make_world, [image(encoding, pixels)] * 8)
    times_ns = recording.column(ENTITY, "DepthImage:buffer").times_ns
    assert times_ns.tolist() == [300_000_000, 1_200_000_000, 2_100_000_000]
    assert depths(recording, 0).tolist() == expected


def test_of_a_large_image_every_third_pixel_is_kept(tmp_path: Path, make_world: Any) -> None:
    v, u = np.indices((360, 480))
    recording = recording_of(
        tmp_path / "a.rrd", make_world, [image("16UC1", (100 * v + u).astype(np.uint16))]
    )
    kept = depths(recording, 0)
    assert kept.shape == (120, 160)
    assert (kept[0, 0], kept[1, 2], kept[-1, -1]) == (101, 407, 35800 + 478)


def test_colours_are_kept_as_pictures_only(tmp_path: Path, make_world: Any) -> None:
    """Those are a tenth of their size."""
    message = image("rgb8", np.zeros((2, 3, 3), np.uint8))
    recording = recording_of(tmp_path / "a.rrd", make_world, [message, message])
    assert [entity for entity in recording.entities if "camera" in entity] == []
