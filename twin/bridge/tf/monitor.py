"""How late and how often transforms come, in the words of tf2_monitor."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

from twin.bridge.msgs import TFMessage, ns

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
