"""The monitor's margins, verdicts and early decisions are those of the definition."""

from __future__ import annotations

import random

import pytest

from tests.scenario.temporal.random_formulas import Trace, by_definition, random_formula, random_trace
from twin.scenario.temporal import Formula, Monitor


def online(formula: Formula, trace: Trace, rng: random.Random | None = None) -> tuple[Monitor, bool | None]:
    """Return a monitor that has seen a trace bit by bit, and what it knew before the end."""
    monitor = Monitor(formula)
    values = sorted((t, name, v) for name in monitor.signals for t, v in trace[name])
    early: bool | None = None
    for t, name, value in values:
        if rng is not None and rng.random() < 0.7:
            monitor.know(t)
            assert early is None or monitor.verdict is early, "a decision stands"
            early = monitor.verdict
        monitor.take(name, t, value)
    monitor.finish()
    return monitor, early


@pytest.mark.parametrize("seed", range(4))
def test_margins_and_verdicts_are_those_of_the_definition(seed: int) -> None:
    rng, decided = random.Random(seed), 0
    for _ in range(400):
        formula = random_formula(rng, 3)
        trace = random_trace(rng, rng.randint(1, 12), regular=rng.random() < 0.5)
        size, holds = by_definition(formula, trace, max(t for values in trace.values() for t, _ in values))
        monitor, early = online(formula, trace, rng)
        margin = monitor.finish()
        assert margin is not None
        assert margin.size == pytest.approx(size, abs=1e-300), (formula, trace)
        assert margin.holds is holds is monitor.verdict, (formula, trace)
        assert early in (None, holds), (formula, trace)
        decided += early is not None
    assert decided > 80, "many are decided before the end"
