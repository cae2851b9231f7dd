"""What is done with clouds, judged by shapes whose answer is known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from twin.clouds.clusters import euclidean_clusters
from twin.clouds.colours import channels, packed_colour
from twin.clouds.deskewing import deskewed
from twin.clouds.filters import crop_box, voxel_grid
from twin.clouds.planes import fit_plane
from twin.clouds.points import coordinates, make_points, transformed
from twin.clouds.times import timed
from twin.errors import CloudError
from twin.geometry import Pose3

GENERATOR = np.random.default_rng(4)
CUBE = make_points(GENERATOR.uniform(-1, 1, (2000, 3)))


def with_field(points: np.ndarray, name: str, values: Any, kind: str) -> np.ndarray:
    made = np.zeros(points.shape, [*points.dtype.descr, (name, kind)])
    for each in points.dtype.names or ():
        made[each] = points[each]
    made[name] = values
    return made


def test_a_crop_keeps_its_faces_and_its_complement_all_else() -> None:
    points = make_points([(0, 0, 0), (1, 1, 1), (1.001, 0, 0), (math.nan, 0, 0), (0.5, -0.1, 0)])
    kept = crop_box(points, (0, 0, 0), (1, 1, 1))
    assert coordinates(kept).tolist() == [[0, 0, 0], [1, 1, 1]]
    others = crop_box(points, (0, 0, 0), (1, 1, 1), negative=True)
    assert coordinates(others)[:, 0].tolist() == pytest.approx([1.001, 0.5])


def test_a_voxel_grid_has_the_centroid_of_each_cube() -> None:
    cloud = with_field(CUBE, "intensity", np.arange(2000), "<f4")
    thin = voxel_grid(cloud, 0.5)
    assert len(thin) == 4**3
    cells = np.floor(coordinates(cloud) / 0.5)
    for point in thin:
        mine = (cells == np.floor(np.array([point[axis] for axis in "xyz"]) / 0.5)).all(axis=1)
        np.testing.assert_allclose(
            [point[axis] for axis in "xyz"], coordinates(cloud)[mine].mean(axis=0), atol=1e-6
        )
        assert point["intensity"] == pytest.approx(cloud["intensity"][mine].mean(), rel=1e-5)
    order = np.floor(coordinates(thin) / 0.5)
    assert np.lexsort(order.T).tolist() == list(range(64))


def test_a_voxel_grid_mixes_colours_by_channel_and_leaves_rings_whole() -> None:
    rgb = packed_colour(np.array([(255, 0, 0), (0, 0, 255)], np.uint8)).view(np.float32)
    points = with_field(make_points([(0.1, 0, 0), (0.2, 0, 0)]), "rgb", rgb, "<f4")
    (mixed,) = voxel_grid(with_field(points, "ring", (7, 9), "<u2"), (1.0, 2.0, 3.0))
    assert channels(np.array([mixed["rgb"]]))[0, :3].tolist() == [128, 0, 128]
    assert mixed["ring"] == 7


@pytest.mark.parametrize("leaf", [0.0, -1.0, math.nan, math.inf, 1e-30])
def test_cubes_that_are_none_are_refused(leaf: float) -> None:
    with pytest.raises(CloudError, match="cube"):
        voxel_grid(CUBE, leaf)


def test_a_cloud_moves_with_its_normals_and_keeps_what_was_not_measured() -> None:
    fields = ("x", "y", "z", "normal_x", "normal_y", "normal_z")
    cloud = make_points([(1, 0, 0, 1, 0, 0), (math.nan, 0, 0, 0, 0, 1)], fields)
    moved = transformed(cloud, Pose3.from_xyz_rpy((0, 0, 5), (0, 0, math.pi / 2)))
    assert moved[0].tolist() == pytest.approx((0, 1, 5, 0, 1, 0), abs=1e-6)
    assert math.isnan(moved[1]["x"])
    assert moved[1]["normal_z"] == 1


def test_the_plane_of_most_points_is_found_the_same_way_every_time() -> None:
    normal = np.array((0.1, -0.2, 0.9)) / np.linalg.norm((0.1, -0.2, 0.9))
    flat = GENERATOR.uniform(-2, 2, (600, 3))
    flat -= np.outer(flat @ normal - 0.7, normal)
    noisy = flat + np.outer(GENERATOR.normal(0, 0.005, 600), normal)
    cloud = make_points(np.concatenate((GENERATOR.uniform(-2, 2, (400, 3)), noisy, [(math.nan,) * 3])))
    plane = fit_plane(cloud, 0.02, np.random.default_rng(1))
    assert plane.normal @ normal > math.cos(0.003)
    assert plane.offset == pytest.approx(-0.7, abs=0.003)
    assert plane.inliers[400:1000].mean() > 0.99
    assert plane.inliers[:400].mean() < 0.05
    assert not plane.inliers[1000]
    np.testing.assert_allclose(plane.distances(flat), 0.0, atol=0.005)
    again = fit_plane(cloud, 0.02, np.random.default_rng(1))
    np.testing.assert_array_equal(plane.normal, again.normal)


@pytest.mark.parametrize("points", [[], [(0, 0, 0), (1, 1, 1)], [(0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 3, 3)]])
def test_points_in_line_have_no_plane(points: list[Any]) -> None:
    with pytest.raises(CloudError, match="plane"):
        fit_plane(make_points(points), 0.01, np.random.default_rng(0), iterations=50)


def test_clusters_are_what_hangs_together_the_largest_first() -> None:
    row = [(0.1 * i, 0, 0) for i in range(20)]
    blob = [(5, 0.1 * i, 0) for i in range(7)]
    cloud = make_points([*blob, (math.nan, 0, 0), *row, (9, 9, 9)])
    clusters = euclidean_clusters(cloud, 0.11)
    assert [cluster.tolist() for cluster in clusters] == [list(range(8, 28)), list(range(7)), [28]]
    assert [len(it) for it in euclidean_clusters(cloud, 0.11, min_size=2, max_size=10)] == [7]
    assert [len(it) for it in euclidean_clusters(cloud, 0.09)] == [1] * 28
    assert euclidean_clusters(make_points([]), 0.1) == []


def test_deskewing_puts_every_point_where_it_was_at_the_stamp() -> None:
    def pose_at(time: float) -> Pose3:
        return Pose3.from_xyz_rpy((2.0 * time, 0.0, 0.0), (0.0, 0.0, 0.5 * time))

    fixed = GENERATOR.uniform(-3, 3, (40, 3))
    times = np.repeat((0.0, 0.1, 0.2, 0.3), 10)
    seen = np.array(
        [pose_at(t).inverse().apply(point[np.newaxis])[0] for t, point in zip(times, fixed, strict=True)]
    )
    cloud = with_field(make_points(seen), "time", times, "<f4")
    np.testing.assert_allclose(coordinates(deskewed(cloud, pose_at)), fixed, atol=1e-5)
    with pytest.raises(CloudError, match="no field 'time'"):
        deskewed(make_points(seen), pose_at)


@pytest.mark.parametrize("stamp", [0.0, 0.06, 5.3, 1_790_000_000.25])
@pytest.mark.parametrize(
    ("field", "kind", "unit", "from_stamp"),
    [
        ("time", "<f4", 1.0, True),  # velodyne
        ("t", "<u4", 1e9, True),  # ouster
        ("timestamp", "<f8", 1e9, False),  # livox_ros_driver2
        ("timestamp", "<f8", 1.0, False),  # hesai, rslidar
        ("time", "<f8", 1.0, True),
    ],
)
def test_times_are_seconds_after_the_stamp_whichever_driver_tells_them(
    field: str, kind: str, unit: float, from_stamp: bool, stamp: float
) -> None:
    after = np.linspace(0.0, 0.1, 11)
    told = (after + (0.0 if from_stamp else stamp)) * unit
    cloud = with_field(make_points(np.ones((11, 3))), field, told, kind)
    found = timed(cloud, stamp)
    np.testing.assert_allclose(found["time"], after, atol=1e-6)
    assert coordinates(found).tolist() == [[1, 1, 1]] * 11


@pytest.mark.parametrize("told", [5.3, 5.3e9, 1_790_000_000.25, 1.79e18, 0.0])
def test_a_cloud_that_was_measured_at_once_was_measured_at_its_stamp(told: float) -> None:
    cloud = with_field(make_points(np.ones((3, 3))), "timestamp", told, "<f8")
    assert timed(cloud, 5.3)["time"].tolist() == [0.0] * 3


def test_a_cloud_that_tells_no_times_is_left_as_it_is() -> None:
    cloud = make_points([(1, 2, 3)])
    assert timed(cloud, 5.0) is cloud
    silent = with_field(cloud, "timestamp", math.nan, "<f8")
    assert timed(silent, 5.0) is silent


def test_a_cloud_without_coordinates_is_told_what_it_lacks() -> None:
    with pytest.raises(CloudError, match="no field 'z' of one number; its fields: x, y"):
        coordinates(make_points([(1, 2)], ("x", "y")))
