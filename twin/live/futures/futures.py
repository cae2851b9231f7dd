"""The futures of a run, as the run sees them: forked at once, told when they are there."""

from __future__ import annotations

import json
import os
import select
import time
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

from twin.errors import SimulationError
from twin.live.futures.fork import Fork
from twin.live.futures.outcome import Outcome
from twin.live.futures.served import serve, watched
from twin.live.futures.what_if import WhatIf
from twin.runtime.open_run import OpenRun
from twin.scenario.verdict import Label

_CHUNK = 1 << 16
_SLACK_S = 30.0
_LIMIT_S, _LIMIT_FACTOR = 60.0, 10.0
"""A future may take so long of wall time, and so much more for each second of its own."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What became of the futures."""

    asked: WhatIf
    at_s: float
    """Simulated time of the fork [s]."""
    label: Label
    """What the robots were at that moment: without physical ones a model."""
    awaited: str
    """What they wait for: `the goal under way`; empty: for nothing."""
    outcomes: tuple[Outcome, ...]
    """By number."""
    cpu_s: float
    """Of all processes, from the fork to the end [s]."""
    wall_s: float
    """From the fork to the answer [s]."""
    stall_s: float
    """How long the run stood still for the fork [s]."""

    @property
    def succeeded(self) -> int:
        """How many arrived in time without a failed check."""
        return sum(outcome.succeeded is True for outcome in self.outcomes)

    @property
    def known(self) -> int:
        """Of how many it is known; those that were lost tell nothing."""
        return sum(outcome.succeeded is not None for outcome in self.outcomes)

    def to_json(self) -> str:
        """Return it as text."""
        outcomes = [outcome.to_dict() for outcome in self.outcomes]
        own = {name: getattr(self, name) for name in ("at_s", "cpu_s", "wall_s", "stall_s")}
        counts = {"succeeded": self.succeeded, "known": self.known}
        told = {"asked": self.asked.to_dict(), "awaited": self.awaited, "label": self.label}
        return json.dumps({**told, **own, **counts, "outcomes": outcomes})

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return what `to_json` gave; raises ValueError, KeyError or TypeError for anything else."""
        values = json.loads(text)
        own = {name: float(values[name]) for name in ("at_s", "cpu_s", "wall_s", "stall_s")}
        outcomes = tuple(map(Outcome.from_dict, values["outcomes"]))
        asked, awaited = WhatIf.from_dict(values["asked"]), str(values["awaited"])
        label: Label = values["label"]
        return cls(asked=asked, awaited=awaited, label=label, outcomes=outcomes, **own)


class Futures:
    """Futures of a run that are under way; to be closed, be it as a context manager."""

    def __init__(
        self,
        run: OpenRun,
        asked: WhatIf,
        *,
        jobs: int | None = None,
        time_limit_s: float | None = None,
        politely: bool = False,
    ) -> None:
        """Fork the run, which must be between two ticks; it goes on as if nothing had happened.

        Args:
            run: Whose futures.
            asked: What is asked.
            jobs: Futures at a time; None: one for each core that this process may use.
            time_limit_s: Of one [s of wall time]; None: a minute, and ten times its horizon.
            politely: Whether the run goes before its futures where there are too few cores.

        Raises:
            SimulationError: The run cannot be forked, or it is not clear which robot is meant.
        """
        if run.run.workers is not None or run.run.lockstep is not None:
            raise SimulationError("a run with --workers or --wait-for is several processes: it has no fork")
        if not run.run.bus.in_own_thread():
            raise SimulationError("a run is forked by the thread that runs it")
        watched(run, asked.robot)
        limit = _LIMIT_S + _LIMIT_FACTOR * asked.horizon if time_limit_s is None else time_limit_s
        jobs = jobs or len(os.sched_getaffinity(0))
        self.asked = asked
        self._at_s, self._label = run.run.world.time_ns * 1e-9, run.label
        self._outcomes: dict[int, Outcome] = {}
        self._heard = b""
        self._told: dict[str, Any] = {}
        self._start = time.monotonic()
        self._deadline = self._start + limit * -(-asked.n // jobs) + _SLACK_S
        self._fork = Fork(partial(serve, run, asked, jobs, limit, politely))
        os.set_blocking(self._fork.pipe, False)
        self._stall_s = time.monotonic() - self._start

    def poll(self, timeout_s: float = 0.0) -> Answer | None:
        """Return the answer if it is there, waiting at most so long [s of wall time].

        Raises:
            SimulationError: What is asked cannot be done.
        """
        while self._fork.pid:
            ready, _, _ = select.select([self._fork.pipe], [], [], timeout_s)
            if not ready:
                if time.monotonic() < self._deadline:
                    return None
                self._fork.end()
                self._lose("the fork of the run did not answer in time")
            elif chunk := os.read(self._fork.pipe, _CHUNK):
                self._hear(chunk)
            else:
                self._lose(f"the fork of the run has ended {self._fork.wait()}")
        if "refused" in self._told:
            raise SimulationError(self._told["refused"])
        return self._told["answer"]

    def wait(self) -> Answer:
        """Return the answer when it is there; see `poll`."""
        while (answer := self.poll(1.0)) is None:
            pass
        return answer

    def close(self) -> None:
        """End all futures. Harmless when repeated."""
        self._fork.end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hear(self, chunk: bytes) -> None:
        *lines, self._heard = (self._heard + chunk).split(b"\n")
        for line in lines:
            values = json.loads(line)
            if "number" in values:
                self._outcomes[values["number"]] = Outcome.from_dict(values)
            else:
                self._told |= values

    def _lose(self, reason: str) -> None:
        """Make the answer of what came; the rest is lost."""
        for number in range(1, self.asked.n + 1):
            self._outcomes.setdefault(number, Outcome(number=number, end="lost", reason=reason))
        self._told["answer"] = Answer(
            asked=self.asked,
            at_s=self._at_s,
            label=self._label,
            awaited=self._told.get("awaited", ""),
            outcomes=tuple(self._outcomes[number] for number in sorted(self._outcomes)),
            cpu_s=self._told.get("cpu_s", 0.0),
            wall_s=time.monotonic() - self._start,
            stall_s=self._stall_s,
        )
