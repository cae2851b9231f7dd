"""Runs of one scenario with changes, each made once: in warm processes, and known again by their content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Self

from twin.errors import TwinError
from twin.experiments.processes import Lost, Processes
from twin.files.kept import hash_of, keep, kept
from twin.plugins import execution
from twin.runtime.open_run import run
from twin.scenario.provenance import cpu_class, versions
from twin.scenario.schema import load_again
from twin.scenario.source import Source
from twin.scenario.verdict import Verdict

_KIND = "trials"


@dataclass(frozen=True)
class Trial:
    """A scenario to run."""

    source: Source
    repeat: int = 0
    """Another number is another run of the same."""

    @property
    def key(self) -> str:
        """What the outcome depends on."""
        source = self.source
        told = (source.data, source.files(), self.repeat, versions(), cpu_class(), _code())
        return json.dumps(told, sort_keys=True)

    def perform(self) -> dict[str, Any]:
        """Run, and return the content of the verdict."""
        try:
            with execution():
                verdict = run(load_again(self.source, execute=True), record=False)
        except TwinError as fault:
            verdict = self.broken(str(fault))
        values: dict[str, Any] = json.loads(verdict.to_json())
        return values

    def broken(self, error: str) -> Verdict:
        """Return the verdict of a run that could not be made or finished."""
        return Verdict(scenario=str(self.source.data.get("name")), seed=0, error=error)


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
            _perform, self.count, preload=(_perform.__module__,)
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
            for (key, trial), result in self._processes.wait():
                pending -= 1
                self.made += 1
                self.told(self.made)
                if isinstance(result, Lost):
                    result = trial.broken(result.reason).to_dict()
                else:
                    keep(_KIND, key, result)
                self._results[key] = result
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


def _perform(job: tuple[str, Trial]) -> dict[str, Any]:
    return job[1].perform()


@cache
def _code() -> str:
    """Return the SHA-256 of all that twin is made of: what changes there may change a verdict."""
    found, package = hashlib.sha256(), Path(__file__).parents[1]
    for file in sorted(package.rglob("*")):
        if "__pycache__" not in file.parts and file.is_file():
            found.update(f"{file.relative_to(package)} {hash_of(file)}\n".encode())
    return found.hexdigest()
