"""A moment of a run in a file: how it was made and what came into it, so that it can be made again."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, Self

from twin.bridge.wire.session import SessionConfig
from twin.errors import RecordingError, SimulationError
from twin.files.reading import absence, read_text
from twin.files.writing import write_whole
from twin.live.futures.inputs import Input, Inputs, feed
from twin.plugins import execution
from twin.runtime.open_run import OpenRun
from twin.scenario.outside import Outside
from twin.scenario.provenance import Provenance, cpu_class, versions
from twin.scenario.schema import load_again

if TYPE_CHECKING:
    from twin.runtime import Progress

_FORMAT = 1
_MOST_BYTES = 1 << 30


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """A moment of a run, between two ticks."""

    provenance: Provenance
    session: str
    """Name of the bus's session, of which the ids of goals are made."""
    time_ns: int
    """Simulated time of the moment [ns]."""
    digest: str
    """Of the run up to it."""
    cpu_s: float
    """What it has cost so far [s]."""
    inputs: tuple[Input, ...]

    @classmethod
    def of(cls, run: OpenRun, inputs: Inputs) -> Self:
        """Take one.

        Raises:
            SimulationError: The run cannot be made again.
        """
        parts = run.run
        if inputs.lacking:
            raise SimulationError(f"{inputs.lacking} is heard as bytes, which a snapshot does not keep")
        if not parts.parts.clock.is_simulated or not parts.scenario.source.data:
            raise SimulationError("a snapshot is of a scenario's run in simulated time; this one is not")
        return cls(
            provenance=run.provenance(),
            session=parts.bus.session_name,
            time_ns=parts.world.time_ns,
            digest=run.digest.finish(parts.world.state_digest()),
            cpu_s=process_time() - inputs.begun_s,
            inputs=tuple(inputs.kept),
        )

    @property
    def cost(self) -> str:
        """What it costs to be there again, in words."""
        return f"{self.time_ns * 1e-9:.1f} s are run again, which took {self.cpu_s:.1f} s of CPU"

    def check(self) -> None:
        """See that nothing of what it was made with is otherwise now; raises SimulationError."""
        _compare(self.provenance.versions, versions(), "")
        _compare({"CPU": self.provenance.cpu}, {"CPU": cpu_class()}, "")
        _compare(self.provenance.files, self.provenance.source.files(), "file ")

    def restore(self, progress: Callable[[Progress], None] | None = None) -> OpenRun:
        """Make the run again, without a network, up to the moment.

        Raises:
            SimulationError: Something of what it was made with is otherwise now, or it is another run.
            TwinError: It cannot be made.
        """
        self.check()
        with execution():
            scenario = load_again(self.provenance.source, execute=True)
            outside = Outside(nodes=self.provenance.nodes)
            network = SessionConfig(name=self.session)
            run = OpenRun(scenario, record=False, outside=outside, network=network)
        try:
            _compare(self.provenance.plugins, run.provenance().plugins, "plugin ")
            world, put = run.run.world, feed(run, self.inputs)
            put()
            run.between_ticks.append(put)
            run.advance(lambda: world.time_ns >= self.time_ns, progress)
            run.between_ticks.remove(put)
            digest = run.digest.finish(world.state_digest())
            if digest != self.digest or world.time_ns != self.time_ns:
                raise SimulationError(
                    f"what came of the snapshot's scenario and inputs is another run: digest {digest[:12]} "
                    f"instead of {self.digest[:12]}; was the file changed?"
                )
        except BaseException:
            run.close()
            raise
        return run

    def to_json(self) -> str:
        """Return it as text."""
        own = {name: getattr(self, name) for name in ("session", "time_ns", "digest", "cpu_s")}
        inputs = [one.to_list() for one in self.inputs]
        told: dict[str, Any] = {"format": _FORMAT, **own, "provenance": self.provenance.to_dict()}
        return json.dumps({**told, "inputs": inputs}, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return what `to_json` gave; raises ValueError, KeyError or TypeError for anything else."""
        values = json.loads(text)
        if values.pop("format") != _FORMAT:
            raise ValueError("of another format")
        provenance = Provenance.from_dict(values.pop("provenance"))
        inputs = tuple(map(Input.from_list, values.pop("inputs")))
        return cls(provenance=provenance, inputs=inputs, **values)

    def write(self, file: Path) -> None:
        """Write it.

        Raises:
            RecordingError: The file cannot be written.
        """
        try:
            write_whole(file, self.to_json() + "\n")
        except OSError as fault:
            raise RecordingError(f"{file}: cannot be written: {fault.strerror}") from fault

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read one.

        Raises:
            RecordingError: It is missing, or none.
        """
        try:
            return cls.from_json(read_text(file, _MOST_BYTES))
        except OSError as fault:
            why = absence(file) or f"cannot be read: {fault.strerror}"
            raise RecordingError(f"{file}: {why}; `twin fork --save` writes a snapshot") from None
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise RecordingError(f"{file}: not a snapshot, as `twin fork --save` writes it") from None


def _compare(then: Mapping[str, str], now: Mapping[str, str], what: str) -> None:
    for name in sorted({*then, *now}):
        before, after = then.get(name, "missing"), now.get(name, "missing")
        if before != after:
            raise SimulationError(
                f"the snapshot was made with {what}{name} {_short(before)}, here it is {_short(after)}: "
                "what comes of it would be another run"
            )


def _short(text: str) -> str:
    return text if len(text) < 40 else f"{text[:12]}…"
