"""The transform tree over time with tf2's rules (geometry2, tf2/src/buffer_core.cpp).

Interpolation, no extrapolation, static transforms always, another parent as time goes on, two times with a
fixed frame. Compared with the real tf2 in tests/bridge/tf/test_oracle.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from twin.bridge.tf.cache import UNKNOWN_AUTHORITY, FrameCache
from twin.bridge.tf.errors import InvalidFrameError, TransformError, UnknownFrameError
from twin.bridge.tf.rigid import IDENTITY, Rigid, as_from_matrix, compose, inverse, normalized, rigid
from twin.bridge.tf.walk import latest_common, solve
from twin.geometry import Pose2, Pose3

_UNIT_TOLERANCE = 10e-3
"""tf2's QUATERNION_NORMALIZATION_TOLERANCE, of the squared length."""
_EXACT_UNIT = 1e-12
"""Within it a rotation that is applied and undone leaves no trace, so that only the path matters."""

_Path = tuple[tuple[FrameCache, ...], tuple[FrameCache, ...], tuple[FrameCache, ...]]
"""Frames from source, and from target, up to but without where they meet; those of both that move."""


class BufferCore:
    """Stores T_parent_child of every frame for some time and looks transforms up along the tree."""

    def __init__(self, cache_ns: int = 10_000_000_000) -> None:
        self.cache_ns = cache_ns
        """How long before its frame's latest sample one is kept [ns]."""
        self.frames: dict[str, FrameCache] = {}
        """By child; in the order in which they came, as all of tf2's lists of frames."""
        self.on_change: list[Callable[[], None]] = []
        """Called after every transform that was stored."""
        self._names: dict[str, None] = {}
        self._irregular: set[str] = set()
        self._paths: dict[tuple[str, str], _Path | None] = {}

    @property
    def parents(self) -> dict[str, str]:
        """Each child frame's parent."""
        return {child: cache.parent for child, cache in self.frames.items()}

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Every frame, parents too, in the order in which they came."""
        return tuple(self._names)

    def set_transform(
        self,
        parent: str,
        child: str,
        time_ns: int,
        T_parent_child: Pose3,
        *,
        static: bool = False,
        authority: object = UNKNOWN_AUTHORITY,
    ) -> bool:
        """Store a transform; return False if it is ignored: a repeated stamp, or older than the cache.

        Args:
            parent: Frame; a leading '/' is ignored.
            child: Frame, likewise.
            time_ns: Stamp [ns].
            T_parent_child: The child's pose in its parent.
            static: Whether it holds for ever.
            authority: Who broadcasts it; its `str` is told in errors and reports.

        Raises:
            ValueError: parent and child are the same, a name is empty, or the rotation is no unit quaternion.
        """
        value = rigid(T_parent_child)
        return self.set_rigid(parent, child, time_ns, value, static=static, authority=authority)

    def set_rigid(
        self,
        parent: str,
        child: str,
        time_ns: int,
        value: Rigid,
        *,
        static: bool = False,
        authority: object = UNKNOWN_AUTHORITY,
    ) -> bool:
        """Do what `set_transform` does, and raise what it raises, with plain numbers."""
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        if not parent or not child or parent == child:
            raise ValueError(f"{child!r} cannot be a child of {parent!r} (from {authority})")
        x, y, z, w, i, j, k = value
        excess = abs(w * w + i * i + j * j + k * k - 1.0)
        if not excess < _UNIT_TOLERANCE or not math.isfinite(x + y + z):
            raise ValueError(
                f"the transform of {child!r} is not finite with a unit quaternion: {value} (from {authority})"
            )
        cache = self.frames.get(child)
        if cache is None or cache.static != static:
            cache = self._add(parent, child, static)
        was = cache.parent
        if not cache.insert(time_ns, parent, value, self.cache_ns):
            return False
        cache.authority = authority
        if parent != was or child in self._irregular or excess > _EXACT_UNIT:
            self._note(cache, parent, excess)
        if self.on_change:
            for callback in tuple(self.on_change):
                callback()
        return True

    def clear(self) -> None:
        """Forget all samples but those of static frames; the frames stay known, as in tf2."""
        for child, cache in self.frames.items():
            cache.clear()
            if not cache.stamps:
                self._irregular.add(child)

    def can_transform(self, target: str, source: str, time_ns: int | None = None) -> bool:
        """Return whether `lookup` would succeed."""
        try:
            self.lookup_stamped(target, source, time_ns)
        except TransformError:
            return False
        return True

    def can_transform_full(
        self, target: str, target_time_ns: int | None, source: str, source_time_ns: int | None, fixed: str
    ) -> bool:
        """Return whether `lookup_full` would succeed."""
        try:
            self.lookup_full(target, target_time_ns, source, source_time_ns, fixed)
        except TransformError:
            return False
        return True

    def chain(self, target: str, source: str) -> list[str]:
        """Return the frames from source up to where it meets target, and down to target, as of the latest.

        Raises:
            UnknownFrameError, DisconnectedFramesError: there is no path.
        """
        self._check(target, source)
        latest_common(self.frames, target, source)
        up, down = self._ancestors(source), self._ancestors(target)
        common = next(frame for frame in up if frame in down)
        return [*up[: up.index(common) + 1], *reversed(down[: down.index(common)])]

    def latest_common_ns(self, target: str, source: str) -> int | None:
        """Return the latest time [ns] at which a lookup succeeds; None if all transforms between are static.

        Raises:
            UnknownFrameError, DisconnectedFramesError: there is no path.
        """
        self._check(target, source)
        return latest_common(self.frames, target, source) or None

    def lookup(self, target: str, source: str, time_ns: int | None = None) -> Pose3:
        """Return T_target_source: what maps coordinates in `source` to `target`.

        Args:
            target: Frame.
            source: Frame.
            time_ns: [ns]; None or 0: the latest time that all transforms between have.

        Raises:
            UnknownFrameError: a frame that nobody has published.
            DisconnectedFramesError: no common root.
            ExtrapolationError: the time is before the first or after the last stamp of a transform between.
            InvalidFrameError: a name that is empty or starts with '/'.
        """
        value, _ = self.lookup_stamped(target, source, time_ns)
        return Pose3(np.array(value[:3]), np.array(value[3:]))

    def lookup_planar(self, target: str, source: str, time_ns: int | None = None) -> Pose2:
        """Return `lookup` projected to the ground plane; cheaper than to project the result."""
        (x, y, _, w, i, j, k), _ = self.lookup_stamped(target, source, time_ns)
        return Pose2(x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k)))

    def lookup_full(
        self, target: str, target_time_ns: int | None, source: str, source_time_ns: int | None, fixed: str
    ) -> tuple[Rigid, int]:
        """Return T_target_source across two times: where `source` was then is where now, seen from `target`?

        Args:
            target: Frame.
            target_time_ns: [ns]; None or 0: the latest.
            source: Frame.
            source_time_ns: [ns]; None or 0: the latest.
            fixed: Frame that is taken not to move between the two times.

        Returns:
            The transform, and the time [ns] in the target frame.

        Raises:
            TransformError: as `lookup`.
        """
        self._check(target, source, fixed)
        T_fixed_source, _ = self.lookup_stamped(fixed, source, source_time_ns)
        T_target_fixed, time_ns = self.lookup_stamped(target, fixed, target_time_ns)
        return as_from_matrix(compose(normalized(T_target_fixed), T_fixed_source)), time_ns

    def lookup_stamped(self, target: str, source: str, time_ns: int | None = None) -> tuple[Rigid, int]:
        """Return `lookup` as numbers, and the time [ns] that it is of: 0 if all between are static.

        Raises:
            TransformError: as `lookup`.
        """
        time_ns = time_ns or 0
        # The remembered path if parents do not depend on the time, else tf2's walk.
        if not self._irregular:
            path = self._paths.get((target, source))
            if path is None:
                path = self._paths[target, source] = self._find_path(target, source)
            if path is not None:
                found = _along(path, time_ns)
                if found is not None:
                    return found
        if target == source:
            cache = self.frames.get(target)
            latest = cache is not None and not cache.static and cache.stamps and cache.stamps[-1]
            return IDENTITY, time_ns or latest or 0
        self._check(target, source)
        return solve(self.frames, target, source, time_ns)

    def _add(self, parent: str, child: str, static: bool) -> FrameCache:
        """Start to store a frame; one that becomes static, or no longer is, starts anew, as in ROS 2."""
        cache = self.frames[child] = FrameCache(child, static)
        self._irregular.discard(child)
        self._paths.clear()
        self._names[child] = self._names[parent] = None
        return cache

    def _note(self, cache: FrameCache, parent: str, excess: float) -> None:
        """Keep in mind whether a frame's path depends on the time, or rounding on the way."""
        self._names[parent] = None
        self._paths.clear()
        if excess > _EXACT_UNIT or not cache.has_one_parent:
            self._irregular.add(cache.child)
        else:
            self._irregular.discard(cache.child)

    def _check(self, *names: str) -> None:
        for name in names:
            if not name or name.startswith("/"):
                valid = f"valid is {name.lstrip('/')!r}" if name.strip("/") else "valid is a name"
                raise InvalidFrameError(f"the frame {name!r} cannot be looked up; {valid}")
            if name not in self._names:
                valid = ", ".join(sorted(self._names)) or "none so far"
                raise UnknownFrameError(f"the frame {name!r} is not in the transform tree; it has: {valid}")

    def _find_path(self, target: str, source: str) -> _Path | None:
        """Return the way that every look-up takes, None if there is none or a loop."""
        up, down = self._ancestors(source), self._ancestors(target)
        common = next((frame for frame in up if frame in down), None)
        if common is None or target == source:
            return None
        below = tuple(self.frames[name] for name in up[: up.index(common)])
        opposite = tuple(self.frames[name] for name in down[: down.index(common)])
        return below, opposite, tuple(cache for cache in (*below, *opposite) if not cache.static)

    def _ancestors(self, frame: str) -> list[str]:
        """Return the frame and its ancestors; none if they form a loop."""
        names = [frame]
        cache = self.frames.get(frame)
        while cache is not None:
            if cache.parent in names:
                return []
            names.append(cache.parent)
            cache = self.frames.get(cache.parent)
        return names


def _along(path: _Path, time_ns: int) -> tuple[Rigid, int] | None:
    """Return the transform along a path and its time; None if a frame is not known at that time."""
    up, down, moving = path
    if not time_ns:
        for cache in moving:
            stamp = cache.stamps[-1]
            if stamp and (stamp < time_ns or not time_ns):
                time_ns = stamp
    chain = back = IDENTITY
    for cache in up:
        value = cache.value(time_ns)
        if value is None:
            return None
        chain = value if chain is IDENTITY else compose(value, chain)
    if not down:
        return chain, time_ns
    for cache in down:
        value = cache.value(time_ns)
        if value is None:
            return None
        back = value if back is IDENTITY else compose(value, back)
    back = inverse(back)
    return (compose(back, chain) if up else back), time_ns
