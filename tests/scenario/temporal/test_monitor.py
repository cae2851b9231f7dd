"""The monitor's margins, verdicts and early decisions are those of the definition."""

from __future__ import annotations

import math
import pickle
import random

import pytest

from tests.scenario.temporal.random_formulas import Trace, by_definition, random_formula, random_trace
from twin.scenario.temporal import (
    Always,
    And,
    Finally,
    Formula,
    Monitor,
    Predicate,
    Until,
    Window,
    eventually,
)


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


def test_memory_is_that_of_the_windows() -> None:
    inner = eventually(Predicate("x", ">", 0.5), Window(0, 50))
    formula = Always(And((inner, Until(Predicate("x", "<", 2.0), Predicate("y", ">", 0.9), Window(10, 60)))))
    monitor, rng = Monitor(formula), random.Random(5)
    sizes = []
    for t in range(4000):
        monitor.take("x", t, rng.random())
        monitor.take("y", t, rng.random())
        monitor.know(t)
        if t % 500 == 499:
            sizes.append(len(pickle.dumps(monitor)))
    assert max(sizes) < 1.5 * sizes[0] < 60_000


def test_a_settled_verdict_takes_no_more() -> None:
    monitor = Monitor(eventually(Predicate("x", ">", 0.5)))
    for t, value in enumerate((0.0, 0.75, 0.0, 2.0)):
        monitor.take("x", t, value)
        monitor.know(t + 1)
    assert monitor.verdict is True
    margin = monitor.finish()
    assert margin is not None
    assert (margin.size, margin.at_ns, margin.value) == (1.5, 3, 2.0), "the margin is that of the whole run"


def test_the_worst_moment_is_the_first_of_equal_ones() -> None:
    for formula in (Always(Predicate("x", "<", 1.0)), Finally(Predicate("x", "<", 1.0))):
        monitor = Monitor(formula)
        for t, value in enumerate((0.0, 0.5, 0.5, 0.5)):
            monitor.take("x", t, value)
        margin = monitor.finish()
        assert margin is not None
        assert (margin.size, margin.at_ns) == (0.5, 1)


def test_what_is_not_a_number_satisfies_no_comparison() -> None:
    for relation in (">", ">=", "<", "<=", "==", "!="):
        assert Predicate("x", relation, 1.0).margin(math.nan) == -math.inf  # type: ignore[arg-type]
    assert Predicate("x", "<=", math.inf).margin(math.inf) > 0.0
    assert Predicate("x", "==", "a").margin("a") == math.inf
    assert Predicate("x", "!=", True).margin(True) == -math.inf


def test_a_signal_that_never_comes_leaves_it_open() -> None:
    monitor = Monitor(And((Predicate("x", ">", 0.0), Predicate("y", ">", 0.0))))
    monitor.take("x", 0, 1.0)
    assert monitor.finish() is None
    assert monitor.verdict is None
