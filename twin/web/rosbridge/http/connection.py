"""A connection whose answer may go on for hours: a stream is no handshake that takes too long."""

from __future__ import annotations

import asyncio

from websockets.asyncio.server import ServerConnection

_REQUEST_S = 10.0


class WebConnection(ServerConnection):
    """Is given up if no request comes; once it has come, the time for the answer is not limited."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait for the request."""
        super().connection_made(transport)
        self.loop.call_later(_REQUEST_S, self._give_up_silent)

    def _give_up_silent(self) -> None:
        if self.request is None:
            self.transport.abort()
