"""What a buffer holds, for people: lists of frames, a text tree, a drawing, and delays and rates.

Lists are tf2's, delays and rates in the words of tf2_monitor. Drawings are Graphviz text as view_frames
writes it, and SVG without Graphviz.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from twin import tree_drawing
from twin.bridge.msgs import TFMessage, ns
from twin.bridge.tf.core import BufferCore
from twin.bridge.tf.errors import seconds
from twin.tree_drawing import Node, escaped

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


_KEPT = 1000
"""tf2_monitor's number of delays that it averages."""


class _Series:
    """Delays [ns] and times of arrival [ns] of one frame or broadcaster."""

    def __init__(self) -> None:
        self.delays: deque[float] = deque(maxlen=_KEPT)
        self.arrivals: deque[int] = deque(maxlen=_KEPT)

    def add(self, delay_ns: float, now_ns: int) -> None:
        self.delays.append(delay_ns)
        self.arrivals.append(now_ns)

    @property
    def delay_text(self) -> tuple[str, str]:
        average = sum(self.delays) / len(self.delays)
        return f"{average * 1e-9:.6g}", f"{max(0.0, *self.delays) * 1e-9:.6g}"

    @property
    def rate_hz(self) -> float:
        """Arrivals after the first, over the time that they took; 0 of a single one."""
        span = self.arrivals[-1] - self.arrivals[0]
        return (len(self.arrivals) - 1) * 1e9 / span if span else 0.0


class TransformStatistics:
    """Adds up what comes on /tf and /tf_static."""

    def __init__(self) -> None:
        self._frames: dict[str, _Series] = {}
        self._authorities: dict[str, str] = {}
        self._nodes: dict[str, _Series] = {}

    def add(self, message: TFMessage, authority: str, now_ns: int) -> None:
        """Count a message that came at a time [ns] from a broadcaster."""
        delays = [now_ns - ns(item.header.stamp) for item in message.transforms]
        for item, delay in zip(message.transforms, delays, strict=True):
            self._frames.setdefault(item.child_frame_id, _Series()).add(delay, now_ns)
            self._authorities[item.child_frame_id] = authority
        average = sum(delays) / max(1, len(delays))
        self._nodes.setdefault(authority, _Series()).add(average, now_ns)

    def report(self, only: Iterable[str] | None = None) -> str:
        """Return lines about frames (all, or those of a chain) and broadcasters."""
        wanted = set(self._frames if only is None else only)
        lines = ["", "Frames:"]
        for frame, series in sorted(self._frames.items()):
            if frame in wanted:
                average, longest = series.delay_text
                lines.append(
                    f"Frame: {frame}, published by {self._authorities[frame]}, Average Delay: {average}, "
                    f"Max Delay: {longest}, Rate: {series.rate_hz:.6g} Hz"
                )
        lines += ["", "All Broadcasters:"]
        for name, series in sorted((str(authority), series) for authority, series in self._nodes.items()):
            average, longest = series.delay_text
            lines.append(
                f"Node: {name} {series.rate_hz:.6g} Hz, Average Delay: {average} Max Delay: {longest}"
            )
        return "\n".join(lines) + "\n"


def net_delay(delays_ns: Sequence[int]) -> str:
    """Return tf2_monitor's line about a chain."""
    average = sum(delays_ns) / max(1, len(delays_ns))
    return f"Net delay     avg = {average * 1e-9:.6g}: max = {max(delays_ns, default=0) * 1e-9:.6g}"


def graphviz(infos: Sequence[FrameInfo], now_ns: int) -> str:
    """Return the tree as a .gv file with the labels of view_frames."""
    if not infos:
        return 'digraph G { "No tf data received" }\n'
    lines = ["digraph G {"]
    for info in infos:
        label = "\\n".join(escaped(text) for text in _label(info))
        lines.append(f'"{escaped(info.parent)}" -> "{escaped(info.frame)}"[label=" {label}\\n"];')
    lines += [
        "edge [style=invis];",
        ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";',
        f'"Recorded at time: {now_ns * 1e-9:.6f}"[ shape=plaintext ] ;',
    ]
    lines += [f'}}->"{escaped(roots(infos)[0])}";', "}"]
    return "\n".join(lines) + "\n"


def svg(infos: Sequence[FrameInfo], now_ns: int) -> str:
    """Return the tree as SVG: roots at the left, a column for each generation."""
    if not infos:
        return tree_drawing.svg({"": Node(lines=["No tf data received"])}, (), [""], title="frames")
    tops, children = roots(infos), children_of(infos)
    nodes = {frame: Node(lines=[frame]) for frame in tops}
    for info in infos:
        if info.frame not in nodes:
            nodes[info.frame] = Node(lines=[info.frame, *_box(info)])
    arrows = [(info.parent, info.frame) for below in children.values() for info in below]
    note = f"Recorded at time: {now_ns * 1e-9:.6f}"
    return tree_drawing.svg(nodes, arrows, tops, title="frames", note=note)


def _label(info: FrameInfo) -> list[str]:
    return [
        f"Broadcaster: {info.broadcaster}",
        f"Average rate: {info.rate_hz:.3f}",
        f"Buffer length: {info.length_ns * 1e-9:.3f}",
        f"Most recent transform: {info.newest_ns * 1e-9:.6f}",
        f"Oldest transform: {info.oldest_ns * 1e-9:.6f}",
    ]


def _box(info: FrameInfo) -> list[str]:
    rate = "static" if info.is_static else f"{info.rate_hz:.1f} Hz, latest {info.newest_ns * 1e-9:.3f} s"
    return [info.broadcaster, rate]
