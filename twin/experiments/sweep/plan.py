"""Everything that a sweep is going to run, in a fixed order, each run with its key."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from twin.errors import Problem, ScenarioError, TwinError
from twin.experiments.sweep.axes import Axis, points
from twin.experiments.sweep.fingerprint import scenario_fingerprint
from twin.plugins import execution
from twin.scenario.catalogue import resolve
from twin.scenario.pass_rate import PassRate
from twin.scenario.schema import load

_MOST_RUNS = 10_000_000


@dataclass(frozen=True, kw_only=True)
class PlannedRun:
    """One run of a sweep."""

    point: int
    """Which combination of values."""
    turn: int
    """Which of the seeds."""
    seed: int
    key: str
    """The hash of all that makes the run: the scenario as resolved, overrides, seed, twin's version."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What to run: every point with every seed."""

    file: Path
    """Of the scenario."""
    name: str
    """Of the scenario."""
    axes: tuple[Axis, ...]
    points: tuple[Mapping[str, str], ...]
    """Overrides of each point, in the order of the table."""
    seeds: tuple[int, ...]
    fingerprints: tuple[str, ...]
    """Of the points' scenarios without their seeds."""
    claim: PassRate | None
    """What share of the runs of each point is to pass; None: all."""
    recorded: bool
    """Whether the scenario lets its runs be recorded."""

    @property
    def size(self) -> int:
        """How many runs there are."""
        return len(self.points) * len(self.seeds)

    @property
    def identity(self) -> str:
        """The hash that tells this sweep from others; with more seeds or another claim it is the same."""
        told = [self.fingerprints, [list(point.items()) for point in self.points]]
        return hashlib.sha256(json.dumps([*told, version("twin")]).encode()).hexdigest()

    def run(self, point: int, turn: int) -> PlannedRun:
        """Return one run."""
        seed = self.seeds[turn]
        overrides = list(self.points[point].items())
        told = json.dumps([self.fingerprints[point], overrides, seed, version("twin")])
        key = hashlib.sha256(told.encode()).hexdigest()[:24]
        return PlannedRun(point=point, turn=turn, seed=seed, key=key)

    def in_turn(self) -> Iterator[PlannedRun]:
        """Yield the runs in the order in which they are made: all points with the first seed, and so on."""
        for turn in range(len(self.seeds)):
            for point in range(len(self.points)):
                yield self.run(point, turn)

    def overrides(self, run: PlannedRun) -> dict[str, str]:
        """Return what differs from the scenario's file, its seed too."""
        return {**self.points[run.point], "seed": str(run.seed)}


def make_plan(
    scenario: str | Path,
    axes: Sequence[Axis] = (),
    *,
    seeds: Sequence[int] | None = None,
    samples: int | None = None,
    pass_rate: float | None = None,
    confidence: float | None = None,
) -> Plan:
    """Read the scenario with the values of every point.

    Args:
        scenario: Its name or file.
        axes: What is varied.
        seeds: Of every point; None: the scenario's own.
        samples: How many to draw of the axes that are intervals.
        pass_rate: Least share of the runs of each point that is to pass, instead of the scenario's.
        confidence: Of its verdict, instead of the scenario's, or of 0.95.

    Raises:
        TwinError: With every problem of the scenario, such as keys and values that cannot be.
    """
    file, found = resolve(scenario).resolve(), points(axes, samples)
    refused = _Refused()
    fingerprints = []
    with execution():
        for overrides in found:
            if refused.knows(overrides):
                continue
            try:
                resolved = load(file, overrides, execute=True)
                fingerprints.append(scenario_fingerprint(resolved))
            except TwinError as fault:
                refused.add(fault.problems, overrides)
    if refused.problems:
        raise ScenarioError(refused.problems.values())
    seeds = (resolved.seed,) if seeds is None else tuple(seeds)
    if len(found) * len(seeds) > _MOST_RUNS:
        raise ScenarioError(f"{len(found) * len(seeds)} runs; a sweep has at most {_MOST_RUNS}")
    return Plan(
        file=file,
        name=resolved.name,
        axes=tuple(axes),
        points=found,
        seeds=seeds,
        fingerprints=tuple(fingerprints),
        claim=_claim(resolved.pass_rate, pass_rate, confidence),
        recorded=resolved.recording.enabled,
    )


class _Refused:
    """What is wrong with points: told once, and looked for no more often than necessary."""

    def __init__(self) -> None:
        self.problems: dict[str, Problem] = {}
        """By what is said, without the value it is said of."""
        self._values = set[tuple[str, str]]()
        self._keys = set[str]()

    def knows(self, overrides: Mapping[str, str]) -> bool:
        return any(item in self._values or item[0] in self._keys for item in overrides.items())

    def add(self, problems: Sequence[Problem], overrides: Mapping[str, str]) -> None:
        for problem in problems:
            said = problem.message
            for key, value in overrides.items():
                if said.startswith(f"override {key}={value}: "):
                    said = said.removeprefix(f"override {key}={value}: ")
                    self._values.add((key, value))
                    if said in self.problems or said.startswith("unknown key"):
                        self._keys.add(key)
                    break
            self.problems.setdefault(said, problem)


def _claim(own: PassRate | None, least: float | None, confidence: float | None) -> PassRate | None:
    if own is None and least is None:
        if confidence is not None:
            raise ScenarioError("--confidence is that of a pass rate; say which, such as --pass-rate 0.95")
        return None
    for option, value in (("--pass-rate", least), ("--confidence", confidence)):
        if value is not None and not 0.0 < value < 1.0:
            raise ScenarioError(f"{option} {value:g}: must be between 0 and 1, such as 0.95")
    given = {} if own is None else own.model_dump()
    asked = {"min": least, "confidence": confidence}
    return PassRate(**given | {key: value for key, value in asked.items() if value is not None})
