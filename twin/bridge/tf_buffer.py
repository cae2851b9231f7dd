"""The transform tree over time, with tf2's rules: interpolation, no extrapolation, static transforms always.

Inside, transforms are tuples of floats: at this size far cheaper than arrays.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right

import numpy as np

from twin.errors import BridgeError
from twin.geometry import Pose2, Pose3

Rigid = tuple[float, float, float, float, float, float, float]
"""x, y, z [m], then the unit quaternion w, x, y, z."""
_IDENTITY: Rigid = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_UNIT_TOLERANCE = 1e-3


class TransformError(BridgeError, LookupError):
    """A transform is not available."""


class UnknownFrameError(TransformError):
    """Nobody has published a frame."""


class DisconnectedFramesError(TransformError):
    """Two frames belong to different trees."""


class ExtrapolationError(TransformError):
    """The time asked for is outside of what was published."""


class _Edge:
    """T_parent_child over time."""

    def __init__(self, parent: str, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.stamps: list[int] = []
        self.values: list[Rigid] = []


class TransformBuffer:
    """Stores T_parent_child of every frame for some time and looks transforms up along the tree."""

    def __init__(self, cache_ns: int = 10_000_000_000) -> None:
        self._cache_ns = cache_ns
        self._edges: dict[str, _Edge] = {}
        self._path_cache: dict[tuple[str, str], tuple[list[str], list[str]]] = {}

    @property
    def parents(self) -> dict[str, str]:
        """Each child frame's parent."""
        return {child: edge.parent for child, edge in self._edges.items()}

    def set_transform(
        self, parent: str, child: str, time_ns: int, T_parent_child: Pose3, *, static: bool = False
    ) -> None:
        """Store a transform; a repeated stamp and what is older than the cache are ignored, as in tf2.

        Raises:
            ValueError: parent and child are the same, a name is empty, or the rotation is no unit quaternion.
        """
        self.set_rigid(parent, child, time_ns, _rigid(T_parent_child), static=static)

    def set_rigid(self, parent: str, child: str, time_ns: int, value: Rigid, *, static: bool = False) -> None:
        """Do what `set_transform` does, with the numbers as they are in a message's order of reading.

        Raises:
            ValueError: as `set_transform`.
        """
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if not parent or not child or parent == child:
            raise ValueError(f"{child!r} cannot be a child of {parent!r}")
        norm = math.sqrt(sum(v * v for v in value[3:]))
        if not abs(norm - 1.0) < _UNIT_TOLERANCE or not all(map(math.isfinite, value)):
            raise ValueError(f"the transform of {child!r} is not finite with a unit quaternion: {value}")
        edge = self._edges.get(child)
        if edge is None or edge.parent != parent or edge.static != static:
            edge = self._edges[child] = _Edge(parent, static)
            self._path_cache.clear()
        if static:
            edge.stamps, edge.values = [time_ns], [value]
        else:
            self._insert(edge, time_ns, value)

    def can_transform(self, target: str, source: str, time_ns: int | None = None) -> bool:
        """Return whether `lookup` would succeed."""
        try:
            self.lookup(target, source, time_ns)
        except TransformError:
            return False
        return True

    def latest_common_ns(self, target: str, source: str) -> int | None:
        """Return the latest time [ns] at which a lookup succeeds; None if all transforms between are static.

        Raises:
            UnknownFrameError, DisconnectedFramesError: there is no path.
        """
        return self._latest_common_ns(*self._paths(target.lstrip("/"), source.lstrip("/")))

    def _latest_common_ns(self, up: list[str], down: list[str]) -> int | None:
        stamps = [edge.stamps[-1] for edge in map(self._edges.__getitem__, (*up, *down)) if not edge.static]
        return min(stamps, default=None)

    def lookup(self, target: str, source: str, time_ns: int | None = None) -> Pose3:
        """Return T_target_source: what maps coordinates in `source` to `target`.

        Args:
            target: Frame.
            source: Frame.
            time_ns: [ns]; None: the latest time that all transforms between have.

        Raises:
            UnknownFrameError: a frame that nobody has published.
            DisconnectedFramesError: no common root.
            ExtrapolationError: the time is before the first or after the last stamp of a transform between.
        """
        value = self._lookup(target, source, time_ns)
        return Pose3(np.array(value[:3]), np.array(value[3:]))

    def lookup_planar(self, target: str, source: str, time_ns: int | None = None) -> Pose2:
        """Return `lookup` projected to the ground plane; cheaper than to project the result."""
        x, y, _, w, i, j, k = self._lookup(target, source, time_ns)
        return Pose2(x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k)))

    def _lookup(self, target: str, source: str, time_ns: int | None) -> Rigid:
        target, source = target.lstrip("/"), source.lstrip("/")
        up, down = self._paths(target, source)
        if time_ns is None:
            time_ns = self._latest_common_ns(up, down) or 0
        T_root_source = self._chain(up, time_ns)
        return _compose(_inverse(self._chain(down, time_ns)), T_root_source) if down else T_root_source

    def _insert(self, edge: _Edge, time_ns: int, value: Rigid) -> None:
        stamps, values = edge.stamps, edge.values
        if not stamps or time_ns > stamps[-1]:
            stamps.append(time_ns)
            values.append(value)
            outdated = bisect_left(stamps, time_ns - self._cache_ns)
            if outdated:
                del stamps[:outdated], values[:outdated]
            return
        index = bisect_left(stamps, time_ns)
        if stamps[index] != time_ns and time_ns >= stamps[-1] - self._cache_ns:
            stamps.insert(index, time_ns)
            values.insert(index, value)

    def _paths(self, target: str, source: str) -> tuple[list[str], list[str]]:
        """Return the frames from source, and from target, up to but without their first common ancestor."""
        cached = self._path_cache.get((target, source))
        if cached is None:
            cached = self._path_cache[target, source] = self._find_paths(target, source)
        return cached

    def _find_paths(self, target: str, source: str) -> tuple[list[str], list[str]]:
        up, down = self._ancestors(source), self._ancestors(target)
        known = set(self._edges) | {edge.parent for edge in self._edges.values()}
        for frame in (target, source):
            if frame not in known and target != source:
                valid = ", ".join(sorted(known)) or "none so far"
                raise UnknownFrameError(f"the frame {frame!r} is not in the transform tree; it has: {valid}")
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            raise DisconnectedFramesError(
                f"{source!r} (root {up[-1]!r}) and {target!r} (root {down[-1]!r}) are in different trees"
            )
        return up[: up.index(common)], down[: down.index(common)]

    def _ancestors(self, frame: str) -> list[str]:
        """Return the frame and its ancestors; a loop ends where it closes."""
        frames = [frame]
        edge = self._edges.get(frame)
        while edge is not None and edge.parent not in frames:
            frames.append(edge.parent)
            edge = self._edges.get(edge.parent)
        return frames

    def _chain(self, frames: list[str], time_ns: int) -> Rigid:
        """Return T_ancestor_frame of the first frame."""
        value = _IDENTITY
        for frame in frames:
            value = _compose(self._at(frame, time_ns), value)
        return value

    def _at(self, child: str, time_ns: int) -> Rigid:
        edge = self._edges[child]
        if edge.static:
            return edge.values[0]
        stamps = edge.stamps
        after = bisect_right(stamps, time_ns)
        if after and stamps[after - 1] == time_ns:
            return edge.values[after - 1]
        if after == 0 or after == len(stamps):
            raise _extrapolation(edge, child, time_ns)
        before = after - 1
        ratio = (time_ns - stamps[before]) / (stamps[after] - stamps[before])
        return _interpolate(edge.values[before], edge.values[after], ratio)


