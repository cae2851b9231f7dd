"""A run publishes what its cameras see, to whom it may concern, and is the same run whoever looks."""

from __future__ import annotations

import ctypes.util
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

from tests.drawing import needs_opengl
from twin.errors import SimulationError
from twin.nodes.cameras.messages import compressed_depth
from twin.recording.read_back import read
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Images

Load = Callable[[str], Scenario]
TOPICS = (
    "camera/image_raw",
    "camera/camera_info",
    "camera/image_raw/compressed",
    "camera/depth/image_raw",
    "camera/depth/camera_info",
    "camera/depth/points",
)


def text(more: str = "", kind: str = "rgbd_camera") -> str:
    return (
        "name: look\nseed: 3\nduration: 0.32 s\n"
        "world: {obstacles: [{name: crate, size: [0.4, 0.4, 0.4], pose: {x: 1.5, y: 0.2}}]}\n"
        f"robots: [{{model: diff_bot, args: {{camera: {kind}}}{more}}}]\n"
        "checks: [{no_collision: {}}]\n"
    )


class Audience:
    """Wants what cameras make, and keeps it."""

    def __init__(self, run: OpenRun, *topics: str) -> None:
        self.heard: dict[str, list[Any]] = {}
        self._topics = {f"/{topic}" for topic in topics}
        run.run.bus.needs.append(lambda publisher: publisher.name in self._topics)
        run.run.bus.tap(self._hear)

    def _hear(self, sample: Any) -> None:
        if sample.publisher.on_demand:
            self.heard.setdefault(sample.topic[1:], []).append(sample.message)


@needs_opengl
def test_nothing_is_drawn_that_nobody_wants_and_to_look_changes_nothing(
    scenario: Load, tmp_path: Path
) -> None:
    unseen = OpenRun(scenario(text()), record=False)
    unseen.advance()
    assert "eyes" not in vars(unseen.run.world)
    seen = OpenRun(scenario(text()), record=False)
    audience = Audience(seen, "camera/image_raw")
    seen.advance()
    assert seen.run.world.eyes.drawn == 3  # one picture of colours each 0.1 s
    assert {topic: len(heard) for topic, heard in audience.heard.items()} == {"camera/image_raw": 3}
    digests = {run.finish().digest for run in (unseen, seen)}
    recorded = OpenRun(scenario(text()), out=tmp_path, bag=tmp_path / "bag")
    recorded.advance()
    assert digests == {recorded.finish().digest}


@needs_opengl
def test_pixels_are_the_same_from_run_to_run_and_the_verdict_names_who_drew_them(scenario: Load) -> None:
    def images(kind: str, *topics: str) -> Images | None:
        run = OpenRun(scenario(text(kind=kind)), record=False)
        Audience(run, *topics)
        run.advance()
        return run.finish().images

    seen = images("rgbd_camera", "camera/image_raw", "camera/depth/image_raw")
    assert seen is not None
    assert seen.drawn == 6
    assert any(name in seen.renderer for name in ("Mesa", "llvmpipe", "OpenGL", "NVIDIA"))
    assert images("rgbd_camera", "camera/image_raw", "camera/depth/image_raw") == seen
    others = [
        images("rgbd_camera", "camera/image_raw"),
        images("rgbd_camera", "camera/depth/image_raw"),
        images("segmentation", "camera/ground_truth/labels_map"),
    ]
    assert len({each.digest for each in (seen, *others) if each is not None}) == 4
    assert images("rgbd_camera") is None


@needs_opengl
def test_all_that_a_camera_says_fits_together(scenario: Load) -> None:
    run = OpenRun(scenario(text()), record=False)
    audience = Audience(run, *TOPICS)
    run.advance()
    assert sorted(audience.heard) == sorted(TOPICS)
    for image, info, jpeg, depth, depth_info, cloud in zip(*(audience.heard[t] for t in TOPICS), strict=True):
        assert (
            len({(m.header.stamp.sec, m.header.stamp.nanosec) for m in (image, info, jpeg, depth, cloud)})
            == 1
        )
        assert {m.header.frame_id for m in (image, info, jpeg, depth, depth_info, cloud)} == {
            "camera_optical_frame"
        }
        assert (image.encoding, image.step, depth.encoding, depth.step) == ("rgb8", 960, "32FC1", 1280)
        pixels = image.data.reshape(240, 320, 3)
        assert jpeg.format == "rgb8; jpeg compressed bgr8"
        picture = np.asarray(Pillow.open(io.BytesIO(jpeg.data.tobytes())))
        assert np.abs(picture.astype(int) - pixels).mean() < 4.0

        assert info.distortion_model == "plumb_bob"
        k, z = info.k.reshape(3, 3), depth.data.view(np.float32).reshape(240, 320)
        assert (k[0, 2], k[1, 2]) == (159.5, 119.5)
        assert (info.p.reshape(3, 4)[:, :3] == k).all()
        v, u = np.mgrid[:240, :320]
        expected = np.stack(((u - k[0, 2]) / k[0, 0] * z, (v - k[1, 2]) / k[1, 1] * z, z), axis=-1)
        fields = {field.name: field.offset for field in cloud.fields}
        raw = cloud.data.reshape(240, 320, cloud.point_step)
        xyz = np.concatenate([raw[..., fields[n] : fields[n] + 4] for n in "xyz"], axis=-1).copy()
        assert np.allclose(xyz.view(np.float32), expected, atol=1e-5, equal_nan=True)
        at = fields["rgb"]
        assert (raw[..., at : at + 3][..., ::-1] == pixels).all()
        assert not cloud.is_dense
        crate = z[100:140, 60:120]
        assert 0.9 < np.nanmin(crate) < 1.2  # from the camera to the near side of the crate
    run.close()


