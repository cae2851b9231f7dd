"""Maps in tiles: every cell is in its tile, and only what has changed is asked for again."""

from __future__ import annotations

import json
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image

from tests.processes import wait_for
from tests.web.serving import get, refused, serving
from twin.bridge.bus import Bus
from twin.bridge.msgs import OccupancyGrid, OccupancyGridUpdate, String, header
from twin.bridge.qos import LATCHED
from twin.geometry import Pose2
from twin.nodes.navigation.mapping.map_server import grid_msg
from twin.web.rosbridge.access import ROLES, RoleRules, Token
from twin.web.rosbridge.bridge import Limits
from twin.web.rosbridge.http.tiles import Tiles
from twin.web.rosbridge.server import ServerConfig

RNG = np.random.default_rng(7)
CELLS = RNG.choice(np.array([-1, 0, 40, 100], np.int8), (700, 1100))


def grid(cells: Any = CELLS, stamp_ns: int = 0) -> OccupancyGrid:
    return grid_msg(cells, 0.05, Pose2(-3.0, 2.0, 0.0), "map", stamp_ns)


def update(x: int, y: int, cells: Any, stamp_ns: int = 0) -> Any:
    height, width = np.shape(cells)
    data = np.asarray(cells, np.int8).ravel()
    return OccupancyGridUpdate(header(stamp_ns, "map"), x=x, y=y, width=width, height=height, data=data)


def cells_of(file: bytes) -> Any:
    """Return the cells of a tile, the first row first."""
    return np.asarray(Image.open(BytesIO(file)))[::-1].astype(np.uint8).view(np.int8)


def whole(tiles: Tiles, z: int) -> Any:
    """Return the grid of a level, put together."""
    rows = []
    while (tiles.png(z, 0, len(rows))) is not None:
        row: list[Any] = []
        while (made := tiles.png(z, len(row), len(rows))) is not None:
            row.append(cells_of(made[1]))
        rows.append(np.hstack(row))
    return np.vstack(rows)


