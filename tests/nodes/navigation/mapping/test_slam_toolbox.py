"""`/slam_toolbox`: a robot that drives through a room gets its map, its pose, and files to go on with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import ORIGIN, Bench, Robot, open_room
from twin.bridge.conversions import pose_from_pose2, twist_from_planar
from twin.bridge.msgs import (
    Float64,
    MapMetaData,
    MarkerArray,
    OccupancyGrid,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    String,
    Twist,
    header,
    new,
)
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import (
    DeserializePoseGraph,
    GetMap,
    PauseSlam,
    ResetSlam,
    SaveSlamMap,
    SerializePoseGraph,
)
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.mapping.slam import SlamConfig
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.nodes.navigation.mapping.slam_toolbox import SlamToolboxNode

pytestmark = pytest.mark.xdist_group("slam")

START = Pose2(-2.0, -1.0, 0.0)


class Mapper:
    """A robot in `open_room` that nobody localises, and the node."""

    def __init__(self, bench: Bench, start: Pose2 = START, **config: Any) -> None:
        self.bench = bench
        self.robot = Robot(bench, open_room(), start=start)
        self.robot.localised = False
        settings = {
            "map_start_pose": (START.x, START.y, START.yaw),
            "map_update_interval_ns": 1_000_000_000,
            "slam": SlamConfig(minimum_travel_distance=0.2, minimum_travel_heading=0.2),
            **config,
        }
        self.node = SlamToolboxNode(bench.bus, self.robot.pose_lookup, SlamNodeConfig(**settings))
        self._cmd = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)

    def drive(self, seconds: float, v: float = 0.4, w: float = 0.2) -> None:
        for _ in range(round(seconds / 0.2)):
            self._cmd.publish(twist_from_planar(v, w))
            self.bench.run(0.2)
        self._cmd.publish(twist_from_planar(0.0, 0.0))
        self.bench.run(0.5)

    def error(self) -> float:
        believed = self.robot.pose_lookup.in_map()
        assert believed is not None
        return believed.distance(self.robot.pose)

    def call(self, service: Any, at: str, **fields: Any) -> Any:
        return self.bench.call(service, f"/slam_toolbox/{at}", new(service.Request, **fields))


def walls_are_right(grid: OccupancyMap) -> bool:
    """Return whether the occupied cells lie on the walls and the pillar of `open_room`."""
    rows, columns = np.nonzero(grid.data == 100)
    x, y = grid.cell_to_world(np.column_stack([columns, rows])).T
    wall = np.minimum(np.abs(np.abs(x) - 3.0), np.abs(np.abs(y) - 2.0))
    pillar = np.maximum(np.abs(x - 1.75) - 0.25, np.abs(y - 1.25) - 0.25)
    return len(rows) > 200 and bool(np.quantile(np.minimum(wall, np.abs(pillar)), 0.95) < 0.06)


def test_driving_makes_a_map_in_the_frame_of_the_start(bench: Bench) -> None:
    maps = bench.listen(OccupancyGrid, "/map", LATCHED)
    metadata = bench.listen(MapMetaData, "/map_metadata", LATCHED)
    entropy, poses = (
        bench.listen(Float64, "/entropy", 10),
        bench.listen(PoseWithCovarianceStamped, "/pose", 10),
    )
    mapper = Mapper(bench)
    mapper.drive(10.0)
    assert mapper.error() < 0.03
    bench.run(1.0)
    assert mapper.node.map is not None
    assert walls_are_right(mapper.node.map)
    assert len(maps) >= 8
    assert metadata[-1].width == maps[-1].info.width
    assert np.isfinite(entropy[-1].data)
    assert poses[-1].header.frame_id == "map"
    assert poses[-1].pose.covariance[0] > 0.0
    assert bench.call(GetMap, "/dynamic_map", new(GetMap.Request)).map.info.width == maps[-1].info.width


def test_the_graph_is_shown_to_who_listens(bench: Bench) -> None:
    mapper = Mapper(bench)
    got = bench.listen(MarkerArray, "/slam_toolbox/graph_visualization", 1)
    mapper.drive(3.0)
    nodes, edges, _loops = got[-1].markers
    assert len(nodes.points) >= 4
    assert len(edges.points) == 2 * (len(nodes.points) - 1)


def test_a_map_is_saved_for_a_map_server(bench: Bench, tmp_path: Path) -> None:
    mapper = Mapper(bench)
    name = String(data=str(tmp_path / "room"))
    no_map = mapper.call(SaveSlamMap, "save_map", name=name)
    assert no_map.result == SaveSlamMap.Response.RESULT_NO_MAP_RECEIEVD
    mapper.drive(3.0)
    assert mapper.call(SaveSlamMap, "save_map", name=name).result == SaveSlamMap.Response.RESULT_SUCCESS
    loaded = OccupancyMap.load(tmp_path / "room.yaml")
    assert (loaded.data == 100).sum() > 100
    nowhere = mapper.call(SaveSlamMap, "save_map", name=String(data=str(tmp_path / "room.yaml" / "room")))
    assert nowhere.result == SaveSlamMap.Response.RESULT_UNDEFINED_FAILURE


def test_a_saved_graph_is_gone_on_with_from_another_pose(bench: Bench, tmp_path: Path) -> None:
    mapper = Mapper(bench)
    mapper.drive(6.0)
    file = str(tmp_path / "room.posegraph")
    assert mapper.call(SerializePoseGraph, "serialize_map", filename=file).result == 0
    before = len(mapper.node.slam.graph().poses)
    assert mapper.call(ResetSlam, "reset", pause_new_measurements=True).result == 0
    bench.run(0.5)
    assert len(mapper.node.slam.graph().poses) == 0
    assert mapper.call(PauseSlam, "pause_new_measurements").status
    here = mapper.robot.pose @ Pose2(0.1, -0.1, 0.05)
    request = DeserializePoseGraph.Request
    at = type(new(request).initial_pose)(x=here.x, y=here.y, theta=here.yaw)
    mapper.call(
        DeserializePoseGraph,
        "deserialize_map",
        filename=file,
        match_type=request.START_AT_GIVEN_POSE,
        initial_pose=at,
    )
    mapper.drive(4.0)
    assert mapper.error() < 0.04
    assert len(mapper.node.slam.graph().poses) > before
    assert walls_are_right(mapper.node.slam.map())


def test_localisation_leaves_the_graph_alone_and_takes_an_initial_pose(bench: Bench, tmp_path: Path) -> None:
    mapper = Mapper(bench)
    mapper.drive(8.0)
    mapper.node.slam.save(tmp_path / "room.posegraph")
    nodes = len(mapper.node.slam.graph().poses)
    near = mapper.robot.pose @ Pose2(0.2, -0.1, 0.2)
    mapper.node.load(tmp_path / "room.posegraph", "localization", near)
    bench.run(0.5)
    assert mapper.error() < 0.03
    there = mapper.robot.pose @ Pose2(-0.5, -0.2, 0.3)  # carried: odometry knows nothing of it
    mapper.robot.start = there @ mapper.robot.drive.odometry.pose.inverse()
    bench.run(0.5)
    assert mapper.error() > 0.3
    guess = mapper.robot.pose @ Pose2(0.15, 0.1, -0.1)
    pose = PoseWithCovariance(pose=pose_from_pose2(guess), covariance=np.zeros(36))
    message = PoseWithCovarianceStamped(header=header(0, "map"), pose=pose)
    bench.node.create_publisher(PoseWithCovarianceStamped, "/initialpose", 10).publish(message)
    mapper.drive(5.0)
    assert mapper.error() < 0.03
    assert len(mapper.node.slam.graph().poses) == nodes


def test_bad_files_and_requests_are_refused_in_words(bench: Bench, tmp_path: Path) -> None:
    logs = bench.logs()
    mapper = Mapper(bench)
    mapper.drive(1.0)
    request = DeserializePoseGraph.Request
    none = str(tmp_path / "none.posegraph")
    mapper.call(
        DeserializePoseGraph, "deserialize_map", filename=none, match_type=request.START_AT_FIRST_NODE
    )
    mapper.call(DeserializePoseGraph, "deserialize_map", filename=none)
    bench.run(0.1)
    assert any("deserialize_map refused" in line and "none.posegraph" in line for line in logs)
    assert "deserialize_map refused: match_type is not set" in logs
    assert mapper.error() < 0.03
    with pytest.raises(MapError, match=r"none\.posegraph"):
        SlamToolboxNode(
            bench.bus, mapper.robot.pose_lookup, SlamNodeConfig(map_file_name=none), namespace="other"
        )


def test_an_initial_pose_is_refused_while_mapping(bench: Bench) -> None:
    mapper = Mapper(bench)
    logs = bench.logs()
    mapper.drive(1.0)
    pose = PoseWithCovariance(pose=pose_from_pose2(Pose2(1.0, 1.0, 0.0)), covariance=np.zeros(36))
    message = PoseWithCovarianceStamped(header=header(0, "map"), pose=pose)
    bench.node.create_publisher(PoseWithCovarianceStamped, "/initialpose", 10).publish(message)
    mapper.drive(1.0)
    assert mapper.error() < 0.2
    assert "initialpose refused: a robot that maps knows where it is" in logs


def test_a_pause_leaves_scans_unread_but_the_transform_alive(bench: Bench) -> None:
    mapper = Mapper(bench)
    mapper.drive(1.0)
    mapper.call(PauseSlam, "pause_new_measurements")
    nodes = len(mapper.node.slam.graph().poses)
    mapper.drive(3.0)
    assert len(mapper.node.slam.graph().poses) == nodes
    assert mapper.error() < 0.2


def test_the_parameters_have_slam_toolboxs_names(bench: Bench) -> None:
    node = Mapper(bench, start=ORIGIN).node.node
    for name, value in (
        ("mode", "mapping"),
        ("map_update_interval", 1.0),
        ("minimum_travel_distance", 0.2),
        ("do_loop_closing", True),
        ("resolution", 0.05),
    ):
        assert node.get_parameter(name).value == value


def test_after_a_reset_there_is_no_map_until_the_next_scan(bench: Bench, tmp_path: Path) -> None:
    mapper = Mapper(bench)
    mapper.drive(2.0)
    maps, logs = bench.listen(OccupancyGrid, "/map", LATCHED), bench.logs()
    bench.run(0.1)
    before = len(maps)
    mapper.call(ResetSlam, "reset", pause_new_measurements=True)
    bench.run(2.5)
    assert len(maps) == before, "an empty map would be taken for the world"
    assert bench.call(GetMap, "/dynamic_map", new(GetMap.Request)).map.info.width == 0
    none, file = String(data=str(tmp_path / "none")), tmp_path / "none.posegraph"
    assert (
        mapper.call(SaveSlamMap, "save_map", name=none).result == SaveSlamMap.Response.RESULT_NO_MAP_RECEIEVD
    )
    saved = mapper.call(SerializePoseGraph, "serialize_map", filename=str(file))
    assert saved.result == SerializePoseGraph.Response.RESULT_FAILED_TO_WRITE_FILE
    assert any("there is no scan to save yet" in line for line in logs)
    assert not list(tmp_path.iterdir())
    mapper.call(PauseSlam, "pause_new_measurements")
    bench.run(0.3)
    assert len(maps) == before + 1, "the first scan is shown at once"
    assert maps[-1].info.width > 50
