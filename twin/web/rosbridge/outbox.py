"""What waits for one client: answers, which are kept, and messages of topics, of which newer ones win."""

from __future__ import annotations

from collections import deque

_MOST_OF_A_TOPIC = 32
_MOST_ANSWERS = 2000


class Outbox:
    """Frames as they travel; filled and emptied in the server's thread."""

    def __init__(self, most_bytes: int) -> None:
        self.dropped = 0
        """Messages of topics that gave way."""
        self.is_overfull = False
        """Whether so many answers wait that the client is to be given up."""
        self._most_bytes = most_bytes
        self._answers: deque[bytes] = deque()
        self._messages: deque[tuple[str, bytes]] = deque()
        self._counts: dict[str, int] = {}
        self._bytes = 0

    def put(self, frame: bytes, topic: str | None) -> None:
        """Add a frame; of a topic that has its share the oldest goes."""
        self._bytes += len(frame)
        if topic is None:
            self._answers.append(frame)
            self.is_overfull |= len(self._answers) > _MOST_ANSWERS
        else:
            self._messages.append((topic, frame))
            count = self._counts[topic] = self._counts.get(topic, 0) + 1
            if count > _MOST_OF_A_TOPIC:
                self._drop(next(i for i, (name, _) in enumerate(self._messages) if name == topic))
        while self._bytes > self._most_bytes and len(self._messages) > 1:
            self._drop(0)
        self.is_overfull |= self._bytes > 4 * self._most_bytes

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits."""
        return not self._answers and not self._messages

    def take_up_to(self, most_bytes: int) -> list[bytes]:
        """Return what is to be sent next, frames of so many bytes; the last one may be longer."""
        if self._bytes <= most_bytes:  # nearly always
            frames = [*self._answers, *(frame for _, frame in self._messages)]
            self._answers.clear()
            self._messages.clear()
            self._counts.clear()
            self._bytes = 0
            return frames
        frames = []
        while most_bytes > 0 and not self.is_empty:
            if self._answers:
                frame = self._answers.popleft()
            else:
                topic, frame = self._messages.popleft()
                self._forget(topic)
            self._bytes -= len(frame)
            most_bytes -= len(frame)
            frames.append(frame)
        return frames

    def _drop(self, index: int) -> None:
        topic, frame = self._messages[index]
        del self._messages[index]
        self._forget(topic)
        self._bytes -= len(frame)
        self.dropped += 1

    def _forget(self, topic: str) -> None:
        self._counts[topic] -= 1
        if not self._counts[topic]:
            del self._counts[topic]
