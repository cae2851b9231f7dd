"""A process that is a bridge: joins a graph, listens, and works until it is told to end."""

from __future__ import annotations

import logging
from collections.abc import Callable
from logging.handlers import RotatingFileHandler
from pathlib import Path

from twin.bridge.bags.reader import BagReader
from twin.bridge.graph import Graph
from twin.bridge.live import LiveBus
from twin.errors import BridgeError
from twin.web.rosbridge.bridge import Bridge, BridgeConfig
from twin.web.rosbridge.server import Server, ServerConfig

PAGE = Path(__file__).parents[1] / "page"
"""The operator's page."""
_BUSY_S, _IDLE_S = 0.01, 0.1
_AUDIT_BYTES = 50_000_000


class Rosbridge:
    """A bridge and its server on one bus."""

    def __init__(
        self,
        process: LiveBus,
        config: ServerConfig,
        bridging: BridgeConfig,
        bag: BagReader | None = None,
    ) -> None:
        """Join and listen; with a bag its topics are there as well.

        Raises:
            RecordingError: see `Bridge`.
            BridgeError: see `Server.start`; or the extra is not installed.
        """
        try:
            import cbor2
            import orjson
            import websockets  # noqa: F401
        except ImportError as error:
            raise BridgeError(f"rosbridge needs {error.name}: pip install 'twin[web]'") from None
        del cbor2, orjson
        self._process = process
        self._graph = Graph.watch(process.bus)
        process.bus.starting()
        self.bridge = Bridge(process.bus, self._graph, bridging, bag=bag)
        process.bus.started()
        self.server = Server(config, bridging.limits, process.bus.external.wake)
        self.bridge.topics.urgent = lambda: self.server.stop(self.bridge)
        self.bridge.topics.together = self.server.together
        self.server.start()

    def spin(self, until: Callable[[], bool]) -> None:
        """Work until a condition holds."""
        while not until():
            self._process.spin_once(_BUSY_S if self.bridge.is_waiting else _IDLE_S)
            self.server.work(self.bridge)
            self.bridge.update()

    def close(self) -> None:
        """Disconnect everybody; what clients moved is stopped."""
        self.server.close()
        self.server.work(self.bridge)
        self._graph.close()


def audit_file(file: Path) -> Callable[[str], None]:
    """Return what appends lines to a file; a full one is kept once as FILE.1.

    Raises:
        BridgeError: it cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handler = RotatingFileHandler(
            file, maxBytes=_AUDIT_BYTES, backupCount=1, encoding="utf-8", delay=True
        )
    except OSError as error:
        raise BridgeError(f"{file}: the audit cannot be written: {error}") from None
    return lambda line: handler.emit(logging.makeLogRecord({"msg": line}))
