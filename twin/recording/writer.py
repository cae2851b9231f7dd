"""Writes the blocks of a recording in a thread of its own, so that the run goes on meanwhile."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    import rerun as rr

    from twin.recording.columns import Chunk

Row = TypeVar("Row")


class Rows(ABC, Generic[Row]):
    """What the run puts aside, and what becomes of it.

    The run appends to `rows` and does as little as it can; `chunks` is called in the writer's thread.
    """

    def __init__(self) -> None:
        self.rows: list[Row] = []

    @abstractmethod
    def chunks(self, rows: list[Row]) -> Iterable[Chunk]:
        """Return a block of rows, in the order of time, as columns; there is at least one row."""


class Writer:
    """Has at most one block under way: a run waits for a slow disk, and loses nothing."""

    def __init__(self, recording: rr.RecordingStream, finish: Callable[[], None]) -> None:
        """Begin; `finish` is called in the writer's thread when a block was sent."""
        self._recording = recording
        self._finish = finish
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="recording")
        self._under_way: Future[None] | None = None

    def write(self, sources: Iterable[Rows[Any]]) -> None:
        """Take the rows away and begin to send them, once the block before is written.

        Raises:
            RecordingError: See `wait`.
        """
        self.wait()
        block = []
        for source in sources:
            if source.rows:
                block.append((source, source.rows))
                source.rows = []
        self._under_way = self._pool.submit(self._send, block)

    def wait(self) -> None:
        """Wait until the block is written.

        Raises:
            RecordingError: It could not be written.
        """
        if self._under_way is not None:
            under_way, self._under_way = self._under_way, None
            under_way.result()

    def close(self) -> None:
        """End the thread, once the block under way is written or has failed."""
        self._pool.shutdown()

    def _send(self, block: list[tuple[Rows[Any], list[Any]]]) -> None:
        # All at once: to wake up Rerun's threads for each would cost as much again.
        for chunk in [chunk for source, rows in block for chunk in source.chunks(rows)]:
            self._recording.send_columns(*chunk)
        self._finish()
