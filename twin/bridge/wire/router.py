"""A Zenoh router in this process, as rmw_zenohd is one: ROS 2 nodes meet at it.

Source: rmw_zenoh zenohd/main.cpp, DEFAULT_RMW_ZENOH_ROUTER_CONFIG.json5.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from twin.bridge.live import DEFAULT_ENDPOINT
from twin.bridge.wire.session import SessionConfig, endpoints, open_session


@dataclass(frozen=True, kw_only=True)
class RouterConfig:
    """Where a router listens."""

    listen: tuple[str, ...] = ()
    """Endpoints; empty: what `file` says, else rmw_zenoh's port on the loopback interface only."""
    connect: tuple[str, ...] = ()
    """Other routers."""
    file: Path | None = None
    """A Zenoh configuration, as rmw_zenohd's ZENOH_ROUTER_CONFIG_URI."""

    def session(self) -> SessionConfig:
        """Return the session that is this router."""
        listens = self.listen or (endpoints(self.file, "listen") if self.file is not None else ())
        return SessionConfig(
            mode="router", listen=listens or (DEFAULT_ENDPOINT,), connect=self.connect, file=self.file
        )


@dataclass(frozen=True)
class Router:
    """A router that runs."""

    session_id: str
    """Hexadecimal."""
    listen: tuple[str, ...]


@contextmanager
def run_router(config: RouterConfig) -> Iterator[Router]:
    """Run a router in Zenoh's threads until the end of the block.

    Raises:
        BridgeError: an endpoint or the file cannot be used.
    """
    settings = config.session()
    session = open_session(settings)
    try:
        yield Router(str(session.zid()), settings.listen)
    finally:
        session.close()  # type: ignore[no-untyped-call]
