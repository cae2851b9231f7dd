"""Runs of one scenario with changes, each made once: in warm processes, and known again by their content."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from twin.errors import TwinError
from twin.experiments.processes import Lost, Processes
from twin.files.kept import keep, kept
from twin.plugins import execution
from twin.runtime.open_run import run
from twin.scenario.provenance import cpu_class, versions
from twin.scenario.schema import load_again
from twin.scenario.source import Source
from twin.scenario.verdict import Verdict

_KIND = "trials"
_POLL_S = 0.5


@dataclass(frozen=True)
class Trial:
    """A scenario to run."""

    source: Source
    repeat: int = 0
    """Another number is another run of the same."""

    @property
    def key(self) -> str:
        """What the outcome depends on."""
        told = (self.source.data, self.source.files(), versions(), cpu_class(), self.repeat)
        return json.dumps(told, sort_keys=True)


def perform(trial: Trial) -> dict[str, Any]:
    """Run, and return the content of the verdict."""
    try:
        with execution():
            verdict = run(load_again(trial.source, execute=True), record=False)
    except TwinError as fault:
        verdict = Verdict(scenario=str(trial.source.data.get("name")), seed=0, error=str(fault))
    values: dict[str, Any] = json.loads(verdict.to_json())
    return values


@dataclass(kw_only=True)
class Trials:
    """Makes runs, and remembers them; to be used as a context manager."""

    count: int = 1
    """Runs at a time."""
    told: Callable[[int], None] = lambda made: None
    """Called with the number of runs that were made, whenever one has ended."""
    made: int = 0
    """How many runs were made, not remembered."""
    _results: dict[str, Mapping[str, Any]] = field(default_factory=dict)

    def __enter__(self) -> Self:
        self._processes: Processes[tuple[str, Trial]] = Processes(
            _keyed, self.count, preload="twin.experiments.trials"
        )
        return self

    def __exit__(self, *_: object) -> None:
        self._processes.close()

    def verdicts(self, trials: Sequence[Trial]) -> list[Mapping[str, Any]]:
        """Return the content of `verdict.json` of each, in order."""
        keys = [trial.key for trial in trials]
        waiting = {key: trial for key, trial in zip(keys, trials, strict=True) if not self._known(key)}
        jobs = iter(waiting.items())
        pending = len(waiting)
        while pending:
            while self._processes.free and (job := next(jobs, None)) is not None:
                self._processes.start(job)
            for (key, trial), result in self._processes.wait(_POLL_S):
                pending -= 1
                self.made += 1
                self.told(self.made)
                self._results[key] = _result(trial, result)
                keep(_KIND, key, self._results[key])
        return [self._results[key] for key in keys]

    def first(self, trials: Sequence[Trial], holds: Callable[[Mapping[str, Any]], bool]) -> int | None:
        """Return the index of the first trial of whose verdict something holds; later ones may stay unmade.

        It is the same one, however many are run at a time.
        """
        for begin in range(0, len(trials), self.count):
            some = trials[begin : begin + self.count]
            for index, verdict in enumerate(self.verdicts(some), begin):
                if holds(verdict):
                    return index
        return None

    def _known(self, key: str) -> bool:
        if key not in self._results and (found := kept(_KIND, key)) is not None:
            self._results[key] = found
        return key in self._results


def _keyed(job: tuple[str, Trial]) -> dict[str, Any]:
    return perform(job[1])


def _result(trial: Trial, result: Any) -> Mapping[str, Any]:
    if isinstance(result, Lost):
        name = str(trial.source.data.get("name"))
        return Verdict(scenario=name, seed=0, error=result.reason).to_dict()
    return dict(result)
