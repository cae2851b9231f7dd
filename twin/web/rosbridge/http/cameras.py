"""Cameras in HTTP as web_video_server has them: `/stream` goes on, `/snapshot` is one picture."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from twin.errors import BridgeError
from twin.web.rosbridge.frames import Heard
from twin.web.rosbridge.http.jpeg import COMPRESSED, IMAGE, Wish, jpeg_of
from twin.web.rosbridge.http.look import Ask, Look, NoTopicError
from twin.web.rosbridge.pages import Page, refusal

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

_BOUNDARY = "frame"
_WAITING_BYTES = 1 << 17
"""Of pictures on their way in the system's own buffer: more would only be older."""
_LOOK_AGAIN_S = 0.02
"""How often it is looked whether a client has read its picture [s]."""


class Camera:
    """One camera for one client."""

    def __init__(self, ask: Ask, topic: str, wish: Wish, patience_s: float) -> None:
        self._ask, self._topic, self._wish, self._patience_s = ask, topic, wish, patience_s

    async def snapshot(self) -> Page:
        """Return the next picture."""
        try:
            with closing(Look(self._ask, self._topic, (IMAGE, COMPRESSED))) as look:
                async with asyncio.timeout(self._patience_s):
                    return Page(200, "image/jpeg", await self._file(await look.next()))
        except TimeoutError:
            return refusal(504, f"no picture came from {self._topic} in {self._patience_s:g} s")
        except NoTopicError as error:
            return refusal(404, str(error))
        except BridgeError as error:
            return refusal(415, str(error))

    async def stream(self, websocket: ServerConnection, begin: Callable[[str], bytes]) -> Page | None:
        """Send pictures until the client has gone; of those that it is too slow for the newest only.

        Args:
            websocket: Its connection, of which nothing but the bytes below is used.
            begin: Returns the head of an answer of a type of content.

        Returns:
            What to answer if there is no picture at all; None: all has been sent.
        """
        import socket

        transport, has_begun = websocket.transport, False
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING_BYTES)
        with closing(Look(self._ask, self._topic, (IMAGE, COMPRESSED))) as look:
            while not transport.is_closing():
                try:
                    picture = await self._file(await look.next())
                except (NoTopicError, BridgeError) as error:
                    if has_begun:
                        return None
                    return refusal(404 if isinstance(error, NoTopicError) else 415, str(error))
                head = b"" if has_begun else begin(f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
                has_begun = True
                size = f"Content-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n\r\n"
                transport.write(b"".join((head, f"--{_BOUNDARY}\r\n{size}".encode(), picture, b"\r\n")))
                async with asyncio.timeout(self._patience_s):
                    while transport.get_write_buffer_size() and not transport.is_closing():
                        await asyncio.sleep(_LOOK_AGAIN_S)
        return None

    async def _file(self, heard: Heard) -> bytes:
        """Return a picture's file, made in another thread: others are served meanwhile."""
        return await asyncio.to_thread(heard.made, self._wish, jpeg_of)
