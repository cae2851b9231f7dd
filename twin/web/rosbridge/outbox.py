"""What waits for one client: answers, which are kept, and messages of topics, of which newer ones win."""

from __future__ import annotations

import threading
from collections import deque

from twin.web.rosbridge.frames import Frame

_MOST_OF_A_TOPIC = 32
_MOST_ANSWERS = 2000


class Outbox:
    """Filled by the bridge's thread, emptied by the server's."""

    def __init__(self, most_bytes: int) -> None:
        self.dropped = 0
        """Messages of topics that gave way."""
        self.is_overfull = False
        """Whether so many answers wait that the client is to be given up."""
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._answers: deque[Frame] = deque()
        self._messages: deque[tuple[str, Frame]] = deque()
        self._counts: dict[str, int] = {}
        self._bytes = 0

    def put(self, frame: Frame, topic: str | None) -> None:
        """Add a frame; of a topic that has its share the oldest goes."""
        with self._lock:
            self._bytes += len(frame)
            if topic is None:
                self._answers.append(frame)
                self.is_overfull |= len(self._answers) > _MOST_ANSWERS
            else:
                self._messages.append((topic, frame))
                self._counts[topic] = self._counts.get(topic, 0) + 1
                if self._counts[topic] > _MOST_OF_A_TOPIC:
                    index = next(i for i, (name, _) in enumerate(self._messages) if name == topic)
                    self._drop(index)
            while self._bytes > self._most_bytes and len(self._messages) > 1:
                self._drop(0)
            self.is_overfull |= self._bytes > 4 * self._most_bytes

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits."""
        return not self._answers and not self._messages

    def take(self) -> Frame | None:
        """Return what is to be sent next, None if there is nothing."""
        return next(iter(self.take_up_to(1)), None)

    def take_up_to(self, most_bytes: int) -> list[Frame]:
        """Return what is to be sent next, frames of so many bytes; the last one may be longer."""
        frames: list[Frame] = []
        with self._lock:
            while most_bytes > 0 and (self._answers or self._messages):
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