@needs_opengl
def test_a_compressed_depth_is_that_of_the_image(scenario: Load) -> None:
    run = OpenRun(scenario(text()), record=False)
    depth = "camera/depth/image_raw"
    audience = Audience(run, depth, f"{depth}/compressedDepth")
    run.advance()
    plain, packed = audience.heard[depth], audience.heard[f"{depth}/compressedDepth"]
    assert [message.header for message in plain] == [message.header for message in packed]
    for image, message in zip(plain, packed, strict=True):
        assert (message.data == compressed_depth(image.header, image).data).all()
    run.close()


@needs_opengl
def test_depth_in_millimetres_is_zero_where_there_is_none(
    scenario: Load, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """And a camera beside it that cannot be is left out, which is told."""
    robot = tmp_path / "mast.urdf"
    robot.write_text(
        "<robot name='mast'><link name='base'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/>"
        "</inertial></link><gazebo reference='base'><sensor name='eye' type='depth_camera'>"
        "<pose>0 0 0.5 0 0 0</pose><camera><image><width>16</width><height>12</height><format>L16</format>"
        "</image></camera></sensor>\n<sensor name='huge' type='camera'><camera><image><width>20000</width>"
        "</image></camera></sensor></gazebo></robot>"
    )
    run = OpenRun(
        scenario(
            f"name: mm\nduration: 0.1 s\nrobots: [{{model: {robot}, base: fixed}}]\n"
            "checks: [{no_collision: {}}]"
        ),
        record=False,
    )
    audience = Audience(run, "eye/depth/image_raw")
    run.advance()
    first = audience.heard["eye/depth/image_raw"][0]
    millimetres = first.data.view(np.uint16).reshape(12, 16)
    assert (first.encoding, first.step, first.header.frame_id) == ("16UC1", 32, "eye_optical_frame")
    assert (millimetres[:6] == 0).all()
    f = 8.0 / np.tan(1.047 / 2.0)
    assert abs(int(millimetres[11, 3]) - round(500.0 * f / 5.5)) <= 1
    drivers = [node.name for node in run.run.bus.nodes if node.name.endswith("_driver")]
    assert drivers == ["eye_driver"]
    (told,) = (record.getMessage() for record in caplog.records if record.levelname == "WARNING")
    assert told == (
        f"{robot}:2: sensor 'huge' of type camera is left out: an image of 20000 x 240 pixels; "
        "valid are whole numbers from 1 to 8192"
    )
    run.close()


@needs_opengl
def test_a_robot_before_a_rack_sees_which_bay_it_is(scenario: Load) -> None:
    run = OpenRun(
        scenario(
            "name: bay\nduration: 0.2 s\nworld: {arena: warehouse}\n"
            "robots: [{model: diff_bot, args: {camera: camera}, pose: {x: 0.2, y: 2.4, yaw: 90 deg},"
            " apriltag: {size: 12 cm}}]\nchecks: [{no_collision: {}}]\n"
        ),
        record=False,
    )
    seen: list[Any] = []
    run.run.bus.tap(lambda sample: seen.append(sample.message) if sample.topic == "/detections" else None)
    run.advance()
    assert {one.id for message in seen for one in message.detections} == {101}
    run.close()


def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)


PACKAGES = "apt-get install libegl1 libgl1-mesa-dri"


def test_without_opengl_who_needs_an_image_is_told_what_to_install(
    scenario: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    blind(monkeypatch)
    run = OpenRun(scenario(text()), record=False)
    Audience(run, "camera/image_raw")
    with pytest.raises(SimulationError, match=PACKAGES):
        run.advance()
    run.close()
    with pytest.raises(SimulationError, match=PACKAGES):
        OpenRun(scenario(text(", cameras: required")), record=False)


def test_without_opengl_the_others_go_on(
    scenario: Load, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    blind(monkeypatch)
    recorded = OpenRun(scenario(text()), out=tmp_path)
    recorded.advance()
    verdict = recorded.finish()
    optional = OpenRun(scenario(text(", cameras: optional")), record=False)
    audience = Audience(optional, "camera/image_raw", "camera/camera_info")
    optional.advance()
    assert {topic: len(heard) for topic, heard in audience.heard.items()} == {"camera/camera_info": 3}
    assert optional.finish().digest == verdict.digest
    told = [record.getMessage() for record in caplog.records if record.name == "twin.camera"]
    assert len(told) == 2  # once each
    assert all(PACKAGES in sentence for sentence in told)


def test_cameras_that_are_off_offer_nothing(scenario: Load) -> None:
    run = OpenRun(scenario(text(", cameras: 'off'")), record=False)
    assert not any("camera" in node.name for node in run.run.bus.nodes)
    run.close()


@needs_opengl
def test_a_recording_shows_pictures_at_its_own_rate(scenario: Load, tmp_path: Path) -> None:
    run = OpenRun(scenario(text() + "recording: {images_hz: 5}\n"), out=tmp_path)
    run.advance()
    assert run.run.world.eyes.drawn == 4  # two pictures, and their depths
    run.finish()
    recording = read(tmp_path / "look.rrd")
    entity = "/cameras/camera/image_raw/compressed"
    column = recording.column(entity, "EncodedImage:blob")
    files = column.values
    assert len(files) == 2
    picture = Pillow.open(io.BytesIO(np.asarray(files[0][0], np.uint8).tobytes()))
    assert picture.size == (320, 240)
    k = np.asarray(recording.column(entity, "Pinhole:image_from_camera").values[0], float).reshape(3, 3).T
    assert (k[0, 2], k[1, 2]) == (159.5, 119.5)
    depths = recording.column("/depths/camera/depth/image_raw", "DepthImage:buffer")
    assert depths.times_ns.tolist() == column.times_ns.tolist()
