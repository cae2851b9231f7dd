"""One Zenoh session: no scouting, no listener unless asked for, an id that depends on its name only."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import xxhash
import zenoh

from twin.errors import BridgeError


def open_session(name: str, listen: Sequence[str], connect: Sequence[str]) -> zenoh.Session:
    """Open a session.

    Args:
        name: Its id is a hash of this; empty: random (sessions of the same id cannot meet on a network).
        listen: Endpoints such as tcp/127.0.0.1:7447.
        connect: Endpoints; one that is absent is retried in the background.

    Raises:
        BridgeError: an endpoint cannot be used, for example because its port is taken.
    """
    config = zenoh.Config()
    for key, value in _settings(name, listen, connect).items():
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise BridgeError(f"{key} {_listed(value)} is not valid: {_reason(error)}; {_FORM}") from error
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        where = _listed([*listen, *connect])
        raise BridgeError(
            f"the bus cannot use {where}: {_reason(error)}; is the port taken by another process? {_FORM}"
        ) from error


_FORM = "An endpoint looks like tcp/127.0.0.1:7447"


def _settings(name: str, listen: Sequence[str], connect: Sequence[str]) -> dict[str, Any]:
    networked = bool(listen or connect)
    settings: dict[str, Any] = {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": networked,  # how a router introduces rmw_zenoh's peers to each other
        "listen/endpoints": list(listen),
        "listen/exit_on_failure": True,
        "connect/endpoints": list(connect),
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "timestamping/enabled": True,  # transient_local's history needs it
        "transport/shared_memory/enabled": False,
    }
    if name:
        # An id may not start with a zero digit.
        settings["id"] = "7" + xxhash.xxh3_128_hexdigest(name.encode())[1:]
    return settings


def _reason(error: zenoh.ZError) -> str:
    """Return Zenoh's words without the place in its sources."""
    return str(error).split(" at /")[0].strip().rstrip(".")


def _listed(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def direct(callback: Callable[[Any], None], drop: Callable[[], None] | None = None) -> Any:
    """Return a handler that Zenoh calls in the thread that puts: synchronously for the own session's samples.

    Indirect handlers, the default, hand over to a thread: not deterministic, and alive at interpreter exit.
    """
    return zenoh.handlers.Callback(callback, drop, indirect=False)
