"""A Zenoh router in this process, as rmw_zenohd is one: ROS 2 nodes meet at it.

Source: rmw_zenoh zenohd/main.cpp, DEFAULT_RMW_ZENOH_ROUTER_CONFIG.json5.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from twin.bridge.wire import DEFAULT_ENDPOINT
from twin.bridge.wire.session import SessionConfig, endpoints, open_session


def router_session(
    listen: Sequence[str] = (), *, connect: Sequence[str] = (), file: Path | None = None
) -> SessionConfig:
    """Return the session that is a router.

    Args:
        listen: Endpoints; empty: what `file` says, else rmw_zenoh's port on the loopback interface only.
        connect: Other routers.
        file: A Zenoh configuration, as rmw_zenohd's ZENOH_ROUTER_CONFIG_URI.

    Raises:
        BridgeError: the file cannot be used.
    """
    listens = tuple(listen) or (endpoints(file, "listen") if file is not None else ())
    return SessionConfig(
        mode="router", listen=listens or (DEFAULT_ENDPOINT,), connect=tuple(connect), file=file
    )


@contextmanager
def run_router(settings: SessionConfig) -> Iterator[str]:
    """Run a router in Zenoh's threads until the end of the block; give its session's id, hexadecimal.

    Raises:
        BridgeError: an endpoint or the file cannot be used.
    """
    session = open_session(settings)
    try:
        yield str(session.zid())
    finally:
        session.close()  # type: ignore[no-untyped-call]
