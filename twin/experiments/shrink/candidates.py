"""Variants of a scenario: whether they are scenarios, and what becomes of them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from twin.errors import TwinError
from twin.experiments.shrink.parts import Data
from twin.experiments.trials import Trial, Trials
from twin.scenario.checks.check import NOTHING
from twin.scenario.schema import load_again
from twin.scenario.source import Source

Verdict = Mapping[str, Any]
"""The content of `verdict.json`."""


class Candidates:
    """Scenarios beside the file of one, as plain data."""

    def __init__(self, source: Source, trials: Trials) -> None:
        self._file, self._trials = source.file, trials

    def with_overrides(self, data: Data, overrides: Mapping[str, str]) -> dict[str, Any]:
        """Return data with overrides; raises ScenarioError where that is no scenario."""
        return dict(load_again(Source(self._file, data), overrides).source.data)

    def is_valid(self, data: Data) -> bool:
        """Whether it can be a scenario."""
        try:
            load_again(Source(self._file, data))
        except TwinError:
            return False
        return True

    def duration_s(self, data: Data) -> float:
        """Return the longest simulated time [s]."""
        return load_again(Source(self._file, data)).duration

    def verdicts(self, candidates: Sequence[Data], repeats: int = 1) -> list[Verdict]:
        """Run scenarios, each so often; what was run before is not run again."""
        return self._trials.verdicts(
            [self._trial(data, again) for data in candidates for again in range(repeats)]
        )

    def first_failing(self, candidates: Sequence[Data]) -> int | None:
        """Return the index of the first of which every check fails; what is no scenario does not."""
        valid = [index for index, data in enumerate(candidates) if self.is_valid(data)]
        found = self._trials.first([self._trial(candidates[index]) for index in valid], fails)
        return None if found is None else valid[found]

    def _trial(self, data: Data, repeat: int = 0) -> Trial:
        return Trial(Source(self._file, data), repeat)


def fails(verdict: Verdict) -> bool:
    """Whether every check fails, each after it has seen something."""
    if verdict["error"] is not None:
        return False
    return not any(each["passed"] or each["reason"].startswith(NOTHING) for each in verdict["checks"])


def fails_alike(one: Verdict, other: Verdict) -> bool:
    """Whether the same checks fail for the same reasons, but for numbers."""
    return fails(other) and _kinds(one) == _kinds(other)


def decided_alike(one: Verdict, other: Verdict) -> bool:
    """Whether the same checks fail, and were decided at the same moments."""
    return fails(other) and all(
        a["at_s"] is not None and a["at_s"] == b["at_s"]
        for a, b in zip(one["checks"], other["checks"], strict=True)
    )


def _kinds(verdict: Verdict) -> list[str]:
    return [re.sub(r"\d+(\.\d+)?", "#", check["reason"]) for check in verdict["checks"]]
