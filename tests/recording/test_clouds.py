"""Point clouds in a recording: few, thinned, coloured, where the lidar truly was."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.recording.conftest import FakeSample
from twin.bridge.msgs import PointCloud2, header
from twin.bridge.point_cloud2 import cloud_of
from twin.clouds.points import make_points
from twin.recording.channels.clouds import MOST_POINTS
from twin.recording.read_back import Recording, read
from twin.recording.sink import RerunSink

TOPIC = "/points"


def recording_of(path: Path, make_world: Any, clouds: list[PointCloud2]) -> Recording:
    """Return a recording of clouds that came every tenth of a second."""
    world, sink = make_world(), RerunSink(path)
    sink.declare(world)
    for i, cloud in enumerate(clouds, 1):
        world.time_ns = i * 100_000_000
        sink.on_sample(FakeSample(TOPIC, "sensor_msgs/msg/PointCloud2", world.time_ns, b"", cloud))  # type: ignore[arg-type]
        sink.on_tick(world)
    sink.close()
    return read(path)


def test_two_clouds_a_second_are_shown_of_some_points_each(tmp_path: Path, make_world: Any) -> None:
    xyz = np.stack([np.arange(10_000), np.zeros(10_000), np.linspace(0, 2, 10_000)], axis=1)
    cloud = cloud_of(header(0, "base_link"), make_points(xyz))
    recording = recording_of(tmp_path / "a.rrd", make_world, [cloud] * 12)
    positions = recording.column(f"/ros{TOPIC}", "Points3D:positions")
    assert positions.times_ns.tolist() == [100_000_000, 500_000_000, 1_000_000_000]
    shown = np.array(positions.values[0])
    assert MOST_POINTS / 2 < len(shown) <= MOST_POINTS
    assert shown[:3, 0].tolist() == [0, 3, 6]
    colours = np.array(recording.column(f"/ros{TOPIC}", "Points3D:colors").values[0])
    assert len(colours) == len(shown)
    assert [hex(colour) for colour in colours[[0, -1]]] == ["0x3c5ae6ff", "0xffdc5aff"]


def test_a_cloud_has_its_own_colours_and_what_was_not_measured_is_left_out(
    tmp_path: Path, make_world: Any
) -> None:
    points = np.zeros(2, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    points["rgb"] = 0x102030
    points["x"][1] = np.nan
    recording = recording_of(tmp_path / "a.rrd", make_world, [cloud_of(header(0, "base_link"), points)])
    assert recording.column(f"/ros{TOPIC}", "Points3D:colors").values == [[0x102030FF]]


@pytest.mark.parametrize("fault", [{"row_step": 1}, {"fields": []}, {"width": 2**31}])
def test_a_cloud_that_is_none_is_not_shown(fault: dict[str, Any], tmp_path: Path, make_world: Any) -> None:
    cloud = cloud_of(header(0, "base_link"), make_points([(1, 2, 3)]))
    for name, value in fault.items():
        setattr(cloud, name, value)
    recording = recording_of(tmp_path / "a.rrd", make_world, [cloud])
    assert "Points3D:positions" not in recording.columns.get(f"/ros{TOPIC}", ())
