"""Pictures as H.264: what is decoded of a recording is what went into it."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

from tests.drawing import needs_opengl
from tests.recording.conftest import FakeSample
from tests.recording.test_shipped_scenarios import verify
from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.errors import RecordingError
from twin.recording import player
from twin.recording.read_back import Recording, read
from twin.recording.sink import RecordingConfig, RerunSink
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario

av = pytest.importorskip("av")

TOPIC = "/camera/image_raw/compressed"
ENTITY = f"/cameras{TOPIC}"
COUNT = 25
PERIOD_NS = 100_000_000


def drawn(i: int, size: tuple[int, int] = (161, 121)) -> np.ndarray:
    """Return a picture of a square that moves over a slope."""
    width, height = size
    picture = np.zeros((height, width, 3), np.uint8)
    picture[..., 0] = np.linspace(40, 200, width)
    picture[..., 1] = np.linspace(220, 60, height)[:, None]
    picture[30:80, 4 * i : 4 * i + 40] = (250, 200, 20)
    return picture


def jpeg(pixels: np.ndarray) -> bytes:
    file = io.BytesIO()
    Pillow.fromarray(pixels).save(file, "jpeg", quality=80)
    return file.getvalue()


def recorded_of(path: Path, make_world: Any, files: list[bytes]) -> Recording:
    world, sink = make_world(), RerunSink(path, config=RecordingConfig(images="h264", images_hz=10.0))
    sink.declare(world)
    for i, file in enumerate(files):
        world.time_ns = i * PERIOD_NS
        message = new(types.get("sensor_msgs/msg/CompressedImage"))
        message.format, message.data = "rgb8; jpeg compressed bgr8", np.frombuffer(file, np.uint8)
        sink.on_sample(FakeSample(TOPIC, "sensor_msgs/msg/CompressedImage", world.time_ns, b"", message))  # type: ignore[arg-type]
        sink.on_tick(world)
    sink.close()
    return read(path)


def samples(recording: Recording, entity: str = ENTITY) -> list[bytes]:
    values = recording.column(entity, "VideoStream:sample").values
    return [np.asarray(value[0], np.uint8).tobytes() for value in values]


def decoded(packets: list[bytes]) -> list[np.ndarray]:
    decoder = av.CodecContext.create("h264", "r")
    frames = [frame for packet in packets for frame in decoder.decode(av.Packet(packet))]
    return [frame.to_ndarray(format="rgb24") for frame in (*frames, *decoder.decode(None))]


def psnr(one: np.ndarray, other: np.ndarray) -> float:
    return float(10.0 * np.log10(255.0**2 / ((one.astype(float) - other) ** 2).mean()))


def test_a_video_shows_the_pictures_and_can_be_entered_every_second(tmp_path: Path, make_world: Any) -> None:
    files = [jpeg(drawn(i)) for i in range(COUNT)]
    recording = recorded_of(tmp_path / "video.rrd", make_world, files)
    assert recording.column(ENTITY, "VideoStream:codec").values == [[int.from_bytes(b"avc1")]]
    column, keys = (recording.column(ENTITY, f"VideoStream:{name}") for name in ("sample", "is_keyframe"))
    assert column.times_ns.tolist() == [i * PERIOD_NS for i in range(COUNT)]
    assert [i for i, (key,) in enumerate(keys.values) if key] == [0, 10, 20]
    packets = samples(recording)
    assert all(packet.startswith(b"\x00\x00\x00\x01") for packet in packets)  # annex B
    frames = decoded(packets)
    assert len(frames) == COUNT
    for i, frame in enumerate(frames):
        assert frame.shape == (122, 162, 3)
        assert psnr(frame[:121, :161], np.asarray(Pillow.open(io.BytesIO(files[i])))) > 32.0
    entered = decoded(packets[10:])
    assert len(entered) == COUNT - 10
    assert (entered[0] == frames[10]).all()
    assert sum(map(len, packets)) < 0.5 * sum(map(len, files))


def test_it_is_the_same_every_time_and_only_of_pictures_that_fit(tmp_path: Path, make_world: Any) -> None:
    files = [jpeg(drawn(i)) for i in range(4)]
    odd = [files[0], b"no picture", jpeg(drawn(0, (64, 48))), *files[1:]]
    first, second = (
        samples(recorded_of(tmp_path / f"{name}.rrd", make_world, odd)) for name in ("one", "two")
    )
    assert first == second
    assert len(first) == 4


def test_without_pyav_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(RecordingError, match=r"h264 needs PyAV, .* pip install 'twin\[video\]'"):
        RerunSink(tmp_path / "none.rrd", config=RecordingConfig(images="h264"))


LOOK = {
    "name": "look",
    "duration": 1.0,
    "world": {
        "obstacles": [{"name": "crate", "size": [0.4, 0.4, 0.4], "pose": {"x": 1.5, "y": 0.2}}],
        "tags": [{"id": 3, "size": 0.16, "pose": {"x": 1.2, "z": 0.15, "yaw": 3.14}}],
    },
    "robots": [
        {"model": "diff_bot", "args": {"camera": "rgbd_camera"}, "apriltag": {"size": 0.16}},
        {"model": "jackal", "args": {"velodyne": "true"}, "pose": {"x": -2.0}},
    ],
    "checks": [{"no_collision": {}}],
}


@needs_opengl
def test_rerun_finds_no_fault_in_cameras_clouds_detections_and_a_video(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("cv2")
    digests = {}
    for images in ("jpeg", "h264"):
        scenario = Scenario.model_validate(LOOK | {"recording": {"images": images, "images_hz": 5.0}})
        run = OpenRun(scenario, out=tmp_path / images)
        run.advance()
        digests[images] = run.finish().digest
        checked = verify(tmp_path / images / "look.rrd", "--check-footers", "false")
        assert (checked.returncode, checked.stderr) == (0, "1 file verified without error.\n")
    assert digests["jpeg"] == digests["h264"]
    file = tmp_path / "h264" / "look.rrd"
    recording, entity = read(file), "/cameras/diff_bot/camera/image_raw/compressed"
    assert {entity, "/depths/diff_bot/camera/depth/image_raw"} < set(recording.entities)
    assert any("velodyne_points" in name for name in recording.entities)
    pictures = read(tmp_path / "jpeg" / "look.rrd").column(entity, "EncodedImage:blob").values
    frames = decoded(samples(recording, entity))
    assert len(frames) == len(pictures) == 6
    for frame, (file_of_one,) in zip(frames, pictures, strict=True):
        picture = np.asarray(Pillow.open(io.BytesIO(np.asarray(file_of_one, np.uint8).tobytes())))
        assert psnr(frame, picture) > 35.0
    monkeypatch.setattr(player, "which", lambda name: None)
    assert "ffmpeg" in player.unshown(file)
    assert not player.unshown(tmp_path / "jpeg" / "look.rrd")