def _extrapolation(edge: _Edge, child: str, time_ns: int) -> ExtrapolationError:
    first, last = edge.stamps[0], edge.stamps[-1]
    gap, side = (
        (first - time_ns, "before the first") if time_ns < first else (time_ns - last, "after the last")
    )
    return ExtrapolationError(
        f"{edge.parent!r} -> {child!r} is known from {first / 1e9:.3f} s to {last / 1e9:.3f} s; "
        f"asked at {time_ns / 1e9:.3f} s, {gap / 1e9:.3f} s {side}"
    )


def _rigid(pose: Pose3) -> Rigid:
    x, y, z = pose.xyz.tolist()
    w, i, j, k = pose.quat_wxyz.tolist()
    return x, y, z, w, i, j, k


def _compose(a: Rigid, b: Rigid) -> Rigid:
    ax, ay, az, aw, ai, aj, ak = a
    bx, by, bz, bw, bi, bj, bk = b
    tx, ty, tz = _rotate(aw, ai, aj, ak, bx, by, bz)
    return (
        ax + tx,
        ay + ty,
        az + tz,
        aw * bw - ai * bi - aj * bj - ak * bk,
        aw * bi + ai * bw + aj * bk - ak * bj,
        aw * bj - ai * bk + aj * bw + ak * bi,
        aw * bk + ai * bj - aj * bi + ak * bw,
    )


def _inverse(a: Rigid) -> Rigid:
    x, y, z, w, i, j, k = a
    tx, ty, tz = _rotate(w, -i, -j, -k, x, y, z)
    return -tx, -ty, -tz, w, -i, -j, -k


def _rotate(
    w: float, i: float, j: float, k: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Turn (x, y, z) by the unit quaternion (w, i, j, k): v + 2 w (q x v) + 2 q x (q x v)."""
    tx, ty, tz = 2.0 * (j * z - k * y), 2.0 * (k * x - i * z), 2.0 * (i * y - j * x)
    return (
        x + w * tx + j * tz - k * ty,
        y + w * ty + k * tx - i * tz,
        z + w * tz + i * ty - j * tx,
    )


def _interpolate(a: Rigid, b: Rigid, ratio: float) -> Rigid:
    """Interpolate linearly in translation and along the shorter great circle in rotation."""
    x, y, z = (p + ratio * (q - p) for p, q in zip(a[:3], b[:3], strict=True))
    dot = sum(p * q for p, q in zip(a[3:], b[3:], strict=True))
    sign = 1.0 if dot >= 0.0 else -1.0
    angle = math.acos(min(1.0, abs(dot)))
    if angle < 1e-6:  # where the sines' quotient loses its digits, the chord is the arc
        wa, wb = 1.0 - ratio, ratio * sign
    else:
        wa = math.sin((1.0 - ratio) * angle) / math.sin(angle)
        wb = sign * math.sin(ratio * angle) / math.sin(angle)
    w, i, j, k = (wa * p + wb * q for p, q in zip(a[3:], b[3:], strict=True))
    norm = math.sqrt(w * w + i * i + j * j + k * k)
    return x, y, z, w / norm, i / norm, j / norm, k / norm
