"""One Zenoh session: no scouting, no listener unless asked for, an id that depends on its name only.

And which graph a process joins: what it is told, else what the environment says, as ROS does it.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import xxhash
import zenoh

from twin.bridge.wire import DEFAULT_ENDPOINT, Wire
from twin.bridge.wire.interrupts import from_zenoh
from twin.errors import BridgeError, NobodyAnswersError
from twin.files.reading import refusal


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


OVERRIDE_VARIABLE = "ZENOH_CONFIG_OVERRIDE"
"""rmw_zenoh's: 'key=value;key=value', values in JSON5 (zenoh_config.cpp)."""


_RETRY_S = 0.1
_ATTEMPT_S = 3.0
"""How long somebody who lets us connect may take to answer."""


@dataclass(frozen=True, kw_only=True)
class SessionConfig:
    """How a session takes part in a network."""

    mode: Literal["peer", "client", "router"] = "peer"
    """What it is if `file` does not say."""
    listen: tuple[str, ...] = ()
    """Endpoints such as tcp/127.0.0.1:7447."""
    connect: tuple[str, ...] = ()
    """Endpoints; a peer retries an absent one in the background, a client fails after `timeout_s`."""
    name: str = ""
    """The session's id is a hash of this; empty: random (sessions of the same id cannot meet)."""
    file: Path | None = None
    """A Zenoh configuration (JSON5 or YAML) with any setting; endpoints given here go before its own.

    What it does not mention stays closed: it listens and scouts only if it says so.
    """
    timeout_s: float = 3.0
    """How long a client tries to connect [s] of wall time."""
    wire: Wire = "rmw_zenoh"
    """How keys and tokens are spelled."""
    domain_id: int = 0
    """ROS_DOMAIN_ID."""

    @property
    def networked(self) -> bool:
        """Whether other processes may take part."""
        return bool(self.listen or self.connect or self.file)


def open_session(config: SessionConfig) -> zenoh.Session:
    """Open a session; one that is networked honours ZENOH_CONFIG_OVERRIDE.

    Raises:
        BridgeError: an endpoint, the file or the variable cannot be used; a port may be taken.
    """
    settings = _zenoh_config(config)
    try:
        return _opened(settings, config.timeout_s)
    except zenoh.ZError as error:
        where = ", ".join((*config.listen, *config.connect)) or str(config.file)
        if settings.get_json("mode") == '"client"':
            raise NobodyAnswersError(
                f"nobody answers at {where}; start `twin run … --listen {where}` or `twin router` first, "
                "or name another endpoint with --connect"
            ) from error
        raise BridgeError(
            f"the bus cannot use {where}: {_reason(error)}; is the port taken by another process? {_FORM}"
        ) from error


def _opened(settings: zenoh.Config, timeout_s: float) -> zenoh.Session:
    """Open; a client tries again and again, as nothing can interrupt Zenoh while it waits by itself."""
    end = time.monotonic() + timeout_s * (settings.get_json("mode") == '"client"')
    while True:
        try:
            return zenoh.open(settings)
        except zenoh.ZError:
            if time.monotonic() >= end:
                raise
        time.sleep(_RETRY_S)


def endpoints(file: Path, key: Literal["listen", "connect"]) -> tuple[str, ...]:
    """Return the endpoints that a configuration names, for whatever mode; not Zenoh's default ones.

    Raises:
        BridgeError: the file is no Zenoh configuration.
    """
    found = json.loads(_from_file(file).get_json(f"{key}/endpoints"))
    if found == _default(f"{key}/endpoints"):
        return ()
    return tuple(found) if isinstance(found, list) else tuple(e for part in found.values() for e in part)


_FORM = "An endpoint looks like tcp/127.0.0.1:7447"


def _zenoh_config(config: SessionConfig) -> zenoh.Config:
    result = zenoh.Config() if config.file is None else _from_file(config.file)
    settings = _settings(config)
    if config.file is not None:
        settings = {
            key: value
            for key, value in settings.items()
            if json.loads(result.get_json(key)) == _default(key) or getattr(config, key.split("/")[0], None)
        }
        settings.pop("transport/shared_memory/enabled", None)  # on by default: unsaid and said look the same
    for key, value in settings.items():
        try:
            result.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise BridgeError(f"{key} {_listed(value)} is not valid: {_reason(error)}; {_FORM}") from error
    if config.networked:
        _override(result, os.environ)
    return result


def _from_file(file: Path) -> zenoh.Config:
    why = refusal(file)
    if why is not None:
        raise BridgeError(f"{file}: not a Zenoh configuration: {why}")
    try:
        return zenoh.Config.from_file(str(file))
    except zenoh.ZError as error:
        raise BridgeError(f"{file}: not a Zenoh configuration: {_reason(error)}") from error


def _default(key: str) -> Any:
    return json.loads(zenoh.Config().get_json(key))


def _override(config: zenoh.Config, environment: Mapping[str, str]) -> None:
    for pair in environment.get(OVERRIDE_VARIABLE, "").split(";"):
        if not pair.strip():
            continue
        key, _, value = (part.strip() for part in pair.partition("="))
        try:
            config.insert_json5(key, value)
        except zenoh.ZError as error:
            raise BridgeError(
                f"{OVERRIDE_VARIABLE}: {pair.strip()!r} is not valid: {_reason(error)}; "
                'it looks like scouting/multicast/enabled=true;connect/endpoints=["tcp/127.0.0.1:7447"]'
            ) from error


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
        "connect/timeout_ms": 0 if client else -1,  # once; `_opened` tries again
        "connect/exit_on_failure": client,
        "timestamping/enabled": True,  # transient_local's history needs it
        "transport/shared_memory/enabled": False,
    }
    if client:
        settings["transport/unicast/open_timeout"] = round(min(config.timeout_s, _ATTEMPT_S) * 1e3)
    if config.name:
        settings["id"] = session_id(config.name)
    return settings


def session_id(name: str) -> str:
    """Return the id of the session of a name; it may not start with a zero digit."""
    return "7" + xxhash.xxh3_128_hexdigest(name.encode())[1:]


def _reason(error: zenoh.ZError) -> str:
    """Return Zenoh's words without the place in its sources, and without the names of its classes."""
    words = str(error).split(" at /")[0].split('msg: "')[-1]
    return words.strip().rstrip(".")


def _listed(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def direct(callback: Callable[[Any], None], drop: Callable[[], None] | None = None) -> Any:
    """Return a handler that Zenoh calls in the thread that puts: synchronously for the own session's samples.

    Indirect handlers, the default, hand over to a thread: not deterministic, and alive at interpreter exit.
    """
    from_zenoh(callback)
    if drop is not None:
        from_zenoh(drop)
    return zenoh.handlers.Callback(callback, drop, indirect=False)
