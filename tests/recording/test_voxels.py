"""A costmap's voxels in a recording: the marked ones, as boxes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.recording.conftest import FakeSample
from twin.bridge.msgs import Point32, Vector3, VoxelGrid, header
from twin.recording.read_back import Recording, read
from twin.recording.sink import RerunSink

TOPIC = "/local_costmap/voxel_grid"


def recording_of(path: Path, make_world: Any, size_x: int) -> Recording:
    columns = np.full(6, 0xFFFF, dtype=np.uint32)
    columns[4] = 0b101 << 16 | 0xFFFF
    grid = VoxelGrid(
        header=header(0, "odom"),
        data=columns,
        origin=Point32(x=1.0, y=2.0, z=0.5),
        resolutions=Vector3(x=0.5, y=0.5, z=0.2),
        size_x=size_x,
        size_y=2,
        size_z=4,
    )
    world, sink = make_world(), RerunSink(path)
    sink.declare(world)
    world.time_ns = 100_000_000
    sink.on_sample(FakeSample(TOPIC, "nav2_msgs/msg/VoxelGrid", world.time_ns, b"", grid))  # type: ignore[arg-type]
    sink.on_tick(world)
    sink.close()
    return read(path)


def test_marked_voxels_are_boxes(tmp_path: Path, make_world: Any) -> None:
    recording = recording_of(tmp_path / "a.rrd", make_world, 3)
    (centres,) = recording.column(f"/ros{TOPIC}", "Boxes3D:centers").values
    assert np.allclose(centres, [(1.75, 2.75, 0.6), (1.75, 2.75, 1.0)])
    (halves,) = recording.column(f"/ros{TOPIC}", "Boxes3D:half_sizes").values
    assert np.allclose(halves, [(0.225, 0.225, 0.09)] * 2)


def test_a_grid_of_another_size_than_it_says_is_not_shown(tmp_path: Path, make_world: Any) -> None:
    recording = recording_of(tmp_path / "a.rrd", make_world, 4)
    with pytest.raises(Exception, match="centers"):
        recording.column(f"/ros{TOPIC}", "Boxes3D:centers")
