"""Grids that clients look at in tiles: each is heard as long as somebody asks for it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from twin.bridge.msgs import OccupancyGrid, OccupancyGridUpdate
from twin.errors import BridgeError
from twin.web.rosbridge.frames import Heard
from twin.web.rosbridge.http.look import Ask, NoTopicError, fault_of
from twin.web.rosbridge.http.tiles import Tiles

if TYPE_CHECKING:
    from twin.web.rosbridge.bridge import Bridge

GRID, UPDATE = OccupancyGrid.__msgtype__, OccupancyGridUpdate.__msgtype__
_KEEP_S = 60.0
"""How long a grid is heard after it was asked for."""


class Map:
    """A grid, and what updates it."""

    def __init__(self, ask: Ask, topic: str) -> None:
        self.tiles = Tiles()
        self.fault = ""
        self.ready = asyncio.Event()
        """Set when there is a grid, or none to come."""
        self.asked_s = 0.0
        self._ask, self._topic = ask, topic
        self._loop = asyncio.get_running_loop()
        ask(self._begin)

    def close(self) -> None:
        """Hear no more."""
        self._ask(self._end)

    def _begin(self, bridge: Bridge) -> None:
        self.fault = fault_of(bridge, self._topic, (GRID,))
        if self.fault:
            self._tell()
            return
        bridge.topics.watch(self, f"{self._topic}_updates", self._on_update, UPDATE)
        bridge.topics.watch(self, self._topic, self._on_grid, GRID, self.tiles.forget)

    def _end(self, bridge: Bridge) -> None:
        for topic in (self._topic, f"{self._topic}_updates"):
            bridge.topics.unwatch(self, topic)

    def _on_grid(self, heard: Heard) -> None:
        try:
            if heard.sample.type == GRID:
                self.tiles.put(heard.message)
                self._tell()
        except BridgeError:
            return  # bytes that are no grid

    def _on_update(self, heard: Heard) -> None:
        try:
            if heard.sample.type == UPDATE:
                self.tiles.patch(heard.message)
        except BridgeError:
            return

    def _tell(self) -> None:
        try:
            self._loop.call_soon_threadsafe(self.ready.set)
        except RuntimeError:
            return  # the server has ended


class Maps:
    """Those that are asked for; in the server's thread."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._open: dict[str, Map] = {}

    async def tiles(self, topic: str, patience_s: float) -> Tiles:
        """Return the tiles of a topic.

        Raises:
            NoTopicError: nobody publishes it, or something else than grids.
            TimeoutError: no grid has come.
        """
        now_s = asyncio.get_running_loop().time()
        for name, each in tuple(self._open.items()):
            if now_s - each.asked_s > _KEEP_S and name != topic:
                self._open.pop(name).close()
        found = self._open.get(topic)
        if found is None:
            found = self._open[topic] = Map(self._ask, topic)
        found.asked_s = now_s
        async with asyncio.timeout(patience_s):
            await found.ready.wait()
        if found.fault:
            self._open.pop(topic, None)
            raise NoTopicError(found.fault)
        return found.tiles
