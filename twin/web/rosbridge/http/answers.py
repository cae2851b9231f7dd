"""Answers to requests of clients without a websocket, under the rules that clients with one have."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from http import HTTPStatus
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from twin.errors import BridgeError
from twin.web.rosbridge.access import Role
from twin.web.rosbridge.bridge import Limits
from twin.web.rosbridge.door import Door, given_token, peer_of
from twin.web.rosbridge.http.cameras import Camera
from twin.web.rosbridge.http.jpeg import Wish
from twin.web.rosbridge.http.look import Ask
from twin.web.rosbridge.pages import Page, policy_of, refusal
from twin.web.rosbridge.rates import Bucket

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from twin.web.rosbridge.server import ServerConfig

_STREAM, _SNAPSHOT = "/stream", "/snapshot"
_KINDS = ("mjpeg", "ros_compressed")
_MOST_PEERS = 10_000


class Http:
    """What is served beside files; in the server's thread."""

    def __init__(
        self, config: ServerConfig, limits: Limits, door: Door, ask: Ask, connected: Callable[[], int]
    ) -> None:
        self.streams: set[ServerConnection] = set()
        self._config, self._limits, self._door, self._ask = config, limits, door, ask
        self._connected = connected
        self._rates: dict[str, Bucket] = {}

    async def answer(self, connection: ServerConnection, request: Request) -> Page | None:
        """Return the answer to a GET; None: it is not for what is served here."""
        url = urlsplit(request.path)
        if url.path not in (_STREAM, _SNAPSHOT):
            return None
        role = self._role(connection, request)
        if isinstance(role, Page):
            return role
        query = dict(parse_qsl(url.query, keep_blank_values=True))
        topic = f"/{query.get('topic', '').strip('/')}"
        try:
            if topic == "/":
                raise BridgeError(f"{url.path} needs ?topic=, the name of a topic")
            kind = query.get("type", "mjpeg")
            if kind not in _KINDS:
                raise BridgeError(f"the type {kind[:40]!r} is not known; valid: {', '.join(_KINDS)}")
            topic = f"{topic}/compressed" if kind == "ros_compressed" else topic
            camera = Camera(self._ask, topic, Wish.of(query), self._limits.stalled_s)
        except BridgeError as error:
            return refusal(400, str(error))
        if not role.allows("heard topic", topic):
            return refusal(403, f"the topic {topic} is not for the role {role.name}")
        return await (camera.snapshot() if url.path == _SNAPSHOT else self._stream(connection, camera))

    def close(self) -> None:
        """End all streams."""
        for each in tuple(self.streams):
            each.transport.abort()

    def _role(self, connection: ServerConnection, request: Request) -> Role | Page:
        """Return what who asks may do, or why it may nothing."""
        if not self._door.is_welcome(request):
            return refusal(403, "pages of this origin may not look")
        peer = peer_of(connection)
        if len(self._rates) > _MOST_PEERS:
            self._rates.clear()
        rate = self._rates.setdefault(peer, Bucket(self._limits.messages_per_s))
        if not rate.may_go(asyncio.get_running_loop().time()):
            return refusal(429, f"more than {self._limits.messages_per_s:g} requests a second")
        if not self._config.tokens:
            return self._config.open_to
        given = given_token(request)
        token = None if given is None else self._door.checked(peer, given)
        return refusal(401, "a token is needed, one that is known") if token is None else token.role

    async def _stream(self, connection: ServerConnection, camera: Camera) -> Page | None:
        if self._connected() + len(self.streams) >= self._limits.clients:
            return refusal(503, "too many clients")

        def begin(kind: str) -> bytes:
            answer = response(Page(200, kind, b""))
            del answer.headers["Content-Length"]
            return answer.serialize()

        self.streams.add(connection)
        work = asyncio.ensure_future(camera.stream(connection, begin))
        gone = asyncio.ensure_future(connection.wait_closed())
        try:
            await asyncio.wait((work, gone), return_when=asyncio.FIRST_COMPLETED)
            page = work.result() if work.done() else None
        except TimeoutError:  # it reads nothing
            page = None
        finally:
            self.streams.discard(connection)
            work.cancel()
            gone.cancel()
        if page is None:
            connection.transport.abort()
            await connection.wait_closed()
        return page or refusal(410, "it has gone")


def response(page: Page) -> Response:
    """Return a page as the answer of the server."""
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    headers = {
        "Content-Type": page.content_type,
        "Content-Length": str(len(page.body)),
        "Content-Security-Policy": policy_of(page),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cache-Control": "no-cache",
        "Connection": "close",
        **dict(page.headers),
    }
    return Response(page.status, HTTPStatus(page.status).phrase, Headers(headers), page.body)
