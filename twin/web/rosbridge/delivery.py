"""From outboxes to websockets: all that waits in one write; who does not keep up holds up nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING

from twin.web.rosbridge.frames import Frame
from twin.web.rosbridge.outbox import Outbox

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

_BATCH_BYTES = 65_536
"""Written at once; a client of which that much has not gone out is waited for."""
_EVERY_S = 0.01
"""Deliveries are no closer [s]: what comes in between goes out together."""


class Delivery:
    """The loop's side; `wake` is for any thread.

    Twenty clients with all topics of a warehouse are ten thousand frames a second: a task that wakes up and
    a system call for each of them cost more than everything else.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, stalled_s: float) -> None:
        """Deliver in a loop; a client that reads nothing for `stalled_s` is disconnected."""
        self._loop, self._stalled_s = loop, stalled_s
        self._filled: deque[Recipient] = deque()
        self._is_called = False
        self._last_s = 0.0

    def wake(self, recipient: Recipient) -> None:
        """Let what waits for a client go out; called in any thread, after it was put into the outbox."""
        # Flags are taken back before what they stand for is looked at: nothing is left lying.
        if recipient.is_filled:
            return
        recipient.is_filled = True
        self._filled.append(recipient)
        if not self._is_called:
            self._is_called = True
            try:
                self._loop.call_soon_threadsafe(self._deliver)
            except RuntimeError:
                return  # the server has ended

    def _deliver(self) -> None:
        now_s = self._loop.time()
        if now_s - self._last_s < _EVERY_S:
            self._loop.call_at(self._last_s + _EVERY_S, self._deliver)
            return
        self._last_s = now_s
        self._is_called = False
        packed: dict[int, tuple[Frame, bytes]] = {}
        while self._filled:
            recipient = self._filled.popleft()
            recipient.is_filled = False
            if recipient.waiting is None and not recipient.write(packed):
                recipient.waiting = asyncio.create_task(recipient.wait(self._stalled_s))


class Recipient:
    """A websocket and what waits for it."""

    def __init__(self, websocket: ServerConnection, outbox: Outbox) -> None:
        self.is_filled = False
        """Whether a delivery is due."""
        self.waiting: asyncio.Task[None] | None = None
        """Of a client that does not keep up."""
        self._websocket, self._outbox = websocket, outbox

    def write(self, packed: dict[int, tuple[Frame, bytes]]) -> bool:
        """Write what waits; return whether that was all.

        Args:
            packed: Bytes of frames that go to several clients, by identity, with the frames: what is there is
                not made again.
        """
        from websockets.protocol import State

        websocket, outbox = self._websocket, self._outbox
        protocol, transport = websocket.protocol, websocket.transport
        while not outbox.is_empty and protocol.state is State.OPEN:
            if outbox.is_overfull or transport.get_write_buffer_size() >= _BATCH_BYTES:
                return False
            frames = outbox.take_up_to(_BATCH_BYTES)
            for frame in frames:
                if id(frame) not in packed:
                    packed[id(frame)] = frame, _packed(frame)
            transport.write(b"".join([packed[id(frame)][1] for frame in frames]))
        return True

    async def wait(self, stalled_s: float) -> None:
        """Write as fast as the client reads, until nothing waits; disconnect one that reads nothing."""
        from websockets.exceptions import ConnectionClosed

        try:
            while not self.write({}):
                frame = self._outbox.take()
                if self._outbox.is_overfull:
                    raise TimeoutError
                if frame is not None:
                    async with asyncio.timeout(stalled_s):
                        await self._websocket.send(frame)
        except TimeoutError:
            self._websocket.transport.abort()  # it reads nothing: a closing handshake would wait for it
        except ConnectionClosed:
            pass
        finally:
            self.waiting = None

    def end(self) -> None:
        """Write no more."""
        if self.waiting is not None:
            self.waiting.cancel()


def _packed(frame: Frame) -> bytes:
    """Return what travels of a frame of a server without compression: it is the same for all clients."""
    from websockets.frames import Frame as Wire
    from websockets.frames import Opcode

    is_text = isinstance(frame, str)
    data = frame.encode() if isinstance(frame, str) else frame
    return Wire(Opcode.TEXT if is_text else Opcode.BINARY, data).serialize(mask=False)
