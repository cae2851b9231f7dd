"""Where the time of a run goes, layer by layer.

Functions by which a run enters a layer are wrapped: the CPU time of the run's thread counts for the layer
that was entered last and not left yet, so every moment counts once. `physics` is MuJoCo's `mj_step`, `rays`
what casts them: together what `benchmarks/measures/replay.py` does alone, where it costs less, as nothing
else uses the caches. What other threads take (Zenoh's, the recording's) is told apart. The clocks cost
something themselves, most where calls are short: messages.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import mujoco

from twin.bridge.topics import Publisher, Subscription
from twin.recording.sink import RerunSink
from twin.runtime.run import Run
from twin.runtime.sensing import SensorSchedule
from twin.sim.sensors.rays import RayCaster
from twin.sim.world import World

REST, THREADS = "rest of the tick", "other threads"
ENTRIES: tuple[tuple[str, Any, str], ...] = (
    ("physics", mujoco, "mj_step"),
    ("rays", RayCaster, "cast"),
    ("guard, kinematics, work", World, "step"),
    ("sensors", SensorSchedule, "fire"),
    ("nodes", Run, "nodes"),
    ("drives", Run, "actuate"),
    ("messages", Publisher, "publish"),
    ("messages", Subscription, "handle"),
    ("observation, checks", Run, "sinks"),
    ("recording", RerunSink, "on_tick"),
    ("recording", RerunSink, "on_sample"),
)
"""Layer, owner and name of a function by which it is entered."""
LAYERS = (*dict.fromkeys(layer for layer, _, _ in ENTRIES), REST, THREADS)


class Layers:
    """The layers of a run; entered and left by its thread alone."""

    def __init__(self) -> None:
        self.restart()

    @contextmanager
    def wrapped(self) -> Iterator[None]:
        """Let what is called inside count; runs are to be made inside, too."""
        with ExitStack() as stack:
            for layer, owner, name in ENTRIES:
                stack.enter_context(patch.object(owner, name, self._timed(getattr(owner, name), layer)))
            # a subscription decodes and then calls back: that is the node's work
            stack.enter_context(
                patch.object(Subscription, "__init__", self._calling_back(Subscription.__init__))
            )
            yield

    def restart(self) -> None:
        """Forget what was measured so far; from now on this thread counts."""
        self._ns = dict.fromkeys(LAYERS, 0)
        self._entered = [REST]
        self._thread = threading.get_ident()
        self._since = self._began = time.thread_time_ns()
        self._process = time.process_time_ns()

    def seconds(self) -> dict[str, float]:
        """Return the CPU time of each layer since the start [s]."""
        now, process = time.thread_time_ns(), time.process_time_ns()
        ns = dict(self._ns)
        ns[self._entered[-1]] += now - self._since
        ns[THREADS] = max(0, process - self._process - (now - self._began))
        return {layer: spent * 1e-9 for layer, spent in ns.items()}

    def _timed(self, function: Callable[..., Any], layer: str) -> Callable[..., Any]:
        def timed(*args: Any, **kwargs: Any) -> Any:
            if threading.get_ident() != self._thread:
                return function(*args, **kwargs)
            self._switch()
            self._entered.append(layer)
            try:
                return function(*args, **kwargs)
            finally:
                self._switch()
                self._entered.pop()

        return timed

    def _switch(self) -> None:
        now = time.thread_time_ns()
        self._ns[self._entered[-1]] += now - self._since
        self._since = now

    def _calling_back(self, init: Callable[..., None]) -> Callable[..., None]:
        def make(
            self_: Any, node: Any, cls: Any, name: Any, callback: Any, *args: Any, **kwargs: Any
        ) -> None:
            init(self_, node, cls, name, self._timed(callback, "nodes"), *args, **kwargs)

        return make


def picture(title: str, layers: Mapping[str, float]) -> str:
    """Return a bar for each layer as SVG.

    Args:
        title: Above them; it tells the unit.
        layers: What each costs.
    """
    left, long, row = 180, 380, 22
    width, height = left + long + 60, 34 + row * len(layers)
    scale = long / max(layers.values())
    lines = [f'<text x="8" y="20" font-weight="bold">{title}</text>']
    for i, (layer, value) in enumerate(layers.items()):
        y, bar = 32 + row * i, value * scale
        lines += [
            f'<text x="{left - 8}" y="{y + 13}" text-anchor="end">{layer}</text>',
            f'<rect x="{left}" y="{y}" width="{bar:.1f}" height="{row - 5}" fill="#1f6f8b"/>',
            f'<text x="{left + bar + 6:.1f}" y="{y + 13}">{value:.2f}</text>',
        ]
    body = "\n".join(lines)
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"
 viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">
<rect width="{width}" height="{height}" fill="#ffffff"/>
{body}
</svg>
"""
