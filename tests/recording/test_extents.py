"""Views hold small and large robots, and wherever they go."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from twin.geometry import Pose3
from twin.models.shapes import Box, Cylinder, Mesh
from twin.recording.blueprint import layout
from twin.recording.extents import RobotBox, Stage, bounds, robot_box
from twin.recording.read_back import Recording, read
from twin.recording.sink import RerunSink
from twin.sim.scene import Scene


class Leaving:
    """A bare floor, and a robot that drives off along y at 2 m/s."""

    body_names = ("robot/base_link",)
    scene = Scene(name="floor")

    def __init__(self, shape: Any, edge: float = 0.5) -> None:
        self.time_ns = 0
        self._shapes = [shape("robot/base_link", (edge, edge, 2.0 * edge))]

    def shapes(self) -> Any:
        return self._shapes

    def pose(self, body: str) -> Pose3:
        return Pose3.from_xyz_rpy((0.3, 2e-9 * self.time_ns, 0.1))

    def body_poses(self) -> tuple[Any, Any]:
        pose = self.pose("robot/base_link")
        return np.array([pose.xyz]), np.array([pose.quat_wxyz])


def drive(path: Path, world: Leaving, *, close: bool) -> Recording:
    """Record eight seconds, in real time."""
    sink = RerunSink(path)
    with patch("twin.recording.sink.monotonic_ns", lambda: world.time_ns):
        sink.declare(world)
        for world.time_ns in range(0, 8_000_000_001, 40_000_000):
            sink.on_tick(world)
    if close:
        sink.close()
    return read(path)


def floor(recording: Recording) -> tuple[Any, Any]:
    centre = recording.column("/world/floor", "Boxes3D:centers").numpy()[0, 0, :2]
    half = recording.column("/world/floor", "Boxes3D:half_sizes").numpy()[0, 0, :2]
    return centre - half, centre + half


@pytest.mark.parametrize("close", [True, False])
def test_the_floor_goes_on_under_a_robot_that_leaves(make_box: Any, tmp_path: Path, close: bool) -> None:
    recording = drive(tmp_path / "away.rrd", Leaving(make_box), close=close)
    (x0, _), (x1, y1) = floor(recording)
    assert y1 > 16.25
    assert x0 < 0.0 < x1
    if close:
        assert y1 < 18.0  # no more than needed


def test_the_map_shows_where_the_robot_went_and_hardly_any_perspective(make_box: Any, tmp_path: Path) -> None:
    recording = drive(tmp_path / "away.rrd", Leaving(make_box), close=True)
    x, y, height = recording.column("/map_eye", "Transform3D:translation").numpy()[0, 0]
    K = recording.column("/map_eye", "Pinhole:image_from_camera").numpy()[0, 0].reshape(3, 3).T
    resolution = recording.column("/map_eye", "Pinhole:resolution").numpy()[0, 0]

    def pixel(point: tuple[float, float, float]) -> Any:
        u, v, w = K @ (point[0] - x, y - point[1], height - point[2])
        return np.array((u, v)) / w

    for corner in ((0.0, -0.25), (0.55, 16.25)):
        assert (pixel((*corner, 0.0)) > 0.0).all()
        assert (pixel((*corner, 0.0)) < resolution).all()
        shift = np.linalg.norm(pixel((*corner, 1.0)) - pixel((*corner, 0.0)))
        assert shift < 0.125 * np.linalg.norm(pixel((0.0, 0.0, 0.0)) - pixel((1.0, 0.0, 0.0)))


def camera(path: Path) -> list[Any]:
    """Return where the eyes of all screens in a file are: (position, target) each."""
    import rerun.chunk as rc

    reader = rc.RrdReader(path)
    eyes = []
    for chunk in (chunk for screen in reader.blueprints() for chunk in reader.stream(store=screen)):
        if chunk.entity_path.endswith("EyeControls3D"):
            batch = chunk.to_record_batch()
            eyes.append(
                tuple(
                    np.array(batch.column(i).to_pylist()[0][0])
                    for name in (":position", ":look_target")
                    for i, column in enumerate(batch.schema.names)
                    if column.endswith(name)
                )
            )
    return eyes


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_a_screen_is_written_that_shows_where_the_robot_went(make_box: Any, tmp_path: Path) -> None:
    drive(tmp_path / "away.rrd", Leaving(make_box), close=True)
    targets = [target for _, target in camera(tmp_path / "away.rrd")]
    assert any(7.0 < target[1] < 9.0 for target in targets)


@pytest.mark.parametrize("edge", [0.05, 0.5, 5.0])
def test_close_up_and_ring_fit_the_robot(make_box: Any, tmp_path: Path, edge: float) -> None:
    world = Leaving(make_box, edge)
    box = robot_box(world, world.shapes(), "robot")
    assert box.size == pytest.approx(np.sqrt(6.0) * edge)
    assert box.radius == pytest.approx(edge / 2.0)
    layout(Stage(world, world.shapes(), [box]), [box]).save("twin", tmp_path / "screen.rbl")
    distances = [np.linalg.norm(position - target) for position, target in camera(tmp_path / "screen.rbl")]
    assert any(distance == pytest.approx(1.3 * box.size, rel=0.05) for distance in distances)


def test_the_ring_of_the_estimate_is_as_large_as_the_robot_and_on_the_floor(
    make_run: Any, make_world: Any, make_box: Any, tmp_path: Path
) -> None:
    class Small(make_world):  # type: ignore[misc, valid-type]
        def shapes(self) -> Any:
            return [make_box("robot/base_link", (0.2, 0.1, 0.1))]

    make_run(duration_s=0.5, world=Small(crates=0)).play(RerunSink(tmp_path / "small.rrd"))
    ring = np.array(
        read(tmp_path / "small.rrd").column("/estimate/robot", "LineStrips3D:strips").values[0][0]
    )
    assert np.max(np.linalg.norm(ring[:, :2], axis=1)) == pytest.approx(0.1, rel=0.05)
    assert 0.0 < ring[0, 2] < 0.05


def test_bounds_know_cylinders_and_meshes(make_shape: Any, tmp_path: Path) -> None:
    wheel = make_shape(
        body="w",
        geometry=Cylinder(radius=0.3, length=0.1),
        T_body_geometry=Pose3.from_xyz_rpy((0, 0, 0.3), (np.pi / 2, 0, 0)),
    )
    low, high = bounds([wheel], lambda _: Pose3.from_xyz_rpy())
    np.testing.assert_allclose((low, high), ((-0.3, -0.05, 0.0), (0.3, 0.05, 0.6)), atol=1e-12)
    (tmp_path / "wedge.obj").write_text("v 1 0 0\nv 3 0 0\nv 1 2 0\nv 1 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n")
    wedge = make_shape(body="m", geometry=Mesh(path=tmp_path / "wedge.obj", scale=(0.1, 0.1, 0.1)))
    low, high = bounds([wedge], lambda _: Pose3.from_xyz_rpy((5, 0, 0)))
    np.testing.assert_allclose((low, high), ((5.1, 0, 0), (5.3, 0.2, 0.1)), atol=1e-12)


def test_a_stage_grows_in_few_steps_and_ignores_what_is_no_place(make_box: Any) -> None:
    world = Leaving(make_box)
    stage = Stage(world, world.shapes(), [robot_box(world, world.shapes(), "robot")])
    assert not stage.grow()
    stage.visit(np.array([[np.nan, 0.0, 0.0], [0.0, np.inf, 0.0]]))
    assert not stage.grow()
    grown = 0
    for y in np.arange(0.0, 100.0, 0.1):
        stage.visit(np.array([[0.0, y, 0.0]]))
        grown += stage.grow()
        assert stage.high[1] > y
    assert 0 < grown < 8
    stage.fit()
    assert stage.high[1] < 102.0


def test_a_robot_without_shapes_has_a_size(make_box: Any) -> None:
    world = Leaving(make_box)
    box = robot_box(world, [], "robot")
    assert isinstance(box, RobotBox)
    assert box.size > 0.0
    assert isinstance(world.shapes()[0].geometry, Box)
