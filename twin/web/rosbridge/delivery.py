"""From outboxes to websockets: all that waits in one write; who does not keep up holds up nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

from twin.web.rosbridge.frames import Frame
from twin.web.rosbridge.outbox import Outbox

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

_BATCH_BYTES = 65_536
"""Written at once; a client of which that much has not gone out is waited for."""
_EVERY_S = 0.01
"""Deliveries are no closer [s]: what comes in between goes out together."""
_MOST_POSTED = 20_000
"""Frames between two deliveries; the oldest give way where the loop gets no time."""


class Delivery:
    """The loop's side; `post` is for any thread.

    Twenty clients with all topics of a warehouse are ten thousand frames a second: a task that wakes up and
    a system call for each of them cost more than everything else, so what comes close together goes out
    together, and a message for all of them is posted once.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, stalled_s: float) -> None:
        """Deliver in a loop; a client that reads nothing for `stalled_s` is disconnected."""
        self._loop, self._stalled_s = loop, stalled_s
        self._posted: deque[tuple[Frame, str | None, Sequence[Recipient]]] = deque(maxlen=_MOST_POSTED)
        self._is_called = False
        self._last_s = 0.0

    def post(self, frame: Frame, topic: str | None, recipients: Sequence[Recipient]) -> None:
        """Let a frame go out to all of these; called in any thread.

        Args:
            frame: It is packed once.
            topic: That it is a message of; an answer is of none.
            recipients: To whom.
        """
        # The flag is taken back before what it stands for is looked at: nothing is left lying.
        self._posted.append((frame, topic, recipients))
        if not self._is_called:
            self._is_called = True
            try:
                self._loop.call_soon_threadsafe(self._deliver)
            except RuntimeError:  # the server has ended
                self._posted.clear()
                self._is_called = False

    def _deliver(self) -> None:
        now_s = self._loop.time()
        if now_s - self._last_s < _EVERY_S:
            self._loop.call_at(self._last_s + _EVERY_S, self._deliver)
            return
        self._last_s = now_s
        self._is_called = False
        reached: dict[Recipient, None] = {}
        last, packed = None, b""
        for _ in range(len(self._posted)):
            frame, topic, recipients = self._posted.popleft()
            if frame is not last:  # one that goes out in different ways is posted several times in a row
                last, packed = frame, _packed(frame)
            for recipient in recipients:
                recipient.outbox.put(packed, topic)
            reached.update(dict.fromkeys(recipients))
        for recipient in reached:
            if recipient.waiting is None and not recipient.write():
                recipient.waiting = asyncio.create_task(recipient.wait(self._stalled_s))


class Recipient:
    """A websocket and what waits for it."""

    def __init__(self, websocket: ServerConnection, outbox: Outbox) -> None:
        self.outbox = outbox
        self.waiting: asyncio.Task[None] | None = None
        """Of a client that does not keep up."""
        self._websocket = websocket

    def write(self) -> bool:
        """Write what waits; return whether that was all."""
        from websockets.protocol import State

        outbox, protocol, transport = self.outbox, self._websocket.protocol, self._websocket.transport
        while not outbox.is_empty and protocol.state is State.OPEN:
            if outbox.is_overfull or transport.get_write_buffer_size() >= _BATCH_BYTES:
                return False
            transport.write(b"".join(outbox.take_up_to(_BATCH_BYTES)))
        return True

    async def wait(self, stalled_s: float) -> None:
        """Write as fast as the client reads, until nothing waits; disconnect one that reads nothing."""
        now_s, transport = asyncio.get_running_loop().time, self._websocket.transport
        left, since_s = -1, now_s()
        try:
            while not self.write():
                if (size := transport.get_write_buffer_size()) != left:
                    left, since_s = size, now_s()
                if self.outbox.is_overfull or now_s() - since_s > stalled_s:
                    transport.abort()  # it reads nothing: a closing handshake would wait for it
                    return
                await asyncio.sleep(_EVERY_S)
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
