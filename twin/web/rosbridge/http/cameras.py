"""Cameras in HTTP as web_video_server has them: `/stream` goes on, `/snapshot` is one picture."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from twin.errors import BridgeError
from twin.web.rosbridge.frames import Heard
from twin.web.rosbridge.http.jpeg import COMPRESSED, IMAGE, Wish, jpeg_of
from twin.web.rosbridge.http.look import Ask, Look
from twin.web.rosbridge.pages import Page

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

_BOUNDARY = "frame"
_WAITING_BYTES = 1 << 17
"""Of pictures on their way in the system's own buffer: more would only be older."""
_LOOK_AGAIN_S = 0.02
"""How often it is looked whether a client has read its picture [s]."""


class EndedError(Exception):
    """A stream that had begun cannot go on."""


class Camera:
    """One camera for one client."""

    def __init__(self, ask: Ask, topic: str, wish: Wish) -> None:
        self._ask, self._topic, self._wish = ask, topic, wish

    async def snapshot(self) -> Page:
        """Return the next picture.

        Raises:
            NoTopicError: there is no such camera.
            BridgeError: its pictures cannot be shown.
        """
        with closing(Look(self._ask, self._topic, (IMAGE, COMPRESSED))) as look:
            return Page(200, "image/jpeg", await self._file(await look.next()))

    async def stream(
        self, websocket: ServerConnection, begin: Callable[[str], bytes], patience_s: float
    ) -> None:
        """Send pictures until the client has gone; of those that it is too slow for the newest only.

        Args:
            websocket: Its connection, of which nothing but the bytes below is used.
            begin: Returns the head of an answer of a type of content.
            patience_s: How long a picture may be on its way [s].

        Raises:
            NoTopicError: there is no such camera.
            BridgeError: its pictures cannot be shown.
            EndedError: the client has not read a picture for so long, or the camera has become another.
        """
        transport, head = websocket.transport, begin(f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING_BYTES)
        with closing(Look(self._ask, self._topic, (IMAGE, COMPRESSED))) as look:
            while not transport.is_closing():
                try:
                    picture = await self._file(await look.next())
                except BridgeError:
                    if head:
                        raise
                    raise EndedError from None
                size = f"Content-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n\r\n"
                transport.write(b"".join((head, f"--{_BOUNDARY}\r\n{size}".encode(), picture, b"\r\n")))
                head = b""
                try:
                    async with asyncio.timeout(patience_s):
                        while transport.get_write_buffer_size() and not transport.is_closing():
                            await asyncio.sleep(_LOOK_AGAIN_S)
                except TimeoutError:
                    raise EndedError from None

    async def _file(self, heard: Heard) -> bytes:
        """Return a picture's file, made in another thread: others are served meanwhile."""
        return await asyncio.to_thread(heard.made, self._wish, jpeg_of)