def test_the_finest_tiles_are_the_grid_and_coarse_ones_show_every_wall() -> None:
    tiles = Tiles()
    tiles.put(grid())
    assert tiles.levels == 4
    assert np.array_equal(whole(tiles, 3), CELLS)
    for z in range(3):
        times = 2 ** (3 - z)
        coarse = whole(tiles, z)
        assert coarse.shape == (-(-700 // times), -(-1100 // times))
        for _ in range(20):
            y, x = (int(RNG.integers(side)) for side in coarse.shape)
            block = CELLS[y * times : (y + 1) * times, x * times : (x + 1) * times]
            assert coarse[y, x] == block.max()


def test_a_change_makes_only_its_tiles_new() -> None:
    tiles = Tiles()
    tiles.put(grid())
    before = tiles.describe()
    assert before["changed"] is None
    versions = {(z, x, y): tiles.png(z, x, y)[0] for z, x, y in ((3, 0, 0), (3, 1, 0), (2, 0, 0), (2, 1, 1))}  # type: ignore[index]
    tiles.patch(update(300, 10, CELLS[10:20, 300:310]))  # the same cells: nothing is new
    assert tiles.describe(before["version"])["changed"] == []
    tiles.patch(update(300, 10, np.full((10, 10), 77)))
    after = tiles.describe(before["version"])
    assert after["changed"] == [[1, 0]]
    assert tiles.png(3, 1, 0)[0] > versions[3, 1, 0]  # type: ignore[index]
    assert tiles.png(2, 0, 0)[0] > versions[2, 0, 0]  # type: ignore[index]
    for same in ((3, 0, 0), (2, 1, 1)):
        assert tiles.png(*same)[0] == versions[same]  # type: ignore[index]
    assert whole(tiles, 3)[10:20, 300:310].tolist() == np.full((10, 10), 77).tolist()


def test_another_size_makes_all_new_and_a_late_grid_gets_the_update_that_was_there() -> None:
    tiles = Tiles()
    tiles.patch(update(1, 2, [[5, 6]], stamp_ns=9))
    tiles.put(grid(stamp_ns=8))
    assert whole(tiles, 3)[2, 1:3].tolist() == [5, 6]
    version = tiles.version
    tiles.put(grid(CELLS[:300], stamp_ns=10))
    assert tiles.describe(version)["changed"] is None
    assert np.array_equal(whole(tiles, tiles.levels - 1), CELLS[:300])  # the update was of before


def test_what_does_not_fit_changes_nothing() -> None:
    tiles = Tiles()
    tiles.put(grid())
    version = tiles.version
    for x, y, cells in ((1095, 0, np.ones((1, 10))), (0, 695, np.ones((10, 1))), (0, 0, np.ones((0, 0)))):
        tiles.patch(update(x, y, cells))
    short = grid()
    short.data = short.data[:-1]
    tiles.put(short)
    assert tiles.version == version
    for at in ((4, 0, 0), (0, 1, 0), (3, 5, 0), (3, 0, 3), (99, 0, 0)):
        assert tiles.png(*at) is None


def test_tiles_are_served_by_the_rules_of_their_topic() -> None:
    made: list[Any] = []

    def nodes(bus: Bus) -> None:
        node = bus.create_node("maps")
        made.append(node.create_publisher(OccupancyGrid, "/map", LATCHED))
        made.append(node.create_publisher(OccupancyGridUpdate, "/map_updates", LATCHED))
        made[0].publish(grid())
        node.create_publisher(String, "/words", 1)
        node.create_publisher(OccupancyGrid, "/silent", LATCHED)

    secret = "viewer-0123456789"
    viewer = RoleRules(subscribe=("/map", "/words", "/silent", "/nothing")).of(ROLES["viewer"])
    config = ServerConfig(port=0, tokens=(Token(secret, viewer, "screen"),))
    with serving(config, Limits(stalled_s=0.3), nodes) as server:
        mine = f"token={secret}&topic=/map"
        with get(server, f"/tiles.json?{mine}") as answer:
            told = json.load(answer)
        assert (told["width"], told["height"], told["levels"], told["tile"]) == (1100, 700, 4, 256)
        assert told["origin"]["position"] == {"x": -3.0, "y": 2.0, "z": 0.0}
        with get(server, f"/tiles/3/4/2.png?{mine}") as answer:
            tag = answer.headers["ETag"]
            assert np.array_equal(cells_of(answer.read()), CELLS[512:, 1024:])
        assert refused(server, f"/tiles/3/4/2.png?{mine}", If_None_Match=tag)[0] == 304
        made[1].publish(update(1090, 690, np.full((2, 2), 12)))

        def changed() -> Any:
            with get(server, f"/tiles.json?{mine}&since={told['version']}") as answer:
                return json.load(answer)["changed"]

        wait_for(lambda: changed() == [[4, 2]])
        with get(server, f"/tiles/3/4/2.png?{mine}", If_None_Match=tag) as answer:
            assert cells_of(answer.read())[690 - 512, 1090 - 1024] == 12
        for path, code, words in (
            ("/tiles.json?topic=/map", 401, "token"),
            (f"/tiles.json?token={secret}&topic=/other", 403, "not for the role viewer"),
            (f"/tiles.json?token={secret}&topic=/nothing", 404, "nobody publishes"),
            (f"/tiles.json?token={secret}&topic=/words", 404, "is a std_msgs/msg/String"),
            (f"/tiles.json?token={secret}&topic=/silent", 504, "nothing came"),
            (f"/tiles.json?token={secret}", 400, "?topic="),
            (f"/tiles/9/0/0.png?{mine}", 404, "no tile"),
            (f"/tiles/-1/0/0.png?{mine}", 404, "not found"),
        ):
            status, told_words = refused(server, path)
            assert (status, words in told_words) == (code, True), (path, status, told_words)
