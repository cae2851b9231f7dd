"""Runs known-bad stacks, and tells which of them a scenario's checks catch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Literal

from twin.errors import PluginError, ScenarioError
from twin.experiments.mutants.registry import MUTANTS
from twin.experiments.mutants.trial import DECIDED, FAULT, NOT_HERE, MutantTrial
from twin.experiments.trials import Trial, Trials
from twin.scenario.source import Source

Fate = Literal["caught", "survived", "no effect", "not here"]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one mutant."""

    mutant: str
    says: str
    """What is wrong with it."""
    fate: Fate
    """`no effect`: its run is the scenario's own, to the last bit; `not here`: there is nothing to spoil."""
    by: tuple[str, ...] = ()
    """Names of the checks that caught it."""
    why: str = ""
    """Reason of the first of them; what broke the run, if nothing could be checked; what is lacking."""
    at_s: float | None = None
    """When the first of them was decided [s]."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """What became of all."""

    scenario: str
    outcomes: tuple[Outcome, ...]

    def of(self, fate: Fate) -> list[str]:
        """Return the names of mutants that had a fate."""
        return [outcome.mutant for outcome in self.outcomes if outcome.fate == fate]

    @property
    def score(self) -> float | None:
        """Share of the mutants with an effect that were caught; None: there are none."""
        caught, survived = len(self.of("caught")), len(self.of("survived"))
        return caught / (caught + survived) if caught + survived else None

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "scenario": self.scenario,
            "score": self.score,
            "survived": self.of("survived"),
            "mutants": [asdict(outcome) for outcome in self.outcomes],
        }


def mutate(source: Source, trials: Trials, mutants: Sequence[str] = ()) -> Report:
    """Run a scenario with each mutant.

    Args:
        source: The scenario, with overrides.
        trials: Who makes the runs.
        mutants: Names, `module:Class` or `FILE.py:Class`; empty: all that are known by name.

    Raises:
        ScenarioError: It does not pass by itself.
        PluginError: There is no such mutant, or one is wrong itself.
    """
    names = tuple(mutants) or MUTANTS.names()
    plugins = [MUTANTS.find(name) for name in names]
    says = [plugin.load().says() for plugin in plugins]
    (whole,) = trials.verdicts([Trial(source)])
    if whole["verdict"] != "pass":
        failed = [check["name"] for check in whole["checks"] if not check["passed"]]
        why = whole["error"] or f"it fails {', '.join(failed)}"
        raise ScenarioError(f"{whole['scenario']} does not pass by itself, so nothing could be caught: {why}")
    verdicts = trials.verdicts([MutantTrial(source, mutant=name) for name in names])
    if faults := [verdict[FAULT] for verdict in verdicts if FAULT in verdict]:
        raise PluginError(faults[0])
    outcomes = map(_outcome, names, says, verdicts, [whole["digest"]] * len(names))
    return Report(scenario=str(whole["scenario"]), outcomes=tuple(outcomes))


def _outcome(mutant: str, says: str, verdict: Mapping[str, Any], digest: str) -> Outcome:
    outcome = partial(Outcome, mutant=mutant, says=says)
    if NOT_HERE in verdict:
        return outcome(fate="not here", why=verdict[NOT_HERE])
    if verdict["error"] is not None:
        return outcome(fate="caught", why=verdict["error"])
    failed = [check for check in verdict["checks"] if not check["passed"]]
    # Of a run that was ended early the others only lack what would have come.
    failed = [check for check in failed if check["name"] in verdict[DECIDED]] or failed
    if failed:
        by = tuple(check["name"] for check in failed)
        first = failed[0]
        return outcome(fate="caught", by=by, why=first["reason"], at_s=first["at_s"])
    return outcome(fate="no effect" if verdict["digest"] == digest else "survived")
