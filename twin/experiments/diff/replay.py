"""A run made again up to a second, with what happened in that second kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from twin.experiments.diff.coordinates import state, state_names
from twin.experiments.diff.side import Side
from twin.geometry import Array
from twin.plugins import execution
from twin.runtime.open_run import OpenRun

if TYPE_CHECKING:
    from twin.bridge.topics import Sample
    from twin.runtime import Progress


@dataclass(frozen=True)
class Message:
    """One sample."""

    tick: int
    """The first tick of a run is 1; nodes that are made publish in 0."""
    order: int
    """Among those of all topics."""
    time_ns: int
    payload: bytes


@dataclass(kw_only=True)
class Replay:
    """A run, and what was kept of two of its seconds; the first is 0."""

    messages_of: int | None
    """The second whose messages are kept."""
    states_of: int | None
    """The second whose physics states are kept."""
    messages: dict[str, list[Message]] = field(default_factory=dict)
    """By topic and type, as `RunHashes.topics`."""
    states: list[Array] = field(default_factory=list)
    """After each physics step; see `coordinates.state`."""
    state_names: tuple[str, ...] = ()
    """What each number of a state is."""
    first_step: int = 0
    """Number of the physics step that ends in the first of the states; the first of a run is 1."""
    timestep_ns: int = 0
    substeps: int = 1
    """Physics steps in a control tick."""
    unlike: int | None = None
    """The first second in which it is not what was stored of the run; None: it is the same run."""
    _second: int = 0
    _tick: int = 0
    _count: int = 0

    def holds(self, second: int | None) -> bool:
        """Whether a second was asked for, and is what it was in the stored run."""
        return second is not None and (self.unlike is None or second < self.unlike)

    def run(self, side: Side, progress: Callable[[Progress], None] | None = None) -> None:
        """Make a run again, as far as is needed.

        Raises:
            TwinError: It cannot be made.
        """
        last = max(self.messages_of or 0, self.states_of or 0)
        with execution():
            run = OpenRun(side.scenario(), record=False, outside=side.outside, taps=[self._on_sample])
            world = run.run.world
            self.timestep_ns = world.timestep_ns
            self.substeps = run.run.parts.control_period_ns // world.timestep_ns
            self.state_names = state_names(world)

            def on_step() -> None:
                if self._second == self.states_of:
                    self.states.append(state(world))

            def after_tick() -> bool:
                self._tick += 1
                second = len(run.digest.stream)
                if self._second != second == self.states_of:
                    self.first_step = world.step_count + 1
                    world.watch_steps(on_step)
                self._second = second
                return second > last

            try:
                self._second = -1
                after_tick()  # of nodes that are made
                run.advance(after_tick, progress)
                stream = run.digest.hashes(world.state_digest()).stream[: last + 1]
            finally:
                run.close()
        stored = side.run.hashes.stream
        pairs = enumerate(zip(stream, stored, strict=False))
        self.unlike = next((index for index, (one, other) in pairs if one != other), None)
        if self.unlike is None and len(stream) < min(len(stored), last + 1):
            self.unlike = len(stream)

    def _on_sample(self, sample: Sample[Any]) -> None:
        if self._second == self.messages_of:
            found = self.messages.setdefault(f"{sample.topic} {sample.msgtype}", [])
            found.append(Message(self._tick, self._count, sample.time_ns, sample.payload))
            self._count += 1
