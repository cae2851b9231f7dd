"""A scenario says what finds totes: the palm's lidar, or a camera there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.drawing import needs_opengl
from tests.runtime.conftest import SCENARIOS
from twin.errors import ScenarioError
from twin.runtime.open_run import OpenRun, run
from twin.scenario.schema import Scenario, load

Load = Callable[[str], Scenario]


def text(robot: str) -> str:
    return (
        "name: look\nduration: 0.2 s\n"
        f"robots: [{{model: warehouse_bot, {robot}}}]\nchecks: [{{no_collision: {{}}}}]\n"
    )


@pytest.mark.parametrize(
    ("robot", "told"),
    [
        ("picture_detector: {depth_boxs: {}}", "did you mean 'depth_boxes'"),
        ("picture_detector: {depth_boxes: {}}, detector: {box_faces: {}}", "give either detector or"),
        ("picture_detector: {depth_boxes: {}}, cameras: 'off'", "this robot's cameras are off"),
        ("picture_detector: {depth_boxes: {min_score: 2}}", "min_score"),
    ],
)
def test_a_file_that_says_nonsense_is_refused(scenario: Load, robot: str, told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        scenario(text(robot))


@pytest.mark.parametrize(
    ("robot", "told"),
    [
        ("picture_detector: {depth_boxes: {}}", "has no camera that makes images of depth in which"),
        (
            "args: {palm_camera: depth_camera}, picture_detector: {rgbd_boxes: {}}",
            "has no camera that makes images of depth and colours",
        ),
        (
            "args: {camera: rgbd_camera, palm_camera: rgbd_camera}, picture_detector: {rgbd_boxes: {}}",
            "has several cameras .* camera is one of camera, palm_camera",
        ),
        (
            "args: {palm_camera: rgbd_camera}, picture_detector: {rgbd_boxes: {camera: palm_camra}}",
            "has no camera 'palm_camra' that makes .* did you mean 'palm_camera'",
        ),
    ],
)
def test_a_robot_that_cannot_look_is_told_of(scenario: Load, robot: str, told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        OpenRun(scenario(text(robot)), record=False)


def test_without_a_camera_at_the_palm_the_robot_is_as_before(scenario: Load) -> None:
    plain = OpenRun(scenario(text("start: null")), record=False)
    robot = plain.run.world.robots["warehouse_bot"]
    assert not any("camera" in name for name in robot.description.links)
    assert not robot.cameras
    plain.close()


@needs_opengl
def test_nothing_is_drawn_before_the_robot_looks(scenario: Load) -> None:
    looking = "args: {palm_camera: rgbd_camera}, picture_detector: {rgbd_boxes: {}}"
    seen = OpenRun(scenario(text(looking)), record=False)
    seen.advance()
    assert seen.run.world.eyes.drawn == 0
    (camera,) = seen.run.world.robots["warehouse_bot"].cameras
    assert camera.spec.depth_noise is not None
    assert camera.spec.depth_noise.model == "realsense"
    seen.close()


@needs_opengl
@pytest.mark.long
@pytest.mark.parametrize(("camera", "detector"), [("depth_camera", "depth"), ("rgbd_camera", "rgbd")])
def test_the_warehouse_passes_with_a_camera_instead_of_a_lidar(
    camera: str, detector: str, tmp_path: Path
) -> None:
    asked = {"robots.0.args.palm_camera": camera, f"robots.0.picture_detector.{detector}_boxes": "{}"}
    verdict = run(load(SCENARIOS / "warehouse.yaml", asked), out=tmp_path, record=False)
    assert verdict.exit_code == 0, verdict.checks
