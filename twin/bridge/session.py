"""One Zenoh session: no scouting, no listener unless asked for, an id that depends on its name only."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import xxhash
import zenoh

from twin.errors import BridgeError


@dataclass(frozen=True, kw_only=True)
class SessionConfig:
    """How a session takes part in a network."""

    mode: Literal["peer", "client", "router"] = "peer"
    listen: tuple[str, ...] = ()
    """Endpoints such as tcp/127.0.0.1:7447."""
    connect: tuple[str, ...] = ()
    """Endpoints; a peer retries an absent one in the background, a client fails after `timeout_s`."""
    name: str = ""
    """The session's id is a hash of this; empty: random (sessions of the same id cannot meet)."""
    file: Path | None = None
    """A Zenoh configuration (JSON5 or YAML) with any setting; endpoints given here go before its own."""
    timeout_s: float = 3.0
    """How long a client tries to connect [s] of wall time."""

    @property
    def networked(self) -> bool:
        """Whether other processes may take part."""
        return bool(self.listen or self.connect or self.file)


def open_session(config: SessionConfig) -> zenoh.Session:
    """Open a session.

    Raises:
        BridgeError: an endpoint or the file cannot be used, for example because a port is taken.
    """
    settings = _zenoh_config(config)
    try:
        return zenoh.open(settings)
    except zenoh.ZError as error:
        where = ", ".join((*config.listen, *config.connect)) or str(config.file)
        if config.mode == "client":
            raise BridgeError(
                f"nobody answers at {where}; start `twin run … --listen {where}` or `twin router` first, "
                "or name another endpoint with --connect"
            ) from error
        raise BridgeError(
            f"the bus cannot use {where}: {_reason(error)}; is the port taken by another process? {_FORM}"
        ) from error


_FORM = "An endpoint looks like tcp/127.0.0.1:7447"


def _zenoh_config(config: SessionConfig) -> zenoh.Config:
    if config.file is None:
        result, settings = zenoh.Config(), _settings(config)
    else:
        try:
            result = zenoh.Config.from_file(str(config.file))
        except zenoh.ZError as error:
            raise BridgeError(f"{config.file}: not a Zenoh configuration: {_reason(error)}") from error
        settings = {f"{key}/endpoints": list(getattr(config, key)) for key in ("listen", "connect")}
        settings = {key: value for key, value in settings.items() if value}
    for key, value in settings.items():
        try:
            result.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise BridgeError(f"{key} {_listed(value)} is not valid: {_reason(error)}; {_FORM}") from error
    return result


def _settings(config: SessionConfig) -> dict[str, Any]:
    client = config.mode == "client"
    settings: dict[str, Any] = {
        "mode": config.mode,
        "scouting/multicast/enabled": False,
        # How a router introduces rmw_zenoh's peers to each other.
        "scouting/gossip/enabled": config.networked,
        "listen/endpoints": list(config.listen),
        "listen/exit_on_failure": True,
        "connect/endpoints": list(config.connect),
        "connect/timeout_ms": round(config.timeout_s * 1e3) if client else -1,
        "connect/exit_on_failure": client,
        "timestamping/enabled": True,  # transient_local's history needs it
        "transport/shared_memory/enabled": False,
    }
    if config.name:
        # An id may not start with a zero digit.
        settings["id"] = "7" + xxhash.xxh3_128_hexdigest(config.name.encode())[1:]
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
