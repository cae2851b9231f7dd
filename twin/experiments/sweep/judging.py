"""What a sweep says in the end: of each point, and of all. Runs are judged in the order of their seeds.

So which runs count is the same however many processes made them, and in whatever order they ended.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from twin.experiments.sequential import bounds, clopper_pearson, judge
from twin.scenario.pass_rate import PassRate

Outcome = Literal["pass", "fail", "error", "inconclusive"]
_GRAVEST: tuple[Outcome, ...] = ("error", "fail", "inconclusive")
_CONFIDENCE = 0.95
"""Of an interval where nothing else is asked for."""


@dataclass(kw_only=True)
class PointJudge:
    """Takes the outcomes of one point's runs in any order, and judges them by their turns."""

    turns: int
    """How many runs there are."""
    claim: PassRate | None
    points: int = 1
    """Of the sweep."""

    def __post_init__(self) -> None:
        self._waiting: dict[int, str] = {}
        self.judged = 0
        """The runs of so many turns, from the first on, are there and count."""
        self.counts = {"pass": 0, "fail": 0, "error": 0}
        self._decided: Literal["pass", "fail"] | None = None

    @property
    def over(self) -> bool:
        """Whether no more runs are needed."""
        return self._decided is not None or self.judged == self.turns

    def needs(self, turn: int) -> bool:
        """Whether the run of this turn is missing."""
        return not self.over and turn >= self.judged and turn not in self._waiting

    def take(self, turn: int, outcome: str) -> None:
        """Take the outcome of a run: pass, fail or error."""
        if turn >= self.judged:
            self._waiting[turn] = outcome
        while not self.over and self.judged in self._waiting:
            self.counts[self._waiting.pop(self.judged)] += 1
            self.judged += 1
            if self.claim is not None:
                passed, failed, errors = self.counts.values()
                claim = self.claim
                self._decided = judge(passed, failed, errors, claim.min, claim.confidence, self.points)

    @property
    def outcome(self) -> Outcome:
        """What is known of the point now."""
        if self._decided is not None:
            return self._decided
        if self.counts["error"]:
            return "error"
        if self.claim is None and self.counts["fail"]:
            return "fail"
        return "pass" if self.claim is None and self.judged == self.turns else "inconclusive"

    @property
    def interval(self) -> tuple[float, float]:
        """The pass rates that the runs leave open; errors count as failures.

        Where a claim is judged its bounds, which hold whenever one looks; otherwise Clopper and Pearson's.
        """
        passed = self.counts["pass"]
        if self.claim is not None:
            return bounds(passed, self.judged - passed, self.claim.confidence)
        return clopper_pearson(passed, self.judged, _CONFIDENCE)


def outcome_of(points: Iterable[PointJudge]) -> Outcome:
    """Return what is said of the sweep: the gravest of what is said of its points."""
    found = {point.outcome for point in points}
    return next((each for each in _GRAVEST if each in found), "pass")
