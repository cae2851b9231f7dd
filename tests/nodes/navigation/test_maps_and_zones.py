"""Map server and saver, filter masks, range sensors and the services of costmaps, on a bus."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench, Robot, map_of_room, open_room
from twin.bridge.action_types import FollowPath
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import (
    Costmap as CostmapMessage,
)
from twin.bridge.msgs import (
    LaserScan,
    OccupancyGrid,
    PolygonStamped,
    Range,
    SpeedLimit,
    header,
    new,
)
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import (
    ClearCostmapAroundPose,
    ClearCostmapAroundRobot,
    ClearCostmapExceptRegion,
    GetCost,
    GetCostmap,
    LoadMap,
    SaveMap,
    SetBool,
)
from twin.geometry import Pose2
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.costmaps.costmap_config import RangeSensorConfig
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.maps.zones import empty_mask, rectangle, with_zone
from twin.nodes.messages import path_msg, pose_stamped
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.controller_server.server import ControllerServerNode
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.costmaps.filter_info import CostmapFilterInfoConfig, CostmapFilterInfoNode
from twin.nodes.navigation.mapping.map_server import MapSaverNode, MapServerNode, grid_msg, occupancy_map

FOOTPRINT = ((0.15, 0.15), (-0.15, 0.15), (-0.15, -0.15), (0.15, -0.15))
LAYERS = CostmapConfig(
    footprint=FOOTPRINT,
    footprint_padding=0.0,
    inflation_radius=0.4,
    obstacle_max_range=4.0,
    raytrace_max_range=5.0,
)
ROLLING = CostmapConfig(
    footprint=FOOTPRINT,
    footprint_padding=0.0,
    inflation_radius=0.4,
    rolling_window=True,
    range_sensor_layer=RangeSensorConfig(clear_on_max_reading=True),
)


def costmap(bench: Bench, robot: Robot, layers: CostmapConfig = LAYERS, **config: Any) -> CostmapNode:
    name, frame = ("local_costmap", "odom") if layers.rolling_window else ("global_costmap", "map")
    return CostmapNode(
        bench.bus, robot.pose_lookup, CostmapNodeConfig(name=name, frame=frame, layers=layers, **config)
    )


def serve_mask(bench: Bench, kind: str, mask: OccupancyMap, **info: Any) -> MapServerNode:
    server = MapServerNode(bench.bus, mask, name=f"{kind}_mask_server", topic=f"{kind}_mask")
    config = CostmapFilterInfoConfig(filter_info_topic=f"{kind}_info", mask_topic=f"{kind}_mask", **info)
    CostmapFilterInfoNode(bench.bus, config, name=f"{kind}_info_server").announce()
    return server


def at(node: CostmapNode, x: float, y: float) -> int:
    assert node.costmap is not None
    return node.costmap.cost_at(x, y)


# map server and saver


def test_another_map_is_loaded_and_everybody_gets_it(bench: Bench, tmp_path: Path) -> None:
    MapServerNode(bench.bus, map_of_room())
    got = bench.listen(OccupancyGrid, "map", LATCHED)
    other = OccupancyMap(data=np.eye(4, dtype=np.int8) * 100, resolution=0.1, origin=Pose2(1.0, 2.0, 0.0))
    other.save(tmp_path / "other.yaml")
    answer = bench.call(LoadMap, "map_server/load_map", LoadMap.Request(map_url=str(tmp_path / "other.yaml")))
    bench.run(0.1)
    assert answer.result == LoadMap.Response.RESULT_SUCCESS
    for message in (answer.map, got[-1]):
        assert np.array_equal(occupancy_map(message).data, other.data)


def test_a_map_that_cannot_be_loaded_leaves_the_old_one(bench: Bench, tmp_path: Path) -> None:
    server = MapServerNode(bench.bus, map_of_room())
    said = bench.logs()
    before = server.message
    OccupancyMap(data=np.zeros((2, 2), np.int8), resolution=1.0, origin=Pose2(0, 0, 0)).save(
        tmp_path / "m.yaml"
    )
    (tmp_path / "m.pgm").write_bytes(b"no image")
    (tmp_path / "wrong.yaml").write_text("image: m.pgm\n")
    response = LoadMap.Response
    for url, result in (
        ("", response.RESULT_MAP_DOES_NOT_EXIST),
        (str(tmp_path / "nowhere.yaml"), response.RESULT_INVALID_MAP_METADATA),
        (str(tmp_path / "wrong.yaml"), response.RESULT_INVALID_MAP_METADATA),
        (str(tmp_path / "m.yaml"), response.RESULT_INVALID_MAP_DATA),
    ):
        assert bench.call(LoadMap, "map_server/load_map", LoadMap.Request(map_url=url)).result == result
    assert server.message is before
    bench.run(0.1)
    assert any("m.pgm" in text for text in said)


def save(bench: Bench, **request: Any) -> bool:
    client = bench.node.create_client(SaveMap, "map_saver/save_map")
    future = client.call_async(new(SaveMap.Request, **request))
    bench.until(lambda: future.done, 5.0)
    return bool(future.result.result)


def test_the_map_of_a_topic_is_saved_and_loads_to_the_same_cells(bench: Bench, tmp_path: Path) -> None:
    MapServerNode(bench.bus, map_of_room(), topic="there")
    MapSaverNode(bench.bus)
    assert save(
        bench, map_topic="there", map_url=str(tmp_path / "saved"), map_mode="trinary", image_format="png"
    )
    assert (tmp_path / "saved.png").is_file()
    loaded = OccupancyMap.load(tmp_path / "saved.yaml")
    assert np.array_equal(loaded.data, map_of_room().data)
    assert (loaded.resolution, loaded.origin) == (0.05, map_of_room().origin)


def test_a_map_that_cannot_be_saved_is_said(bench: Bench, tmp_path: Path) -> None:
    MapSaverNode(bench.bus)
    said = bench.logs()
    assert not save(bench, map_url=str(tmp_path / "saved"))
    MapServerNode(bench.bus, map_of_room())
    assert not save(bench, map_url=str(tmp_path / "saved"), image_format="gif")
    assert not save(bench, map_url=str(tmp_path / "saved"), free_thresh=0.9)
    assert save(bench, map_url=str(tmp_path / "saved"), map_mode="strange")
    text = "\n".join(said)
    for words in ("no map came on map in 2 s", "pgm, png, bmp", "free < occupied", "'strange' is unknown"):
        assert words in text


# filters


def test_a_keepout_mask_reaches_both_costmaps_and_can_be_switched_off(bench: Bench) -> None:
    robot = Robot(bench, open_room(), start=Pose2(-1.0, 0.5, 0.3))
    MapServerNode(bench.bus, map_of_room())
    mask = with_zone(empty_mask(map_of_room()), rectangle(-1.0, -1.0, 0.0, -0.5), 100)
    serve_mask(bench, "keepout", mask)
    in_map = costmap(bench, robot, keepout_filter_info_topic="keepout_info")
    in_odom = costmap(bench, robot, ROLLING, keepout_filter_info_topic="keepout_info")
    bench.run(1.0)
    inside, beside = (-0.5, -0.75), (-0.5, -0.4)
    for node, T_frame_map in ((in_map, Pose2(0.0, 0.0, 0.0)), (in_odom, robot.start.inverse())):
        assert at(node, *T_frame_map.apply(inside)) == 254
        assert at(node, *T_frame_map.apply(beside)) == 253
    off = bench.call(SetBool, "global_costmap/keepout_filter/toggle_filter", SetBool.Request(data=False))
    assert (off.success, off.message) == (True, "Disabled")
    bench.run(0.5)
    assert at(in_map, *inside) == 0
    bench.call(SetBool, "global_costmap/keepout_filter/toggle_filter", SetBool.Request(data=True))
    bench.run(0.5)
    assert at(in_map, *inside) == 254


def test_a_mask_that_is_loaded_later_takes_over(bench: Bench, tmp_path: Path) -> None:
    robot = Robot(bench, open_room())
    MapServerNode(bench.bus, map_of_room())
    serve_mask(bench, "keepout", empty_mask(map_of_room()))
    node = costmap(bench, robot, keepout_filter_info_topic="keepout_info")
    bench.run(0.5)
    assert at(node, -0.5, -0.75) == 0
    with_zone(empty_mask(map_of_room()), rectangle(-1.0, -1.0, 0.0, -0.5), 100).save(tmp_path / "z.yaml")
    request = LoadMap.Request(map_url=str(tmp_path / "z.yaml"))
    bench.call(LoadMap, "keepout_mask_server/load_map", request)
    bench.run(0.5)
    assert at(node, -0.5, -0.75) == 254


def test_info_of_another_filter_is_refused_and_said(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    said = bench.logs()
    serve_mask(bench, "keepout", empty_mask(map_of_room()), type=1)
    costmap(bench, robot, ROLLING, keepout_filter_info_topic="keepout_info")
    bench.run(0.3)
    assert any("keepout_filter: info of type 1 refused" in text for text in said)


def test_a_robot_obeys_the_speed_limit_of_a_zone(bench: Bench) -> None:
    """It drives from -2 to 2; from -0.5 to 0.5 it may drive at 40 % of its cruise speed."""
    robot = Robot(bench, open_room(), start=Pose2(-2.0, 0.0, 0.0))
    mask = with_zone(empty_mask(map_of_room()), rectangle(-0.5, -2.0, 0.5, 2.0), 40)
    serve_mask(bench, "speed", mask, type=1)
    local = costmap(bench, robot, ROLLING, speed_filter_info_topic="speed_info")
    limits = bench.listen(SpeedLimit, "speed_limit", 10)
    config = ControllerServerConfig(
        controllers={"FollowPath": RegulatedPurePursuitConfig(desired_linear_vel=0.5)}
    )
    ControllerServerNode(bench.bus, robot.pose_lookup, local, np.array(FOOTPRINT), config)
    follow = ActionClient(bench.node, FollowPath, "follow_path")
    bench.run(0.5)
    path = path_msg(np.column_stack([np.linspace(-2, 2, 81), np.zeros((81, 2))]), "map", 0)
    goal = follow.send_goal(new(FollowPath.Goal, path=path))
    speeds: dict[float, float] = {}
    while not goal.done:
        bench.tick()
        if robot.commands:
            speeds[round(robot.pose.x, 2)] = robot.commands[-1][0]
    assert goal.succeeded
    assert [(m.percentage, m.speed_limit) for m in limits] == [(True, 40.0), (True, 0.0)]
    assert max(v for x, v in speeds.items() if -0.2 < x < 0.5) == pytest.approx(0.2)
    assert max(v for x, v in speeds.items() if x < -0.6) == pytest.approx(0.5)
    assert max(v for x, v in speeds.items() if x > 0.7) == pytest.approx(0.5)


# range sensors, services, topics


def reading(bench: Bench, distance: float) -> Range:
    return new(
        Range,
        header=header(bench.clock.now_ns - 20_000_000, "lidar"),
        field_of_view=0.3,
        min_range=0.05,
        max_range=2.0,
        range=distance,
    )


def test_a_sonar_marks_what_the_lidar_does_not_see(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    robot.blind = True
    node = costmap(bench, robot, ROLLING, range_topics=("sonar",))
    publisher = bench.node.create_publisher(Range, "sonar", SENSOR_DATA)
    bench.run(0.2)
    for _ in range(4):
        publisher.publish(reading(bench, 0.6))
        bench.run(0.2)
    assert at(node, 0.712, 0.012) == 254, "0.6 m before the sensor, which is 0.1 m ahead of the base"
    publisher.publish(reading(bench, 2.0))
    bench.run(0.2)
    assert at(node, 0.712, 0.012) == 0


def test_costmaps_are_cleared_in_part(bench: Bench) -> None:
    room = open_room()
    robot = Robot(bench, room)
    MapServerNode(bench.bus, map_of_room())
    node = costmap(bench, robot)
    room.add_box(0.61, -0.2, 0.8, 0.2)
    room.add_box(-2.0, -0.2, -1.8, 0.2)
    bench.run(0.6)
    robot.blind = True
    bench.run(0.3)
    near, far, wall = (0.62, 0.0), (-1.81, 0.0), (3.02, 0.0)
    assert [at(node, *p) for p in (near, far, wall)] == [254, 254, 254]
    name = "global_costmap/clear_around_global_costmap"
    bench.call(ClearCostmapAroundRobot, name, new(ClearCostmapAroundRobot.Request, reset_distance=2.0))
    assert [at(node, *p) for p in (near, far, wall)] == [0, 254, 254], "the static map stays"
    robot.blind = False
    bench.run(0.5)
    robot.blind = True
    bench.run(0.3)
    name = "global_costmap/clear_except_global_costmap"
    bench.call(ClearCostmapExceptRegion, name, new(ClearCostmapExceptRegion.Request, reset_distance=2.0))
    assert [at(node, *p) for p in (near, far, wall)] == [254, 0, 254]
    pose = pose_stamped(Pose2(*near, 0.0), "odom", 0)
    request = new(ClearCostmapAroundPose.Request, pose=pose, reset_distance=0.8)
    bench.call(ClearCostmapAroundPose, "global_costmap/clear_around_pose_global_costmap", request)
    assert at(node, *near) == 0
    said = bench.logs()
    name = "global_costmap/clear_around_global_costmap"
    bench.call(ClearCostmapAroundRobot, name, new(ClearCostmapAroundRobot.Request, reset_distance=math.inf))
    assert "nothing cleared: the pose or the distance is not finite" in said


def test_a_second_lidar_marks_too_and_is_missed_when_it_stops(bench: Bench) -> None:
    room = open_room()
    robot = Robot(bench, room)
    MapServerNode(bench.bus, map_of_room())
    layers = replace(LAYERS, expected_update_rate=0.5)
    node = costmap(bench, robot, layers, scan_topics=("scan", "scan_rear"))
    rear = bench.node.create_publisher(LaserScan, "scan_rear", SENSOR_DATA)
    robot.blind = True
    room.add_box(-2.0, -0.2, -1.8, 0.2)
    bench.run(1.0)
    assert at(node, -1.81, 0.0) == 0
    for _ in range(4):
        rear.publish(room.scan(robot.pose @ robot.T_base_lidar, bench.clock.now_ns - TICK_NS))
        bench.run(0.2)
    assert at(node, -1.81, 0.0) == 254
    assert "no scan for 1.8 s" in node.fault, "the other one"
    robot.blind = False
    bench.run(0.2)
    assert node.fault == ""
    bench.run(0.6)
    assert "no scan for" in node.fault


def test_costs_can_be_asked_for(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    MapServerNode(bench.bus, map_of_room())
    node = costmap(bench, robot)
    bench.run(0.5)

    def cost(x: float, y: float, theta: float = 0.0, footprint: bool = False) -> float:
        request = new(GetCost.Request, use_footprint=footprint, x=x, y=y, theta=theta)
        return float(bench.call(GetCost, "global_costmap/get_cost_global_costmap", request).cost)

    assert (cost(3.02, 0.0), cost(0.0, 0.0), cost(99.0, 0.0)) == (254.0, 0.0, -1.0)
    assert cost(2.83, 0.0, math.pi / 4, footprint=True) == 254.0
    assert cost(2.83, 0.0) < 254.0
    assert [cost(math.nan, 0.0), cost(0.0, math.inf), cost(0.0, 0.0, math.nan, footprint=True)] == [-1.0] * 3
    raw = bench.call(GetCostmap, "global_costmap/get_costmap", new(GetCostmap.Request)).map
    assert node.costmap is not None
    assert np.array_equal(raw.data.reshape(raw.metadata.size_y, raw.metadata.size_x), node.costmap.costs)


def test_what_a_costmap_publishes(bench: Bench) -> None:
    robot = Robot(bench, open_room(), start=Pose2(0.5, -0.3, 0.4))
    node = costmap(bench, robot, ROLLING)
    grids = bench.listen(OccupancyGrid, "local_costmap/costmap", LATCHED)
    raws = bench.listen(CostmapMessage, "local_costmap/costmap_raw", LATCHED)
    outlines = bench.listen(PolygonStamped, "local_costmap/published_footprint", 1)
    bench.run(1.5)
    assert node.costmap is not None
    raw, grid = raws[-1], grids[-1]
    table = {0: 0, 253: 99, 254: 100, 255: -1}
    assert {int(v) for v in raw.data} >= {0, 253, 254}
    assert grid.data.tolist() == [table.get(cost, 1 + 97 * (cost - 1) // 251) for cost in raw.data.tolist()]
    assert (raw.metadata.size_x, raw.metadata.layer) == (100, "master")
    corners = [(point.x, point.y) for point in outlines[-1].polygon.points]
    assert np.allclose(corners, FOOTPRINT, atol=1e-6), "odometry begins where the robot starts"
    assert outlines[-1].header.frame_id == "odom"


def grown(grid: OccupancyMap, cells: int) -> OccupancyMap:
    """The same map with so many more unknown cells on every side."""
    x, y = grid.origin.x - cells * grid.resolution, grid.origin.y - cells * grid.resolution
    data = np.pad(grid.data, cells, constant_values=-1)
    return OccupancyMap(data=data, resolution=grid.resolution, origin=Pose2(x, y, 0.0))


def test_zones_and_obstacles_stay_when_a_new_map_comes(bench: Bench) -> None:
    """As with SLAM, whose map grows while the robot drives: no plan leads through what is not looked at."""
    robot = Robot(bench, open_room())
    server = MapServerNode(bench.bus, map_of_room())
    zone = with_zone(empty_mask(map_of_room()), rectangle(-1.0, -1.0, 0.0, -0.5), 100)
    serve_mask(bench, "keepout", zone)
    node = costmap(bench, robot, keepout_filter_info_topic="keepout_info")
    robot.room.add_box(-1.2, 0.8, -1.0, 1.2)
    bench.run(1.0)
    robot.blind = True
    bench.run(0.5)
    publisher = bench.node.create_publisher(OccupancyGrid, "/map", LATCHED)
    for grid in (map_of_room(), grown(map_of_room(), 7)):
        publisher.publish(grid_msg(grid.data, grid.resolution, grid.origin, "map", bench.clock.now_ns))
        for _ in range(15):
            bench.tick()
            assert at(node, -0.5, -0.75) == 254, "the zone"
            assert at(node, -0.98, 1.0) == 254, "the box"
        assert node.costmap is not None
        assert node.costmap.costs.shape == grid.data.shape
    assert server.message.info.width == 140
