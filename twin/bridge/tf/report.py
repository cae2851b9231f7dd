"""What a buffer holds, for people: tf2's lists of frames, and a text tree."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from twin.bridge.tf.core import BufferCore
from twin.bridge.tf.errors import seconds

_SHORTEST_NS = 100_000
"""tf2's lower bound of a buffer's length when it computes a rate."""


@dataclass(frozen=True, kw_only=True)
class FrameInfo:
    """What is known of one frame."""

    frame: str
    parent: str
    broadcaster: str
    is_static: bool
    rate_hz: float
    """Samples over the time that they cover, as tf2 counts: 10000 of a single one."""
    newest_ns: int
    """Stamp [ns]; 0 of a static frame."""
    oldest_ns: int
    """Stamp [ns]; 0 of a static frame."""

    @property
    def length_ns(self) -> int:
        """How long a time the samples cover [ns]."""
        return self.newest_ns - self.oldest_ns


def frame_infos(buffer: BufferCore) -> tuple[FrameInfo, ...]:
    """Return what is known of every frame that has a parent, in the order in which they came."""
    infos = []
    for cache in buffer.frames.values():
        if not cache.stamps:
            continue
        first, last = (0, 0) if cache.static else (cache.stamps[0], cache.stamps[-1])
        infos.append(
            FrameInfo(
                frame=cache.child,
                parent=cache.parent,
                broadcaster=str(cache.authority),
                is_static=cache.static,
                rate_hz=len(cache.stamps) * 1e9 / max(last - first, _SHORTEST_NS),
                newest_ns=last,
                oldest_ns=first,
            )
        )
    return tuple(infos)


def frames_as_yaml(infos: Iterable[FrameInfo], now_ns: int = 0) -> str:
    """Return tf2's allFramesAsYAML: what view_frames reads; with a time [ns] also each frame's delay."""
    lines = []
    for info in infos:
        lines += [
            f"{info.frame}: ",
            f"  parent: '{info.parent}'",
            f"  broadcaster: '{info.broadcaster}'",
            f"  rate: {info.rate_hz:.3f}",
            f"  most_recent_transform: {info.newest_ns * 1e-9:.6f}",
            f"  oldest_transform: {info.oldest_ns * 1e-9:.6f}",
        ]
        if now_ns:
            lines.append(f"  transform_delay: {(now_ns - info.newest_ns) * 1e-9:.3f}")
        lines.append(f"  buffer_length: {info.length_ns * 1e-9:.3f}")
    return "\n".join(lines) + "\n" if lines else "[]"


def frames_as_string(infos: Iterable[FrameInfo]) -> str:
    """Return tf2's allFramesAsString."""
    return "".join(f"Frame {info.frame} exists with parent {info.parent}.\n" for info in infos)


def text_tree(infos: Sequence[FrameInfo]) -> str:
    """Return the frames as a tree, a line each: broadcaster, and rate or that it is static."""
    children = children_of(infos)
    lines: list[str] = []
    tops = roots(infos)
    shown = set(tops)
    for root in tops:
        lines.append(root)
        # Frames to show, those that come next last: a chain may be deeper than Python can call.
        waiting = _branch(children, root, "")
        while waiting:
            info, indent, last = waiting.pop()
            lines.append(f"{indent}{'└── ' if last else '├── '}{info.frame}  {_described(info)}")
            if info.frame not in shown:
                shown.add(info.frame)
                waiting += _branch(children, info.frame, indent + ("    " if last else "│   "))
    return "\n".join(lines) + "\n" if lines else ""


def children_of(infos: Iterable[FrameInfo]) -> dict[str, list[FrameInfo]]:
    """Return the children of each frame that has some, sorted by name."""
    children: dict[str, list[FrameInfo]] = {}
    for info in sorted(infos, key=lambda info: info.frame):
        children.setdefault(info.parent, []).append(info)
    return children


def roots(infos: Iterable[FrameInfo]) -> list[str]:
    """Return the frames that have no parent, sorted; then of each loop, which hangs on none, one frame."""
    parents = {info.frame: info.parent for info in infos}
    found = sorted(set(parents.values()) - set(parents))
    reached: set[str] = set(found)
    for frame in sorted(parents):
        path: dict[str, None] = {}
        while frame not in reached and frame not in path:
            path[frame] = None
            frame = parents[frame]
        if frame in path:
            ring = list(path)
            found.append(min(ring[ring.index(frame) :]))
        reached.update(path)
    return found


def _branch(
    children: dict[str, list[FrameInfo]], frame: str, indent: str
) -> list[tuple[FrameInfo, str, bool]]:
    """Return a frame's children, the last one first, with their indent and whether they are the last."""
    branch = children.get(frame, ())
    return [(info, indent, number == 0) for number, info in enumerate(reversed(branch))]


def _described(info: FrameInfo) -> str:
    how = "static" if info.is_static else f"{info.rate_hz:.1f} Hz, latest at {seconds(info.newest_ns)} s"
    return f"({how}, from {info.broadcaster})"
