"""The page's map of a large hall in a browser, in tiles and whole."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.web.hall import Robot, hall, opened, walls
from tests.web.test_page import CHROMIUM, eventually
from twin.bridge.bus import Bus
from twin.bridge.msgs import OccupancyGridUpdate, header
from twin.bridge.qos import LATCHED

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}"),
]
SIDE = 2000
MIDDLE = """() => {
    const canvas = document.querySelector('canvas.map'), c = canvas.getContext('2d');
    return [...c.getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data].slice(0, 3);
}"""
WALL, FREE = [185, 201, 208], [34, 49, 58]


def large() -> Any:
    """Return a hall of 2000 x 2000 cells with shelves, and a wall in its middle."""
    data = walls(SIDE, SIDE)
    data[100:-100:60, 100:-100] = 100
    data[:, 40::400] = 0
    data[SIDE // 2 - 20 : SIDE // 2 + 20, SIDE // 2 - 20 : SIDE // 2 + 20] = 100
    return data


def test_a_large_hall_is_seen_in_tiles_and_changes_where_it_changes() -> None:
    updates: list[Any] = []

    def costmap(bus: Bus, robot: Robot) -> None:
        grid = robot.node.create_publisher(type(robot.grid(large())), "/global_costmap/costmap", LATCHED)
        grid.publish(robot.grid(np.zeros((SIDE, SIDE))))
        updates.append(
            robot.node.create_publisher(OccupancyGridUpdate, "/global_costmap/costmap_updates", LATCHED)
        )

    with hall(large(), costmap) as (address, _), opened(address, 400, 800) as page:
        asked: list[str] = []
        eventually(lambda: page.evaluate(MIDDLE) == WALL, "the wall in the middle is seen")
        page.wait_for_timeout(3000)
        page.on("request", lambda request: asked.append(request.url))
        message = OccupancyGridUpdate(
            header(1, "map"), x=990, y=990, width=20, height=20, data=np.full(400, 100, np.int8)
        )
        updates[0].publish(message)
        eventually(lambda: page.evaluate(MIDDLE) != WALL, "what the costmap says lies over it")
        page.wait_for_timeout(1500)
        tiles = [url for url in asked if "/tiles/" in url]
        assert 1 <= len(tiles) <= 6, "around the middle, and no others"
        assert all("costmap" in url for url in tiles)

        # Near, the finest tiles are seen; every wall has its place.
        for _ in range(12):
            page.click("button[aria-label='Zoom in']")
        page.click("#theme")
        page.click("#theme")
        eventually(lambda: page.evaluate(MIDDLE) != FREE, "the wall is still there")
        eventually(lambda: any("/tiles/3/" in url for url in asked), "the finest tiles are asked for")
        page.click("#tool-view3d")
        page.wait_for_selector("canvas.scene")


def test_where_there_are_no_tiles_the_grid_comes_whole_and_updates_are_laid_over_it() -> None:
    updates: list[Any] = []

    def costmap(bus: Bus, robot: Robot) -> None:
        grid = robot.node.create_publisher(type(robot.grid(walls(1, 1))), "/global_costmap/costmap", LATCHED)
        grid.publish(robot.grid(np.zeros((120, 160))))
        updates.append(
            robot.node.create_publisher(OccupancyGridUpdate, "/global_costmap/costmap_updates", LATCHED)
        )

    with hall(more=costmap) as (address, _), opened("about:blank", ready=False) as page:
        page.route("**/tiles.json?*", lambda route: route.fulfill(status=404))
        page.goto(address)
        eventually(lambda: page.evaluate(MIDDLE) == FREE, "the hall is seen")
        data = np.full(400, 100, np.int8)
        updates[0].publish(OccupancyGridUpdate(header(1, "map"), x=70, y=50, width=20, height=20, data=data))
        eventually(lambda: page.evaluate(MIDDLE) != FREE, "the update is seen")
