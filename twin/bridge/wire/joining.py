"""Which graph a process joins: what it is told, else what the environment says, as ROS does it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from twin.bridge.wire import DEFAULT_ENDPOINT, Wire
from twin.bridge.wire.session import SessionConfig, endpoints
from twin.errors import BridgeError


def session_to_join(
    connect: Sequence[str] | None = None,
    *,
    listen: Sequence[str] = (),
    config: Path | None = None,
    domain_id: int | None = None,
    timeout_s: float = 3.0,
    wire: Wire = "rmw_zenoh",
) -> SessionConfig:
    """Return a Zenoh client without a listener, or a peer if it is to listen; arguments as of `live.join`.

    Nothing to connect to is added where `listen` or the file says enough.

    Raises:
        BridgeError: the file or ROS_DOMAIN_ID cannot be used.
    """
    uri = os.environ.get("ZENOH_SESSION_CONFIG_URI")
    file = config or (Path(uri) if uri else None)
    if connect is None:
        enough = listen or (file and (endpoints(file, "connect") or endpoints(file, "listen")))
        connect = () if enough else (os.environ.get("TWIN_CONNECT") or DEFAULT_ENDPOINT,)
    return SessionConfig(
        mode="peer" if listen else "client",
        wire=wire,
        listen=tuple(listen),
        connect=tuple(connect),
        file=file,
        timeout_s=timeout_s,
        domain_id=_domain_id() if domain_id is None else domain_id,
    )


def _domain_id() -> int:
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isdecimal() or int(text) > 232:
        raise BridgeError(f"ROS_DOMAIN_ID is {text!r}; valid is a number from 0 to 232")
    return int(text)
