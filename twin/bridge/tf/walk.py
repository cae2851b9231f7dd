"""The walk from two frames to where they meet, as of a time: tf2's walkToTopParent and getLatestCommonTime.

Which frame is whose parent may depend on the time, so it is found on the way.
"""

from __future__ import annotations

from collections.abc import Mapping

from twin.bridge.tf.cache import FrameCache
from twin.bridge.tf.errors import DisconnectedFramesError, ExtrapolationError, UnknownFrameError, seconds
from twin.bridge.tf.rigid import IDENTITY, Rigid, compose, inverse

MAX_DEPTH = 1000
"""tf2's MAX_GRAPH_DEPTH: who climbs more steps is in a loop."""

Frames = Mapping[str, FrameCache]


def solve(frames: Frames, target: str, source: str, time_ns: int) -> tuple[Rigid, int]:
    """Return T_target_source of two known frames at a time [ns], 0 the latest, and that time.

    Raises:
        UnknownFrameError: the frames form a loop.
        DisconnectedFramesError: no common root.
        ExtrapolationError: a frame on the way is not known at that time.
    """
    time_ns = time_ns or latest_common(frames, target, source)
    chain, top, missing = _climb(frames, source, time_ns, (target,))
    if top == target:
        return chain, time_ns
    # Up there, beyond where the two meet, a frame may be missing: it is not needed.
    back, end, missing_here = _climb(frames, target, time_ns, (source, top))
    if end == source:
        return inverse(back), time_ns
    if end == top and missing_here is None:
        return compose(inverse(back), chain), time_ns
    late = missing_here or missing
    if late is not None:
        raise extrapolation(late, time_ns, target, source)
    raise _disconnected(target, end, source, top)


def latest_common(frames: Frames, target: str, source: str) -> int:
    """Return the latest time [ns] that all frames between two known ones have; 0 if all are static.

    Raises:
        UnknownFrameError: the frames form a loop.
        DisconnectedFramesError: no common root.
    """
    if target == source:
        return _latest(frames.get(target))
    up = _latest_ancestors(frames, source, (target,))
    meeting = {parent for _, parent in up}
    if target in meeting:
        return _earliest(up)
    down = _latest_ancestors(frames, target, (source, *meeting))
    end = down[-1][1] if down else target
    if end == source:
        return _earliest(down)
    if end not in meeting:
        raise _disconnected(target, end, source, up[-1][1] if up else source)
    parents = [parent for _, parent in up]
    return _earliest([*down, *up[: parents.index(end) + 1]])


def extrapolation(cache: FrameCache, time_ns: int, target: str, source: str) -> ExtrapolationError:
    """Return what to say of a frame that is not known at a time [ns]."""
    edge = f"{cache.parent!r} -> {cache.child!r} (from {cache.authority})"
    asked = f"asked at {seconds(time_ns)} s"
    wanted = f" (looking up {source!r} in {target!r})"
    if not cache.stamps:
        return ExtrapolationError(f"{edge} has no samples any more; {asked}{wanted}")
    first, last = cache.stamps[0], cache.stamps[-1]
    known = (
        f"from {seconds(first)} s to {seconds(last)} s" if first != last else f"only at {seconds(first)} s"
    )
    gap, side = (
        (first - time_ns, "before the first") if time_ns < first else (time_ns - last, "after the last")
    )
    return ExtrapolationError(f"{edge} is known {known}; {asked}, {seconds(gap)} s {side}{wanted}")


def _climb(
    frames: Frames, start: str, time_ns: int, until: tuple[str, ...]
) -> tuple[Rigid, str, FrameCache | None]:
    """Return T_end_start, where the climb ended, and the frame not known at that time that ended it."""
    chain, frame = IDENTITY, start
    way: list[str] = []
    for _ in range(MAX_DEPTH + 1):
        cache = frames.get(frame)
        if frame in until or cache is None:
            return chain, frame, None
        value = cache.value(time_ns)
        if value is None:
            return chain, frame, cache
        chain = compose(value, chain)
        way.append(frame)
        frame = cache.parent_at(time_ns)
    raise _loop(way)


def _latest_ancestors(frames: Frames, start: str, until: tuple[str, ...]) -> list[tuple[int, str]]:
    """Return latest stamp [ns] and parent of a frame and its ancestors, up to one of `until`."""
    steps: list[tuple[int, str]] = []
    cache = frames.get(start)
    while cache is not None and cache.stamps:
        steps.append((_latest(cache), cache.parent))
        if cache.parent in until:
            break
        if len(steps) > MAX_DEPTH:
            raise _loop([start, *(parent for _, parent in steps)])
        cache = frames.get(cache.parent)
    return steps


def _latest(cache: FrameCache | None) -> int:
    return 0 if cache is None or cache.static or not cache.stamps else cache.stamps[-1]


def _earliest(steps: list[tuple[int, str]]) -> int:
    """Return the first of the latest stamps; 0 is that of a static frame."""
    return min((stamp for stamp, _ in steps if stamp), default=0)


def _disconnected(target: str, target_root: str, source: str, source_root: str) -> DisconnectedFramesError:
    return DisconnectedFramesError(
        f"{source!r} (root {source_root!r}) and {target!r} (root {target_root!r}) are in different trees"
    )


def _loop(way: list[str]) -> UnknownFrameError:
    """Return what to say of a way up, of whatever time, that comes by a frame again."""
    end = next(i for i, name in enumerate(way) if name in way[:i])
    ring = way[way.index(way[end]) : end + 1]
    return UnknownFrameError(f"the frames above {way[0]!r} form a loop: {' -> '.join(ring)}")
