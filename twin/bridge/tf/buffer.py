"""The transform buffer of a node: tf2_ros's Buffer, over `BufferCore`."""

from __future__ import annotations

from typing import Any, TypeVar

from twin.bridge.msgs import LaserScan, Quaternion, Time, Transform, TransformStamped, Vector3, header, ns
from twin.bridge.services import Future
from twin.bridge.tf.core import BufferCore
from twin.bridge.tf.errors import TransformError, TransformTimeoutError, seconds
from twin.bridge.tf.report import frame_infos, frames_as_string, frames_as_yaml
from twin.bridge.tf.rigid import Rigid
from twin.bridge.tf.transforms import do_transform, transform_laser_scan
from twin.errors import BridgeError

M = TypeVar("M")
AnyTime = int | Time | None
"""[ns], or a stamp; None or 0 is the latest time that all transforms between have."""


class TransformBuffer(BufferCore):
    """Stores T_parent_child of every frame for some time; looks up, transforms messages, waits.

    A look-up is of where `source` is in `target`: it takes coordinates in `source` to `target`.
    """

    def __init__(self, cache_ns: int = 10_000_000_000) -> None:
        super().__init__(cache_ns)
        self.waiting = Waiting(self)

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: AnyTime = None
    ) -> TransformStamped:
        """Return `lookup` as a message, stamped with the time that it is of.

        Raises:
            TransformError: as `lookup`.
        """
        found = self.lookup_stamped(target_frame, source_frame, _ns(time))
        return _message(target_frame, source_frame, *found)

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: AnyTime,
        source_frame: str,
        source_time: AnyTime,
        fixed_frame: str,
    ) -> TransformStamped:
        """Return `lookup_full` as a message.

        Raises:
            TransformError: as `lookup`.
        """
        found = self.lookup_full(target_frame, _ns(target_time), source_frame, _ns(source_time), fixed_frame)
        return _message(target_frame, source_frame, *found)

    def transform(self, message: M, target_frame: str) -> M:
        """Return a stamped message in another frame, by the transform at its stamp.

        Raises:
            TransformError: as `lookup`.
            BridgeError: messages of this type cannot be transformed.
        """
        stamped: Any = message
        if not hasattr(message, "header"):
            raise BridgeError(f"a {type(message).__name__} has no header that tells its frame and time")
        if isinstance(message, LaserScan):
            raise BridgeError("a LaserScan becomes a cloud in another frame: use transform_laser_scan")
        here = self.lookup_transform(target_frame, stamped.header.frame_id, stamped.header.stamp)
        return do_transform(message, here)

    def transform_full(self, message: M, target_frame: str, target_time: AnyTime, fixed_frame: str) -> M:
        """Return a stamped message as seen from a frame at another time, while `fixed_frame` did not move.

        Raises:
            TransformError: as `lookup`.
            BridgeError: messages of this type cannot be transformed.
        """
        stamped: Any = message
        frame, time = stamped.header.frame_id, stamped.header.stamp
        there = self.lookup_transform_full(target_frame, target_time, frame, time, fixed_frame)
        return do_transform(message, there)

    def transform_laser_scan(self, scan: LaserScan, target_frame: str, *, range_cutoff: float = -1.0) -> Any:
        """Return a scan as a PointCloud2 in another frame; see `tf_laser.transform_laser_scan`.

        Raises:
            TransformError: no transform for the first or the last ray.
        """
        return transform_laser_scan(self, target_frame, scan, range_cutoff=range_cutoff)

    def wait_for_transform_async(
        self, target_frame: str, source_frame: str, time: AnyTime = None
    ) -> TransformFuture:
        """Return a future that is done as soon as a look-up succeeds; for a time-out ask the listener."""
        return self.waiting.add(target_frame, source_frame, _ns(time), None)

    def all_frames_as_yaml(self, now_ns: int = 0) -> str:
        """Return parent, broadcaster, rate, stamps and length of every frame, as tf2 writes it."""
        return frames_as_yaml(frame_infos(self), now_ns)

    def all_frames_as_string(self) -> str:
        """Return a line for every frame, as tf2 writes it."""
        return frames_as_string(frame_infos(self))


def _ns(time: AnyTime) -> int | None:
    return ns(time) if isinstance(time, Time) else time


def _message(target: str, source: str, value: Rigid, time_ns: int) -> TransformStamped:
    x, y, z, w, i, j, k = value
    return TransformStamped(
        header(time_ns, target), source, Transform(Vector3(x, y, z), Quaternion(i, j, k, w))
    )


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
