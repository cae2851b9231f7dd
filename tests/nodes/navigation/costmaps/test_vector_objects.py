"""Zones that are drawn during a run: the costmap keeps out of them, and what is none is a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge import types
from twin.bridge.msgs import CostmapFilterInfo, OccupancyGrid, Point32, new
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import AddShapes, GetShapes, RemoveShapes
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.maps.zones import empty_mask, rectangle, with_zone
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.costmaps.filter_info import CostmapFilterInfoConfig, CostmapFilterInfoNode
from twin.nodes.navigation.costmaps.vector_objects import VectorObjectServerConfig, VectorObjectServerNode
from twin.nodes.navigation.mapping.map_server import MapServerNode, occupancy_map

POLYGON, CIRCLE = (types.get(f"nav2_msgs/msg/{kind}Object") for kind in ("Polygon", "Circle"))
SQUARE = ((-1.0, -1.0), (0.0, -1.0), (0.0, -0.5), (-1.0, -0.5))
INSIDE = (-0.5, -0.75)


def polygon(corners: Any = SQUARE, **fields: Any) -> Any:
    points = [Point32(float(x), float(y), 0.0) for x, y in corners]
    return new(POLYGON, **{"points": points, "closed": True, "value": 100, **fields})


def request(*polygons: Any, circles: tuple[Any, ...] = ()) -> Any:
    return AddShapes.Request(circles=list(circles), polygons=list(polygons))


def serve(bench: Bench, below: str = "") -> None:
    config = CostmapFilterInfoConfig(filter_info_topic="zones_info", mask_topic="vo_map")
    info = CostmapFilterInfoNode(bench.bus, config)
    VectorObjectServerNode(bench.bus, VectorObjectServerConfig(), info.announce, below=below)


def shapes(bench: Bench) -> Any:
    return bench.call(GetShapes, "vector_object_server/get_shapes", GetShapes.Request())


def add(bench: Bench, wanted: Any) -> bool:
    done: bool = bench.call(AddShapes, "vector_object_server/add_shapes", wanted).success
    bench.run(0.5)
    return done


def remove(bench: Bench, *uuids: Any, everything: bool = False) -> bool:
    wanted = RemoveShapes.Request(all_objects=everything, uuids=list(uuids))
    done: bool = bench.call(RemoveShapes, "vector_object_server/remove_shapes", wanted).success
    bench.run(0.5)
    return done


@pytest.fixture
def node(bench: Bench) -> CostmapNode:
    """A costmap that hears of zones."""
    robot = Robot(bench, open_room())
    MapServerNode(bench.bus, map_of_room())
    serve(bench)
    layers = CostmapConfig(
        footprint=((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)), inflation_radius=0.2
    )
    config = CostmapNodeConfig(
        name="global_costmap", frame="map", layers=layers, keepout_filter_info_topic="zones_info"
    )
    made = CostmapNode(bench.bus, robot.pose_lookup, config)
    bench.run(0.5)
    return made


def cost(node: CostmapNode, at: tuple[float, float] = INSIDE) -> int:
    assert node.costmap is not None
    return node.costmap.cost_at(*at)


def test_a_zone_is_kept_out_of_until_it_is_removed(bench: Bench, node: CostmapNode) -> None:
    heard = bench.listen(CostmapFilterInfo, "zones_info", LATCHED)
    assert cost(node) == 0
    assert not heard, "as long as there is no zone, nothing is said"
    assert add(bench, request(polygon()))
    assert cost(node) == 254
    (drawn,) = shapes(bench).polygons
    assert [(p.x, p.y) for p in drawn.points] == list(SQUARE)
    assert not remove(bench, type(drawn.uuid)(np.full(16, 9, np.uint8)))
    assert cost(node) == 254
    assert remove(bench, drawn.uuid)
    assert cost(node) == 0
    assert not shapes(bench).polygons


def test_a_shape_of_the_same_name_takes_its_place_and_circles_are_zones_too(
    bench: Bench, node: CostmapNode
) -> None:
    circle = new(CIRCLE, center=Point32(0.5, 0.5, 0.0), radius=0.3, fill=True, value=100)
    assert add(bench, request(polygon(), circles=(circle,)))
    (drawn,) = shapes(bench).polygons
    assert cost(node, (0.6, 0.4)) == 254
    moved = [(x, y + 1.0) for x, y in SQUARE]
    assert add(bench, request(polygon(moved, uuid=drawn.uuid)))
    assert len(shapes(bench).polygons) == 1
    assert cost(node) == 0
    assert cost(node, (INSIDE[0], INSIDE[1] + 1.0)) == 254
    assert remove(bench, everything=True)
    assert cost(node, (0.6, 0.4)) == 0


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (polygon(SQUARE[:2]), "three corners or more"),
        (polygon([*SQUARE[:3], (float("nan"), 0.0)]), "three corners or more"),
        (polygon([SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]), "edges 1 and 3 of the zone cross"),
        (polygon([(x + 100.0, y) for x, y in SQUARE]), "no cell of the mask lies in the zone"),
        (polygon(closed=False), "open polygon"),
        (polygon(value=101), "value is 101"),
        (polygon([(np.cos(a), np.sin(a)) for a in np.linspace(0, 6, 501)]), "500 corners at most"),
        (polygon(header=new(types.get("std_msgs/msg/Header"), frame_id="odom")), "in the frame 'odom'"),
    ],
)
def test_what_is_no_zone_is_a_sentence_and_nothing_is_added(
    bench: Bench, node: CostmapNode, wrong: Any, words: str
) -> None:
    said = bench.logs()
    assert not add(bench, request(polygon(), wrong))
    assert any(words in line for line in said), said
    assert not shapes(bench).polygons
    assert cost(node) == 0


def test_zones_are_laid_over_a_mask_of_a_file_and_follow_another_map(bench: Bench) -> None:
    mask = with_zone(empty_mask(map_of_room()), rectangle(0.5, 0.5, 1.0, 1.0), 100)
    MapServerNode(bench.bus, mask, name="mask_server", topic="keepout_filter_mask")
    serve(bench, below="keepout_filter_mask")
    heard = bench.listen(OccupancyGrid, "vo_map", LATCHED)
    bench.run(0.2)
    assert np.array_equal(occupancy_map(heard[-1]).data, mask.data)
    assert add(bench, request(polygon()))
    assert np.array_equal(occupancy_map(heard[-1]).data, with_zone(mask, SQUARE, 100).data)


def test_another_map_has_the_zones_on_its_own_cells(bench: Bench) -> None:
    server = MapServerNode(bench.bus, map_of_room())
    serve(bench)
    heard = bench.listen(OccupancyGrid, "vo_map", LATCHED)
    bench.run(0.2)
    assert add(bench, request(polygon()))
    room = map_of_room()
    data = np.repeat(np.repeat(room.data, 2, 0), 2, 1)
    fine = OccupancyMap(data=data, resolution=room.resolution / 2, origin=room.origin)
    server._serve(fine)
    bench.run(0.2)
    drawn = occupancy_map(heard[-1])
    assert drawn.data.shape == fine.data.shape
    assert drawn.value_at(INSIDE) == 100
    assert drawn.value_at((0.7, 0.7)) == -1, "beside zones it says nothing"
