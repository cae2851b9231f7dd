"""What was found in pictures is drawn over them: once for each picture that is kept, of its own camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.recording.conftest import FakeSample
from twin.bridge import types
from twin.bridge.msgs import header
from twin.bridge.types.default_values import new
from twin.recording.read_back import Recording, read
from twin.recording.sink import RerunSink

PICTURES = "/camera/image_raw/compressed"
TAGS, BOXES = "apriltag_msgs/msg/AprilTagDetectionArray", "vision_msgs/msg/Detection2DArray"


def message(kind: str, time_ns: int, frame: str, *detections: Any) -> Any:
    made = new(types.get(kind))
    made.header = header(time_ns, frame)
    made.detections = list(detections)
    return made


def picture(time_ns: int, frame: str) -> Any:
    made = new(types.get("sensor_msgs/msg/CompressedImage"))
    made.header, made.format, made.data = header(time_ns, frame), "rgb8; jpeg", np.zeros(4, np.uint8)
    return made


def tag(number: int, *corners: tuple[float, float]) -> Any:
    made = new(types.get("apriltag_msgs/msg/AprilTagDetection"))
    made.family, made.id = "tag36h11", number
    for point, (x, y) in zip(made.corners, corners, strict=True):
        point.x, point.y = x, y
    return made


def box(name: str, x: float, y: float, width: float, height: float, theta: float = 0.0) -> Any:
    made = new(types.get("vision_msgs/msg/Detection2D"))
    made.id, made.bbox.size_x, made.bbox.size_y = name, width, height
    made.bbox.center.position.x, made.bbox.center.position.y, made.bbox.center.theta = x, y, theta
    return made


SQUARE = ((10.0, 40.0), (40.0, 40.0), (40.0, 10.0), (10.0, 10.0))


def recording_of(path: Path, make_world: Any, topic: str, kind: str, *found: list[Any]) -> Recording:
    """Return a recording of pictures and of what was found in them, one of each every 0.5 s."""
    world, sink = make_world(), RerunSink(path)
    sink.declare(world)
    for i, detections in enumerate(found, 1):
        world.time_ns = i * 500_000_000
        seen = picture(world.time_ns, "eye")
        sink.on_sample(FakeSample(PICTURES, "sensor_msgs/msg/CompressedImage", world.time_ns, b"", seen))  # type: ignore[arg-type]
        told = message(kind, world.time_ns, "eye", *detections)
        sink.on_sample(FakeSample(topic, kind, world.time_ns + 20_000_000, b"", told))  # type: ignore[arg-type]
        sink.on_tick(world)
    sink.close()
    return read(path)


def test_tags_are_outlined_and_named_in_the_pictures_that_are_kept(tmp_path: Path, make_world: Any) -> None:
    found = [[tag(3, *SQUARE), tag(7, *SQUARE)], [tag(9, *SQUARE)], [tag(1, *SQUARE)], []]
    recording = recording_of(tmp_path / "a.rrd", make_world, "/detections", TAGS, *found)
    entity = f"/cameras{PICTURES}/detections"
    names = recording.column(entity, "LineStrips2D:labels")
    assert names.times_ns.tolist() == [520_000_000, 1_020_000_000, 2_020_000_000], (
        "one picture a second is kept"
    )
    assert [list(each) for each in names.values] == [["tag36h11:3", "tag36h11:7"], ["tag36h11:9"], []]


@pytest.mark.parametrize("theta", [0.0, np.pi / 2])
def test_boxes_lie_where_they_are_found(tmp_path: Path, make_world: Any, theta: float) -> None:
    found = [[box("tote", 50.0, 20.0, 30.0, 10.0, theta)]]
    recording = recording_of(tmp_path / "a.rrd", make_world, "/boxes", BOXES, *found)
    ((strip,),) = recording.column(f"/cameras{PICTURES}/boxes", "LineStrips2D:strips").values
    low, high = np.min(strip, axis=0), np.max(strip, axis=0)
    half = (15.0, 5.0) if theta == 0.0 else (5.0, 15.0)
    assert np.allclose(low, np.subtract((50.0, 20.0), half), atol=1e-4)
    assert np.allclose(high, np.add((50.0, 20.0), half), atol=1e-4)
    assert np.allclose(strip[0], strip[-1])


def test_boxes_in_space_have_their_place_and_size(tmp_path: Path, make_world: Any) -> None:
    kind = "vision_msgs/msg/Detection3DArray"
    crate = new(types.get("vision_msgs/msg/Detection3D"))
    crate.bbox.center.position.x, crate.bbox.center.position.z = 1.0, 0.5
    crate.bbox.size.x, crate.bbox.size.y, crate.bbox.size.z = 0.2, 0.4, 0.6
    world, sink = make_world(), RerunSink(tmp_path / "a.rrd")
    sink.declare(world)
    for world.time_ns, detections in ((100_000_000, [crate]), (200_000_000, [])):
        told = message(kind, world.time_ns, "odom", *detections)
        sink.on_sample(FakeSample("/crates", kind, world.time_ns, b"", told))  # type: ignore[arg-type]
    sink.on_tick(world)
    sink.close()
    recording = read(tmp_path / "a.rrd")
    centres, halves = (
        recording.column("/ros/crates", f"Boxes3D:{name}") for name in ("centers", "half_sizes")
    )
    assert np.allclose(centres.values[0], [(1.0, 0.0, 0.5)])
    assert np.allclose(halves.values[0], [(0.1, 0.2, 0.3)])
    assert len(centres.values[1]) == 0


def test_what_another_camera_sees_is_not_drawn_over_this_ones_pictures(
    tmp_path: Path, make_world: Any
) -> None:
    world, sink = make_world(), RerunSink(tmp_path / "a.rrd")
    sink.declare(world)
    seen = picture(0, "eye")
    sink.on_sample(FakeSample(PICTURES, "sensor_msgs/msg/CompressedImage", 0, b"", seen))  # type: ignore[arg-type]
    told = message(TAGS, 0, "other_eye", tag(3, *SQUARE))
    sink.on_sample(FakeSample("/detections", TAGS, 0, b"", told))  # type: ignore[arg-type]
    sink.on_tick(world)
    sink.close()
    assert not [each for each in read(tmp_path / "a.rrd").entities if each.endswith("detections")]
