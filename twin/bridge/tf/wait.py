"""To wait for a transform without blocking: a future that a spin completes, as in rclpy's tf2_ros."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.bridge.services import Future
from twin.bridge.tf.errors import TransformError, TransformTimeoutError, seconds

if TYPE_CHECKING:
    from twin.bridge.tf.core import BufferCore


class TransformFuture(Future):
    """Done when a transform is there; `result` is True."""

    def __init__(self, target: str, source: str, time_ns: int | None) -> None:
        super().__init__(f"the transform of {source!r} in {target!r}")
        self.target, self.source, self.time_ns = target, source, time_ns
        self.deadline_ns: int | None = None
        """When to give up [ns], by the clock of the node that listens; None: never."""

    @property
    def result(self) -> Any:
        """True.

        Raises:
            TransformTimeoutError: it did not come in time.
            BridgeError: it is not there yet.
        """
        if self.error is not None:
            raise TransformTimeoutError(self.error)
        return super().result


class Waiting:
    """The futures of a buffer that are not done."""

    def __init__(self, buffer: BufferCore) -> None:
        self._buffer = buffer
        self._futures: list[TransformFuture] = []

    def add(self, target: str, source: str, time_ns: int | None, deadline_ns: int | None) -> TransformFuture:
        """Return a future, done at once if the transform is there."""
        future = TransformFuture(target, source, time_ns)
        future.deadline_ns = deadline_ns
        if self._buffer.can_transform(target, source, time_ns):
            future.finish(True)
        else:
            if not self._futures:  # a buffer is told of every transform: only while somebody waits
                self._buffer.on_change.append(self._on_change)
            self._futures.append(future)
        return future

    def expire(self, now_ns: int) -> None:
        """Fail those whose time is over."""
        for future in tuple(self._futures):
            if future.deadline_ns is not None and now_ns >= future.deadline_ns:
                self._remove(future)
                future.finish(None, f"at {seconds(now_ns)} s the wait is over: {self._why(future)}")

    def _on_change(self) -> None:
        for future in tuple(self._futures):
            if future.done:  # given up by who waited
                self._remove(future)
            elif self._buffer.can_transform(future.target, future.source, future.time_ns):
                self._remove(future)
                future.finish(True)

    def _remove(self, future: TransformFuture) -> None:
        self._futures.remove(future)
        if not self._futures:
            self._buffer.on_change.remove(self._on_change)

    def _why(self, future: TransformFuture) -> str:
        try:
            self._buffer.lookup(future.target, future.source, future.time_ns)
        except TransformError as error:
            return str(error)
        return "the transform is there"
