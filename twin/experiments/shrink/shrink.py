"""Reduces a scenario that fails to the smallest that fails the same checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from twin.errors import ScenarioError, TwinError
from twin.experiments.shrink.candidates import Candidates, Verdict, decided_alike, fails, fails_alike
from twin.experiments.shrink.ddmin import ddmin
from twin.experiments.shrink.parts import Data, Part, causes, inside, tasks, without
from twin.experiments.trials import Trials
from twin.scenario.checks.check import NOTHING
from twin.scenario.source import Source

_GRID_S = 0.1
"""Durations are multiples of it [s]."""
_SLACK, _SLACK_S = 2.0, 10.0
"""What is left out may let the failure come later: up to so many times later, and this [s], is looked at."""
_KEPT_OVERRIDES = ("seed", "duration")

Failing = Callable[[Sequence[Data]], int | None]
"""Returns the index of the first candidate that fails; None: none does."""


@dataclass(frozen=True, kw_only=True)
class Shrunk:
    """What is left of a scenario, and what not."""

    source: Source
    checks: tuple[str, ...]
    """Names of the checks that fail, as in the verdict."""
    removed: tuple[str, ...]
    """What was left out, for people, in the order in which that was found."""
    left: tuple[str, ...]
    """What could not be left out."""
    durations_s: tuple[float, float]
    """Before and after."""
    verdict: Verdict
    """Of what is left."""


def shrink(source: Source, overrides: Mapping[str, str], trials: Trials) -> Shrunk:
    """Return the smallest scenario that fails what this one fails.

    First what can be the cause: overrides, faults, obstacles, goods, parameters, found by delta debugging,
    first whole groups, then what is in them (hierarchical delta debugging, Misherghi and Su, ICSE 2006). Then
    what robots do, and for how long; here what is left must pass without its causes, so that nothing fails
    only because too little is left. The result does not depend on how many runs are made at a time.

    Args:
        source: A scenario.
        overrides: Of its keys; each may be left out as well.
        trials: Who makes the runs.

    Raises:
        ScenarioError: It passes, cannot be run, or is not the same run twice.
    """
    given = Candidates(source, trials)
    data = given.with_overrides(source.data, overrides)
    data.pop("early_stop", None)  # all that fail are to fail again, not the first of them
    data, checks, removed = _failing_alone(given, data)
    before_s = given.duration_s(data)

    data = _cut_after_failure(given, data)
    data, gone = _without_overrides(given, source.data, overrides, data)
    removed += gone
    data, gone = _without_parts(data, causes, given.first_failing)
    removed += gone
    failing = _for_its_causes(given, data)
    data, gone = _without_parts(data, tasks, failing)
    removed += gone
    data = _cut(given, data, failing)
    (verdict,) = given.verdicts([data])
    return Shrunk(
        source=Source(source.file, data),
        checks=checks,
        removed=tuple(removed),
        left=tuple(part.name for part in causes(data)),
        durations_s=(before_s, given.duration_s(data)),
        verdict=verdict,
    )


def _failing_alone(given: Candidates, data: Data) -> tuple[dict[str, Any], tuple[str, ...], list[str]]:
    """Return the scenario with only the checks that fail, their names, and which others it had."""
    one, other = given.verdicts([data], repeats=2)
    name, checks = one["scenario"], one["checks"]
    if one["error"] is not None:
        raise ScenarioError(f"{name} cannot be run: {one['error']}")
    if one["verdict"] == "pass":
        raise ScenarioError(f"{name} passes all its checks: there is no failure to shrink")
    if one["digest"] != other["digest"]:
        told = " and ".join((each["digest"] or "none")[:12] for each in (one, other))
        raise ScenarioError(
            f"{name} is not the same run twice (digests {told}): what matters could not be told from chance"
        )
    seen = [
        i for i, each in enumerate(checks) if not each["passed"] and not each["reason"].startswith(NOTHING)
    ]
    if not seen:
        reason = next(check["reason"] for check in checks if not check["passed"])
        raise ScenarioError(f"{name} fails only as a check has {reason}: there is no failure to shrink")
    left = deepcopy(dict(data))
    left["checks"] = [left["checks"][index] for index in seen]
    removed = [f"checks.{index} {check['name']}" for index, check in enumerate(checks) if index not in seen]
    return left, tuple(checks[index]["name"] for index in seen), removed


def _without_overrides(
    given: Candidates, plain: Data, overrides: Mapping[str, str], data: dict[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """Return the scenario with only those overrides that its failure needs, and the others."""

    def with_some(keys: Sequence[str]) -> dict[str, Any]:
        try:
            fresh = given.with_overrides(plain, {key: overrides[key] for key in keys})
        except TwinError:
            return {}  # no scenario
        found_so_far = {key: data[key] for key in ("checks", *_KEPT_OVERRIDES) if key in data}
        return {**fresh, **found_so_far}

    optional = [key for key in overrides if key not in _KEPT_OVERRIDES]
    needed = ddmin(optional, lambda some: given.first_failing(list(map(with_some, some))))
    gone = [f"--set {key}={overrides[key]}" for key in optional if key not in needed]
    return (with_some(needed), gone) if gone else (data, gone)


def _without_parts(
    data: dict[str, Any], parts_of: Callable[[Data], list[Part]], failing: Failing
) -> tuple[dict[str, Any], list[str]]:
    """Return the scenario with only what its failure needs, and what else it had."""
    removed: list[str] = []
    depth = 0
    while parts := _at_depth(data, parts_of, depth):
        needed = ddmin(parts, _Selections(data, parts, failing))
        gone = [part for part in parts if part not in needed]
        removed += [part.name for part in gone]
        data = without(data, gone)
        depth += 1
    return data, removed


def _at_depth(data: Data, parts_of: Callable[[Data], list[Part]], depth: int) -> list[Part]:
    parts = parts_of(data)
    for _ in range(depth):
        parts = inside(data, parts)
    return parts


@dataclass(frozen=True)
class _Selections:
    """Which selection of parts fails, the rest of the scenario being there."""

    data: Data
    parts: Sequence[Part]
    failing: Failing

    def __call__(self, selections: Sequence[Sequence[Part]]) -> int | None:
        return self.failing(
            [without(self.data, [part for part in self.parts if part not in kept]) for kept in selections]
        )


def _for_its_causes(given: Candidates, data: Data) -> Failing:
    """Return what finds candidates that fail, but not without their causes.

    Where the scenario does not pass without them, candidates must fail for its reason.
    """
    bare = without(data, causes(data))
    whole, *healthy = given.verdicts([data, *([bare] if given.is_valid(bare) and bare != data else [])])
    has_contrast = any(each["verdict"] == "pass" for each in healthy)

    def first(candidates: Sequence[Data]) -> int | None:
        for index, candidate in enumerate(candidates):
            contrast = without(candidate, causes(candidate))
            tried = [candidate, *([contrast] if has_contrast else [])]
            if not all(map(given.is_valid, tried)):
                continue
            verdict, *without_causes = given.verdicts(tried)
            caused = all(each["verdict"] == "pass" for each in without_causes)
            if (caused if has_contrast else fails_alike(whole, verdict)) and fails(verdict):
                return index
        return None

    return first


def _cut_after_failure(given: Candidates, data: dict[str, Any]) -> dict[str, Any]:
    """Return the scenario with an end some time after its checks were decided, if that decides the same."""
    (whole,) = given.verdicts([data])
    decided = [check["at_s"] for check in whole["checks"]]
    if None in decided:
        return data
    end_s = math.ceil((max(decided) * _SLACK + _SLACK_S) / _GRID_S) * _GRID_S
    if end_s >= given.duration_s(data):
        return data
    shorter = _lasting(data, end_s)
    if not given.is_valid(shorter):
        return data
    (cut,) = given.verdicts([shorter])
    return shorter if decided_alike(whole, cut) else data


def _cut(given: Candidates, data: dict[str, Any], failing: Failing) -> dict[str, Any]:
    """Return the scenario with the shortest duration in which it fails as it does."""
    (whole,) = given.verdicts([data])

    def is_enough(steps: int) -> bool:
        shorter = _lasting(data, steps * _GRID_S)
        if not given.is_valid(shorter):  # a fault would come after its end
            return False
        (cut,) = given.verdicts([shorter])
        return decided_alike(whole, cut) or (fails_alike(whole, cut) and failing([shorter]) is not None)

    low, high = 0, math.ceil(min(given.duration_s(data), whole["metrics"]["sim_time_s"]) / _GRID_S - 1e-6)
    if not is_enough(high):
        return data
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return _lasting(data, high * _GRID_S)


def _lasting(data: Data, duration_s: float) -> dict[str, Any]:
    return {**data, "duration": f"{duration_s:.6g} s"}
