"""Who is let in: by the name of this server, the origin of a page, and a token."""

from __future__ import annotations

import ipaddress
import socket
import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

from twin.web.rosbridge.access import Token, find_token

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request

    from twin.web.rosbridge.server import ServerConfig

_WRONG_TOKENS = 10
_LOCKED_S = 60.0
_LOCAL = ("localhost", "127.0.0.1", "::1")


class Door:
    """Looks at requests; in the server's thread."""

    def __init__(self, config: ServerConfig, wake: Callable[[], None]) -> None:
        self.strangers: deque[tuple[str, str]] = deque(maxlen=100)
        """Who was not let in, and why: for the audit."""
        self._config, self._wake = config, wake
        self._wrong: dict[str, tuple[int, float]] = {}

    def is_own_name(self, host: str) -> bool:
        """Whether a Host is us: a name of somebody else's that leads here is DNS rebinding."""
        name = _hostname(f"//{host}")
        if name in (*_LOCAL, self._config.address, socket.gethostname().lower(), *self._config.hosts):
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return not is_loopback(self._config.address)

    def is_welcome(self, request: Request) -> bool:
        """Whether the page that asks, if it is one, is ours or one that may connect.

        Browsers tell the origin of a websocket or a script's request. Of a picture in a page of somebody
        else they only tell that it is one, and perhaps the page's address.
        """
        headers = request.headers
        origin = headers.get("Origin")
        if origin is None and headers.get("Sec-Fetch-Site", "none") in ("cross-site", "same-site"):
            parts = urlsplit(headers.get("Referer", ""))
            origin = f"{parts.scheme}://{parts.netloc}"
        return origin is None or self._may_come_from(origin, headers.get("Host", ""))

    def _may_come_from(self, origin: str, host: str) -> bool:
        if origin in self._config.origins:
            return True
        parts = urlsplit(origin)
        is_local = is_loopback(self._config.address) and _hostname(origin) in _LOCAL
        return parts.scheme in ("http", "https") and (is_local or parts.netloc.lower() == host.lower())

    def checked(self, peer: str, secret: str) -> Token | None:
        """Return the token that a client has told; after ten wrong ones, for a while, none."""
        count, since_s = self._wrong.get(peer, (0, 0.0))
        now_s = time.monotonic()
        if count >= _WRONG_TOKENS and now_s - since_s < _LOCKED_S:
            return None  # told of already, ten times
        token = find_token(self._config.tokens, secret)
        if token is not None:
            self._wrong.pop(peer, None)
        else:
            if len(self._wrong) > 10_000:
                self._wrong.clear()
            self._wrong[peer] = (count + 1 if now_s - since_s < _LOCKED_S else 1, now_s)
            self.strangers.append((peer, "wrong token"))
            self._wake()
        return token


def given_token(request: Request) -> str | None:
    """Return what a request tells as its token: in a header, or in its address."""
    header = request.headers.get("Authorization", "")
    if header.startswith("Bearer "):
        return header.removeprefix("Bearer ").strip()
    found = parse_qs(urlsplit(request.path).query).get("token")
    return found[0] if found else None


def peer_of(connection: ServerConnection) -> str:
    """Return the address of who has connected."""
    address = connection.remote_address
    return str(address[0]) if address else "somebody"


def is_loopback(address: str) -> bool:
    """Whether an address is this computer alone."""
    try:
        return address == "localhost" or ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


def _hostname(url: str) -> str:
    try:
        return (urlsplit(url).hostname or "").lower()
    except ValueError:
        return ""
