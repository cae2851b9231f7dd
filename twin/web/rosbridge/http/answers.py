"""Answers to requests of clients without a websocket, under the rules that clients with one have."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from http import HTTPStatus
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, unquote, urlsplit

from twin.errors import BridgeError
from twin.web.rosbridge.access import Role
from twin.web.rosbridge.bridge import Limits
from twin.web.rosbridge.door import Door, given_token, peer_of
from twin.web.rosbridge.frames import to_json
from twin.web.rosbridge.http.cameras import Camera, EndedError
from twin.web.rosbridge.http.jpeg import NoPictureError, Wish
from twin.web.rosbridge.http.look import Ask, NoTopicError
from twin.web.rosbridge.http.maps import Maps
from twin.web.rosbridge.pages import Page, content_type, policy_of, refusal
from twin.web.rosbridge.rates import Bucket

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from twin.web.assets import Assets
    from twin.web.rosbridge.server import ServerConfig

_STREAM, _SNAPSHOT, _TILES, _MESHES = "/stream", "/snapshot", "/tiles.json", "/meshes/"
_TILE = re.compile(r"/tiles/(\d{1,2})/(\d{1,6})/(\d{1,6})\.png")
_VERSION = re.compile(r"\d{1,18}")
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
        self._maps = Maps(ask)
        self._rates: dict[str, Bucket] = {}
        self._assets: Assets | None = None
        self._reads = asyncio.Lock()  # packages are looked for on the way, by one at a time

    async def answer(self, connection: ServerConnection, request: Request) -> Page | None:
        """Return the answer to a GET; None: it is not for what is served here."""
        url = urlsplit(request.path)
        tile = _TILE.fullmatch(url.path)
        is_mesh = url.path.startswith(_MESHES)
        if url.path not in (_STREAM, _SNAPSHOT, _TILES) and tile is None and not is_mesh:
            return None
        role = self._role(connection, request)
        if isinstance(role, Page):
            return role
        if is_mesh:
            return await self._mesh(unquote(url.path.removeprefix(_MESHES)))
        query = dict(parse_qsl(url.query, keep_blank_values=True))
        topic = f"/{query.get('topic', '').strip('/')}"
        kind = query.get("type", _KINDS[0])
        if topic == "/":
            return refusal(400, f"{url.path} needs ?topic=, the name of a topic")
        if kind not in _KINDS:
            return refusal(400, f"the type {kind[:40]!r} is not known; valid: {', '.join(_KINDS)}")
        topic = f"{topic}/compressed" if kind == "ros_compressed" else topic
        if not role.allows("heard topic", topic):
            return refusal(403, f"the topic {topic} is not for the role {role.name}")
        try:
            if tile is not None:
                z, x, y = map(int, tile.groups())
                return await self._tile(topic, (z, x, y), request.headers.get("If-None-Match"))
            if url.path == _TILES:
                return await self._described(topic, query.get("since"))
            camera = Camera(self._ask, topic, Wish.of(query))
            if url.path == _STREAM:
                return await self._stream(connection, camera)
            async with asyncio.timeout(self._limits.stalled_s):
                return await camera.snapshot()
        except TimeoutError:
            return refusal(504, f"nothing came from {topic} in {self._limits.stalled_s:g} s")
        except NoTopicError as error:
            return refusal(404, str(error))
        except BridgeError as error:
            return refusal(415 if isinstance(error, NoPictureError) else 400, str(error))

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

    async def _mesh(self, path: str) -> Page:
        """Return a file of a ROS package: PACKAGE/PATH, as `package://` has it."""
        if self._config.packages is None:
            return refusal(404, "this server gives no meshes")
        async with self._reads:
            if self._assets is None:
                from twin.web.assets import Assets  # robot files are nothing that others wait for

                self._assets = Assets(self._config.packages)
            content = await asyncio.to_thread(self._assets.read, f"package://{path}")
        if content is None:
            return refusal(404, f"no mesh or picture is known as package://{path[:200]}")
        return Page(200, content_type(path), content)

    async def _described(self, topic: str, since: str | None) -> Page:
        tiles = await self._maps.tiles(topic, self._limits.stalled_s)
        known = int(since) if since is not None and _VERSION.fullmatch(since) else None
        return Page(200, "application/json", to_json(tiles.describe(known)).encode())

    async def _tile(self, topic: str, at: tuple[int, int, int], known: str | None) -> Page:
        tiles = await self._maps.tiles(topic, self._limits.stalled_s)
        made = await asyncio.to_thread(tiles.png, *at)
        if made is None:
            return refusal(404, f"{topic} has no tile z, x, y = {at[0]}, {at[1]}, {at[2]}")
        version, file = made
        tag = f'"{version}"'
        return (
            Page(304, "image/png", b"", (("ETag", tag),))
            if known == tag
            else Page(200, "image/png", file, (("ETag", tag),))
        )

    async def _stream(self, connection: ServerConnection, camera: Camera) -> Page:
        if self._connected() + len(self.streams) >= self._limits.clients:
            return refusal(503, "too many clients")

        def begin(kind: str) -> bytes:
            answer = response(Page(200, kind, b""))
            del answer.headers["Content-Length"]
            return answer.serialize()

        self.streams.add(connection)
        work = asyncio.ensure_future(camera.stream(connection, begin, self._limits.stalled_s))
        gone = asyncio.ensure_future(connection.wait_closed())
        try:
            await asyncio.wait((work, gone), return_when=asyncio.FIRST_COMPLETED)
            if work.done():
                work.result()
        except EndedError:
            pass
        finally:
            self.streams.discard(connection)
            work.cancel()
            gone.cancel()
        connection.transport.abort()
        await connection.wait_closed()
        return refusal(410, "it has gone")  # nobody reads it


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
